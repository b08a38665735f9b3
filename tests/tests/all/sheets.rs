//! Image sheets against their f64 reference.
//!
//! The bound is per pixel and derived, not chosen: the table of 4096 scalars takes the nearest, so a sample's scalar is
//! off by up to span / 8190; what that changes in opacity and colour, times the transmittance in front, is summed along the
//! ray by the reference (`slack`, with what lies within rounding of the volume's faces). On top of it come 1e-5 for f32
//! sums. Threads, convergence and faces are in `sheet_properties.rs`, extremes in `sheets_extremes.rs`.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::{SheetPixel, render as reference};
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, random_volume, render, sheared_grid, transfer,
};
use volsplat::procedural::blobs;
use volsplat::{DepthPlane, RenderOptions, Subpixels, TransferFunction, Volume, Voxels};

/// Rounding of f32 sums over up to a few hundred slabs, beside the table's error.
const ROUNDING: f64 = 1e-5;

fn options(slab_voxels: f64, subpixels: u32) -> RenderOptions {
    with_field(
        RenderOptions {
            subpixels: Subpixels::Fixed(subpixels),
            min_transmittance: 0.0,
            depth: DepthPlane::Expected,
            ..RenderOptions::default()
        },
        |field| field.slab_voxels = slab_voxels,
    )
}

/// Compares a picture with the reference; returns the largest difference and the largest bound.
fn hold(
    name: &str,
    (volume, transfer): (&Volume, &TransferFunction),
    camera: &Camera,
    options: &RenderOptions,
) {
    let truth = reference(&Scene {
        volume,
        transfer,
        camera,
        options,
    });
    let image = render(volume, transfer, options, camera);
    let depths = image.depth.as_ref().expect("a depth plane was asked for");
    let (mut worst, mut beyond, mut slack) = (0.0f64, 0.0f64, 0.0f64);
    for (i, (got, truth)) in image.rgba.iter().zip(&truth).enumerate() {
        let error = difference(got, truth);
        (worst, beyond) = (worst.max(error), beyond.max(error - truth.slack));
        slack = slack.max(truth.slack);
        check_depth(name, f64::from(depths[i]), truth, volume);
    }
    let seen = truth.iter().filter(|p| p.transmittance < 0.9).count();
    println!("{name}: off by {worst:.1e}, the table allows {slack:.1e}; {seen} px seen");
    assert!(seen > 0, "{name}: nothing is seen, so nothing is tested");
    assert!(
        beyond < ROUNDING,
        "{name}: {beyond:.1e} more than the table allows"
    );
}

fn difference(got: &[f32; 4], truth: &SheetPixel) -> f64 {
    let [r, g, b] = truth.rgb;
    let pairs = got.iter().zip([r, g, b, 1.0 - truth.transmittance]);
    pairs
        .map(|(got, expected)| (f64::from(*got) - expected).abs())
        .fold(0.0, f64::max)
}

/// Opacities that change by `slack` move the mean depth by that share of the depths that are met, over the opacity.
fn check_depth(name: &str, got: f64, truth: &SheetPixel, volume: &Volume) {
    let opacity = 1.0 - truth.transmittance;
    if opacity < 0.01 {
        return;
    }
    let extent = volume
        .dims
        .iter()
        .zip(volume.spacing())
        .map(|(n, s)| *n as f64 * s)
        .sum::<f64>();
    let bound = (2.0 * truth.slack + ROUNDING) / (opacity - truth.slack).max(1e-9) * extent
        + 1e-5 * truth.depth.abs();
    let error = (got - truth.depth).abs();
    assert!(
        error < bound,
        "{name}: depth {got} instead of {}, bound {bound:.1e}",
        truth.depth
    );
}

/// A volume, opaque towards one side and visible up to its faces.
fn scene(grid: DAffine3) -> (Volume, DVec3, f64) {
    let volume = random_volume([12, 9, 17], grid);
    let middle = grid.transform_point3(DVec3::new(5.5, 4.0, 8.0));
    let size = (grid.matrix3 * DVec3::new(11.0, 8.0, 16.0)).length();
    (volume, middle, size)
}

fn cameras(middle: DVec3, size: f64) -> [Camera; 2] {
    let eye = middle + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, middle, 40.0, [26, 22]),
        orthographic(eye, middle, 0.9 * size, [26, 22]),
    ]
}

fn hold_grid(name: &str, grid: DAffine3) {
    let (volume, middle, size) = scene(grid);
    for camera in cameras(middle, size) {
        for (slab_voxels, subpixels) in [(0.25, 1), (0.5, 1), (0.5, 2), (1.0, 4)] {
            let name = format!(
                "{name}, {:?}, slab {slab_voxels}, {subpixels} sub-pixels",
                camera.projection
            );
            hold(
                &name,
                (&volume, &coloured(0.3)),
                &camera,
                &options(slab_voxels, subpixels),
            );
        }
    }
}

#[test]
fn cubic_grid() {
    hold_grid("cubic", DAffine3::IDENTITY);
}

#[test]
fn sheared_and_anisotropic_grids() {
    hold_grid("sheared", sheared_grid());
    hold_grid(
        "anisotropic",
        DAffine3::from_scale(DVec3::new(0.5, 1.3, 0.7)),
    );
    hold_grid("mirrored", DAffine3::from_scale(DVec3::new(-1.0, 0.8, 1.0)));
}

