//! Depth images larger than memory: the picture is that of the references in memory, and the work follows what is seen.
//!
//! A vertex is rounded to f32 in the window that it is drawn in, 2^-24 of the window's place, so that two pictures
//! differ by rounding where they are drawn in other windows. Where that decides whether one of the sub-pixels at an edge
//! is covered, its pixel changes by a share of the contrast. So all pixels agree to 1e-4, except for a few in a thousand at
//! edges; without windows, where only a part of the reference is read, all of them do.

mod files;

use glam::{DMat3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::warp_scenes::camera;
use resample_tests::warp_soft::{Numbers, Softening, softened};
use tempfile::TempDir;
use warp3d::input::{DepthKind, DepthMeaning};
use warp3d::large::Files;
use warp3d::{
    Fill, FrameStats, LargeReference, LargeWarper, Method, MixedPixels, Reference, SurfaceOptions,
    SurfaceTolerance, Visibility, WarpOptions, Warper,
};

use files::{BUDGET, SIZE, in_file, in_memory, pairs, part, source};

/// The new picture, px.
const TARGET: [u32; 2] = [320, 240];

/// Most memory of the methods that lay samples one by one, which take 180 bytes for each, bytes.
const SPLAT_BUDGET: u64 = 288 << 20;

/// Largest change of a channel that is rounding: a fortieth of a step of 8 bits.
const TOLERANCE: f32 = 1e-4;

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
    assert_eq!(filed.nearest(), held.nearest(), "the same nearest sample");
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
fn soft_edges_are_made_sharp_as_they_are_in_memory() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let reference = softened(&reference, Numbers::Z, Softening::Blurred(1.5));
    let pair = &pairs(folder.path(), &reference)[0];
    let held = in_memory(pair, &from);
    let (_, to) = poses().swap_remove(1);
    let (whole, _) = draw(vec![held.clone()], &WarpOptions::default(), &to);
    let filed = in_file(pair, &from, SurfaceTolerance::Auto);
    let moved = filed.depths(1).expect("readable");
    let moved = moved.iter().filter(|(i, z)| *z != held.depth[*i]).count();
    assert!(moved > 1000, "{moved} samples moved to a surface");
    let large = draw_large(vec![filed], &WarpOptions::default(), &to);
    assert_same("soft", &large, &whole);
}

#[test]
fn every_format_is_unpacked_as_it_is_read_into_memory() {
    let folder = TempDir::new().expect("a folder");
    let (from, reference) = source();
    let (_, to) = poses().swap_remove(1);
    for pair in &pairs(folder.path(), &reference) {
        let held = in_memory(pair, &from);
        let filed = in_file(pair, &from, SurfaceTolerance::Auto);
        assert_eq!(filed.nearest(), held.nearest(), "{}", pair.depth.display());
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
