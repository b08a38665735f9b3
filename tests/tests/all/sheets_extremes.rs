//! Image sheets at their extremes (method, section 8): where the eye is, how large and how far things are, opacities
//! from nothing to everything, and the smallest volumes and pictures.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image};
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::render as reference;
use resample_tests::volumes::scenes::{
    coloured, grey, orthographic, perspective, random_volume, render, single_voxel, volume,
};
use volsplat::{DepthPlane, RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

fn options() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        depth: DepthPlane::Expected,
        ..RenderOptions::default()
    }
}

/// Largest difference from the reference beyond what the table and the volume's faces allow.
fn beyond(
    (volume, transfer): (&Volume, &TransferFunction),
    camera: &Camera,
    options: &RenderOptions,
) -> f64 {
    let truth = reference(&Scene {
        volume,
        transfer,
        camera,
        options,
    });
    let image = render(volume, transfer, options, camera);
    let errors = image.rgba.iter().zip(&truth).map(|(got, truth)| {
        let [r, g, b] = truth.rgb;
        let pairs = got.iter().zip([r, g, b, 1.0 - truth.transmittance]);
        pairs
            .map(|(got, t)| (f64::from(*got) - t).abs())
            .fold(0.0, f64::max)
            - truth.slack
    });
    errors.fold(0.0, f64::max)
}

/// Prints and bounds an error.
fn hold(
    what: &str,
    subject: (&Volume, &TransferFunction),
    camera: &Camera,
    options: &RenderOptions,
) {
    let error = beyond(subject, camera, options);
    println!("{what}: {error:.1e} beyond the table");
    assert!(error < 2e-5, "{what}: off by {error}");
    let image = render(subject.0, subject.1, options, camera);
    assert!(
        image.rgba.iter().any(|p| p[3] > 1e-3),
        "{what}: nothing is seen"
    );
}

#[test]
fn a_camera_that_looks_away_sees_nothing() {
    let volume = random_volume([9, 9, 9], DAffine3::IDENTITY);
    let eye = DVec3::new(20.0, 3.0, 4.0);

    for subpixels in [Subpixels::Auto, Subpixels::Fixed(16)] {
        let options = RenderOptions {
            subpixels,
            ..options()
        };
        let image = render(
            &volume,
            &grey(0.5),
            &options,
            &perspective(eye, 2.0 * eye, 60.0, [20, 20]),
        );
        assert!(
            image.rgba.iter().all(|p| *p == [0.0; 4]),
            "something is seen behind the eye"
        );
        let depth = image.depth.expect("a depth plane was asked for");
        assert!(
            depth.iter().all(|d| *d == f32::INFINITY),
            "nothing has a depth"
        );
    }
}

#[test]
fn smallest_volumes_and_pictures() {
    for dims in [[2, 2, 2], [2, 2, 40], [40, 2, 3]] {
        let volume = random_volume(dims, DAffine3::IDENTITY);
        let middle = 0.5 * DVec3::from(dims.map(|n| n as f64 - 1.0));
        for size in [[1, 1], [1, 33], [33, 1], [17, 16]] {
            for n in [1, 16] {
                let camera = perspective(middle + DVec3::new(16.3, 13.1, -12.7), middle, 8.0, size);
                let options = RenderOptions {
                    subpixels: Subpixels::Fixed(n),
                    ..options()
                };
                hold(
                    &format!("{dims:?} voxels, {size:?} px, {n} sub-pixels"),
                    (&volume, &coloured(0.6)),
                    &camera,
                    &options,
                );
            }
        }
    }
}

/// Needles and plates, seen by parallel rays close enough for their thin sides to show.
#[test]
fn spacing_ratios_of_a_thousand() {
    let cases = [
        (DVec3::new(1e3, 1.0, 1.0), 6.0),
        (DVec3::new(1.0, 1e-3, 1.0), 2.5),
        (DVec3::new(0.03, 1.0, 30.0), 4.0),
    ];
    for (scale, height) in cases {
        let volume = random_volume([3, 3, 3], DAffine3::from_scale(scale));
        let eye = scale + scale.length() * DVec3::new(3.1, 3.4, -3.9);
        let camera = orthographic(eye, scale, height, [20, 20]);
        let unit = Some(0.3 * height);
        let options = with_field(
            RenderOptions {
                opacity_unit: unit,
                ..options()
            },
            |field| field.slab_voxels = 1.0,
        );
        hold(
            &format!("spacing {scale}"),
            (&volume, &coloured(0.99)),
            &camera,
            &options,
        );
    }
}

