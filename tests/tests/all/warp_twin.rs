//! The hybrid's fast path held against a slow twin: inside surfaces every pixel is found by brute force in f64.
//!
//! The twin projects the four corners of every cell, looks for the cell that holds the pixel's centre by solving the
//! plane's homography there, and evaluates the interpolating cubic spline by dense elimination. Nothing of the fast path
//! is used but the cameras. Scenes are smooth, without depth edges, so that what differs is arithmetic.

use glam::{DMat3, DVec2, DVec3};
use resample_core::simd::SimdLevel;
use resample_core::{Camera, Image};
use resample_tests::warps::scenes::{AnalyticScene, camera};
use warp3d::{Reference, WarpOptions, Warper};

const SIZE: [usize; 2] = [48, 36];

/// Samples from the border of the reference from which on the twin's spline is that of the fast path, which ends naturally.
const MARGIN: f64 = 3.0;

fn warp(reference: &Reference, target: &Camera, simd: SimdLevel) -> Image {
    let options = WarpOptions {
        simd,
        ..WarpOptions::default()
    };
    Warper::new(vec![reference.clone()], &options)
        .expect("good")
        .render(target)
        .expect("a camera")
        .image
}

/// Solves (c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i] with c = f at the ends.
fn spline_line(f: &[f64]) -> Vec<f64> {
    let n = f.len();
    let mut c = f.to_vec();
    // Gauss-Seidel halves the error and more a sweep: sixty leave nothing.
    for _ in 0..60 {
        for i in 1..n - 1 {
            c[i] = (6.0 * f[i] - c[i - 1] - c[i + 1]) / 4.0;
        }
    }
    c
}

fn spline_of(reference: &Reference) -> Vec<f64> {
    let [width, height] = SIZE;
    let green: Vec<f64> = reference.colour.iter().map(|c| f64::from(c[1])).collect();
    let rows: Vec<f64> = green.chunks(width).flat_map(spline_line).collect();
    let mut out = rows.clone();
    for x in 0..width {
        let column: Vec<f64> = (0..height).map(|y| rows[y * width + x]).collect();
        for (y, c) in spline_line(&column).into_iter().enumerate() {
            out[y * width + x] = c;
        }
    }
    out
}

fn basis(t: f64) -> f64 {
    let t = t.abs();
    if t < 1.0 {
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    } else if t < 2.0 {
        (2.0 - t).powi(3) / 6.0
    } else {
        0.0
    }
}

fn spline_at(coefficients: &[f64], at: DVec2) -> f64 {
    let [width, height] = SIZE;
    let place = |i: usize| (i as f64 + 0.5, width);
    (0..width * height)
        .map(|i| {
            coefficients[i] * basis(at.x - place(i % width).0) * basis(at.y - place(i / width).0)
        })
        .sum()
}

/// Where in the reference the pixel's centre lies, and how deep: the nearest of all triangles of all cells.
fn traced(reference: &Reference, target: &Camera, pixel: DVec2) -> Option<(DVec2, f64)> {
    let [width, height] = SIZE;
    let in_target = |x: usize, y: usize| {
        let (_, ray) = reference
            .camera
            .ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let z = f64::from(reference.depth[y * width + x]);
        let in_world = reference
            .camera
            .camera_from_world
            .inverse()
            .transform_point3(z * ray);
        target.camera_from_world.transform_point3(in_world)
    };
    let (_, ray) = target.ray_in_camera(pixel);
    let mut best: Option<(DVec2, f64)> = None;
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let corner = |i: usize| (x + i % 2, y + i / 2);
            let inverse =
                |i: usize| 1.0 / f64::from(reference.depth[corner(i).1 * width + corner(i).0]);
            let flatter = (inverse(0) - inverse(3)).abs() <= (inverse(1) - inverse(2)).abs();
            let triangles = if flatter {
                [[0, 1, 3], [0, 3, 2]]
            } else {
                [[0, 1, 2], [1, 3, 2]]
            };
            for triangle in triangles {
                // The ray meets the triangle where a combination of its corners lies on it.
                let [a, b, c] = triangle.map(|i: usize| in_target(corner(i).0, corner(i).1));
                let weights = DMat3::from_cols(a, b, c).inverse() * ray;
                if weights.min_element() < -1e-9 {
                    continue;
                }
                let depth = 1.0 / weights.element_sum();
                // The reference's eye is no origin of the target: weights of points are not those of the picture.
                let z = triangle
                    .map(|i: usize| f64::from(reference.depth[corner(i).1 * width + corner(i).0]));
                let in_picture = weights * DVec3::from_array(z);
                let share = in_picture / in_picture.element_sum();
                let place =
                    |k: usize| DVec2::new(corner(k).0 as f64 + 0.5, corner(k).1 as f64 + 0.5);
                let [p, q, r] = triangle.map(place);
                let at = share.x * p + share.y * q + share.z * r;
                if best.is_none_or(|(_, nearest)| depth < nearest) {
                    best = Some((at, depth));
                }
            }
        }
    }
    best
}

