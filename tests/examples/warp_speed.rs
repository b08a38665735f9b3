//! Times the warp of one depth image: the hybrid against the nearest-pixel baseline, stage by stage, as ratios of one run.
//!
//! `cargo run --release -p resample-tests --example warp_speed [-- FRAMES [WIDTH]]`. The scene is analytic, at 640x480 and at
//! 1920x1080; the camera moves from frame to frame. CPU time is that of one thread, the least of the frames; frames a
//! second are those of two threads, by the median frame. What is prepared once per reference is timed apart.

use std::time::Instant;

use glam::DVec3;
use rayon::{ThreadPool, ThreadPoolBuilder};
use resample_core::Camera;
use resample_tests::warp_scenes::{AnalyticScene, camera};
use warp3d::{FrameStats, Method, Reference, WarpOptions, Warper};

/// Timed frames if none are asked for.
const FRAMES: usize = 9;

fn main() {
    let frames = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(FRAMES);
    println!(
        "| size | method | prepared once, wall ms | frame, CPU ms | times nearest | project | accumulate | resolve | frames/s, 2 threads |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let only = std::env::args().nth(2).and_then(|a| a.parse().ok());
    for (size, focal_px) in [([640, 480], 520.0), ([1920, 1080], 1400.0)] {
        if only.is_some_and(|width: u32| width != size[0]) {
            continue;
        }
        let start = camera(size, focal_px, DVec3::ZERO, 0.0);
        let reference = AnalyticScene::room().reference(&start);
        let mut nearest_ms = f64::NAN;
        for method in [Method::NEAREST, Method::HYBRID] {
            let (prepare_ms, stats) = timed(&reference, method, frames, &pool(1));
            if method == Method::NEAREST {
                nearest_ms = stats.cpu_ms;
            }
            let (_, wall) = timed(&reference, method, frames, &pool(2));
            println!(
                "| {}x{} | {method:?} | {prepare_ms:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
                size[0],
                size[1],
                stats.cpu_ms,
                stats.cpu_ms / nearest_ms,
                stats.stages.project.cpu_ms,
                stats.stages.accumulate.cpu_ms,
                stats.stages.resolve.cpu_ms,
                1e3 / wall.wall_ms
            );
        }
    }
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads")
}

/// Time to prepare, ms, and the stats of the frame that took the least CPU time, with the median wall time.
fn timed(
    reference: &Reference,
    method: Method,
    frames: usize,
    pool: &ThreadPool,
) -> (f64, FrameStats) {
    pool.install(|| {
        let clock = Instant::now();
        let options = WarpOptions::with_method(method);
        let mut warper = Warper::new(vec![reference.clone()], &options).expect("a good reference");
        let prepare_ms = 1e3 * clock.elapsed().as_secs_f64();
        let mut stats: Vec<FrameStats> = (0..=frames)
            .map(|i| {
                warper
                    .render(&target(&reference.camera, i as f64 / frames as f64))
                    .expect("a camera")
                    .stats
            })
            .collect();
        stats.remove(0);
        stats.sort_by(|a, b| a.wall_ms.total_cmp(&b.wall_ms));
        let median_ms = stats[stats.len() / 2].wall_ms;
        stats.sort_by(|a, b| a.cpu_ms.total_cmp(&b.cpu_ms));
        (
            prepare_ms,
            FrameStats {
                wall_ms: median_ms,
                ..stats[0].clone()
            },
        )
    })
}

/// The reference's camera, moved aside and ahead and turned a little.
fn target(reference: &Camera, along: f64) -> Camera {
    let size = [reference.width, reference.height];
    camera(
        size,
        reference.fx,
        DVec3::new(0.1 + 0.1 * along, -0.03, 0.05 * along),
        0.02 * along,
    )
}
