//! Depth in coarse codes: a step of one code is no edge, and the picture is that of fine depth.

use glam::{DMat3, DVec3};
use resample_tests::warps::filtered::filtered_scene;
use resample_tests::warps::measure::{WarpFigures, measure};
use resample_tests::warps::scenes::{AnalyticScene, Body, camera};
use resample_tests::warps::soft::{Numbers, Softening, softened};
use resample_tests::warps::truth::WarpScene;
use warp3d::input::{self, DepthKind, DepthMeaning, Picture, Plane, Stored};
use warp3d::{Reference, WarpOptions, Warper};

use std::path::Path;

const SIZE: [u32; 2] = [320, 240];

/// Ground and a wall that is seen at a slant, without an edge between things: one smooth surface with a bump.
fn smooth() -> WarpScene {
    let slant = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(-0.4);
    let wall = Body::Card(
        DVec3::Z * 6.0,
        slant * DVec3::X * 30.0,
        slant * DVec3::Y * 30.0,
    );
    let ball = Body::Sphere(slant * DVec3::new(0.3, 0.1, 7.0) + DVec3::Z * 6.0, 7.3);
    let scene = AnalyticScene(vec![
        (wall, 1.0, [0.8, 0.7, 0.6]),
        (ball, 1.0, [0.3, 0.7, 0.5]),
    ]);
    let from = camera(SIZE, 260.0, DVec3::ZERO, 0.0);
    let to = camera(SIZE, 260.0, DVec3::new(0.9, 0.2, 0.0), 0.0);
    filtered_scene("smooth", &scene, &from, &to)
}

fn room() -> WarpScene {
    let from = camera(SIZE, 260.0, DVec3::ZERO, 0.0);
    let to = camera(SIZE, 260.0, DVec3::X * 0.25, 0.0);
    filtered_scene("room", &AnalyticScene::room(), &from, &to)
}

/// A kind of code: what is stored of a depth, and what that means.
struct Code {
    name: &'static str,
    meaning: DepthMeaning,
    stored: Stored,
    number: fn(f64) -> f64,
}

/// Codes of a scene that reaches from the hand to the horizon: a step is 2 to 5 % of inverse depth in what is seen of it.
const NEAR_FAR: [f64; 2] = [0.5, 100.0];

/// Planes of a depth buffer whose half floats have as large steps.
const BUFFER: [f64; 2] = [0.1, 100.0];

fn inverse_code(z: f64) -> f64 {
    let [near, far] = NEAR_FAR;
    (1.0 / z - 1.0 / far) / (1.0 / near - 1.0 / far)
}

/// A number as floating point of 16 bits holds it, for numbers from 2^-14 to 65504.
fn half(value: f64) -> f64 {
    let step = 2f64.powi(value.abs().log2().floor() as i32 - 10);
    (value / step).round() * step
}

fn codes() -> Vec<Code> {
    let of = |kind| DepthMeaning {
        near_far: Some(NEAR_FAR),
        ..DepthMeaning::of(kind)
    };
    vec![
        Code {
            name: "MPEG codes of 8 bits",
            meaning: of(DepthKind::Mpeg),
            stored: Stored::Code(255),
            number: |z| (255.0 * inverse_code(z)).round(),
        },
        Code {
            name: "relative depth of 8 bits",
            meaning: DepthMeaning {
                range: Some([0.0, 255.0]),
                ..of(DepthKind::Relative)
            },
            stored: Stored::Code(255),
            number: |z| (255.0 * inverse_code(z)).round(),
        },
        Code {
            name: "the same in 16 bits, widened from 8",
            meaning: of(DepthKind::Mpeg),
            stored: Stored::Code(65_535),
            number: |z| 257.0 * (255.0 * inverse_code(z)).round(),
        },
        Code {
            name: "camera z of 8 bits",
            meaning: DepthMeaning {
                scale: Some(0.05),
                ..DepthMeaning::of(DepthKind::Z)
            },
            stored: Stored::Code(255),
            number: |z| (z / 0.05).round(),
        },
        Code {
            name: "depth buffer, half floats",
            meaning: DepthMeaning {
                near_far: Some(BUFFER),
                ..DepthMeaning::of(DepthKind::OpenGl)
            },
            stored: Stored::Float,
            number: |z| half((1.0 / BUFFER[0] - 1.0 / z) / (1.0 / BUFFER[0] - 1.0 / BUFFER[1])),
        },
    ]
}

/// How the numbers of a file are read.
#[derive(Clone, Copy, PartialEq)]
enum Reading {
    /// As a plane.
    Whole,
    /// Each by itself, as if there were no others.
    Single,
}

