//! Interpolating kernels on scans: every other voxel of a scan is drawn, and the picture of the whole scan is the truth.
//!
//! `cargo run --release -p resample-tests --example interpolate_real [-- FRAMES]` prints one Markdown table a subject, in the
//! close view of the comparison. A voxel of the half scan is either one voxel in eight, so that what lies between is the
//! question, or the mean of eight, as a coarse scanner gives it. Each half is drawn with every kernel; the truth is the whole
//! scan, trilinear, in slabs of an eighth of a voxel. PSNR is over the pixels that the truth shows. Time is process-CPU time
//! of one thread, the least of FRAMES frames (1 if not given). Says "skipped" and succeeds where the data is absent.

use std::process::ExitCode;

use glam::{DAffine3, DVec3};
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, Image, KernelShape};
use resample_tests::choices::{summed, with_field, with_sheets};
use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::volumes::peer_scenes::{Distance, Scene, Subject};
use resample_tests::volumes::scenes::volume;
use volsplat::{Interpolate, RenderOptions, Renderer, TransferFunction, Volume};

const PROGRAM: &str = "interpolate_real";

fn main() -> ExitCode {
    let Some(frames) = frames_argument(PROGRAM, 1) else {
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
    let Some(whole) = subject.volume(PROGRAM) else {
        return;
    };
    let camera = Scene {
        subject,
        distance: Distance::Close,
    }
    .pose()
    .camera();
    let fine = with_field(plain(), |field| field.slab_voxels = 0.125);
    let (truth, _) = drawn(&whole, &subject.transfer(), &fine, (&camera, 1));
    println!(
        "### {}\n\n| kernel | one voxel in eight: dB; ms | mean of eight: dB; ms |\n|---|---|---|",
        subject.name()
    );
    let halves = [decimated(&whole), averaged(&whole)];
    for (name, options) in settings() {
        let cells = halves.each_ref().map(|half| {
            let (image, ms) = drawn(half, &subject.transfer(), &options, (&camera, frames));
            let mask = Mask::from_alpha(&truth);
            let psnr_db = compare(&image, &truth, Some(&mask))
                .expect("pictures of one size")
                .psnr_db;
            format!("{psnr_db:.1}; {ms:.0}")
        });
        println!("| {name} | {} |", cells.join(" | "));
    }
    println!();
}

/// Opacity is meant per voxel of the whole scan, whatever is drawn.
fn plain() -> RenderOptions {
    RenderOptions {
        opacity_unit: Some(1.0),
        ..RenderOptions::default()
    }
}

fn settings() -> Vec<(String, RenderOptions)> {
    let mut rows = vec![("trilinear".to_owned(), plain())];
    for (name, shape) in [
        ("polynomial", KernelShape::Polynomial),
        ("gaussian", KernelShape::Gaussian),
        ("b-spline", KernelShape::BSpline),
    ] {
        let blurred = summed(plain(), shape);
        let sharp = with_sheets(blurred.clone(), |sheets| {
            sheets.interpolate = Interpolate::On
        });
        rows.push((name.to_owned(), blurred));
        rows.push((format!("{name}, `--interpolate`"), sharp));
    }
    rows
}

fn drawn(
    volume: &Volume,
    look: &TransferFunction,
    options: &RenderOptions,
    (camera, frames): (&Camera, usize),
) -> (Image, f64) {
    let mut renderer = Renderer::new(volume, look, options).expect("options within their ranges");
    let mut least_ms = f64::INFINITY;
    let mut image = None;
    for _ in 0..frames {
        let frame = renderer.render(camera).expect("a valid camera");
        least_ms = least_ms.min(frame.stats.cpu_ms);
        image = Some(frame.image);
    }
    (image.expect("at least one frame"), least_ms)
}

/// Every other voxel along each axis, where it is.
fn decimated(whole: &Volume) -> Volume {
    half(whole, DVec3::ZERO, |at, value| value(at))
}

/// The means of eight voxels, in their middle.
fn averaged(whole: &Volume) -> Volume {
    half(whole, DVec3::splat(0.5), |[x, y, z], value| {
        (0..8)
            .map(|i| value([x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)]))
            .sum::<f64>()
            / 8.0
    })
}

/// A volume of half as many voxels along each axis, the first at `first` voxels of the whole.
fn half(
    whole: &Volume,
    first: DVec3,
    voxel: impl Fn([usize; 3], &dyn Fn([usize; 3]) -> f64) -> f64,
) -> Volume {
    let [nx, ny, _] = whole.dims;
    let value = |[x, y, z]: [usize; 3]| whole.value(x + nx * (y + ny * z));
    let spread = DAffine3::from_translation(first) * DAffine3::from_scale(DVec3::splat(2.0));
    volume(
        whole.dims.map(|n| n / 2),
        whole.world_from_index * spread,
        |at| voxel(at.to_array().map(|i| 2 * i as usize), &value),
    )
}
