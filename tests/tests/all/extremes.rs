//! Extremes that must hold (method, section 8): where the eye is, how large and how far things are.
//!
//! Each case gives a finite picture, and its error against the f64 reference is measured, printed and bounded. Values
//! of opacity at their extremes are in `extreme_opacities.rs`.

mod errors;

use glam::{DAffine3, DVec3};
use resample_core::{Camera, KernelShape, SelectMode};
use resample_tests::choices::with_samples;
use resample_tests::volumes::scenes::{
    coloured, full, grey, orthographic, perspective, random_volume, render, single_voxel, volume,
};
use volsplat::{DepthPlane, RenderOptions, Renderer, Volume};

use errors::{hold, shows, worst, worst_with};

#[test]
fn eye_inside_a_kernel() {
    for offset in [0.0, 1e-3, 0.4, 1.2, 1.79] {
        let eye = offset * DVec3::new(0.6, -0.5, -0.62).normalize();
        let camera = perspective(eye, eye + DVec3::new(0.2, 0.3, 1.0), 70.0, [20, 20]);
        let voxel = single_voxel(DVec3::ZERO);
        assert!(
            shows(&voxel, &camera),
            "eye {offset} from the centre: the picture is empty"
        );
        hold(
            &format!("eye {offset} from the centre"),
            worst(&voxel, &camera),
            1e-6,
        );
    }
}

#[test]
fn eye_inside_a_volume() {
    let volume = random_volume([6, 6, 6], DAffine3::IDENTITY);
    for fov in [40.0, 120.0, 170.0] {
        let camera = perspective(
            DVec3::new(2.3, 2.9, 2.6),
            DVec3::new(4.0, 2.0, 3.5),
            fov,
            [24, 24],
        );
        hold(
            &format!("eye inside, {fov} degrees"),
            worst(&volume, &camera),
            1e-4,
        );
    }
}

#[test]
fn kernel_that_crosses_the_eye_plane() {
    for (z, x) in [(0.5, 2.5), (-1.0, 2.1), (1.7, 4.0), (0.0, 2.0)] {
        let camera = perspective(
            DVec3::new(-x, 0.1, -z),
            DVec3::new(-x, 0.1, 1.0 - z),
            150.0,
            [32, 32],
        );
        let voxel = single_voxel(DVec3::ZERO);
        hold(
            &format!("crossing the eye plane, z {z}, x {x}"),
            worst(&voxel, &camera),
            1e-6,
        );
    }
}

/// Half cone angles up to 90 degrees: a kernel (radius 1.8) that nearly touches the near plane, on and off the axis.
#[test]
fn cone_angle_up_to_a_right_angle() {
    for gap in [1e-1, 1e-3, 1e-5, 3e-7] {
        for (side, fov) in [(0.0, 140.0), (0.7, 140.0), (6.0, 140.0), (100.0, 179.5)] {
            let forward = DVec3::new(0.48, 0.6, 0.64);
            let right = forward.cross(DVec3::Y).normalize();
            let eye = -(1.8 + gap) * forward - side * right;
            let camera = perspective(eye, eye + 1e-4 * forward, fov, [33, 33]);
            let voxel = single_voxel(DVec3::ZERO);
            assert!(
                shows(&voxel, &camera),
                "gap {gap:e}, aside {side}: the picture is empty"
            );
            hold(
                &format!("gap {gap:e}, aside {side}"),
                worst(&voxel, &camera),
                1e-4,
            );
        }
    }
}

#[test]
fn centre_rays_at_89_9_degrees() {
    for distance in [20.0, 600.0, 1100.0, 2000.0, 1e5] {
        let angle = 89.9f64.to_radians();
        let voxel = single_voxel(distance * DVec3::new(angle.sin(), 0.0, angle.cos()));
        // An odd size: the middle row of pixel centres passes through the voxel's projection, 16 px off the centre.
        let camera = perspective(DVec3::ZERO, DVec3::Z, 179.9, [65, 65]);
        let camera = Camera {
            camera_from_world: DAffine3::IDENTITY,
            ..camera
        };
        hold(
            &format!("89.9 degrees off the axis at {distance}"),
            worst(&voxel, &camera),
            1e-4,
        );
    }
}

/// Distance over radius from 1e-3 to 1e7, through a lens that keeps the voxel about 10 px large; also far from the
/// world's origin, where positions of the world have lost seven digits before the eye is subtracted.
#[test]
fn distances_of_ten_decades() {
    for origin in [DVec3::ZERO, DVec3::new(1e7, -1e7, 2e7)] {
        for exponent in -3..=7 {
            let distance = 1.8 * 10f64.powi(exponent);
            let eye = origin - distance * DVec3::new(0.48, 0.6, 0.64);
            let fov = if distance < 6.0 {
                90.0
            } else {
                (2.0 * (5.0 / distance).atan()).to_degrees()
            };
            let camera = perspective(eye, origin, fov, [24, 24]);
            let voxel = single_voxel(origin);
            assert!(
                shows(&voxel, &camera),
                "|c|/r 1e{exponent}: the picture is empty"
            );
            hold(
                &format!("|c|/r 1e{exponent}, origin {:e}", origin.x),
                worst(&voxel, &camera),
                1e-4,
            );
        }
    }
}

