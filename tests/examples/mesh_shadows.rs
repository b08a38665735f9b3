//! Times of light that a mesh blocks from itself: preparing, and frames with and without shadows, in turn.
//!
//! `cargo run --release -p resample-tests --example mesh_shadows -- [MODEL [ENVIRONMENT]]`; without a model, a bumpy ball of 100,000 triangles.

use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_core::clock::StageClock;
use resample_tests::meshes::shadows::bumpy_ball;
use resample_tests::volumes::scenes::perspective;
use texmap::{LoadOptions, RenderOptions, Renderer, Scene, Shadows};

fn scene() -> Scene {
    let mut words = std::env::args().skip(1);
    let Some(model) = words.next() else {
        return bumpy_ball(158);
    };
    let options = LoadOptions {
        environment: words.next().map(PathBuf::from),
        ..LoadOptions::default()
    };
    texmap::load(Path::new(&model), &options)
        .expect("a model")
        .scene
}

fn main() {
    let scene = scene();
    let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    for threads in [2, 1] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().expect("threads").install(|| {
            let mut renderers = [Shadows::None, Shadows::Mesh].map(|shadows| {
                let options = RenderOptions {
                    shadows,
                    ..RenderOptions::default()
                };
                let clock = StageClock::start();
                let renderer = Renderer::new(&scene, &options).expect("good options");
                println!(
                    "{threads} threads, {triangles} triangles, {shadows:?}: prepared in {:?}",
                    clock.stop()
                );
                renderer
            });
            let [low, high] = renderers[0].bounds_in_world().expect("triangles");
            let (middle, size) = (0.5 * (low + high), (high - low).length());
            let mut sums = [0.0; 2];
            for step in 0..10 {
                let turn = 0.1 * f64::from(step);
                let eye = middle + DVec3::new(turn.sin(), 0.4, turn.cos()) * size;
                let camera = perspective(eye, middle, 50.0, [800, 800]);
                for (renderer, sum) in renderers.iter_mut().zip(&mut sums) {
                    *sum += renderer.render(&camera).expect("a frame").stats.cpu_ms;
                }
            }
            println!(
                "{:.1} and {:.1} ms a frame, {:.3}",
                sums[0] / 10.0,
                sums[1] / 10.0,
                sums[1] / sums[0]
            );
        });
    }
}
