//! Every sample, composited: where the eye is, how large and how far things are (method, section 8), against the f64 reference of
//! samples. Every mode of selection, footprint and opacity must give numbers beside.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, FootprintMode, OpacityMode, SelectMode};
use volsplat::{DepthPlane, RenderOptions, Volume};

use super::row::{Claim, Result, Row};
use crate::choices::with_samples;
use crate::twins::samples::{Scene, render as reference};
use crate::volumes::scenes::{
    coloured, full, orthographic, perspective, random_volume, render, single_voxel,
};

/// All rows.
pub(super) fn rows() -> Result<Vec<Row>> {
    let tables = [
        eye_inside_a_kernel(),
        eye_inside_a_volume(),
        kernel_that_crosses_the_eye_plane(),
        cone_angle_up_to_a_right_angle(),
        centre_rays_at_89_9_degrees(),
        distances_of_ten_decades(),
        splats_larger_than_the_picture_and_smaller_than_a_ten_thousandth_pixel(),
        spacing_ratios_of_a_thousand(),
        smallest_volumes_and_pictures(),
        parallel_views_do_not_depend_on_the_image_plane(),
        a_volume_seen_from_very_far(),
    ];
    Ok(tables.into_iter().flatten().collect())
}

/// The row of a picture's largest error.
fn row(extreme: impl Into<String>, error: f64, bound: f64) -> Row {
    let claim = Claim {
        quantity: "largest error of a picture of every sample",
        bound,
        why: "positions and footprints are taken from the eye in f64; what swaps of near-ties may cost is not counted",
    };
    claim.row(extreme, [error, 0.0])
}

fn eye_inside_a_kernel() -> Vec<Row> {
    let mut rows = Vec::new();
    for offset in [0.0, 1e-3, 0.4, 1.2, 1.79] {
        let eye = offset * DVec3::new(0.6, -0.5, -0.62).normalize();
        let camera = perspective(eye, eye + DVec3::new(0.2, 0.3, 1.0), 70.0, [20, 20]);
        let voxel = single_voxel(DVec3::ZERO);
        assert!(
            shows(&voxel, &camera),
            "eye {offset} from the centre: the picture is empty"
        );
        rows.push(row(
            format!("eye {offset} from the centre"),
            worst(&voxel, &camera),
            1e-6,
        ));
    }
    rows
}

fn eye_inside_a_volume() -> Vec<Row> {
    let mut rows = Vec::new();
    let volume = random_volume([6, 6, 6], DAffine3::IDENTITY);
    for fov in [40.0, 120.0, 170.0] {
        let camera = perspective(
            DVec3::new(2.3, 2.9, 2.6),
            DVec3::new(4.0, 2.0, 3.5),
            fov,
            [24, 24],
        );
        rows.push(row(
            format!("eye inside, {fov} degrees"),
            worst(&volume, &camera),
            1e-4,
        ));
    }
    rows
}

fn kernel_that_crosses_the_eye_plane() -> Vec<Row> {
    let mut rows = Vec::new();
    for (z, x) in [(0.5, 2.5), (-1.0, 2.1), (1.7, 4.0), (0.0, 2.0)] {
        let camera = perspective(
            DVec3::new(-x, 0.1, -z),
            DVec3::new(-x, 0.1, 1.0 - z),
            150.0,
            [32, 32],
        );
        let voxel = single_voxel(DVec3::ZERO);
        rows.push(row(
            format!("crossing the eye plane, z {z}, x {x}"),
            worst(&voxel, &camera),
            1e-6,
        ));
    }
    rows
}

/// Half cone angles up to 90 degrees: a kernel (radius 1.8) that nearly touches the near plane, on and off the axis.
fn cone_angle_up_to_a_right_angle() -> Vec<Row> {
    let mut rows = Vec::new();
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
            rows.push(row(
                format!("gap {gap:e}, aside {side}"),
                worst(&voxel, &camera),
                1e-4,
            ));
        }
    }
    rows
}

fn centre_rays_at_89_9_degrees() -> Vec<Row> {
    let mut rows = Vec::new();
    for distance in [20.0, 600.0, 1100.0, 2000.0, 1e5] {
        let angle = 89.9f64.to_radians();
        let voxel = single_voxel(distance * DVec3::new(angle.sin(), 0.0, angle.cos()));
        // An odd size: the middle row of pixel centres passes through the voxel's projection, 16 px off the centre.
        let camera = perspective(DVec3::ZERO, DVec3::Z, 179.9, [65, 65]);
        let camera = Camera {
            camera_from_world: DAffine3::IDENTITY,
            ..camera
        };
        rows.push(row(
            format!("89.9 degrees off the axis at {distance}"),
            worst(&voxel, &camera),
            1e-4,
        ));
    }
    rows
}

