//! Stereo row by row: against a slow twin, against the truth, and at the extremes.

mod twin;

use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, Image, Projection};
use resample_tests::warps::films::{FilmScene, Network};
use resample_tests::warps::filtered::forward_backward;
use resample_tests::warps::measure::measure;
use resample_tests::warps::pairs::pair;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use warp3d::{Fill, Frame, Method, Reference, SurfaceTolerance, WarpOptions, Warper};

const SIZE: [u32; 2] = [64, 24];

fn drawn(reference: &Reference, target: &Camera, method: Method) -> Frame {
    let options = WarpOptions::with_method(method);
    let mut warper = Warper::new(vec![reference.clone()], &options).expect("a reference");
    warper.render(target).expect("along the rows")
}

fn rows(reference: &Reference, target: &Camera) -> Image {
    drawn(reference, target, Method::ROWS).image
}

/// A camera at `eye` with the lens of all references here.
fn eye(eye: DVec3) -> Camera {
    camera(SIZE, 60.0, eye, 0.0)
}

/// A picture with a nearer card in its middle, and a strip without depth.
fn card() -> Reference {
    let camera = eye(DVec3::ZERO);
    let [width, height] = SIZE.map(|v| v as usize);
    let at = |i: usize| ((i % width) as f32, (i / width) as f32);
    let is_card = |x: f32, y: f32| (20.0 + 0.4 * y..40.0).contains(&x);
    let colour = |(x, y): (f32, f32)| {
        let wave = 0.5 + 0.3 * (0.7 * x + 0.2 * y).sin();
        match is_card(x, y) {
            true => [0.9, wave, 0.1],
            false => [0.1, 0.3, wave],
        }
    };
    let depth = |(x, y): (f32, f32)| match () {
        () if x > 56.0 && y > 12.0 => f32::NAN,
        () if is_card(x, y) => 1.5 + 0.002 * x,
        () => 3.0 + 0.01 * x + 0.004 * y,
    };
    Reference {
        camera,
        colour: (0..width * height).map(|i| colour(at(i))).collect(),
        depth: (0..width * height).map(|i| depth(at(i))).collect(),
    }
}

/// The camera with its picture stretched along x and y.
fn stretched(camera: Camera, [x, y]: [f64; 2]) -> Camera {
    Camera {
        width: (f64::from(camera.width) * x) as u32,
        height: (f64::from(camera.height) * y) as u32,
        fx: camera.fx * x,
        fy: camera.fy * y,
        cx: camera.cx * x,
        cy: camera.cy * y,
        ..camera
    }
}

#[test]
fn rows_are_those_of_a_slow_twin() {
    let reference = card();
    for shift in [0.0, 0.0731, -0.2173, 0.611] {
        for stretch in [[1.0, 1.0], [0.5, 1.0], [1.0, 0.5], [1.5, 1.0]] {
            let target = stretched(eye(DVec3::X * shift), stretch);
            let fast = rows(&reference, &target);
            let slow = twin::picture(&reference, &target);
            let mut worst = 0.0f64;
            for (fast, slow) in fast.rgba.iter().zip(&slow) {
                for (fast, slow) in fast.iter().zip(slow) {
                    worst = worst.max((f64::from(*fast) - slow).abs());
                }
            }
            println!("shift {shift}, stretched {stretch:?}: {worst:.6}");
            assert!(
                worst < 1e-3,
                "shift {shift}, stretched {stretch:?}: {worst}"
            );
        }
    }
}

#[test]
fn edges_are_nearer_to_the_truth_than_a_simple_warper_s() {
    for film in FilmScene::ALL {
        let scene = film.pair(7, [320, 180], 0.1);
        let exact = &scene.reference;
        let network = Network::USUAL.of(exact, 7);
        let figures = |image: &Image| measure(image, &scene.truth);
        let row = figures(&rows(exact, &scene.target));
        let simple = figures(&forward_backward(exact, &scene.target));
        println!(
            "{film:?}: {:.1} dB, edges {:.1}, simple {:.1}",
            row.psnr_db, row.edge_db, simple.edge_db
        );
        assert!(
            row.psnr_db > 48.0 && row.edge_db > 37.0,
            "{film:?}: {row:?}"
        );
        assert!(
            row.edge_db > simple.edge_db + 2.0,
            "{film:?}: {row:?}, {simple:?}"
        );
        assert!(row.holes_percent < 0.1, "{film:?}: {row:?}");
        // A network's depth, in the tolerance of films: at most a decibel behind the hybrid.
        let tolerance = SurfaceTolerance::Relative(0.03);
        let hybrid = Method::Hybrid {
            tolerance,
            subpixels: 4,
        };
        let [row, hybrid] = [Method::Rows { tolerance }, hybrid]
            .map(|method| figures(&drawn(&network, &scene.target, method).image));
        println!(
            "{film:?}, network: {:.2} dB, hybrid {:.2}",
            row.psnr_db, hybrid.psnr_db
        );
        assert!(
            row.psnr_db > hybrid.psnr_db - 1.0,
            "{film:?}: {row:?}, {hybrid:?}"
        );
    }
}