#[test]
fn splats_larger_than_the_picture_and_smaller_than_a_ten_thousandth_pixel() {
    for fov in [10.0, 0.1, 1e-4] {
        let camera = perspective(
            DVec3::new(0.3, 0.2, -5.0),
            DVec3::new(0.1, 0.4, 0.0),
            fov,
            [20, 12],
        );
        let voxel = single_voxel(DVec3::ZERO);
        assert!(
            shows(&voxel, &camera),
            "{fov} degrees: the picture is empty"
        );
        hold(
            &format!("voxel larger than a view of {fov} degrees"),
            worst(&voxel, &camera),
            1e-5,
        );
    }
    for spacing_px in [1e-2, 1e-4, 1e-6] {
        // The middle of an odd picture is a pixel centre, which the splat just covers.
        let camera = orthographic(
            DVec3::new(0.0, 0.0, -5.0),
            DVec3::ZERO,
            9.0 / spacing_px,
            [9, 9],
        );
        let voxel = single_voxel(DVec3::ZERO);
        assert!(
            shows(&voxel, &camera),
            "{spacing_px} px: the splat misses its pixel"
        );
        hold(
            &format!("voxel of {spacing_px} px"),
            worst(&voxel, &camera),
            1e-4,
        );
    }
}

#[test]
fn spacing_ratios_of_a_thousand() {
    for scale in [
        DVec3::new(1e3, 1.0, 1.0),
        DVec3::new(1.0, 1e-3, 1.0),
        DVec3::new(0.03, 1.0, 30.0),
    ] {
        let volume = random_volume([3, 3, 3], DAffine3::from_scale(scale));
        let size = scale.length();
        let camera = perspective(size * DVec3::new(3.1, 3.4, -3.9), scale, 60.0, [32, 32]);
        let options = RenderOptions {
            opacity_unit: Some(0.3 * size),
            ..full(SelectMode::Splats)
        };
        assert!(
            shows(&volume, &camera),
            "spacing {scale}: the picture is empty"
        );
        hold(
            &format!("spacing {scale}"),
            worst_with(&volume, &camera, &options),
            1e-4,
        );
    }
}

#[test]
fn smallest_volumes_and_pictures() {
    for dims in [[1, 1, 1], [1, 1, 40], [40, 1, 1], [1, 17, 16]] {
        let volume = random_volume(dims, DAffine3::IDENTITY);
        let middle = 0.5 * DVec3::from(dims.map(|n| n as f64 - 1.0));
        for size in [[1, 1], [1, 33], [33, 1], [17, 16]] {
            let camera = perspective(middle + DVec3::new(16.3, 13.1, -12.7), middle, 50.0, size);
            hold(
                &format!("{dims:?} voxels, {size:?} px"),
                worst(&volume, &camera),
                1e-4,
            );
        }
    }
}

#[test]
fn a_camera_that_looks_away_sees_nothing() {
    let volume = random_volume([8, 8, 8], DAffine3::IDENTITY);
    let eye = DVec3::new(20.0, 3.0, 4.0);
    for select in [SelectMode::Hybrid, SelectMode::Ewa] {
        let options = RenderOptions {
            depth: DepthPlane::Expected,
            ..full(select)
        };
        let image = render(
            &volume,
            &grey(0.5),
            &options,
            &perspective(eye, 2.0 * eye, 60.0, [20, 20]),
        );
        assert!(
            image.rgba.iter().all(|p| *p == [0.0; 4]),
            "{select:?}: something is seen behind the eye"
        );
        let depth = image.depth.expect("a depth plane was asked for");
        assert!(
            depth.iter().all(|d| *d == f32::INFINITY),
            "{select:?}: nothing has a depth"
        );
    }
}

/// Parallel rays have no eye: the volume may lie before, behind and on both sides of the image plane, or far from it,
/// and its order must not depend on that.
#[test]
fn parallel_views_do_not_depend_on_the_image_plane() {
    let volume = random_volume([3, 3, 5], DAffine3::IDENTITY);
    let forward = DVec3::new(0.2, 0.3, 1.0);
    let on_plane = DVec3::new(1.13, 0.87, 2.21);
    for along in [0.0, -30.0, 40.0, -1e6, 1e6] {
        let eye = on_plane + along * forward;
        let camera = orthographic(eye, eye + forward, 8.0, [24, 24]);
        for near in [-50.0 - 2.0 * along.abs(), -1e30] {
            let camera = Camera { near, ..camera };
            for select in [SelectMode::Splats, SelectMode::Points] {
                let error = worst_with(&volume, &camera, &full(select));
                hold(
                    &format!("image plane at {along}, near {near:e}, {select:?}"),
                    error,
                    1e-4,
                );
            }
        }
    }
}