#[test]
fn far_from_the_origin_of_the_world() {
    hold_grid(
        "offset by 1e7",
        DAffine3::from_translation(DVec3::new(1e7, -1e7, 2e7)),
    );
}

#[test]
fn eye_inside_the_volume() {
    let (volume, middle, _) = scene(DAffine3::IDENTITY);
    for fov_deg in [40.0, 90.0, 150.0] {
        let eye = middle + DVec3::new(0.3, -0.4, 0.2);
        let camera = perspective(eye, eye + DVec3::new(0.5, 0.2, 1.0), fov_deg, [26, 22]);
        for subpixels in [1, 2, 4] {
            let name = format!("eye inside, {fov_deg} degrees, {subpixels} sub-pixels");
            hold(
                &name,
                (&volume, &coloured(0.3)),
                &camera,
                &options(0.5, subpixels),
            );
        }
    }
}

#[test]
fn wide_field_of_view() {
    let (volume, middle, size) = scene(DAffine3::IDENTITY);
    let eye = middle + 0.45 * size * DVec3::new(0.9, 0.55, -1.0);
    for slab_voxels in [0.25, 1.0] {
        let camera = perspective(eye, middle, 150.0, [40, 40]);
        let name = format!("150 degrees, slab {slab_voxels}");
        hold(
            &name,
            (&volume, &coloured(0.3)),
            &camera,
            &options(slab_voxels, 2),
        );
    }
}

/// Where neither faces nor steps are met, the table alone is left: half an entry is 7e-4 of opacity per unit here.
#[test]
fn a_smooth_cloud() {
    let volume = blobs(23).expect("a good size");
    let look = transfer(
        &[(0.0, [0.1, 0.2, 1.0]), (2.0, [1.0, 0.3, 0.1])],
        &[(0.1, 0.0), (1.5, 0.3), (3.0, 0.5)],
    );
    for camera in cameras(DVec3::ZERO, 2.0) {
        for (slab_voxels, subpixels) in [(0.25, 1), (0.5, 2), (1.0, 4)] {
            let name = format!("cloud, {:?}, slab {slab_voxels}", camera.projection);
            hold(
                &name,
                (&volume, &look),
                &camera,
                &options(slab_voxels, subpixels),
            );
        }
    }
}

/// Most cells are dropped, and the samples beside them must not show what is not there.
#[test]
fn bands_and_steps() {
    let white = [(0.0, [1.0; 3])];
    let band = transfer(
        &white,
        &[(0.45, 0.0), (0.45, 0.4), (0.55, 0.4), (0.55, 0.0)],
    );
    let step = transfer(&white, &[(0.9, 0.0), (0.9, 1.0)]);
    let low = transfer(&white, &[(0.3, 0.5), (0.32, 0.0)]);
    let (volume, middle, size) = scene(DAffine3::IDENTITY);
    for (name, look) in [("band", &band), ("step", &step), ("low", &low)] {
        for camera in cameras(middle, size) {
            for subpixels in [1, 2] {
                let name = format!("{name}, {:?}, {subpixels} sub-pixels", camera.projection);
                hold(&name, (&volume, look), &camera, &options(0.5, subpixels));
            }
        }
    }
}

/// Random integers of `low..=high` from the shared formula.
fn integers(dims: [usize; 3], low: f64, high: f64) -> Vec<f64> {
    let random = random_volume(dims, DAffine3::IDENTITY);
    let unit = |i: usize| (random.value(i) - 0.2) / 0.8;
    (0..random.len())
        .map(|i| (low + unit(i) * (high - low)).round())
        .collect()
}

/// As [`coloured`], over other scalars.
fn coloured_over(low: f64, high: f64) -> TransferFunction {
    coloured(0.3).rescaled(low, high)
}

#[test]
fn voxel_types_and_odd_sizes() {
    for dims in [[17, 9, 23], [2, 2, 2], [9, 2, 8], [16, 8, 8], [2, 33, 3]] {
        let u8s = integers(dims, 0.0, 255.0);
        let u16s = integers(dims, 30_000.0, 30_400.0);
        let i16s = integers(dims, -1024.0, 3071.0);
        let cases = [
            (
                Voxels::U8(u8s.iter().map(|&v| v as u8).collect()),
                (0.0, 255.0),
            ),
            (
                Voxels::U16(u16s.iter().map(|&v| v as u16).collect()),
                (30_000.0, 30_400.0),
            ),
            (
                Voxels::I16(i16s.iter().map(|&v| v as i16).collect()),
                (-1024.0, 3071.0),
            ),
            (
                Voxels::F32(i16s.iter().map(|&v| 1e-3 * v as f32).collect()),
                (-1.024, 3.071),
            ),
        ];
        for (number, (voxels, (low, high))) in cases.into_iter().enumerate() {
            let volume = Volume::new(dims, voxels, DAffine3::IDENTITY).expect("a valid volume");
            let middle = 0.5 * DVec3::from(dims.map(|n| (n - 1) as f64));
            let eye = middle + 2.2 * middle.length() * DVec3::new(0.5, 0.4, -0.8);
            let camera = perspective(eye, middle, 50.0, [20, 20]);
            let name = format!("{dims:?}, type {number}");
            hold(
                &name,
                (&volume, &coloured_over(low, high)),
                &camera,
                &options(0.5, 2),
            );
        }
    }
}
