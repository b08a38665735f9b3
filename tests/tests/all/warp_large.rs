//! Depth images larger than memory: the picture is that of the references in memory, and the work follows what is seen.
//!
//! A vertex is rounded to f32 in the window that it is drawn in, 2^-24 of the window's place, so that two pictures
//! differ by rounding where they are drawn in other windows. Where that decides whether one of the sub-pixels at an edge
//! is covered, its pixel changes by a share of the contrast. So all pixels agree to 1e-4, but for a few in a thousand at
//! edges; without windows, where only a part of the reference is read, all of them do.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::warp_scenes::{AnalyticScene, camera};
use tempfile::TempDir;
use warp3d::input::{self, DepthKind, DepthMeaning, Part, colour, depth};
use warp3d::large::Files;
use warp3d::{
    Fill, FrameStats, LargeReference, LargeWarper, Method, MixedPixels, Reference, SurfaceOptions,
    SurfaceTolerance, Visibility, WarpOptions, Warper,
};

/// The reference, px: no side is a whole number of blocks. In memory it takes 180 MB.
const SIZE: [u32; 2] = [1610, 1217];

/// The new picture, px.
const TARGET: [u32; 2] = [320, 240];

/// Most memory, bytes.
const BUDGET: u64 = 96 << 20;

/// Most memory of the methods that lay samples one by one, which take 180 bytes for each, bytes.
const SPLAT_BUDGET: u64 = 288 << 20;

/// Largest change of a channel that is rounding: a fortieth of a step of 8 bits.
const TOLERANCE: f32 = 1e-4;

/// Files of one reference.
struct Pair {
    colour: PathBuf,
    depth: PathBuf,
    meaning: DepthMeaning,
}

/// World units of a code of 16 bits.
const UNIT: f64 = 2e-4;