#[test]
fn real_pairs_come_out_as_with_the_hybrid() {
    for name in ["Cones", "Teddy", "Art", "Piano", "Pipes"] {
        let Some(scene) = pair("warp_rows", name) else {
            continue;
        };
        let reference = &scene.reference;
        let psnr = |image: &Image| measure(image, &scene.truth).psnr_db;
        let row = psnr(&rows(reference, &scene.target));
        let hybrid = psnr(&drawn(reference, &scene.target, Method::HYBRID).image);
        let simple = psnr(&forward_backward(reference, &scene.target));
        println!("{name}: {row:.2} dB, hybrid {hybrid:.2}, simple {simple:.2}");
        assert!(
            row > hybrid - 0.3 && row > simple + 0.2,
            "{name}: {row} dB, hybrid {hybrid}, simple {simple}"
        );
    }
}

#[test]
fn a_picture_seen_from_its_own_place_is_itself() {
    let reference = card();
    let image = rows(&reference, &reference.camera);
    let width = SIZE[0] as usize;
    for (i, (pixel, colour)) in image.rgba.iter().zip(&reference.colour).enumerate() {
        let around =
            |d: isize| reference.depth[i.saturating_add_signed(d).min(image.rgba.len() - 1)];
        let is_inside = (2..width - 2).contains(&(i % width))
            && (-2..=2).all(|d| (around(d) - reference.depth[i]).abs() < 0.1);
        if is_inside {
            assert_eq!(pixel[3], 1.0, "pixel {i}");
            for (a, b) in pixel.iter().zip(colour) {
                assert!((a - b).abs() < 1e-5, "pixel {i}: {pixel:?}, {colour:?}");
            }
        }
    }
}

#[test]
fn lenses_off_by_rounding_and_a_little_more_draw_the_same() {
    let reference = card();
    let target = eye(DVec3::X * 0.0731);
    let own = rows(&reference, &target);
    for off in [1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-4, 1e-3] {
        for [x, y] in [
            [1.0, 0.0],
            [-1.0, 0.0],
            [0.0, 1.0],
            [0.0, -1.0],
            [-1.0, -1.0],
        ] {
            let target = Camera {
                fx: target.fx * (1.0 + off * x),
                fy: target.fy * (1.0 + off * y),
                // Half a row and a column lower, where the middle of a pixel lies between two samples.
                cy: target.cy + 0.5 * y.abs(),
                ..target
            };
            let image = rows(&reference, &target);
            // The first and the last row may lie outside the picture.
            let inside = SIZE[0] as usize..(SIZE[0] * (SIZE[1] - 1)) as usize;
            let pixels = image.rgba[inside.clone()]
                .iter()
                .zip(&own.rgba[inside.clone()]);
            let squares = pixels.map(|(pixel, own)| f64::from((pixel[1] - own[1]).powi(2)));
            let error = (squares.sum::<f64>() / inside.len() as f64).sqrt();
            // Half a row moves the slanted edge and the pattern by 0.03.
            let most = if y == 0.0 { 0.02 } else { 0.06 };
            assert!(error < most, "{off:e} by {x}, {y}: {error}");
        }
    }
}