/// Distance over radius from 1e-3 to 1e7, through a lens that keeps the voxel about 10 px large; also far from the
/// world's origin, where positions of the world have lost seven digits before the eye is subtracted.
fn distances_of_ten_decades() -> Vec<Row> {
    let mut rows = Vec::new();
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
            rows.push(row(
                format!("|c|/r 1e{exponent}, origin {:e}", origin.x),
                worst(&voxel, &camera),
                1e-4,
            ));
        }
    }
    rows
}

fn splats_larger_than_the_picture_and_smaller_than_a_ten_thousandth_pixel() -> Vec<Row> {
    let mut rows = Vec::new();
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
        rows.push(row(
            format!("voxel larger than a view of {fov} degrees"),
            worst(&voxel, &camera),
            1e-5,
        ));
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
        rows.push(row(
            format!("voxel of {spacing_px} px"),
            worst(&voxel, &camera),
            1e-4,
        ));
    }
    rows
}

fn spacing_ratios_of_a_thousand() -> Vec<Row> {
    let mut rows = Vec::new();
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
        rows.push(row(
            format!("spacing {scale}"),
            worst_with(&volume, &camera, &options),
            1e-4,
        ));
    }
    rows
}

fn smallest_volumes_and_pictures() -> Vec<Row> {
    let mut rows = Vec::new();
    for dims in [[1, 1, 1], [1, 1, 40], [40, 1, 1], [1, 17, 16]] {
        let volume = random_volume(dims, DAffine3::IDENTITY);
        let middle = 0.5 * DVec3::from(dims.map(|n| n as f64 - 1.0));
        for size in [[1, 1], [1, 33], [33, 1], [17, 16]] {
            let camera = perspective(middle + DVec3::new(16.3, 13.1, -12.7), middle, 50.0, size);
            rows.push(row(
                format!("{dims:?} voxels, {size:?} px"),
                worst(&volume, &camera),
                1e-4,
            ));
        }
    }
    rows
}

/// Parallel rays have no eye: the volume may lie before, behind and on both sides of the image plane, or far from it,
/// and its order must not depend on that.
fn parallel_views_do_not_depend_on_the_image_plane() -> Vec<Row> {
    let mut rows = Vec::new();
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
                rows.push(row(
                    format!("image plane at {along}, near {near:e}, {select:?}"),
                    error,
                    1e-4,
                ));
            }
        }
    }
    rows
}

/// In perspective the order is that of the distance from the eye in f32. From 1e6 voxels away it is known to 1/8
/// voxel, so neighbours may swap: the picture is right up to what those swaps cost.
fn a_volume_seen_from_very_far() -> Vec<Row> {
    let mut rows = Vec::new();
    let volume = random_volume([3, 3, 4], DAffine3::IDENTITY);
    for distance in [1e3, 1e5, 1e6] {
        let middle = DVec3::new(1.0, 1.1, 1.4);
        let eye = middle - distance * DVec3::new(0.48, 0.6, 0.64);
        let camera = perspective(eye, middle, (8.0 / distance).to_degrees(), [24, 24]);
        rows.push(row(
            format!("volume at {distance:e}"),
            worst(&volume, &camera),
            1e-4,
        ));
    }
    rows
}

/// Error of the every-sample renderer, beyond what swaps of near-ties may cost.
fn worst(volume: &Volume, camera: &Camera) -> f64 {
    worst_with(volume, camera, &full(SelectMode::Splats))
}

fn worst_with(volume: &Volume, camera: &Camera, options: &RenderOptions) -> f64 {
    let transfer = coloured(0.6);
    let truth = reference(&Scene {
        volume,
        transfer: &transfer,
        camera,
        options,
    });
    let image = render(volume, &transfer, options, camera);
    let mut worst = 0.0f64;
    for (got, truth) in image.rgba.iter().zip(&truth) {
        let [r, g, b] = truth.rgb;
        for (got, expected) in got.iter().zip([r, g, b, 1.0 - truth.transmittance]) {
            worst =
                worst.max((f64::from(*got) - expected).abs() - truth.swap_cost - truth.phase_cost);
        }
    }
    // Every mode must give numbers, whatever they are worth.
    for select in [SelectMode::Hybrid, SelectMode::Points, SelectMode::Ewa] {
        render(volume, &transfer, &full(select), camera);
    }
    for footprint in FootprintMode::ALL {
        for opacity in [OpacityMode::Extinction, OpacityMode::Linear] {
            let options = with_samples(
                RenderOptions {
                    opacity,
                    depth: DepthPlane::Expected,
                    ..options.clone()
                },
                |samples| samples.footprint = footprint,
            );
            render(volume, &transfer, &options, camera);
        }
    }
    worst
}

/// Returns true if any pixel shows something: a test of an empty picture tests nothing.
fn shows(volume: &Volume, camera: &Camera) -> bool {
    render(volume, &coloured(0.6), &full(SelectMode::Splats), camera)
        .rgba
        .iter()
        .any(|p| p[3] > 1e-3)
}
