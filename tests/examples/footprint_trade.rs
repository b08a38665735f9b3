//! Measures what the modes of footprint evaluation lose against the exact one, and what they save.
//!
//! `cargo run --release -p resample-tests --example footprint_trade [-- FRAMES]`. The eye stands close before the middle of
//! a face, with a wide field of view: that is where the modes differ, because their error grows with the footprint's
//! half cone angle times the tangent of its angle off the axis. Prints one Markdown table per volume: PSNR against the
//! picture of the exact mode over the pixels that it covers, and CPU time relative to it (least of FRAMES frames, 9 if
//! not given, one thread, the modes taking turns frame by frame). The built-in volumes need no data; the Engine is
//! skipped where it is absent.

use std::process::ExitCode;

use glam::{DAffine3, DVec3};
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, FootprintMode, LookAt};
use resample_tests::choices::with_samples;
use resample_tests::interleaved::{Entrant, run};
use resample_tests::peer_scenes::{Pose, Subject};
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{FrameStats, RenderOptions, TransferFunction, Volume, Voxels, procedural};

/// Vertical fields of view, degrees: a usual wide angle and one near the limit of what people accept.
const FOVS_DEG: [f64; 2] = [60.0, 100.0];

/// Gaps between the eye and the face, voxels: at 8 the nearest footprints have half cone angles of 13 degrees.
const GAPS_VOXELS: [f64; 2] = [8.0, 32.0];

/// How far the camera turns about the volume's middle from frame to frame.
const TURN_DEG: f64 = 0.7;

/// Frames that only bring buffers to their size.
const WARM_UP: usize = 2;

/// Timed frames if none are asked for.
const FRAMES: usize = 9;

/// Voxels per axis of the built-in volume: about half a million are visible.
const BLOBS_SIDE: usize = 192;

fn main() -> ExitCode {
    let frames = match std::env::args()
        .nth(1)
        .map(|argument| argument.parse::<usize>())
    {
        None => FRAMES,
        Some(Ok(frames)) if frames > 0 => frames,
        Some(_) => {
            eprintln!("usage: footprint_trade [FRAMES], with FRAMES a whole number above 0");
            return ExitCode::FAILURE;
        }
    };
    print_volume(
        "isolated voxels, one in 6 per axis",
        (&isolated(), &white()),
        frames,
    );
    let blobs = procedural::blobs(BLOBS_SIDE).expect("a good size");
    print_volume(
        &format!("built-in blobs, {BLOBS_SIDE}^3"),
        (&blobs, &bands()),
        frames,
    );
    if let Some(engine) = Subject::Engine.volume("footprint_trade") {
        print_volume(
            "Engine, 256x256x128",
            (&engine, &Subject::Engine.transfer()),
            frames,
        );
    }
    ExitCode::SUCCESS
}

fn print_volume(title: &str, subject: (&Volume, &TransferFunction), frames: usize) {
    println!("### {title}\n");
    println!(
        "| field of view | gap | footprint | against exact | frame | project | composite | splats | points |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for fov_deg in FOVS_DEG {
        for gap_voxels in GAPS_VOXELS {
            let pose = before_the_face(subject.0, gap_voxels, fov_deg.to_radians());
            print_view(
                &format!("{fov_deg} deg | {gap_voxels} voxels"),
                subject,
                &cameras(&pose, frames),
            );
        }
    }
    println!();
}

fn print_view(view: &str, subject: (&Volume, &TransferFunction), cameras: &[Camera]) {
    let options = |footprint| {
        with_samples(RenderOptions::paper(), |samples| {
            samples.footprint = footprint
        })
    };
    let entrant = |mode: FootprintMode| Entrant::new(name(mode), subject, &options(mode));
    let mut entrants = FootprintMode::ALL.map(entrant);
    run(&mut entrants, cameras, WARM_UP);
    let [.., exact] = &entrants;
    let inside = Mask::from_alpha(&exact.image);
    for entrant in &entrants {
        let ratio = |stage: fn(&FrameStats) -> f64| entrant.least(stage) / exact.least(stage);
        let error =
            compare(&entrant.image, &exact.image, Some(&inside)).expect("pictures of one size");
        println!(
            "| {view} | {} | {} | {:.2} | {:.2} | {:.2} | {} | {} |",
            entrant.name,
            decibels(error.psnr_db),
            ratio(|stats| stats.cpu_ms),
            ratio(|stats| stats.stages.project.cpu_ms),
            ratio(|stats| stats.stages.composite.cpu_ms),
            entrant.last().splats,
            entrant.last().points
        );
    }
}

/// Without difference the ratio is infinite.
fn decibels(psnr_db: f64) -> String {
    if psnr_db.is_finite() {
        format!("{psnr_db:.1} dB")
    } else {
        "same".to_owned()
    }
}

fn name(mode: FootprintMode) -> &'static str {
    match mode {
        FootprintMode::AffineApprox => "affine-approx",
        FootprintMode::Affine => "affine",
        FootprintMode::Table => "table",
        FootprintMode::Exact => "exact",
    }
}

/// The eye before the middle of the last slice, looking at the volume's centre.
fn before_the_face(volume: &Volume, gap_voxels: f64, fov_y_rad: f64) -> Pose {
    let last = DVec3::from(volume.dims.map(|n| (n - 1) as f64));
    let in_world = |index: DVec3| volume.world_from_index.transform_point3(index);
    let eye = DVec3::new(0.5 * last.x, 0.5 * last.y, last.z + gap_voxels);
    let look_at = LookAt {
        position: in_world(eye),
        target: in_world(0.5 * last),
        up: DVec3::Y,
    };
    Pose { look_at, fov_y_rad }
}

/// The turning camera; the last one stands straight before the face.
fn cameras(pose: &Pose, frames: usize) -> Vec<Camera> {
    let turned = |back: usize| pose.turned((back as f64 * TURN_DEG).to_radians()).camera();
    (0..WARM_UP + frames).rev().map(turned).collect()
}

/// Single voxels in empty space: what one footprint looks like, with no neighbours to hide its error.
fn isolated() -> Volume {
    let side = 97;
    let is_set = |i: usize| {
        [i % side, i / side % side, i / (side * side)]
            .iter()
            .all(|x| x % 6 == 0)
    };
    let voxels = (0..side.pow(3)).map(|i| u8::from(is_set(i))).collect();
    Volume::new([side; 3], Voxels::U8(voxels), DAffine3::IDENTITY)
        .expect("as many voxels as dims say")
}

/// Nothing at 0, white and dense at 1.
fn white() -> TransferFunction {
    let opacities = [(0.0, 0.0), (1.0, 0.9)].map(|(value, opacity)| OpacityKnot { value, opacity });
    let colour = ColourKnot {
        value: 1.0,
        rgb: [1.0; 3],
    };
    TransferFunction::new(vec![colour], opacities.to_vec()).expect("the knots ascend")
}

/// A translucent hull and a dense core, so that the shape of each footprint shows.
fn bands() -> TransferFunction {
    let colour = |value, rgb| ColourKnot { value, rgb };
    let opacity = |value, opacity| OpacityKnot { value, opacity };
    let colours = vec![
        colour(0.3, [0.1, 0.3, 0.8]),
        colour(1.2, [0.9, 0.6, 0.1]),
        colour(2.0, [0.9, 0.1, 0.1]),
    ];
    let opacities = vec![
        opacity(0.3, 0.0),
        opacity(0.6, 0.05),
        opacity(1.5, 0.1),
        opacity(2.0, 0.6),
    ];
    TransferFunction::new(colours, opacities).expect("the knots ascend")
}
