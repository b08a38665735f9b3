//! `resample demo`: volumes, a mesh and a depth image, all made of formulas, as pictures on one page.
//!
//! 1. the scenes are written as files that any command can read;
//! 2. each is drawn twice, as the command line draws it and the quick way that most programs go, and both are held against
//!    a reference;
//! 3. a page shows the pictures, their errors, and the commands that draw them again.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Parser;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use resample_core::metrics::Mask;
use resample_core::{Camera, Image, metrics};
use serde_json::Value;

use crate::args::words::typed;
use crate::args::{Cli, Command, DemoArgs, Drawing, SceneArg};
use crate::commands::built_in;
use crate::open::Opened;
use crate::output::{Depth, Format};
use crate::plan::Purpose;
use crate::process::report;
use crate::process::report::Verbosity;
use crate::values::Size;
use crate::{output, planner};
use texmap::background::Background;
use warp3d::input::procedural;
use warp3d::input::procedural::{FOV_Y_DEG, NEW_EYE, PHOTOGRAPH_SAMPLES, ball_before_wall};

/// Writes files, pictures and the page, and says where it is.
pub(crate) fn run(args: &DemoArgs, verbosity: Verbosity) -> Result<()> {
    let start = Instant::now();
    let folder = &args.output;
    output::make_folder(folder)?;
    let page = folder.join("index.html");
    output::check_writable(&page)?;
    let mut pictures = Vec::new();
    for scene in all(folder)? {
        let scene = shown(scene, folder, args.size)?;
        if verbosity == Verbosity::Verbose {
            report::say(&format!("{}: {:.0} ms", scene.title, scene.draw_ms));
        }
        pictures.push(scene);
    }
    output::write_text(&page, &html(&pictures))?;
    if verbosity != Verbosity::Quiet {
        report::say(&format!(
            "wrote {} pictures and {} in {:.1} s",
            2 * pictures.len(),
            page.display(),
            start.elapsed().as_secs_f64()
        ));
    }
    Ok(())
}

const STYLE: &str = include_str!("page.css");

/// The page.
fn html(scenes: &[DemoPicture]) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "resample: demo" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "resample: demo" }
                p { "Six scenes made of formulas. Each is drawn as the command line draws it, and the quick way that most programs \
                     go. The error is the peak signal-to-noise ratio in decibels: ten more is a third of the error." }
                @for scene in scenes { (section(scene)) }
            }
        }
    };
    page.into_string()
}

fn section(scene: &DemoPicture) -> Markup {
    html! {
        section {
            h2 { (scene.title) }
            p { (scene.about) }
            div class="ways" { @for way in &scene.ways { (figure(way)) } }
            p class="note" { (scene.against) }
        }
    }
}

fn figure(way: &Way) -> Markup {
    let error = way.psnr_db.map(|psnr_db| {
        if psnr_db.is_finite() {
            format!(": {psnr_db:.1} dB")
        } else {
            ": the same".to_owned()
        }
    });
    html! {
        figure {
            a href=(way.file) { img src=(way.file) alt=(way.title); }
            figcaption { b { (way.title) } @if let Some(error) = error { (error) } }
            details { summary { "command" } pre { (way.command) } }
        }
    }
}

/// A scene, and the command that draws it.
struct DemoScene {
    /// Name of its picture, without the ending.
    name: &'static str,
    title: &'static str,
    /// The difficulty of the scene, in a sentence.
    about: &'static str,
    /// Words of both commands, without the picture's name.
    words: Vec<String>,
    /// Words that the first of them has.
    own: &'static [&'static str],
    /// Words that make the second draw the quick way.
    quick: &'static [&'static str],
    /// The quick way, in words.
    quick_title: &'static str,
    /// Where the error is measured against.
    truth: Truth,
}

/// The picture that others are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Truth {
    /// The most exact setting.
    MostExact,
    /// The scene of the depth image, traced from the new eye.
    Traced,
    /// No picture: the two show different things.
    Nothing,
}

/// Knots of a transfer function: value and display colour, value and opacity. By hand, for looks only.
struct Function {
    colours: &'static [(f64, [f64; 3])],
    opacities: &'static [(f64, f64)],
}

const RIPPLES: Function = Function {
    colours: &[
        (0.0, [0.1, 0.15, 0.42]),
        (0.1, [0.15, 0.58, 0.66]),
        (0.2, [0.95, 0.88, 0.58]),
        (0.5, [0.9, 0.48, 0.25]),
        (1.0, [0.54, 0.15, 0.35]),
    ],
    opacities: &[(0.0, 0.3), (0.1, 0.3), (0.2, 0.9)],
};

