//! Warps scenes whose depth was blurred, enlarged or packed with loss, and prints error and false fill as a table.
//!
//! `cargo run --release -p resample-tests --example warp_soft [-- FOLDER]`. Beside the default stand two simple warpers:
//! the nearest sample of each pixel, and depth forward with colour backward by a cubic. With FOLDER, pictures are
//! written there. The two scenes with ray-traced truth are left out where the test data is absent.

use glam::DVec3;
use resample_core::Image;
use resample_core::image::srgb_from_linear;
use resample_tests::warps::filtered::{filtered_scene, forward_backward};
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::soft::{Numbers, Softening, softened};
use resample_tests::warps::truth::WarpScene;
use warp3d::{Method, Reference, WarpOptions, Warper};

fn main() {
    let folder = std::env::args().nth(1);
    println!(
        "| scene | numbers | depth | PSNR: nearest | depth forward, cubic back | hybrid | holes %: hybrid \
         | false fill %: nearest | depth forward, cubic back | hybrid |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for scene in scenes() {
        for (numbers, softening) in depths() {
            print_row(&scene, numbers, softening, folder.as_deref());
        }
    }
}

fn scenes() -> Vec<WarpScene> {
    let vga = [320, 240];
    let start = camera(vga, 260.0, DVec3::ZERO, 0.0);
    let room = AnalyticScene::room();
    let made = [
        ("stereo", camera(vga, 260.0, DVec3::X * 0.5, 0.0)),
        ("6dof", camera(vga, 250.0, DVec3::new(0.5, -0.2, 0.4), 0.08)),
    ];
    let mut scenes: Vec<WarpScene> = made
        .iter()
        .map(|(name, to)| filtered_scene(name, &room, &start, to))
        .collect();
    let traced = ["stereo", "sphere"].map(|name| WarpScene::load("warp_soft", name));
    scenes.extend(traced.into_iter().flatten().map(|scene| WarpScene {
        name: format!("{}, ray-traced", scene.name),
        ..scene
    }));
    scenes
}

fn depths() -> Vec<(Numbers, Option<Softening>)> {
    let all = [0.5, 0.8, 1.2, 2.0, 3.0]
        .map(Softening::Blurred)
        .into_iter()
        .chain([2, 4].map(Softening::Linear))
        .chain([Softening::Cubic(4)])
        .chain([95.0, 75.0].map(Softening::Jpeg));
    let mut depths = vec![(Numbers::Z, None)];
    for softening in all {
        depths.extend([Numbers::Z, Numbers::Inverse].map(|numbers| (numbers, Some(softening))));
    }
    depths
}

fn print_row(
    scene: &WarpScene,
    numbers: Numbers,
    softening: Option<Softening>,
    folder: Option<&str>,
) {
    let reference = softening.map_or_else(
        || scene.reference.clone(),
        |how| softened(&scene.reference, numbers, how),
    );
    let what = softening.map_or("exact".to_owned(), |how| match how {
        Softening::Blurred(sigma) => format!("blurred by {sigma} px"),
        Softening::Linear(step) => format!("enlarged {step}x, linear"),
        Softening::Cubic(step) => format!("enlarged {step}x, cubic"),
        Softening::Guided(sigma) => format!("blurred by {sigma} px, guided"),
        Softening::Jpeg(quality) => format!("8-bit JPEG, quality {quality}"),
    });
    let nearest = warped(
        &reference,
        scene,
        &WarpOptions::with_method(Method::NEAREST),
    );
    let simple = forward_backward(&reference, &scene.target);
    let hybrid = warped(&reference, scene, &WarpOptions::default());
    let [n, s, h] = [&nearest, &simple, &hybrid].map(|image| measure(image, &scene.truth));
    println!(
        "| {} | {numbers:?} | {what} | {:.1} | {:.1} | {:.1} | {:.2} | {:.1} | {:.1} | {:.1} |",
        scene.name,
        n.psnr_db,
        s.psnr_db,
        h.psnr_db,
        h.holes_percent,
        n.false_fill_percent,
        s.false_fill_percent,
        h.false_fill_percent,
    );
    if let Some(folder) = folder {
        for (name, image) in [
            ("nearest", &nearest),
            ("simple", &simple),
            ("hybrid", &hybrid),
        ] {
            let path = format!("{folder}/{}-{what}-{numbers:?}-{name}.png", scene.name);
            write_png(image, &path.replace([' ', ','], ""));
        }
    }
}

fn warped(reference: &Reference, scene: &WarpScene, options: &WarpOptions) -> Image {
    let mut warper = Warper::new(vec![reference.clone()], options).expect("a good reference");
    warper.render(&scene.target).expect("a camera").image
}

/// Writes the picture on red, 8 bits, sRGB.
fn write_png(image: &Image, path: &str) {
    let file = std::fs::File::create(path).expect("a writable folder");
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let code = |v: f32| (255.0 * srgb_from_linear(v) + 0.5) as u8;
    let pixels = image
        .rgba
        .iter()
        .flat_map(|p| [p[0] + 1.0 - p[3], p[1], p[2]].map(code));
    let bytes: Vec<u8> = pixels.collect();
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&bytes))
        .expect("a written picture");
}
