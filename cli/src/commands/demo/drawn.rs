//! A scene's two pictures, and how far each is from a reference.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Parser;
use resample_core::metrics::Mask;
use resample_core::{Camera, Image, metrics};

use super::scenes::{DemoScene, Truth};
use crate::args::words::typed;
use crate::args::{Cli, Command, Drawing};
use crate::commands::built_in;
use crate::open::Opened;
use crate::output::{Depth, Format};
use crate::picture::background::Background;
use crate::plan::Purpose;
use crate::process::report;
use crate::process::report::Verbosity;
use crate::values::Size;
use crate::{output, planner};

/// A scene that was drawn.
pub(super) struct DemoPicture {
    pub(super) title: &'static str,
    pub(super) about: &'static str,
    /// The way of the command line, and the quick one.
    pub(super) ways: [Way; 2],
    /// Time of the first picture, ms.
    pub(super) draw_ms: f64,
    /// Where the errors are measured against.
    pub(super) against: &'static str,
}

/// One way to draw a scene.
pub(super) struct Way {
    pub(super) title: &'static str,
    /// The picture's file in the folder of the page.
    pub(super) file: String,
    pub(super) command: String,
    /// Decibels, where both show something.
    pub(super) psnr_db: f64,
}

/// Side of the pictures that are measured: the most exact setting takes seconds at the size of a screen.
const MEASURED_PX: u32 = 96;

/// Draws and measures a scene.
pub(super) fn shown(scene: DemoScene, folder: &Path, size: Size) -> Result<DemoPicture> {
    let quick: Vec<String> = scene.quick.iter().map(|&word| word.to_owned()).collect();
    let words = [scene.words.clone(), [scene.words.clone(), quick].concat()];
    let size = match scene.truth {
        Truth::MostExact => size,
        // As wide for its height as the picture that it is made of.
        Truth::Traced => {
            let [width, height] = built_in::DEPTH_IMAGE_PX.map(|side| side as u32);
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
            opened.draw(&measured)?.image
        }
        Truth::Traced => {
            built_in::ball_before_wall(built_in::NEW_EYE, built_in::DEPTH_IMAGE_SAMPLES)
        }
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
            psnr_db: psnr_db(&pictures[place], &truth)?,
        });
    }
    let ways: [Way; 2] = ways.try_into().ok().context("two ways")?;
    Ok(DemoPicture {
        title: scene.title,
        about: scene.about,
        ways,
        draw_ms,
        against: match scene.truth {
            Truth::MostExact => "the most exact setting",
            Truth::Traced => "the scene itself, where the picture has no hole",
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
        Truth::MostExact => [MEASURED_PX; 2],
        // As large as the picture that was traced.
        Truth::Traced => built_in::DEPTH_IMAGE_PX.map(|side| side as u32),
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
