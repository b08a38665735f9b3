//! How long it takes to prepare a reference and to draw a frame: a disc before a wall with exact depth, with soft depth and
//! with noise, 400x300 px.
//!
//! Items are samples of the reference. One thread. Scenes are made here, so that no file is needed.

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::DVec3;
use rayon::{ThreadPool, ThreadPoolBuilder};
use resample_core::{Camera, LookAt};
use warp3d::{Fill, Reference, WarpOptions, Warper};

/// Pixels of the reference and of the frame.
const SIZE: [u32; 2] = [400, 300];

/// Pixels from the rim of the disc over which soft depth changes.
const RAMP_PX: f32 = 4.0;

/// A scene.
#[derive(Clone, Copy, Debug)]
enum Scene {
    /// Depth steps from one sample to the next.
    Exact,
    /// Depth has ramps.
    Soft,
    /// Depth is off by up to one part in a hundred.
    Noisy,
}

const ALL: [Scene; 3] = [Scene::Exact, Scene::Soft, Scene::Noisy];

fn main() {
    divan::Divan::default()
        .max_time(std::time::Duration::from_secs(1))
        .config_with_args()
        .main();
}

#[divan::bench(args = ALL)]
fn prepare(bencher: Bencher, scene: Scene) {
    let reference = reference(scene);
    let options = WarpOptions::default();
    let pool = one_thread();
    let prepared = |reference| {
        pool.install(|| Warper::new(vec![reference], &options).expect("a good reference"))
    };
    bencher
        .counter(ItemsCount::new(reference.depth.len()))
        .with_inputs(|| reference.clone())
        .bench_local_values(prepared);
}

#[divan::bench(args = ALL)]
fn frame(bencher: Bencher, scene: Scene) {
    draw(bencher, scene, Fill::None);
}

#[divan::bench(args = ALL)]
fn filled_frame(bencher: Bencher, scene: Scene) {
    draw(bencher, scene, Fill::Background);
}

fn draw(bencher: Bencher, scene: Scene, fill: Fill) {
    let options = WarpOptions {
        fill,
        ..WarpOptions::default()
    };
    let (reference, target) = (reference(scene), camera_at(0.2));
    let bencher = bencher.counter(ItemsCount::new(reference.depth.len()));
    let pool = one_thread();
    let mut warper = Warper::new(vec![reference], &options).expect("a good reference");
    bencher.bench_local(|| pool.install(|| warper.render(&target)));
}

fn one_thread() -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread can be started")
}

fn camera_at(x: f64) -> Camera {
    let pose = LookAt {
        position: DVec3::new(x, 0.0, 0.0),
        target: DVec3::new(x, 0.0, 1.0),
        up: DVec3::NEG_Y,
    };
    Camera::perspective(&pose, 0.8, SIZE).expect("a camera")
}

/// A chequered wall four units away and a disc before it, two units away.
fn reference(scene: Scene) -> Reference {
    let (mut colour, mut depth) = (Vec::new(), Vec::new());
    let mut state = 1u32;
    let [width, height] = SIZE.map(|side| side as i32);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let beyond_px = ((x - 200) as f32).hypot((y - 150) as f32) - 60.0;
        let wall = [0.1 + 0.5 * ((x / 25 + y / 25) % 2) as f32; 3];
        colour.push(if beyond_px < 0.0 {
            [0.8, 0.2, 0.1]
        } else {
            wall
        });
        let is_wall = match scene {
            Scene::Soft => (0.5 + 0.5 * beyond_px / RAMP_PX).clamp(0.0, 1.0),
            Scene::Exact | Scene::Noisy => f32::from(u8::from(beyond_px >= 0.0)),
        };
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let off = match scene {
            Scene::Noisy => (state >> 8) as f32 / (1 << 23) as f32 - 1.0,
            Scene::Exact | Scene::Soft => 0.0,
        };
        depth.push((1.0 + 0.01 * off) / (0.5 - 0.25 * is_wall));
    }
    Reference {
        camera: camera_at(0.0),
        colour,
        depth,
    }
}