const BLOBS: Function = Function {
    colours: &[
        (0.0, [0.25, 0.35, 0.74]),
        (1.0, [0.8, 0.35, 0.66]),
        (1.6, [1.0, 0.66, 0.25]),
        (2.2, [1.0, 0.95, 0.74]),
    ],
    opacities: &[
        (0.1, 0.0),
        (0.6, 0.015),
        (1.4, 0.04),
        (1.8, 0.3),
        (2.4, 0.8),
    ],
};

/// Writes all scenes into the folder.
fn all(folder: &Path) -> Result<Vec<DemoScene>> {
    let volume = |scene, function: Option<Function>, orbit: &str| -> Result<Vec<String>> {
        let args = built_in::volume(scene, folder)?;
        if let (Some(function), Some(path)) = (function, &args.transfer.transfer) {
            let map: Value = built_in::map(function.colours, function.opacities);
            output::write_text(path, &serde_json::to_string_pretty(&map)?)?;
        }
        let start = ["volsplat".to_owned()].into_iter();
        let view = ["--orbit".to_owned(), orbit.to_owned()];
        Ok(start.chain(built_in::words(&args)).chain(view).collect())
    };
    let one_ray = "one ray a pixel";
    let in_light = [
        volume(SceneArg::Blobs, Some(BLOBS), "15,20,0.75")?,
        vec!["--light".into(), "-0.7,0.5,0.6".into()],
    ];
    Ok(vec![
        DemoScene {
            name: "light",
            title: "Shadow and occlusion",
            about: "Light that matter takes on its way: which part lies in front is seen at once.",
            words: in_light.concat(),
            own: &["--shadows", "--occlusion"],
            quick: &[],
            quick_title: "the same light, without shadow and occlusion",
            truth: Truth::Nothing,
        },
        DemoScene {
            name: "marschner-lobb",
            title: "Ripples",
            about: "A field that is as fine as its voxels: what is interpolated badly shows as broken rings.",
            words: volume(SceneArg::MarschnerLobb, Some(RIPPLES), "25,25")?,
            own: &[],
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        DemoScene {
            name: "blobs",
            title: "Soft matter",
            about: "Translucent matter that hides itself, with nothing sharp but its insides.",
            words: volume(SceneArg::Blobs, Some(BLOBS), "15,20,0.75")?,
            own: &[],
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        DemoScene {
            name: "checker-box",
            title: "A box of opaque cells",
            about: "Edges everywhere: between cells, against the background, and along the rays.",
            words: volume(SceneArg::CheckerBox, None, "35,25")?,
            own: &[],
            quick: &["--subpixels", "1"],
            quick_title: one_ray,
            truth: Truth::MostExact,
        },
        mesh(folder)?,
        depth_image(folder)?,
    ])
}

fn mesh(folder: &Path) -> Result<DemoScene> {
    let args = built_in::mesh(folder)?;
    let texture = args.model.texture.unwrap_or_default();
    let words = format!(
        "texmap {} --texture {} --orbit 20,9,0.45",
        args.input.path.display(),
        texture.display()
    );
    Ok(DemoScene {
        name: "ball-on-ground",
        title: "A chequered ground",
        about: "Towards the horizon thousands of texels fall into a pixel: look-ups of a few of them make moire.",
        words: words.split(' ').map(str::to_owned).collect(),
        own: &[],
        quick: &["--method", "backward-bilinear", "--subpixels", "1"],
        quick_title: "a bilinear look-up a pixel",
        truth: Truth::MostExact,
    })
}

fn depth_image(folder: &Path) -> Result<DemoScene> {
    let args = built_in::depth_image(folder)?;
    let shift = NEW_EYE.to_array().map(|x| x.to_string()).join(",");
    let words = format!(
        "warp3d {} {} --from fov:{FOV_Y_DEG} --to shift:{shift}",
        args.colour, args.depth
    );
    Ok(DemoScene {
        name: "ball-before-wall",
        title: "A picture with depth, seen from beside",
        about: "The ball uncovers a part of the wall that no pixel has seen; all else should be whole.",
        words: words.split(' ').map(str::to_owned).collect(),
        own: &[],
        quick: &["--method", "nearest"],
        quick_title: "each pixel to its nearest place",
        truth: Truth::Traced,
    })
}

/// A scene that was drawn.
struct DemoPicture {
    title: &'static str,
    about: &'static str,
    /// The way of the command line, and the quick one.
    ways: [Way; 2],
    /// Time of the first picture, ms.
    draw_ms: f64,
    /// Where the errors are measured against, in a sentence.
    against: &'static str,
}

/// One way to draw a scene.
struct Way {
    title: &'static str,
    /// The picture's file in the folder of the page.
    file: String,
    command: String,
    /// Decibels, where both show something; none where nothing is measured.
    psnr_db: Option<f64>,
}

/// Side of the pictures that are measured: the most exact setting takes seconds at the size of a screen.
const MEASURED_PX: u32 = 96;

/// Draws and measures a scene.
fn shown(scene: DemoScene, folder: &Path, size: Size) -> Result<DemoPicture> {
    let words = [scene.own, scene.quick].map(|added| {
        let added = added.iter().map(|&word| word.to_owned());
        scene.words.iter().cloned().chain(added).collect::<Vec<_>>()
    });
    let size = match scene.truth {
        Truth::MostExact | Truth::Nothing => size,
        // As wide for its height as the picture that it is made of.
        Truth::Traced => {
            let [width, height] = procedural::SIZE_PX.map(|side| side as u32);
            Size {
                width: size.width,
                height: (size.width * height / width).max(1),
            }
        }
    };
    let mut opened = opened(&words[0], size)?;
    let camera = *opened.cameras().first().context("no camera")?;
    let start = Instant::now();
    let first = opened.draw(&camera)?.image;
    let draw_ms = report::ms_since(start);
    let measured = measured_camera(&camera, scene.truth)?;
    let mut pictures = vec![opened.draw(&measured)?.image];
    let truth = match scene.truth {
        Truth::MostExact => {
            opened.set(&planner::ends(&drawing(&words[0], size)?.setting())?.exact)?;
            Some(opened.draw(&measured)?.image)
        }
        Truth::Traced => Some(ball_before_wall(NEW_EYE, PHOTOGRAPH_SAMPLES)),
        Truth::Nothing => None,
    };
    let mut quick = self::opened(&words[1], size)?;
    let second = quick.draw(&camera)?.image;
    pictures.push(quick.draw(&measured)?.image);
    let titles = ["resample", scene.quick_title];
    let names = [
        format!("{}.png", scene.name),
        format!("{}-quick.png", scene.name),
    ];
    let mut ways = Vec::with_capacity(2);
    for (place, picture) in [first, second].into_iter().enumerate() {
        write(&folder.join(&names[place]), picture)?;
        ways.push(Way {
            title: titles[place],
            file: names[place].clone(),
            command: command(&words[place], folder, &names[place], size),
            psnr_db: truth
                .as_ref()
                .map(|truth| psnr_db(&pictures[place], truth))
                .transpose()?,
        });
    }
    let ways: [Way; 2] = ways.try_into().ok().context("two ways")?;
    Ok(DemoPicture {
        title: scene.title,
        about: scene.about,
        ways,
        draw_ms,
        against: match scene.truth {
            Truth::MostExact => "Against the most exact setting.",
            Truth::Traced => "Against the scene itself, where the picture has no hole.",
            Truth::Nothing => "Nothing is measured: the two show different things.",
        },
    })
}

fn drawing(words: &[String], size: Size) -> Result<Drawing> {
    let Size { width, height } = size;
    let start = ["resample".to_owned()].into_iter().chain(words.to_vec());
    let end = ["-o", "demo.png", "--size", &format!("{width}x{height}")].map(str::to_owned);
    let parsed = Cli::try_parse_from(start.chain(end))?;
    match parsed.command {
        Command::Draw(drawing) => Ok(drawing),
        _ => anyhow::bail!("a command that draws"),
    }
}

fn opened(words: &[String], size: Size) -> Result<Opened> {
    Opened::read(drawing(words, size)?, Purpose::Compare, Verbosity::Quiet)
}

/// The view in which errors are measured.
fn measured_camera(camera: &Camera, truth: Truth) -> Result<Camera> {
    let [width, height] = match truth {
        Truth::MostExact | Truth::Nothing => [MEASURED_PX; 2],
        // As large as the picture that was traced.
        Truth::Traced => procedural::SIZE_PX.map(|side| side as u32),
    };
    Ok(camera.resized(width, height)?)
}

/// The error of a picture where it and the truth show something.
fn psnr_db(picture: &Image, truth: &Image) -> Result<f64> {
    let both = picture.rgba.iter().zip(&truth.rgba);
    let inside = both.map(|(a, b)| a[3] > 0.5 && b[3] > 0.0).collect();
    let mask = Mask::new(truth.width, truth.height, inside)?;
    Ok(metrics::compare(picture, truth, Some(&mask))?.psnr_db)
}

/// Over black, so that translucent matter looks the same everywhere.
fn write(path: &Path, picture: Image) -> Result<()> {
    let picture = Background::Colour([0.0; 3]).behind(picture);
    output::write_picture(path, Format::Png(Depth::Eight), &picture)?;
    Ok(())
}

/// The command that draws a picture again, run from where this one was.
fn command(words: &[String], folder: &Path, name: &str, size: Size) -> String {
    let Size { width, height } = size;
    let file = folder.join(name).display().to_string();
    let size = format!("{width}x{height}");
    let end = ["--background", "black", "--size", &size, "-o", &file].map(str::to_owned);
    typed::line(&[words, &end].concat())
}
