//! Times of a scan of 5 million points at 1920x1080: preparing, listing and drawing, on two threads and on one.
//!
//! `cargo run --release -p resample-tests --example scan_times`. The points lie on a sphere, evenly, in a shuffled order.

use glam::{DVec3, Vec3};
use resample_cloud::{CloudOptions, CloudRenderer, PointCloud, prepare};
use resample_core::{Camera, clock::StageClock};
use resample_tests::volumes::scenes::perspective;

const POINTS: u32 = 5_000_000;

/// Points of a spiral over the unit sphere.
fn sphere() -> PointCloud {
    /// The golden angle: neighbours on the sphere lie far apart in the list.
    const TURN: f64 = 2.399_963_229_728_653;
    let mut cloud = PointCloud::default();
    for number in 0..POINTS {
        let height = 1.0 - 2.0 * (f64::from(number) + 0.5) / f64::from(POINTS);
        let across = (1.0 - height * height).sqrt();
        let (sin, cos) = (TURN * f64::from(number)).sin_cos();
        let place: Vec3 = DVec3::new(across * cos, height, across * sin).as_vec3();
        cloud.positions.push(place.to_array());
        cloud.colours.push([200, 120, 80]);
    }
    cloud
}

/// A camera that no other step has: what is listed for one camera is kept.
fn camera(step: u32) -> Camera {
    let eye = DVec3::new(0.6 + 0.001 * f64::from(step), -0.8, -3.0);
    perspective(eye, DVec3::ZERO, 35.5, [1920, 1080])
}

fn main() {
    let cloud = sphere();
    for threads in [2, 1] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().expect("threads").install(|| {
            let clock = StageClock::start();
            let prepared = prepare(&cloud).expect("points");
            println!("{threads} threads: prepared in {:?}", clock.stop());
            let mut renderer =
                CloudRenderer::new(prepared, &CloudOptions::default()).expect("options");
            for step in 0..3 {
                let stats = renderer.render(&camera(step)).expect("a frame").stats;
                println!(
                    "listed in {:?}, drawn in {:?}, {} pixels",
                    stats.project, stats.draw, stats.seen
                );
            }
        });
    }
}