fn compare(scene: &AnalyticScene, target: &Camera, name: &str) {
    let from = camera([SIZE[0] as u32, SIZE[1] as u32], 40.0, DVec3::ZERO, 0.0);
    let reference = scene.reference(&from);
    let coefficients = spline_of(&reference);
    let images = SimdLevel::ALL.map(|simd| warp(&reference, target, simd));
    let mut compared = 0;
    for index in 0..images[0].rgba.len() {
        let (x, y) = (index % target.width as usize, index / target.width as usize);
        let Some((at, depth)) = traced(
            &reference,
            target,
            DVec2::new(x as f64 + 0.5, y as f64 + 0.5),
        ) else {
            continue;
        };
        let size = DVec2::new(SIZE[0] as f64, SIZE[1] as f64);
        if at.min(size - at).min_element() < MARGIN {
            continue;
        }
        compared += 1;
        let expected = spline_at(&coefficients, at).max(0.0);
        for (image, simd) in images.iter().zip(SimdLevel::ALL) {
            let pixel = image.rgba[index];
            let z = image.depth.as_ref().expect("depth")[index];
            assert!(
                (pixel[3] - 1.0).abs() < 1e-6,
                "{name}, {simd:?}: coverage {} at ({x}, {y})",
                pixel[3]
            );
            assert!(
                (f64::from(pixel[1]) - expected).abs() < 2e-6,
                "{name}, {simd:?}: {} at ({x}, {y}), the twin has {expected}",
                pixel[1]
            );
            assert!(
                (f64::from(z) / depth - 1.0).abs() < 1e-6,
                "{name}, {simd:?}: depth {z} against {depth}"
            );
        }
    }
    assert!(
        compared > 1000,
        "{name}: only {compared} pixels were compared"
    );
}

#[test]
fn magnified_surfaces_are_those_of_the_slow_twin() {
    // Both axes magnified, so that nothing is filtered but by the spline.
    let to = camera([64, 48], 90.0, DVec3::new(0.1, 0.05, 0.3), 0.05);
    compare(&AnalyticScene::wall(0.3), &to, "a slanted wall");
    compare(&AnalyticScene::wall(0.0), &to, "a wall");
}

#[test]
fn every_level_of_vector_instructions_draws_the_same_picture() {
    let from = camera([160, 120], 130.0, DVec3::ZERO, 0.0);
    let reference = AnalyticScene::room().reference(&from);
    for (focal_px, name) in [
        (130.0, "unit scale"),
        (50.0, "minified"),
        (400.0, "magnified"),
    ] {
        let to = camera([160, 120], focal_px, DVec3::new(0.2, 0.1, 0.1), 0.05);
        let scalar = warp(&reference, &to, SimdLevel::Baseline);
        for simd in SimdLevel::ALL {
            let image = warp(&reference, &to, simd);
            let apart = image.rgba.iter().zip(&scalar.rgba);
            let far = apart
                .filter(|(a, b)| (0..4).any(|c| (a[c] - b[c]).abs() > 2e-5))
                .count();
            // A place of the finer lattice that lies on an edge to rounding may fall to either side.
            assert!(
                far <= 8,
                "{name}, {simd:?}: {far} pixels differ from the scalar level"
            );
        }
    }
}
