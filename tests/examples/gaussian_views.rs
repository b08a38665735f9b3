//! Gaussians against their twin, near, in the middle, wide and far: errors and times.
//!
//! `cargo run --release -p resample-tests --example gaussian_views [COUNT] [PIXELS] [SLAB_ERROR]`

use std::sync::Arc;

use glam::DVec3;
use resample_core::Camera;
use resample_core::image::srgb_from_linear;
use resample_tests::gaussians::scenes::{Numbers, ball, camera, knot};
use resample_tests::gaussians::twin::GaussianTwin;
use volsplat::{GaussianModel, GaussianOptions, GaussianRenderer, Gaussians, PixelSamples};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: f64| {
        words
            .get(at)
            .map_or(default, |word| word.parse().expect("a number"))
    };
    let (count, pixels) = (number(0, 150_000.0) as usize, number(1, 300.0) as usize);
    let slab_error = number(2, 0.02) as f32;
    rayon::ThreadPoolBuilder::new().build_global().ok();
    let knot = Arc::new(knot(count, 1));
    let ball = Arc::new(ball(count / 50, 2));
    let from = |distance: f64| distance * DVec3::new(0.3, 0.4, 1.0).normalize();
    let views = [
        ("knot near", &knot, camera(from(1.7), 50.0, [640, 480])),
        ("knot middle", &knot, camera(from(4.0), 40.0, [640, 480])),
        ("knot far", &knot, camera(from(24.0), 40.0, [640, 480])),
        ("knot wide", &knot, camera(from(1.1), 120.0, [640, 480])),
        ("ball middle", &ball, camera(from(3.0), 50.0, [640, 480])),
    ];
    for (name, scene, camera) in &views {
        let truth = truth(scene, camera, pixels);
        for samples in [PixelSamples::One, PixelSamples::Four, PixelSamples::Auto] {
            let options = GaussianOptions {
                samples,
                slab_error,
                ..GaussianOptions::default()
            };
            measure(name, scene, camera, &options, &truth);
        }
        for model in [GaussianModel::Khr, GaussianModel::Inria, GaussianModel::Mip] {
            let options = GaussianOptions {
                model,
                samples: PixelSamples::One,
                ..GaussianOptions::default()
            };
            measure(name, scene, camera, &options, &truth);
        }
    }
}

/// Pixels that the knot covers, with what the twin has there.
fn truth(scene: &Gaussians, camera: &Camera, count: usize) -> Vec<([usize; 2], [f64; 4])> {
    let twin = GaussianTwin::new(scene, camera);
    let mut numbers = Numbers(7);
    let mut found = Vec::new();
    for _ in 0..40 * count {
        if found.len() == count {
            break;
        }
        let x = (numbers.uniform() * f64::from(camera.width)) as usize;
        let y = (numbers.uniform() * f64::from(camera.height)) as usize;
        let truth = twin.pixel(x, y);
        if truth[3] > 0.05 {
            found.push(([x, y], truth));
        }
    }
    found
}

fn measure(
    name: &str,
    scene: &Arc<Gaussians>,
    camera: &Camera,
    options: &GaussianOptions,
    truth: &[([usize; 2], [f64; 4])],
) {
    let mut renderer = GaussianRenderer::new(scene.clone(), options).expect("options");
    let mut least = f64::INFINITY;
    let mut frame = renderer.render(camera).expect("a frame");
    for _ in 0..3 {
        frame = renderer.render(camera).expect("a frame");
        least = least.min(frame.stats.cpu_ms);
    }
    let (mut squares, mut bias, mut opacities, mut worst) = (0.0, 0.0, 0.0, 0.0f64);
    for ([x, y], truth) in truth {
        let [r, g, b, opacity] = frame.image.pixel(*x, *y);
        let blend = |c: f32| f64::from(srgb_from_linear(c / opacity.max(1e-9)) * opacity);
        for (got, wanted) in [blend(r), blend(g), blend(b)].iter().zip(truth) {
            squares += (got - wanted).powi(2);
            bias += got - wanted;
            worst = worst.max((got - wanted).abs());
        }
        opacities += (f64::from(opacity) - truth[3]).powi(2);
    }
    let n = truth.len() as f64;
    let stats = &frame.stats;
    println!(
        "{name:12} {:6?} {:5?} {:5.1} dB, alpha {:5.1} dB, bias {:+.4}, worst {worst:.3}; {least:6.1} ms CPU ({:.1} project, {:.1} tiles), {} in view, {:.2} M pairs, {:.1} M met, {:.1} M summed",
        options.model,
        options.samples,
        -10.0 * (squares / (3.0 * n)).log10(),
        -10.0 * (opacities / n).log10(),
        bias / (3.0 * n),
        stats.stages.project.cpu_ms,
        stats.stages.composite.cpu_ms,
        stats.splats,
        stats.tile_pairs as f64 / 1e6,
        stats.pixels_touched as f64 / 16e6,
        stats.lanes_computed as f64 / 16e6,
    );
    if options.samples == PixelSamples::Auto {
        let pixels = frame.image.over_background([0.0; 3]).srgb8();
        let bytes: Vec<u8> = pixels.into_iter().flatten().collect();
        let path = std::env::temp_dir().join(format!("{}.png", name.replace(' ', "-")));
        let file = std::fs::File::create(path).expect("a file");
        let mut encoder = png::Encoder::new(file, camera.width, camera.height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&bytes).expect("pixels");
    }
}
