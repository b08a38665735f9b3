//! What cells, sub-pixels and kernels do for every-sample, in the six comparison views: error, cost and memory.
//!
//! `cargo run --release -p resample-tests --example cell_trade [-- FRAMES]`. PSNR is inside the object against the area
//! truth. Time is process-CPU time of one thread: the least over FRAMES frames (3 if not given). Says "skipped" and
//! succeeds where the data is absent.

use std::process::ExitCode;

use resample_core::metrics::{Mask, compare};
use resample_core::{Image, KernelShape};
use resample_tests::choices::with_samples;
use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::peer_scenes::{Distance, Scene, Subject, Truth};
use volsplat::{Cells, RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

const PROGRAM: &str = "cell_trade";

fn main() -> ExitCode {
    let Some(frames) = frames_argument(PROGRAM, 3) else {
        return ExitCode::FAILURE;
    };
    one_thread().install(|| {
        Subject::ALL
            .into_iter()
            .for_each(|subject| print_subject(subject, frames))
    });
    ExitCode::SUCCESS
}

fn print_subject(subject: Subject, frames: usize) {
    let Some(volume) = subject.volume(PROGRAM) else {
        return;
    };
    let distances = [Distance::Close, Distance::Mixed, Distance::Far];
    let scenes = distances.map(|distance| Scene { subject, distance });
    let truths: Vec<Image> = scenes
        .iter()
        .filter_map(|scene| scene.truth(PROGRAM, Truth::Area))
        .collect();
    if truths.len() < scenes.len() {
        return;
    }
    println!("### {}\n", subject.name());
    println!(
        "| samples | composited at | close: dB; ms | mixed: dB; ms | far: dB; ms | samples drawn | prepared in ms |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, options) in settings() {
        row(
            name,
            &options,
            (&volume, &subject.transfer()),
            (&scenes, &truths, frames),
        );
    }
    println!();
}

fn row(
    name: [&str; 2],
    options: &RenderOptions,
    (volume, transfer): (&Volume, &TransferFunction),
    (scenes, truths, frames): (&[Scene], &[Image], usize),
) {
    let start = std::time::Instant::now();
    let mut renderer =
        Renderer::new(volume, transfer, options).expect("options within their ranges");
    let prepared_ms = 1e3 * start.elapsed().as_secs_f64();
    let mut drawn = 0;
    let cells: Vec<String> = scenes
        .iter()
        .zip(truths)
        .map(|(scene, truth)| {
            let camera = scene.pose().camera();
            let mut least_ms = f64::INFINITY;
            let mut image = None;
            for _ in 0..frames {
                let frame = renderer.render(&camera).expect("a valid camera");
                least_ms = least_ms.min(frame.stats.cpu_ms);
                drawn = frame.stats.splats + frame.stats.points + frame.stats.culled;
                image = Some(frame.image);
            }
            let image = image.expect("at least one frame");
            let psnr_db = compare(&image, truth, Some(&Mask::from_alpha(truth)))
                .expect("pictures of one size")
                .psnr_db;
            format!("{psnr_db:.1}; {least_ms:.0}")
        })
        .collect();
    println!(
        "| {} | {} | {} | {drawn} | {prepared_ms:.0} |",
        name[0],
        name[1],
        cells.join(" | ")
    );
}

fn settings() -> Vec<([&'static str; 2], RenderOptions)> {
    let paper = RenderOptions::paper;
    let counts = [
        ("pixel", 1),
        ("2x2 sub-pixels", 2),
        ("4x4 sub-pixels", 4),
        ("8x8 sub-pixels", 8),
    ];
    let cells = [
        (
            "voxels, Gaussian (the paper)",
            Cells::Off,
            KernelShape::Gaussian,
        ),
        ("voxels", Cells::Off, KernelShape::Polynomial),
        ("means of cells", Cells::Mean, KernelShape::Polynomial),
        (
            "cells split at 1/4",
            Cells::Split { error: 0.25 },
            KernelShape::Polynomial,
        ),
        (
            "cells split at 1/8",
            Cells::Split { error: 0.125 },
            KernelShape::Polynomial,
        ),
        (
            "cells split at 1/16",
            Cells::Split { error: 1.0 / 16.0 },
            KernelShape::Polynomial,
        ),
        (
            "cells split at 1/32",
            Cells::Split { error: 1.0 / 32.0 },
            KernelShape::Polynomial,
        ),
        (
            "cells split at 1/64",
            Cells::Split { error: 1.0 / 64.0 },
            KernelShape::Polynomial,
        ),
    ];
    let mut rows = Vec::new();
    for (name, cells, kernel) in cells {
        for (at, n) in counts {
            let options = with_samples(
                RenderOptions {
                    subpixels: Subpixels::Fixed(n),
                    ..paper()
                },
                |samples| {
                    samples.cells = cells;
                    samples.kernel = kernel;
                },
            );
            rows.push(([name, at], options));
        }
    }
    rows.push((["default", "default"], RenderOptions::every_sample()));
    rows
}
