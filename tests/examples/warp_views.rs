//! Warps the scenes of the warp comparison and real pairs with every method and prints error and cost as tables.
//!
//! `cargo run --release -p resample-tests --example warp_views [-- FRAMES [FOLDER]]`. Each method draws one frame to warm up
//! and FRAMES timed ones (5 if not given). With FOLDER, pictures are written there. Says "skipped" and succeeds where the
//! data is absent. Time is process-CPU time of all threads, the least of the frames.

use std::process::ExitCode;

use glam::DVec3;
use resample_core::Image;
use resample_core::image::srgb_from_linear;
use resample_tests::warps::measure::{WarpFigures, measure};
use resample_tests::warps::pairs::{PAIRS, pair};
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::truth::{SCENES, WarpScene};
use warp3d::{Fill, Frame, Method, WarpOptions, Warper};

/// Timed frames if none are asked for.
const FRAMES: usize = 5;

/// What skip lines call this program.
const PROGRAM: &str = "warp_views";

fn main() -> ExitCode {
    let frames = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(FRAMES);
    let folder = std::env::args().nth(2);
    let scenes = SCENES
        .into_iter()
        .map(|name| WarpScene::load(PROGRAM, name));
    for scene in scenes
        .chain(PAIRS.into_iter().map(|name| pair(PROGRAM, name)))
        .flatten()
    {
        print_scene(&scene, frames, folder.as_deref());
    }
    if let Some(folder) = folder {
        write_png(&figure(), None, &format!("{folder}/warp-figure6.png"));
    }
    ExitCode::SUCCESS
}

fn print_scene(scene: &WarpScene, frames: usize, folder: Option<&str>) {
    println!("### {}\n", scene.name);
    println!(
        "| method | PSNR | half seen | clear of holes | sRGB | interior | edge band | holes % | false fill % | SSIM | FLIP | CPU ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (label, options) in settings() {
        let (frame, cpu_ms) = timed(scene, &options, frames);
        print_row(label, &measure(&frame.image, &scene.truth), cpu_ms);
        if let Some(folder) = folder {
            let path = format!("{folder}/{}-{label}", scene.name);
            write_png(
                &frame.image,
                Some(&scene.truth.visible()),
                &format!("{path}.png"),
            );
            write_png(
                &difference(&frame.image, &scene.truth.image),
                None,
                &format!("{path}-diff.png"),
            );
        }
    }
    println!();
}

fn print_row(label: &str, f: &WarpFigures, cpu_ms: f64) {
    println!(
        "| {label} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.3} | {:.2} | {:.3} | {:.3} | {cpu_ms:.0} |",
        f.psnr_db,
        f.half_seen_db,
        f.clear_db,
        f.srgb_db,
        f.interior_db,
        f.edge_db,
        f.holes_percent,
        f.false_fill_percent,
        f.ssim,
        f.flip
    );
}

fn timed(scene: &WarpScene, options: &WarpOptions, frames: usize) -> (Frame, f64) {
    let mut warper = Warper::new(vec![scene.reference.clone()], options).expect("a good reference");
    let mut frame = warper.render(&scene.target).expect("a camera");
    let mut least = f64::INFINITY;
    for _ in 0..frames {
        frame = warper.render(&scene.target).expect("a camera");
        least = least.min(frame.stats.cpu_ms);
    }
    (frame, least)
}

fn settings() -> Vec<(&'static str, WarpOptions)> {
    let of = WarpOptions::with_method;
    vec![
        ("nearest", of(Method::NEAREST)),
        ("points", of(Method::POINTS)),
        ("splats", of(Method::SPLATS)),
        ("hybrid", of(Method::HYBRID)),
        (
            "hybrid, fill background",
            WarpOptions {
                fill: Fill::Background,
                ..WarpOptions::default()
            },
        ),
        (
            "hybrid, fill natural",
            WarpOptions {
                fill: Fill::Natural,
                ..WarpOptions::default()
            },
        ),
    ]
}

/// An analytic scene magnified twice, enlarged: nearest, splats, hybrid with background filled, and the truth.
fn figure() -> Image {
    const CROP: [usize; 2] = [160, 120];
    const FROM: [usize; 2] = [60, 60];
    let from = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let to = camera([320, 240], 520.0, DVec3::X * 0.25, 0.0);
    let scene = AnalyticScene::room();
    let by = |options: &WarpOptions| {
        let mut warper =
            Warper::new(vec![scene.reference(&from)], options).expect("a good reference");
        warper.render(&to).expect("a camera").image
    };
    let filled = WarpOptions {
        fill: Fill::Background,
        ..WarpOptions::default()
    };
    let nearest = by(&WarpOptions::with_method(Method::NEAREST));
    let splats = by(&WarpOptions::with_method(Method::SPLATS));
    let panels = [nearest, splats, by(&filled), scene.truth(&to, &from).image];
    let mut out = Image::transparent(4 * CROP[0], 4 * CROP[1]);
    for (i, pixel) in out.rgba.iter_mut().enumerate() {
        let (x, y) = (i % (4 * CROP[0]), i / (4 * CROP[0]));
        let panel = &panels[x / (2 * CROP[0]) + 2 * (y / (2 * CROP[1]))];
        *pixel = panel.pixel(
            FROM[0] + x % (2 * CROP[0]) / 2,
            FROM[1] + y % (2 * CROP[1]) / 2,
        );
    }
    out
}

/// Four times the absolute difference.
fn difference(image: &Image, truth: &Image) -> Image {
    let mut out = truth.clone();
    for (o, p) in out.rgba.iter_mut().zip(&image.rgba) {
        *o = std::array::from_fn(|c| {
            if c == 3 {
                1.0
            } else {
                4.0 * (o[c] - p[c]).abs()
            }
        });
    }
    out
}

/// Writes the picture on black, 8 bits, sRGB; what is not visible is tinted.
fn write_png(image: &Image, visible: Option<&[bool]>, path: &str) {
    let file = std::fs::File::create(path).expect("a writable folder");
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let code = |v: f32| (255.0 * srgb_from_linear(v) + 0.5) as u8;
    let pixels = image.rgba.iter().enumerate().flat_map(|(i, p)| {
        let [r, g, b] = [p[0], p[1], p[2]].map(code);
        if visible.is_some_and(|v| !v[i]) {
            [r / 2 + 127, g / 2, b / 2]
        } else {
            [r, g, b]
        }
    });
    let bytes: Vec<u8> = pixels.collect();
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&bytes))
        .expect("a written picture");
}
