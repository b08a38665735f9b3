//! The cost of a mesh inside a volume beside those of the volume alone and of the mesh alone, as a Markdown table.
//!
//! `cargo run --release -p resample-tests --example mesh_in_volume [-- FRAMES]`. All three are drawn in turn from each camera of an orbit, on
//! one thread; times are medians of CPU time. Says "skipped" where the data is absent.

use glam::DVec3;
use resample_core::clock::StageClock;
use resample_core::{Camera, Framing, Stop};
use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::meshes::shadows::{Body, Shape, scene};
use resample_tests::meshes::surroundings::Reflector;
use resample_tests::volumes::lod_scenes::{procedural, real};
use volsplat::{RenderOptions, Renderer, Shading};

const PROGRAM: &str = "mesh_in_volume";

/// Sides of the pictures, px.
const SIDES_PX: [u32; 2] = [400, 1000];

fn main() {
    let frames = frames_argument(PROGRAM, 9).unwrap_or(9);
    println!(
        "| scene | picture | sub-pixels | volume, ms | mesh, ms | both, ms | both to their sum |"
    );
    println!("|---|---|---|---|---|---|---|");
    let subjects = procedural().into_iter().chain(real(PROGRAM));
    for subject in subjects {
        for shading in [Shading::None, Shading::Lambert] {
            for side in SIDES_PX {
                let options = RenderOptions {
                    shading,
                    ..RenderOptions::default()
                };
                let mut volume = Renderer::new(&subject.volume, &subject.transfer, &options)
                    .expect("options within their ranges");
                let [low, high] = volume.visible_bounds_in_world().expect("something is seen");
                let bodies = standing([low, high]);
                let mut mesh =
                    texmap::Renderer::new(&scene(&bodies), &texmap::RenderOptions::default())
                        .expect("options within their ranges");
                let mut times = [const { Vec::new() }; 3];
                let mut subpixels = 0;
                one_thread().install(|| {
                    for number in 0..frames {
                        let camera = camera([low, high], side, number as f64 / frames as f64);
                        subpixels = volume.subpixels(&camera).expect("a field");
                        draw(&camera, (&mut volume, &mut mesh), &mut times);
                    }
                });
                let [alone, own, both] = times.map(median);
                println!(
                    "| {}, {shading:?} | {side}x{side} | {subpixels} | {alone:.0} | {own:.0} | {both:.0} | {:.2} |",
                    subject.name,
                    both / (alone + own)
                );
            }
        }
    }
}

/// A ball of 9,000 triangles in the middle, and a rod through all.
fn standing([low, high]: [DVec3; 2]) -> [Body; 2] {
    let surface = Reflector {
        base: DVec3::new(0.9, 0.3, 0.1),
        metal: 0.0,
        roughness: 0.6,
    };
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let thin = 0.05 * half.min_element();
    let reach = DVec3::new(1.1 * half.x, thin, thin);
    let shapes = [
        Shape::Ball(middle, 0.3 * half.min_element()),
        Shape::Block(middle - reach, middle + reach),
    ];
    shapes.map(|shape| Body { shape, surface })
}

fn camera(bounds: [DVec3; 2], side: u32, turn: f64) -> Camera {
    let angle = std::f64::consts::TAU * turn;
    let framing = Framing {
        towards_eye: DVec3::new(angle.sin(), 0.4, angle.cos()),
        up: DVec3::Y,
        fov_y_rad: 0.5,
    };
    framing
        .camera(bounds, [side, side])
        .expect("a box with an extent")
}

/// Draws the volume alone, the mesh alone and both from a camera, and notes their CPU times, ms.
fn draw(
    camera: &Camera,
    (volume, mesh): (&mut Renderer, &mut texmap::Renderer),
    [alone, own, both]: &mut [Vec<f64>; 3],
) {
    let clock = StageClock::start();
    volume.render(camera).expect("a valid camera");
    alone.push(clock.stop().cpu_ms);
    let clock = StageClock::start();
    mesh.render(camera).expect("a valid camera");
    own.push(clock.stop().cpu_ms);
    let clock = StageClock::start();
    let subpixels = volume.subpixels(camera).expect("a field");
    let surface = mesh.surface(camera, subpixels).expect("a valid camera");
    volume
        .render_among(camera, &[surface], &Stop::default(), &mut |_| {})
        .expect("a valid camera");
    both.push(clock.stop().cpu_ms);
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
