//! Warps leaves and twigs with soft depth, fills the holes, and prints the figures of the edge band as a table.
//!
//! `cargo run --release -p resample-tests --example warp_thicket [-- FOLDER]`. With FOLDER, pictures are written there, the
//! truth beside.

use resample_core::Image;
use resample_core::image::srgb_from_linear;
use resample_tests::warps::soft::Softening::{Blurred, Guided, Linear};
use resample_tests::warps::thicket::{BandFigures, Made, in_band, views, with_depth};
use warp3d::{Fill, WarpOptions, Warper};

fn main() {
    let folder = std::env::args().nth(1);
    let scenes = views();
    let options = WarpOptions {
        fill: Fill::Background,
        ..WarpOptions::default()
    };
    println!("| depth | view | seen, dB | with fills, dB | stray | foreign | specks | of |");
    println!("|---|---|---|---|---|---|---|---|");
    let all = [
        Made::Exact,
        Made::Soft(Blurred(1.0)),
        Made::Soft(Blurred(2.0)),
        Made::Soft(Blurred(3.0)),
        Made::Soft(Guided(2.0)),
        Made::Soft(Linear(4)),
        Made::Coded(Blurred(1.5)),
        Made::Coded(Guided(2.0)),
    ];
    for made in all {
        let mut total = BandFigures::default();
        for scene in &scenes {
            let reference = with_depth(&scene.reference, made);
            let mut warper = Warper::new(vec![reference], &options).expect("good");
            let image = warper.render(&scene.target).expect("a camera").image;
            let found = in_band(&image, &scene.truth);
            print_row(made, &scene.name, found);
            total.psnr_db += found.psnr_db / scenes.len() as f64;
            total.filled_db += found.filled_db / scenes.len() as f64;
            total.stray += found.stray;
            total.foreign += found.foreign;
            total.specks += found.specks;
            total.count += found.count;
            if let Some(folder) = &folder {
                let made = format!("{made:?}").replace(['(', ')', '.'], "");
                let name = scene.name.replace(' ', "");
                write_png(&image, &format!("{folder}/{name}-{made}.png"));
                write_png(&scene.truth.image, &format!("{folder}/{name}-truth.png"));
            }
        }
        print_row(made, "all", total);
    }
    for scene in &scenes {
        let found = in_band(&scene.truth.image, &scene.truth);
        println!("truth, {}: {} specks", scene.name, found.specks);
    }
}

fn print_row(made: Made, view: &str, found: BandFigures) {
    println!(
        "| {made:?} | {view} | {:.2} | {:.2} | {} | {} | {} | {} |",
        found.psnr_db, found.filled_db, found.stray, found.foreign, found.specks, found.count
    );
}

/// Writes the picture, 8 bits, sRGB.
fn write_png(image: &Image, path: &str) {
    let file = std::fs::File::create(path).expect("a writable folder");
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let code = |v: f32| (255.0 * srgb_from_linear(v) + 0.5) as u8;
    let pixels = image.rgba.iter().flat_map(|p| [p[0], p[1], p[2]].map(code));
    let bytes: Vec<u8> = pixels.collect();
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(&bytes))
        .expect("a written picture");
}