fn source() -> (Camera, Reference) {
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
fn pairs(folder: &Path, reference: &Reference) -> Vec<Pair> {
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

fn part(path: &Path) -> Part {
    Part::from_text(&path.display().to_string())
}

fn in_memory(pair: &Pair, from: &Camera) -> Reference {
    let picture = colour::read(&part(&pair.colour)).expect("a picture");
    let stored = depth::read(&part(&pair.depth)).expect("a depth");
    input::reference(picture, &stored, *from, &pair.meaning, &pair.depth).expect("a reference")
}

fn in_file(pair: &Pair, from: &Camera, tolerance: SurfaceTolerance) -> LargeReference {
    let (colour, depth) = (part(&pair.colour), part(&pair.depth));
    let files = Files {
        colour: &colour,
        depth: &depth,
        camera: from,
        meaning: &pair.meaning,
    };
    LargeReference::read(&files, tolerance, BUDGET).expect("a large reference")
}

/// How two pictures differ.
#[derive(Debug, Default)]
struct Change {
    /// Pixels with a channel off by more than [`TOLERANCE`].
    pixels: usize,
    /// Pixels whose depth or planes are off by more.
    planes: usize,
    /// Largest change of a channel.
    largest: f32,
}

fn change(a: &Image, b: &Image) -> Change {
    assert_eq!([a.width, a.height], [b.width, b.height], "sizes");
    let mut found = Change::default();
    for (a, b) in a.rgba.iter().zip(&b.rgba) {
        let worst = (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
        found.largest = found.largest.max(worst);
        found.pixels += usize::from(!(worst <= TOLERANCE));
    }
    let depths = |image: &Image| image.depth.clone().expect("a depth");
    let off = |a: f32, b: f32| a != b && !((a - b).abs() <= TOLERANCE * a.abs());
    found.planes += depths(a)
        .iter()
        .zip(&depths(b))
        .filter(|(a, b)| off(**a, **b))
        .count();
    for (a, b) in a.planes.iter().zip(&b.planes) {
        assert_eq!(a.name, b.name, "planes");
        found.planes += a
            .values
            .iter()
            .zip(&b.values)
            .filter(|(a, b)| (*a - *b).abs() > TOLERANCE)
            .count();
    }
    found
}

/// The poses.
fn poses() -> Vec<(&'static str, Camera)> {
    let at = |focal, eye: [f64; 3], yaw: f64| camera(TARGET, focal, DVec3::from_array(eye), yaw);
    let tilted = {
        let turn = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(0.2);
        let view = at(240.0, [0.4, -0.5, -0.3], 0.1);
        Camera {
            camera_from_world: glam::DAffine3::from_mat3(turn) * view.camera_from_world,
            ..view
        }
    };
    vec![
        ("forward", at(260.0, [0.2, 0.05, 1.5], 0.0)),
        ("turned", at(260.0, [-0.3, 0.0, 0.4], 0.25)),
        ("tilted", tilted),
        ("minified", at(200.0, [0.0, 0.1, -3.0], 0.0)),
        ("magnified", at(4000.0, [0.05, 0.0, 0.0], 0.12)),
        (
            "inside the surfaces",
            Camera {
                near: 0.4,
                ..at(200.0, [-1.1, -0.2, 4.9], 0.3)
            },
        ),
        (
            "looking away",
            at(260.0, [0.0, 0.0, 0.0], std::f64::consts::PI),
        ),
    ]
}

fn draw_large(
    references: Vec<LargeReference>,
    options: &WarpOptions,
    to: &Camera,
) -> (Image, FrameStats) {
    let budget = match options.method {
        Method::Points { .. } | Method::Splats { .. } => SPLAT_BUDGET,
        Method::Nearest { .. } | Method::Hybrid { .. } => BUDGET,
    };
    let mut warper = LargeWarper::new(references, options, budget).expect("a warper");
    let frame = warper.render(to).expect("a picture");
    (frame.image, frame.stats)
}

fn draw(references: Vec<Reference>, options: &WarpOptions, to: &Camera) -> (Image, FrameStats) {
    let frame = Warper::new(references, options)
        .expect("a warper")
        .render(to)
        .expect("a picture");
    (frame.image, frame.stats)
}

/// Few pixels differ by more than rounding, and none where one window shows all.
fn assert_same(what: &str, (large, stats): &(Image, FrameStats), whole: &Image) {
    let found = change(large, whole);
    println!(
        "{what}: {} windows, {} samples read, {found:?}",
        stats.windows, stats.read_samples
    );
    let pixels = large.rgba.len();
    let allowed = if stats.windows <= 1 { 0 } else { pixels / 1000 };
    assert!(
        found.pixels <= allowed && found.planes <= allowed,
        "{what}: {found:?}"
    );
}

#[test]
fn pictures_are_those_of_references_in_memory() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let pair = &pairs(folder.path(), &reference)[0];
    let held = in_memory(pair, &from);
    let mut warper = Warper::new(vec![held.clone()], &WarpOptions::default()).expect("a warper");
    let filed = in_file(pair, &from, SurfaceTolerance::Auto);
    assert_eq!(filed.bounds(), held.bounds(), "the same box");
    assert_eq!(
        filed.known(),
        held.depth.iter().filter(|z| !z.is_nan()).count() as u64,
        "the same samples"
    );
    for (index, z) in filed.depths(997).expect("readable") {
        assert_eq!(z.to_bits(), held.depth[index].to_bits(), "sample {index}");
    }
    let mut large =
        LargeWarper::new(vec![filed], &WarpOptions::default(), BUDGET).expect("a warper");
    let all = u64::from(SIZE[0]) * u64::from(SIZE[1]);
    for (name, to) in poses() {
        let whole = warper.render(&to).expect("a picture");
        let frame = large.render(&to).expect("a picture");
        let (windows, read) = (frame.stats.windows, frame.stats.read_samples);
        match name {
            "looking away" => assert_eq!((windows, read), (0, 0), "nothing is read"),
            "magnified" => assert!(
                windows == 1 && read < all / 3,
                "{windows} windows, {read} samples"
            ),
            "minified" => assert!(windows > 3, "{name}: {windows} windows"),
            _ => assert!(whole.stats.seen > 1000, "{name}: something is seen"),
        }
        assert_eq!(frame.stats.samples, whole.stats.samples, "{name}: samples");
        assert_same(name, &(frame.image, frame.stats), &whole.image);
    }
}

#[test]
fn every_format_is_unpacked_as_it_is_read_into_memory() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let (_, to) = poses().swap_remove(1);
    for pair in &pairs(folder.path(), &reference) {
        let held = in_memory(pair, &from);
        let filed = in_file(pair, &from, SurfaceTolerance::Auto);
        assert_eq!(filed.bounds(), held.bounds(), "{}", pair.depth.display());
        for (index, z) in filed.depths(101).expect("readable") {
            assert_eq!(
                z.to_bits(),
                held.depth[index].to_bits(),
                "{} at {index}",
                pair.depth.display()
            );
        }
        let whole = draw(vec![held], &WarpOptions::default(), &to);
        let large = draw_large(vec![filed], &WarpOptions::default(), &to);
        assert_same(&pair.depth.display().to_string(), &large, &whole.0);
    }
}

#[test]
fn methods_orders_fills_and_several_references_too() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let pair = &pairs(folder.path(), &reference)[1];
    let (_, to) = poses().swap_remove(0);
    let default = WarpOptions::default();
    let settings = [
        ("nearest", WarpOptions::with_method(Method::NEAREST)),
        ("splats", WarpOptions::with_method(Method::SPLATS)),
        ("points", WarpOptions::with_method(Method::POINTS)),
        (
            "occlusion order",
            WarpOptions::with_method(Method::Nearest {
                visibility: Visibility::OcclusionOrder,
            }),
        ),
        (
            "background",
            WarpOptions {
                fill: Fill::Background,
                ..default.clone()
            },
        ),
        (
            "natural",
            WarpOptions {
                fill: Fill::Natural,
                ..default.clone()
            },
        ),
        (
            "a tolerance",
            WarpOptions::with_method(Method::Hybrid {
                surfaces: SurfaceOptions {
                    tolerance: SurfaceTolerance::Relative(0.01),
                    mixed: MixedPixels::Unmix,
                },
                subpixels: 2,
            }),
        ),
    ];
    for (name, options) in &settings {
        let whole = draw(vec![in_memory(pair, &from)], options, &to);
        let surfaces = options.method.surfaces().unwrap_or_default();
        let filed = vec![in_file(pair, &from, surfaces.tolerance)];
        let large = draw_large(filed, options, &to);
        assert_same(name, &large, &whole.0);
    }
    // The second sees the same pictures from elsewhere: what matters here is that both are blended alike.
    let aside = camera(SIZE, 1300.0, DVec3::X * 0.3, 0.05);
    let whole = draw(
        vec![in_memory(pair, &from), in_memory(pair, &aside)],
        &default,
        &to,
    );
    let both = vec![
        in_file(pair, &from, SurfaceTolerance::Auto),
        in_file(pair, &aside, SurfaceTolerance::Relative(0.004)),
    ];
    assert_same("two references", &draw_large(both, &default, &to), &whole.0);
}