#[test]
fn opacities_of_nothing_almost_nothing_and_everything() {
    let volume = random_volume([6, 6, 6], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(9.0, 8.0, -7.0),
        DVec3::splat(2.5),
        40.0,
        [16, 16],
    );

    let nothing = render(&volume, &grey(0.0), &options(), &camera);
    assert!(
        nothing.rgba.iter().all(|p| *p == [0.0; 4]),
        "opacity 0 is seen"
    );
    let faint = render(&volume, &grey(1e-12), &options(), &camera);
    // Transmittance is f32 and stays 1; the colour is there, and is at most 12 voxels long.
    let most = faint.rgba.iter().map(|p| p[0]).fold(0.0, f32::max);
    assert!(most > 1e-13 && most < 12e-12, "opacity 1e-12 gives {most}");

    hold("opacity 1", (&volume, &grey(1.0)), &camera, &options());
    let all = resample_tests::volumes::scenes::transfer(&[(0.0, [0.5; 3])], &[(0.0, 1.0)]);
    hold("opaque everywhere", (&volume, &all), &camera, &options());
}

/// A visible volume without structure: no pixel inside it may leave more or less than its neighbours do.
fn hold_no_holes(what: &str, volume: &Volume, camera: &Camera) {
    let image = render(volume, &grey(0.01), &options(), camera);
    let truth = reference(&Scene {
        volume,
        transfer: &grey(0.01),
        camera,
        options: &options(),
    });
    let pairs = image.rgba.iter().zip(&truth);
    let errors: Vec<f64> = pairs
        .map(|(got, t)| (1.0 - f64::from(got[3]) - t.transmittance).abs() - t.slack)
        .collect();
    let worst = errors.iter().fold(0.0f64, |worst, e| worst.max(*e));
    let holes = errors.iter().filter(|e| **e > 2e-5).count();
    println!("{what}: {worst:.1e} beyond the faces, {holes} holes");
    assert!(
        truth.iter().any(|t| t.transmittance < 0.9),
        "{what}: nothing is seen, so nothing is tested"
    );
    assert_eq!(holes, 0, "{what}: pixels off by up to {worst}");
}

fn constant() -> (Volume, DVec3) {
    (
        volume([30, 26, 34], DAffine3::IDENTITY, |_| 1.0),
        DVec3::new(14.5, 12.5, 16.5),
    )
}

/// The weights of a cell sum to 1 however far the eye is: planes and voxels are counted from the middle of the volume.
#[test]
fn far_away_through_a_long_lens_there_are_no_holes() {
    let (volume, middle) = constant();
    for direction in [
        DVec3::new(0.48, 0.6, 0.64),
        DVec3::Z,
        DVec3::new(1.0, 0.0, 1e-3),
    ] {
        for distance in [1e3, 1e5, 1e6] {
            let eye = middle - distance * direction.normalize();
            let camera = perspective(eye, middle, (60.0 / distance).to_degrees(), [48, 48]);

            hold_no_holes(
                &format!("at {distance:e} along {direction}"),
                &volume,
                &camera,
            );
        }
    }
}

/// Voxels much smaller than a pixel, also in a picture whose principal point lies 20,000 px beside it.
#[test]
fn small_voxels_far_from_the_principal_point_have_no_holes() {
    let (volume, middle) = constant();
    for spacing_px in [0.9, 0.1, 0.02] {
        for beside_px in [0.0, 20_000.0] {
            // The lens looks past the volume by at most 45 degrees: that sets how far the eye is.
            let distance = f64::max(300.0, beside_px / spacing_px);
            let forward = DVec3::new(0.48, 0.6, 0.64);
            let eye = middle - distance * forward
                + beside_px / spacing_px * forward.any_orthonormal_vector();
            let focal = spacing_px * distance;
            let camera = perspective(eye, eye + forward, 30.0, [48, 48]);
            let camera = Camera {
                fx: focal,
                fy: focal,
                ..camera
            };
            let seen = camera.screen_from_camera(camera.camera_from_world.transform_point3(middle));
            let camera = Camera {
                cx: camera.cx + 24.3 - seen.x,
                cy: camera.cy + 24.6 - seen.y,
                ..camera
            };

            let what = format!(
                "{spacing_px} px a voxel, axis at {:.0}, {:.0}",
                camera.cx, camera.cy
            );
            hold_no_holes(&what, &volume, &camera);
        }
    }
}

