//! Transmittance of the every-sample renderer against a marched integral (method, section 3, "Opacity").
//!
//! With exact footprints and extinction, the product of the transmittances of all splats is
//! exp(-integral of the reconstructed extinction): the reference steps through that field, pixel by pixel, and knows
//! no footprint. Its own error is below 1e-6 (the test of the march module). The bound is 1e-4 of the full
//! transmittance, per pixel. The B-spline's footprint profile is off by 8e-4 of its peak, and has a bound of its own.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, KernelShape, SelectMode};
use resample_tests::choices::{samples, with_samples};
use resample_tests::data::data_file;
use resample_tests::twins::field::Field;
use resample_tests::twins::march::optical_depths;
use resample_tests::volumes::scenes::{
    full, grey, orthographic, perspective, render, sheared_grid, transfer,
};
use volsplat::procedural::blobs;
use volsplat::{
    LoadOptions, RawOptions, RenderOptions, TransferFunction, Volume, VoxelType, Voxels, load,
};

/// Step of the march, voxels. The error at it is measured beside the march: 5e-7.
const STEP: f64 = 0.02;

/// Per pixel, for the Gaussian and the polynomial kernel.
const BOUND: f64 = 1e-4;

/// Largest difference of transmittance between the renderer and the march.
fn worst(
    volume: &Volume,
    transfer: &TransferFunction,
    options: &RenderOptions,
    camera: &Camera,
) -> f64 {
    let field = Field::new(volume, transfer, samples(options).kernel);
    let unit = options
        .opacity_unit
        .unwrap_or_else(|| volume.smallest_spacing());
    let depths = optical_depths(&field, camera, unit, STEP);
    let image = render(volume, transfer, options, camera);
    let least = depths.iter().map(|d| (-d).exp()).fold(1.0, f64::min);
    assert!(
        least < 0.5,
        "the scene is too faint to test anything: transmittance down to {least}"
    );
    let errors = image
        .rgba
        .iter()
        .zip(&depths)
        .map(|(p, d)| (1.0 - f64::from(p[3]) - (-d).exp()).abs());
    errors.fold(0.0, f64::max)
}

/// Two views of the blobs: a close pinhole that looks along no axis, and parallel rays.
fn cameras(middle: DVec3, size: f64) -> [Camera; 2] {
    let eye = middle + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, middle, 50.0, [36, 36]),
        orthographic(eye, middle, 1.3 * size, [36, 36]),
    ]
}

/// Blobs on `grid`, which places voxel (i, j, k) of 18 per axis.
fn blobs_on(grid: DAffine3) -> Volume {
    let made = blobs(18).expect("a good size");
    Volume::new(made.dims, made.voxels, grid).expect("a valid grid")
}

fn check_grid(name: &str, grid: DAffine3) {
    let volume = blobs_on(grid);
    let middle = grid.transform_point3(DVec3::splat(8.5));
    let size = (grid.matrix3 * DVec3::splat(17.0)).length();
    for shape in KernelShape::ALL {
        for camera in cameras(middle, size) {
            let options = with_samples(
                RenderOptions {
                    opacity_unit: Some(1.0),
                    ..full(SelectMode::Splats)
                },
                |samples| samples.kernel = shape,
            );
            let error = worst(&volume, &grey(0.15), &options, &camera);
            println!("{name}, {shape:?}, {:?}: {error:.2e}", camera.projection);
            let bound = if shape == KernelShape::BSpline {
                5e-4
            } else {
                BOUND
            };
            assert!(
                error < bound,
                "{name}, {shape:?}, {:?}: off by {error}",
                camera.projection
            );
        }
    }
}

#[test]
fn blobs_on_a_cubic_grid() {
    check_grid(
        "cubic",
        DAffine3::from_translation(DVec3::new(1.0, -2.0, 0.5)),
    );
}

/// Section 2: non-uniform voxels are the same formula in voxel space.
#[test]
fn blobs_on_a_sheared_grid() {
    check_grid("sheared", sheared_grid());
}

/// Kernels that the near plane cuts are integrated from there on: the march starts there too.
#[test]
fn eye_inside_the_blobs() {
    let volume = blobs_on(DAffine3::IDENTITY);
    for eye in [DVec3::new(9.0, 9.0, 9.0), DVec3::new(14.2, 9.1, 8.3)] {
        let camera = perspective(eye, DVec3::new(2.0, 7.0, 8.0), 80.0, [36, 36]);
        let error = worst(&volume, &grey(0.15), &full(SelectMode::Splats), &camera);
        println!("eye at {eye}: {error:.2e}");
        assert!(error < BOUND, "eye at {eye}: off by {error}");
    }
}

#[test]
fn a_part_of_the_engine() {
    let Some(path) = data_file(
        "a_part_of_the_engine",
        "volumes/raw/engine_256x256x128_uint8.raw",
    ) else {
        return;
    };
    let raw = Some(RawOptions::new([256, 256, 128], VoxelType::U8));
    let engine = load(
        &path,
        &LoadOptions {
            raw,
            ..LoadOptions::default()
        },
    )
    .expect("the engine");
    // Around the upper cylinder: walls, the dense sleeve, and air.
    let volume = crop(&engine, [96, 64, 32], 64);
    let transfer = transfer(
        &[
            (0.0, [0.0; 3]),
            (90.0, [0.35, 0.45, 0.6]),
            (150.0, [0.6, 0.65, 0.7]),
            (255.0, [1.0, 0.9, 0.6]),
        ],
        &[
            (0.0, 0.0),
            (70.0, 0.0),
            (110.0, 0.05),
            (150.0, 0.08),
            (200.0, 0.4),
            (255.0, 0.7),
        ],
    );
    let middle = DVec3::splat(31.5);
    let eye = middle + 110.0 * DVec3::new(0.62, 0.38, 0.69);
    let camera = perspective(eye, middle, 40.0, [48, 48]);
    let error = worst(&volume, &transfer, &full(SelectMode::Splats), &camera);
    println!("engine, 64^3 voxels: {error:.2e}");
    assert!(error < BOUND, "engine: off by {error}");
}

/// A cube of voxels cut out of a volume, with unit spacing.
fn crop(from: &Volume, first: [usize; 3], side: usize) -> Volume {
    let value = |i: usize| {
        let at = [
            i % side + first[0],
            i / side % side + first[1],
            i / (side * side) + first[2],
        ];
        from.value((at[2] * from.dims[1] + at[1]) * from.dims[0] + at[0])
    };
    let voxels = (0..side.pow(3)).map(value).collect();
    Volume::new([side; 3], Voxels::F64(voxels), DAffine3::IDENTITY).expect("a crop")
}