fn in_codes(reference: &Reference, code: &Code, reading: Reading) -> Reference {
    let [width, height] = SIZE.map(|side| side as usize);
    let number = |&z: &f32| {
        if z.is_nan() {
            f32::NAN
        } else {
            (code.number)(f64::from(z)) as f32
        }
    };
    let values: Vec<f32> = reference.depth.iter().map(number).collect();
    let plane = |width, height, values| Plane {
        width,
        height,
        values,
        stored: code.stored,
    };
    if reading == Reading::Single {
        let z = |value: &f32| {
            code.meaning
                .camera_z(&plane(1, 1, vec![*value]), &reference.camera)
        };
        let z = |value: &f32| z(value).expect("complete")[0];
        return Reference {
            depth: values.iter().map(z).collect(),
            ..reference.clone()
        };
    }
    let picture = Picture {
        width,
        height,
        rgb: reference.colour.clone(),
        coverage: None,
    };
    let stored = plane(width, height, values);
    let path = Path::new("depth");
    input::reference(picture, &stored, reference.camera, &code.meaning, path).expect("complete")
}

/// The figures of the picture, and the share of visible pixels that are not covered whole, percent.
fn figures(name: &str, scene: &WarpScene, reference: &Reference) -> (WarpFigures, f64) {
    let warper = Warper::new(vec![reference.clone()], &WarpOptions::default());
    let frame = warper.expect("good").render(&scene.target);
    let image = frame.expect("a camera").image;
    let found = measure(&image, &scene.truth);
    let visible = scene.truth.visible();
    let torn = image
        .rgba
        .iter()
        .zip(&visible)
        .filter(|(rgba, visible)| **visible && rgba[3] < 0.99);
    let torn = 100.0 * torn.count() as f64 / visible.len() as f64;
    println!(
        "{}, {name}: {:.2} dB, interior {:.2}, edges {:.2}, torn {torn:.3} %, false fill {:.2} %",
        scene.name, found.psnr_db, found.interior_db, found.edge_db, found.false_fill_percent
    );
    (found, torn)
}

/// The same depth in steps a hundredth as large.
fn fine(reference: &Reference) -> Reference {
    let code = Code {
        stored: Stored::Code(65_535),
        number: |z| (65_535.0 * inverse_code(z)).round(),
        ..codes().remove(0)
    };
    in_codes(reference, &code, Reading::Whole)
}

#[test]
fn a_smooth_surface_in_codes_is_whole_and_nearly_as_in_fine_depth() {
    let scene = smooth();
    let (_, exact) = figures("fine codes", &scene, &fine(&scene.reference));
    for code in codes() {
        let terraces = in_codes(&scene.reference, &code, Reading::Single);
        let (before, _) = figures(&format!("terraces, {}", code.name), &scene, &terraces);
        let found = in_codes(&scene.reference, &code, Reading::Whole);
        let (found, torn) = figures(code.name, &scene, &found);
        assert!(torn <= exact + 0.1, "{}: {torn} % are torn", code.name);
        assert!(found.psnr_db > before.psnr_db + 4.0, "{}", code.name);
    }
}

#[test]
fn edges_of_several_codes_stay_edges() {
    let scene = room();
    let (exact, whole) = figures("fine codes", &scene, &fine(&scene.reference));
    for code in codes() {
        let terraces = in_codes(&scene.reference, &code, Reading::Single);
        let (before, _) = figures(&format!("terraces, {}", code.name), &scene, &terraces);
        let found = in_codes(&scene.reference, &code, Reading::Whole);
        let (found, torn) = figures(code.name, &scene, &found);
        assert!(torn <= whole + 1.0, "{}", code.name);
        assert!(
            found.false_fill_percent <= exact.false_fill_percent + 0.1,
            "{}",
            code.name
        );
        assert!(found.psnr_db > before.psnr_db, "{}", code.name);
    }
}

#[test]
fn packed_codes_are_whole_too() {
    let scene = smooth();
    let (_, exact) = figures("fine codes", &scene, &fine(&scene.reference));
    for quality in [95.0, 75.0] {
        let packed = softened(&scene.reference, Numbers::Inverse, Softening::Jpeg(quality));
        let code = &codes()[0];
        let terraces = in_codes(&packed, code, Reading::Single);
        let (before, _) = figures(&format!("terraces, JPEG {quality}"), &scene, &terraces);
        let found = in_codes(&packed, code, Reading::Whole);
        let (found, torn) = figures(&format!("JPEG {quality}"), &scene, &found);
        assert!(torn <= exact + 0.1, "JPEG {quality}: {torn} % are torn");
        assert!(found.psnr_db > before.psnr_db + 4.0, "JPEG {quality}");
    }
}