#[test]
fn cameras_off_the_rows_are_refused() {
    let reference = card();
    let own = reference.camera;
    let turned = |axis: DVec3, angle: f64| Camera {
        camera_from_world: DAffine3::from_mat3(DMat3::from_axis_angle(axis, angle))
            * own.camera_from_world,
        ..own
    };
    let off = [
        eye(DVec3::Y * 0.1),
        eye(DVec3::Z * 0.1),
        turned(DVec3::X, 0.01),
        turned(DVec3::Y, 0.01),
        turned(DVec3::Z, 0.01),
        Camera {
            projection: Projection::Orthographic,
            ..own
        },
    ];
    for target in off {
        let options = WarpOptions::with_method(Method::ROWS);
        let mut warper = Warper::new(vec![reference.clone()], &options).expect("a reference");
        let error = warper
            .render(&target)
            .expect_err("off the rows")
            .to_string();
        assert!(error.contains("use the method hybrid"), "{error}");
    }
}

#[test]
fn extreme_depths_and_sizes_leave_numbers() {
    let depths = [
        f32::NAN,
        0.0,
        -1.0,
        f32::INFINITY,
        1e-30,
        1e30,
        f32::MAX,
        f32::MIN_POSITIVE,
    ];
    for size in [[1, 1], [1, 9], [9, 1], [2, 2], [65, 3]] {
        for (number, &odd) in depths.iter().enumerate() {
            let lens = camera(size, 20.0, DVec3::ZERO, 0.0);
            let pixels = (size[0] * size[1]) as usize;
            let depth = |i: usize| if i.is_multiple_of(3) { odd } else { 2.0 };
            let colour = |i: usize| match i % 5 {
                0 => [f32::NAN, f32::INFINITY, -1.0],
                1 => [1e30, 3e35, 0.0],
                _ => [0.2, 0.4, 0.8],
            };
            let reference = Reference {
                camera: lens,
                colour: (0..pixels).map(colour).collect(),
                depth: (0..pixels).map(depth).collect(),
            };
            for shift in [0.0, 1e-9, 0.3, -40.0, 1e9] {
                let target = camera(size, 20.0, DVec3::X * shift, 0.0);
                for fill in [Fill::None, Fill::Background] {
                    let options = WarpOptions {
                        fill,
                        ..WarpOptions::with_method(Method::ROWS)
                    };
                    let mut warper =
                        Warper::new(vec![reference.clone()], &options).expect("a reference");
                    let image = warper.render(&target).expect("along the rows").image;
                    for pixel in &image.rgba {
                        let is_number = pixel.iter().all(|v| v.is_finite() && *v >= 0.0);
                        assert!(
                            is_number && pixel[3] <= 1.0,
                            "{size:?}, depth {number}, shift {shift}: {pixel:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_infinitely_far_away_rests() {
    let reference = Reference {
        depth: vec![f32::INFINITY; card().depth.len()],
        ..card()
    };
    let [near, far] = [0.0, 1e6].map(|shift| rows(&reference, &eye(DVec3::X * shift)));
    assert_eq!(near.rgba, far.rgba);
    assert!(near.rgba.iter().all(|pixel| pixel[3] == 1.0));
}

#[test]
fn rows_are_the_same_on_any_number_of_threads_and_in_any_unit() {
    let scene = AnalyticScene::room();
    let reference = scene.reference(&camera([320, 200], 260.0, DVec3::ZERO, 0.0));
    let target = camera([320, 200], 260.0, DVec3::X * 0.31, 0.0);
    let alone = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| drawn(&reference, &target, Method::ROWS))
    };
    let (one, three) = (alone(1), alone(3));
    assert_eq!(one.image.rgba, three.image.rgba);
    assert_eq!(one.image.depth, three.image.depth);
    assert!(one.stats.edge_pixels > 0 && one.stats.samples == 320 * 200);
    for unit in [1e-18f64, 1e18] {
        let moved = |camera: &Camera| Camera {
            camera_from_world: DAffine3::from_mat3_translation(
                camera.camera_from_world.matrix3,
                camera.camera_from_world.translation * unit,
            ),
            near: camera.near * unit,
            ..*camera
        };
        let reference = Reference {
            camera: moved(&reference.camera),
            depth: reference
                .depth
                .iter()
                .map(|z| (f64::from(*z) * unit) as f32)
                .collect(),
            ..reference.clone()
        };
        let image = rows(&reference, &moved(&target));
        let worst = image
            .rgba
            .iter()
            .zip(&one.image.rgba)
            .flat_map(|(a, b)| (0..4).map(|c| (a[c] - b[c]).abs()))
            .fold(0.0, f32::max);
        assert!(worst < 0.02, "unit {unit}: {worst}");
    }
}