#[test]
fn a_single_voxel_along_an_axis_is_refused_with_the_way_out() {
    for (dims, axis) in [([1, 4, 4], "x"), ([4, 1, 4], "y"), ([4, 4, 1], "z")] {
        let thin = random_volume(dims, DAffine3::IDENTITY);

        let refused = Renderer::new(&thin, &grey(0.5), &options());
        let message = refused
            .expect_err("one voxel along an axis makes no cell")
            .to_string();
        assert!(
            message.contains("use order every-sample"),
            "no way out in: {message}"
        );
        assert!(
            message.contains(&format!("({axis} has 1)")),
            "the axis {axis} is not named in: {message}"
        );
    }
    let every = Renderer::new(
        &single_voxel(DVec3::ZERO),
        &grey(0.5),
        &RenderOptions::paper(),
    );
    assert!(every.is_ok(), "the way out is open");
}

/// One voxel above the threshold, in a corner, on an edge, and where eight bricks meet.
#[test]
fn a_single_visible_voxel() {
    let look = resample_tests::volumes::scenes::transfer(
        &[(0.0, [1.0, 0.5, 0.2])],
        &[(0.5, 0.0), (1.0, 0.9)],
    );
    for at in [
        DVec3::ZERO,
        DVec3::new(16.0, 0.0, 7.0),
        DVec3::splat(8.0),
        DVec3::new(7.0, 8.0, 9.0),
    ] {
        let volume = volume([17, 17, 17], DAffine3::IDENTITY, |p| f64::from(p == at));
        let camera = perspective(at + DVec3::new(4.0, 3.0, -5.0), at, 25.0, [24, 24]);
        hold(
            &format!("one voxel at {at}"),
            (&volume, &look),
            &camera,
            &options(),
        );
    }
}

#[test]
fn a_single_visible_cell() {
    let look = resample_tests::volumes::scenes::transfer(
        &[(0.0, [1.0, 0.5, 0.2])],
        &[(0.4, 0.0), (1.0, 0.9)],
    );
    // Eight voxels of 0.41 around one cell, whose neighbours therefore fall below the threshold almost at once.
    let cell = DVec3::new(7.0, 7.0, 7.0);
    let inside = |p: DVec3| {
        (p - cell)
            .to_array()
            .iter()
            .all(|x| (0.0..=1.0).contains(x))
    };
    let volume = volume([17, 17, 17], DAffine3::IDENTITY, |p| {
        if inside(p) { 0.41 } else { 0.0 }
    });
    let camera = perspective(
        cell + DVec3::new(4.0, 3.0, -5.0),
        cell + 0.5,
        25.0,
        [24, 24],
    );
    hold("one cell", (&volume, &look), &camera, &options());
}

/// Whatever the lens, the near plane and the sub-pixels: numbers, and no panic.
#[test]
fn unusual_cameras_give_finite_pictures() {
    let volume = random_volume([9, 17, 8], DAffine3::IDENTITY);
    let eye = DVec3::new(4.0, 8.0, 3.0);
    let inside = perspective(eye, eye + DVec3::new(0.3, 0.1, 1.0), 179.9, [33, 31]);
    let cameras = [
        inside,
        Camera {
            near: 1e-12,
            ..inside
        },
        Camera {
            near: 1e9,
            ..inside
        },
        orthographic(eye, eye + DVec3::new(0.3, 0.1, 1.0), 1e6, [9, 9]),
        orthographic(eye, eye + DVec3::new(0.3, 0.1, 1.0), 1e-6, [9, 9]),
        perspective(eye - DVec3::new(1e7, 3.0, 1e7), eye, 1e-4, [20, 20]),
    ];
    for camera in &cameras {
        for subpixels in [Subpixels::Auto, Subpixels::Fixed(2)] {
            let options = RenderOptions {
                subpixels,
                ..options()
            };
            let image: Image = render(&volume, &coloured(0.4), &options, camera);
            assert!(image.depth.is_some(), "a depth plane was asked for");
        }
    }
}
