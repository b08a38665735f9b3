//! Warps the scenes of the warp comparison with every method and prints error and cost as Markdown tables.
//!
//! `cargo run --release -p resample-tests --bin warp_views [-- FRAMES [FOLDER]]`. Each method draws one frame to warm up
//! and FRAMES timed ones (5 if not given). With FOLDER, pictures are written there. Says "skipped" and succeeds where the
//! data is absent. Time is process-CPU time, the least of the frames.

use std::process::ExitCode;

use resample_core::Image;
use resample_core::image::srgb_from_linear;
use resample_tests::warp_measure::{WarpFigures, measure};
use resample_tests::warp_truth::{SCENES, WarpScene};
use warp3d::{Frame, Method, WarpOptions, Warper};

/// Timed frames if none are asked for.
const FRAMES: usize = 5;

/// What skip lines call this program.
const PROGRAM: &str = "warp_views";

fn main() -> ExitCode {
    let frames = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(FRAMES);
    let folder = std::env::args().nth(2);
    for name in SCENES {
        let Some(scene) = WarpScene::load(PROGRAM, name) else { continue };
        println!(
            "### {name}\n\n| method | PSNR | interior | edge band | holes % | false fill % | SSIM | FLIP | CPU ms |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for (label, options) in settings() {
            let (frame, cpu_ms) = timed(&scene, &options, frames);
            print_row(label, &measure(&frame.image, &scene.truth), cpu_ms);
            if let Some(folder) = &folder {
                let path = format!("{folder}/{name}-{label}");
                write_png(&frame.image, Some(&scene.truth.visible), &format!("{path}.png"));
                write_png(&difference(&frame.image, &scene.truth.image), None, &format!("{path}-diff.png"));
            }
        }
        println!();
    }
    ExitCode::SUCCESS
}

fn print_row(label: &str, f: &WarpFigures, cpu_ms: f64) {
    println!(
        "| {label} | {:.2} | {:.2} | {:.2} | {:.3} | {:.3} | {:.4} | {:.4} | {cpu_ms:.1} |",
        f.psnr_db, f.interior_db, f.edge_db, f.holes_percent, f.false_fill_percent, f.ssim, f.flip
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
        ("nearest", of(Method::Nearest)),
        ("points", of(Method::Points)),
        ("splats", of(Method::Splats)),
        ("ewa", of(Method::Ewa)),
        ("mesh", of(Method::Mesh)),
        ("hybrid", of(Method::Hybrid)),
    ]
}

/// Four times the absolute difference.
fn difference(image: &Image, truth: &Image) -> Image {
    let mut out = truth.clone();
    for (o, p) in out.rgba.iter_mut().zip(&image.rgba) {
        *o = std::array::from_fn(|c| if c == 3 { 1.0 } else { 4.0 * (o[c] - p[c]).abs() });
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
        if visible.is_some_and(|v| !v[i]) { [r / 2 + 127, g / 2, b / 2] } else { [r, g, b] }
    });
    let bytes: Vec<u8> = pixels.collect();
    encoder.write_header().and_then(|mut w| w.write_image_data(&bytes)).expect("a written picture");
}
