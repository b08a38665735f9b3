//! One reference written in several formats, and read again into memory or left in its files.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use resample_core::Camera;
use resample_tests::warp_scenes::{AnalyticScene, camera};
use warp3d::input::{self, DepthKind, DepthMeaning, Part, colour, depth};
use warp3d::large::Files;
use warp3d::{LargeReference, Reference, SurfaceTolerance};

/// Most memory, bytes.
pub(super) const BUDGET: u64 = 72 << 20;

/// The reference, px: no side is a whole number of blocks. In memory it takes 110 MB.
pub(super) const SIZE: [u32; 2] = [1610, 1217];

/// Files of one reference.
pub(super) struct Pair {
    pub(super) colour: PathBuf,
    pub(super) depth: PathBuf,
    pub(super) meaning: DepthMeaning,
}

/// World units of a code of 16 bits.
const UNIT: f64 = 2e-4;

pub(super) fn source() -> (Camera, Reference) {
    let from = camera(SIZE, 1300.0, DVec3::ZERO, 0.0);
    let mut reference = AnalyticScene::room().reference(&from);
    // Texture down to single samples, so that a wrong place shows.
    for (i, rgb) in reference.colour.iter_mut().enumerate() {
        let noise = ((i as u32).wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0;
        *rgb = rgb.map(|v| v * (0.6 + 0.4 * noise));
    }
    (from, reference)
}

fn srgb_code(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * v + 0.5) as u8
}

fn png(path: &Path, (colour, bits): (png::ColorType, png::BitDepth), data: &[u8]) {
    let file = fs::File::create(path).expect("a file");
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), SIZE[0], SIZE[1]);
    encoder.set_color(colour);
    encoder.set_depth(bits);
    encoder.set_compression(png::Compression::Fast);
    encoder
        .write_header()
        .expect("a header")
        .write_image_data(data)
        .expect("pixels");
}

/// The same reference in several formats.
pub(super) fn pairs(folder: &Path, reference: &Reference) -> Vec<Pair> {
    let file = |name: &str| folder.join(name);
    let codes: Vec<u8> = reference
        .colour
        .iter()
        .flat_map(|rgb| rgb.map(srgb_code))
        .collect();
    png(
        &file("colour.png"),
        (png::ColorType::Rgb, png::BitDepth::Eight),
        &codes,
    );
    let z = |i: usize| {
        if reference.depth[i].is_nan() {
            0.0
        } else {
            f64::from(reference.depth[i])
        }
    };
    let count = reference.depth.len();
    let codes: Vec<u8> = (0..count)
        .flat_map(|i| ((z(i) / UNIT + 0.5) as u16).to_be_bytes())
        .collect();
    png(
        &file("depth.png"),
        (png::ColorType::Grayscale, png::BitDepth::Sixteen),
        &codes,
    );
    let width = SIZE[0] as usize;
    let mut pfm = format!("Pf\n{} {}\n-1.0\n", SIZE[0], SIZE[1]).into_bytes();
    for row in reference.depth.chunks_exact(width).rev() {
        row.iter()
            .for_each(|z| pfm.extend_from_slice(&z.to_le_bytes()));
    }
    fs::write(file("depth.pfm"), pfm).expect("written");
    for (name, order) in [("depth.npy", "False"), ("columns.npy", "True")] {
        let mut header = format!(
            "{{'descr': '<f4', 'fortran_order': {order}, 'shape': ({}, {}), }}",
            SIZE[1], SIZE[0]
        );
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut npy = b"\x93NUMPY\x01\x00".to_vec();
        npy.extend_from_slice(&(header.len() as u16).to_le_bytes());
        npy.extend_from_slice(header.as_bytes());
        let by_columns = |i: usize| i % SIZE[1] as usize * width + i / SIZE[1] as usize;
        for i in 0..count {
            let from = if order == "True" { by_columns(i) } else { i };
            npy.extend_from_slice(&reference.depth[from].to_le_bytes());
        }
        fs::write(file(name), npy).expect("written");
    }
    exr::prelude::write_rgba_file(file("both.exr"), width, SIZE[1] as usize, |x, y| {
        let [r, g, b] = reference.colour[y * width + x];
        // A corner is not covered.
        let alpha = if x < 100 && y < 80 { 0.25f32 } else { 1.0 };
        (r * alpha, g * alpha, b * alpha, alpha)
    })
    .expect("written");
    let floats = DepthMeaning::of(DepthKind::Z);
    let pair = |colour: &str, depth: &str, meaning| Pair {
        colour: file(colour),
        depth: file(depth),
        meaning,
    };
    vec![
        pair(
            "colour.png",
            "depth.png",
            DepthMeaning {
                scale: Some(UNIT),
                ..floats
            },
        ),
        pair("colour.png", "depth.pfm", floats),
        pair("both.exr", "depth.npy", floats),
        pair("both.exr", "columns.npy", floats),
        // Alpha as distance along the ray: any channel of an EXR file may be a depth.
        pair("colour.png", "both.exr#A", DepthMeaning::of(DepthKind::Ray)),
    ]
}

pub(super) fn part(path: &Path) -> Part {
    Part::from_text(&path.display().to_string())
}

pub(super) fn in_memory(pair: &Pair, from: &Camera) -> Reference {
    let picture = colour::read(&part(&pair.colour)).expect("a picture");
    let stored = depth::read(&part(&pair.depth)).expect("a depth");
    input::reference(picture, &stored, *from, &pair.meaning, &pair.depth).expect("a reference")
}

pub(super) fn in_file(pair: &Pair, from: &Camera, tolerance: SurfaceTolerance) -> LargeReference {
    let (colour, depth) = (part(&pair.colour), part(&pair.depth));
    let files = Files {
        colour: &colour,
        depth: &depth,
        camera: from,
        meaning: &pair.meaning,
    };
    LargeReference::read(&files, tolerance, BUDGET).expect("a large reference")
}