/// Sheets of points too thin to be numbered in f32 are still seen.
#[test]
fn sheets_of_no_thickness() {
    let volume = random_volume([3, 3, 5], DAffine3::IDENTITY);
    let eye = DVec3::new(3.1, 2.9, -9.0);
    for camera in [
        orthographic(eye, DVec3::ONE, 8.0, [24, 24]),
        perspective(eye, DVec3::ONE, 40.0, [24, 24]),
    ] {
        for sheet_voxels in [1e-300, 1e-30, 1e300] {
            let options = with_samples(full(SelectMode::Points), |samples| {
                samples.sheet_voxels = sheet_voxels
            });
            let image = render(&volume, &coloured(0.6), &options, &camera);
            let seen = image.rgba.iter().any(|p| p[3] > 0.1);
            assert!(
                seen,
                "{:?}: nothing is seen in sheets of {sheet_voxels:e}",
                camera.projection
            );
        }
    }
}

/// In perspective the order is that of the distance from the eye in f32. From 1e6 voxels away it is known to 1/8
/// voxel, so neighbours may swap: the picture is right up to what those swaps cost.
#[test]
fn a_volume_seen_from_very_far() {
    let volume = random_volume([3, 3, 4], DAffine3::IDENTITY);
    for distance in [1e3, 1e5, 1e6] {
        let middle = DVec3::new(1.0, 1.1, 1.4);
        let eye = middle - distance * DVec3::new(0.48, 0.6, 0.64);
        let camera = perspective(eye, middle, (8.0 / distance).to_degrees(), [24, 24]);
        hold(
            &format!("volume at {distance:e}"),
            worst(&volume, &camera),
            1e-4,
        );
    }
}

/// Section 4: a pixel left at transmittance T changes by at most T.
#[test]
fn an_early_end_changes_no_pixel_by_more_than_its_bound() {
    let volume = random_volume([16, 16, 16], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(26.0, 21.0, -17.0),
        DVec3::splat(7.5),
        45.0,
        [48, 48],
    );
    for select in [SelectMode::Splats, SelectMode::Hybrid] {
        let picture = |min_transmittance| {
            let options = RenderOptions {
                min_transmittance,
                ..full(select)
            };
            render(&volume, &coloured(0.5), &options, &camera)
        };
        let whole = picture(0.0);
        for bound in [1.0 / 512.0, 0.05, 0.5, 0.99] {
            let difference =
                resample_tests::volumes::scenes::worst_difference(&whole, &picture(bound));
            println!("{select:?}, end at {bound}: {difference:.1e}");
            assert!(
                difference <= f64::from(bound),
                "{select:?}: {difference}, more than {bound}"
            );
            assert!(
                bound < 0.5 || difference > 0.0,
                "{select:?}: {bound} ended nothing early"
            );
        }
    }
}

/// One clear error before any work.
#[test]
fn numbers_that_are_none_are_refused() {
    let voxel = single_voxel(DVec3::ZERO);
    let good = perspective(DVec3::splat(5.0), DVec3::ZERO, 40.0, [8, 8]);
    let mut renderer =
        Renderer::new(&voxel, &grey(0.5), &RenderOptions::paper()).expect("valid options");
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let error = renderer
            .render(&Camera { fx: bad, ..good })
            .expect_err("a camera with a bad focal length");
        assert!(
            error.to_string().contains("fx"),
            "the error does not name fx: {error}"
        );
        let options = RenderOptions {
            opacity_unit: Some(bad),
            ..RenderOptions::paper()
        };
        assert!(
            Renderer::new(&voxel, &grey(0.5), &options).is_err(),
            "an opacity unit of {bad}"
        );
    }
    let nan = Volume::new(
        [1, 1, 1],
        volsplat::Voxels::F32(vec![f32::NAN]),
        DAffine3::IDENTITY,
    );
    assert!(nan.is_err(), "a voxel that is not a number must be refused");
    let denormal = volume([2, 2, 2], DAffine3::IDENTITY, |_| f64::MIN_POSITIVE / 4.0);
    render(&denormal, &grey(1.0), &full(SelectMode::Splats), &good);
    for shape in KernelShape::ALL {
        let options = with_samples(full(SelectMode::Splats), |samples| samples.kernel = shape);
        render(&voxel, &grey(1.0), &options, &good);
    }
}
