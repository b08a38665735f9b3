//! Turns volumes through 45 degrees with every order of compositing and prints how much the frames change, as Markdown.
//!
//! `cargo run --release -p resample-tests --example popping [-- FOLDER]`. With FOLDER, also writes the two views on either
//! side of 45 degrees of the generated box (the paper's Figure 7), one PNG for each order and view. The real volumes are
//! left out, with a line that says so, where the data is absent.

use std::fs::File;
use std::path::Path;
use std::process::ExitCode;

use glam::DVec3;
use resample_core::Image;
use resample_core::KernelShape;
use resample_core::image::srgb_from_linear;
use resample_tests::choices::with_samples;
use resample_tests::peer_scenes::Subject;
use resample_tests::popping::{Changes, Turn, checkers};
use volsplat::procedural::blobs;
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume};

/// Half the angle between the two views, degrees: one step of the turn apart.
const BESIDE_DEG: f64 = 0.25;

/// Side of the pictures that are written, px.
const SIDE_PX: u32 = 200;

fn main() -> ExitCode {
    println!("| volume | order | median change | largest change | at step | ratio |");
    println!("|---|---|---|---|---|---|");
    let (checkers, look) = checkers(100);
    let turn = Turn::around_unit_box(SIDE_PX);
    print_rows("Checker Box 100^3", (&checkers, &look), &turn);
    let cloud = blobs(64).expect("a good size");
    print_rows(
        "blobs 64^3",
        (
            &cloud,
            &resample_tests::scenes::coloured(0.3).rescaled(0.0, 2.5),
        ),
        &turn,
    );
    for subject in Subject::ALL {
        let Some(volume) = subject.volume("popping") else {
            continue;
        };
        let extent = DVec3::from(subject.dims().map(|n| (n - 1) as f64));
        let eye = extent.length() * DVec3::new(0.0, 0.4, -1.5);
        let turn = Turn {
            centre: 0.5 * extent,
            eye,
            fov_y_deg: 35.0,
            side_px: SIDE_PX,
        };
        print_rows(subject.name(), (&volume, &subject.transfer()), &turn);
    }
    match std::env::args().nth(1) {
        None => ExitCode::SUCCESS,
        Some(folder) => match write_views((&checkers, &look), &turn, Path::new(&folder)) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{folder}: {error}");
                ExitCode::FAILURE
            }
        },
    }
}

/// The orders with the defaults of everything else, but for the kernel of Westover's: his.
fn orders() -> [(&'static str, RenderOptions); 3] {
    [
        (
            "axis-sheets",
            with_samples(RenderOptions::axis_sheets(), |samples| {
                samples.kernel = KernelShape::Gaussian
            }),
        ),
        ("every-sample", RenderOptions::every_sample()),
        ("image-sheets", RenderOptions::default()),
    ]
}

fn print_rows(name: &str, subject: (&Volume, &TransferFunction), turn: &Turn) {
    for (order, options) in orders() {
        let changes = Changes::measure(subject, turn, &options);
        let Changes {
            median,
            largest,
            at,
        } = changes;
        println!(
            "| {name} | {order} | {median:.2e} | {largest:.2e} | {at} | {:.2} |",
            changes.ratio()
        );
    }
}

fn write_views(
    subject: (&Volume, &TransferFunction),
    turn: &Turn,
    folder: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    for (order, options) in orders() {
        let mut renderer = Renderer::new(subject.0, subject.1, &options)?;
        for (side, angle) in [("before", 45.0 - BESIDE_DEG), ("after", 45.0 + BESIDE_DEG)] {
            let image = renderer.render(&turn.camera(angle))?.image;
            write_png(&folder.join(format!("popping-{order}-{side}.png")), &image)?;
        }
    }
    Ok(())
}

/// Writes a picture over black.
fn write_png(path: &Path, image: &Image) -> Result<(), Box<dyn std::error::Error>> {
    let mut encoder =
        png::Encoder::new(File::create(path)?, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let bytes: Vec<u8> = image
        .rgba
        .iter()
        .flat_map(|pixel| pixel[..3].iter())
        .map(|&c| (255.0 * srgb_from_linear(c)).round() as u8)
        .collect();
    encoder.write_header()?.write_image_data(&bytes)?;
    Ok(())
}