#[test]
fn what_cannot_be_done_is_said_in_one_line() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let pair = &pairs(folder.path(), &reference)[0];
    let (colour, depth) = (part(&pair.colour), part(&pair.depth));
    let files = Files {
        colour: &colour,
        depth: &depth,
        camera: &from,
        meaning: &pair.meaning,
    };
    let said =
        |result: Result<LargeReference, warp3d::Error>| result.expect_err("refused").to_string();
    assert!(
        said(LargeReference::read(
            &files,
            SurfaceTolerance::Auto,
            1 << 20
        ))
        .contains("bytes of memory")
    );
    let other = camera([SIZE[0] + 1, SIZE[1]], 1300.0, DVec3::ZERO, 0.0);
    let text = said(LargeReference::read(
        &Files {
            camera: &other,
            ..files
        },
        SurfaceTolerance::Auto,
        BUDGET,
    ));
    assert!(text.contains("1610") && text.contains("1611"), "{text}");
    let codes = DepthMeaning::of(DepthKind::Z);
    let text = said(LargeReference::read(
        &Files {
            meaning: &codes,
            ..files
        },
        SurfaceTolerance::Auto,
        BUDGET,
    ));
    assert!(
        text.contains("depth scale") && text.contains("depth.png"),
        "{text}"
    );
    let filed = || in_file(pair, &from, SurfaceTolerance::Auto);
    let mut small =
        LargeWarper::new(vec![filed()], &WarpOptions::default(), 36 << 20).expect("a warper");
    let text = small
        .render(&poses()[0].1)
        .expect_err("too little")
        .to_string();
    assert!(
        text.contains("are allowed") && text.lines().count() == 1,
        "{text}"
    );
}
