//! Renders the six views of the volume comparison with many settings and prints error and cost as Markdown tables.
//!
//! `cargo run --release -p resample-tests --example volume_views [-- FRAMES]`. Each setting draws two frames to warm up and
//! FRAMES timed ones (9 if not given), the camera turned by 0.7 degrees about up from frame to frame; the last frame
//! is not turned, and is compared with the truths over the pixels that the truth covers. Says "skipped" and succeeds
//! where the data is absent. Time is process-CPU time of one thread: the median over the frames, and the least.

use std::process::ExitCode;

use resample_core::metrics::{Comparison, Mask, compare};
use resample_core::{Camera, FootprintMode, Image, KernelShape, OpacityMode, SelectMode};
use resample_tests::choices::{with_field, with_samples};
use resample_tests::frames::frames_argument;
use resample_tests::interleaved::{Entrant, run};
use resample_tests::volumes::peer_scenes::{Scene, Subject, Truth};
use volsplat::{RenderOptions, Subpixels, TransferFunction, Volume};

/// How far the camera turns from frame to frame: a voxel at the volume's rim moves by about two pixels.
const TURN_DEG: f64 = 0.7;

/// Frames that only bring buffers to their size.
const WARM_UP: usize = 2;

/// Timed frames if none are asked for.
const FRAMES: usize = 9;

/// What skip lines call this program.
const PROGRAM: &str = "volume_views";

fn main() -> ExitCode {
    let Some(frames) = frames_argument(PROGRAM, FRAMES) else {
        return ExitCode::FAILURE;
    };
    for subject in Subject::ALL {
        let Some(volume) = subject.volume(PROGRAM) else {
            continue;
        };
        let transfer = subject.transfer();
        for scene in Scene::ALL
            .into_iter()
            .filter(|scene| scene.subject == subject)
        {
            print_scene(&scene, (&volume, &transfer), frames);
        }
    }
    ExitCode::SUCCESS
}

fn print_scene(scene: &Scene, subject: (&Volume, &TransferFunction), frames: usize) {
    let truths: Vec<Image> = Truth::ALL
        .iter()
        .filter_map(|&truth| scene.truth(PROGRAM, truth))
        .collect();
    let [point, area] = truths.as_slice() else {
        return;
    };
    let mut entrants: Vec<Entrant> = settings()
        .iter()
        .map(|(name, options)| Entrant::new(name, subject, options))
        .collect();
    run(&mut entrants, &cameras(scene, frames), WARM_UP);
    println!("### {}\n", scene.name());
    println!(
        "| setting | against point truth | against area truth | CPU ms (least) | bricks | splats | points |"
    );
    println!("|---|---|---|---|---|---|---|");
    for entrant in &entrants {
        let stats = entrant.last();
        println!(
            "| {} | {} | {} | {:.1} ({:.1}) | {} | {} | {} |",
            entrant.name,
            figures(&against(&entrant.image, point)),
            figures(&against(&entrant.image, area)),
            entrant.median_cpu_ms(),
            entrant.least(|stats| stats.cpu_ms),
            stats.bricks,
            stats.splats,
            stats.points
        );
    }
    println!();
}

/// PSNR inside, SSIM inside, mean FLIP inside.
fn figures(comparison: &Comparison) -> String {
    format!(
        "{:.1} dB; {:.3}; {:.3}",
        comparison.psnr_db, comparison.ssim, comparison.flip.mean
    )
}

/// The comparison over the pixels that the truth covers.
fn against(image: &Image, truth: &Image) -> Comparison {
    compare(image, truth, Some(&Mask::from_alpha(truth))).expect("finite pictures of one size")
}

/// The turning camera; the last one looks as the truth does.
fn cameras(scene: &Scene, frames: usize) -> Vec<Camera> {
    let pose = scene.pose();
    let turned = |back: usize| pose.turned((back as f64 * TURN_DEG).to_radians()).camera();
    (0..WARM_UP + frames).rev().map(turned).collect()
}

/// What is compared: image sheets, then every sample, each with one choice of its default changed at a time.
fn settings() -> Vec<(&'static str, RenderOptions)> {
    let mut rows = sheet_settings();
    rows.extend(every_sample_settings());
    rows
}

fn sheet_settings() -> Vec<(&'static str, RenderOptions)> {
    let default = RenderOptions::default;
    let mut rows = vec![(
        "default: image sheets, slab 0.5, auto sub-pixels",
        default(),
    )];
    let slabs = [("slab 1", 1.0), ("slab 0.25", 0.25)];
    rows.extend(slabs.map(|(name, slab_voxels)| {
        (
            name,
            with_field(default(), |field| field.slab_voxels = slab_voxels),
        )
    }));
    let counts = [
        ("1 sub-pixel", 1),
        ("2x2 sub-pixels", 2),
        ("4x4 sub-pixels", 4),
    ];
    rows.extend(counts.map(|(name, n)| {
        (
            name,
            RenderOptions {
                subpixels: Subpixels::Fixed(n),
                ..default()
            },
        )
    }));
    rows
}

fn every_sample_settings() -> Vec<(&'static str, RenderOptions)> {
    // The rows after the first change one choice of the paper's way.
    let default = RenderOptions::paper;
    let mut rows = vec![
        ("every sample: its default", RenderOptions::every_sample()),
        (
            "every sample, the paper's way: hybrid, exact, Gaussian",
            default(),
        ),
    ];
    let footprints = [
        (
            "every sample, footprint affine-approx",
            FootprintMode::AffineApprox,
        ),
        ("every sample, footprint affine", FootprintMode::Affine),
        ("every sample, footprint table", FootprintMode::Table),
    ];
    rows.extend(footprints.map(|(name, footprint)| {
        (
            name,
            with_samples(default(), |samples| samples.footprint = footprint),
        )
    }));
    let kernels = [
        ("every sample, kernel polynomial", KernelShape::Polynomial),
        ("every sample, kernel B-spline", KernelShape::BSpline),
    ];
    rows.extend(kernels.map(|(name, kernel)| {
        (
            name,
            with_samples(default(), |samples| samples.kernel = kernel),
        )
    }));
    let selections = [
        ("every sample, select splats", SelectMode::Splats),
        ("every sample, select points", SelectMode::Points),
        ("every sample, select ewa", SelectMode::Ewa),
    ];
    rows.extend(selections.map(|(name, select)| {
        (
            name,
            with_samples(default(), |samples| samples.select = select),
        )
    }));
    let opacity = OpacityMode::Linear;
    rows.push((
        "every sample, opacity linear",
        RenderOptions {
            opacity,
            ..default()
        },
    ));
    rows
}
