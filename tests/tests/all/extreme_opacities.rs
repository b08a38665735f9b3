//! Opacities at their extremes (method, section 8): 0, 1, 1e-12, and a million layers.
//!
//! The tiles keep transmittance in f32 and subtract what each splat takes. While transmittance is near 1 that is
//! rounded to a multiple of 2^-24, and a layer below 3e-8 is lost: n layers may be wrong by up to n 2^-25 in all, which
//! is 3e-5 for a thousand. Longer lists keep what rounding takes. The errors found are written at each case.

use glam::{DAffine3, DVec3};
use resample_core::{KernelShape, SelectMode};
use resample_tests::choices::with_samples;
use resample_tests::twins::field::ReferenceKernel;
use resample_tests::volumes::scenes::{
    full, grey, orthographic, perspective, random_volume, render, single_voxel,
};
use volsplat::{Volume, Voxels};

const LAYERS: usize = 1_000_000;

/// A row of opaque-valued voxels along z.
fn row(len: usize) -> Volume {
    Volume::new([1, 1, len], Voxels::U8(vec![1; len]), DAffine3::IDENTITY).expect("a row of voxels")
}

/// Transmittance of the middle pixel of a picture along the row, and its true value.
fn through_the_row(len: usize, opacity: f64, shape: KernelShape) -> [f64; 2] {
    let camera = orthographic(DVec3::new(0.0, 0.0, -5.0), DVec3::ZERO, 3.0, [3, 3]);
    let options = with_samples(full(SelectMode::Splats), |samples| samples.kernel = shape);
    let image = render(&row(len), &grey(opacity), &options, &camera);
    let per_layer =
        -(-opacity).ln_1p() * ReferenceKernel::new(shape).line_integral(0.0, f64::NEG_INFINITY);
    [
        1.0 - f64::from(image.pixel(1, 1)[3]),
        (-(len as f64) * per_layer).exp(),
    ]
}

/// Error found in the transmittance of a pixel: 2.9e-7 for layers of 1e-5, 2.4e-6 for 1e-6 (the footprint's own error), 2.9e-7
/// for 1e-7, 8.9e-8 for 1e-8.
#[test]
fn a_million_faint_layers() {
    for (opacity, bound) in [
        (1e-5, 1e-6),
        (1e-6, 1e-5),
        (1e-7, 2e-6),
        (1e-8, 1e-6),
        (1e-12, 6e-7),
    ] {
        let [got, truth] = through_the_row(LAYERS, opacity, KernelShape::Gaussian);
        let error = (got - truth).abs();
        println!("a million layers of {opacity:e}: {got:.6}, truly {truth:.6}, error {error:.1e}");
        assert!(
            error < bound,
            "a million layers of {opacity:e}: {got} instead of {truth}"
        );
    }
}

/// The same layers as points, which a sheet of one voxel sums before it is composited. A layer is spread over nine
/// pixels and takes 1.5e-7 of the middle one: without what rounding takes, 0.108 of the true 0.25 px^2 of optical depth
/// would be lost over the screen.
#[test]
fn a_million_faint_points() {
    let camera = orthographic(DVec3::new(0.0, 0.0, -5.0), DVec3::ZERO, 18.0, [9, 9]);
    let image = render(
        &row(LAYERS),
        &grey(1e-6),
        &full(SelectMode::Points),
        &camera,
    );
    let depth: f64 = image
        .rgba
        .iter()
        .map(|p| -(1.0 - f64::from(p[3])).ln())
        .sum();
    let truth = -(-1e-6f64).ln_1p() * LAYERS as f64 * 0.25;
    println!(
        "a million points of 1e-6: optical depth {depth:.6} over the screen, truly {truth:.6}"
    );
    assert!(
        (depth - truth).abs() < 1e-5,
        "optical depth {depth}, expected {truth}"
    );
    // Sheets of a thousand voxels lose nothing.
    let thick = with_samples(full(SelectMode::Points), |samples| {
        samples.sheet_voxels = 1000.0
    });
    let image = render(&row(LAYERS), &grey(1e-6), &thick, &camera);
    let depth: f64 = image
        .rgba
        .iter()
        .map(|p| -(1.0 - f64::from(p[3])).ln())
        .sum();
    println!("in sheets of a thousand voxels: {depth:.6}");
    assert!(
        (depth / truth - 1.0).abs() < 1e-3,
        "in thick sheets: optical depth {depth}, expected {truth}"
    );
}

/// Transmittance falls through the last normal f32 to 0 and stays a number; alpha ends at exactly 1.
#[test]
fn transmittance_at_the_edge_of_f32() {
    for opacity in [0.5, 0.9, 0.999_999, 1.0] {
        for len in [10, 60, 120, 400] {
            let [got, truth] = through_the_row(len, opacity, KernelShape::Gaussian);
            println!("{len} layers of {opacity}: {got:e}, truly {truth:e}");
            assert!(
                (got - truth).abs() < 1e-5,
                "{len} layers of {opacity}: {got:e} instead of {truth:e}"
            );
        }
    }
}

#[test]
fn opacity_of_zero_is_nothing_and_of_one_is_a_wall() {
    let volume = random_volume([5, 5, 5], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(9.0, 8.0, -7.0),
        DVec3::splat(2.0),
        30.0,
        [24, 24],
    );
    for select in [
        SelectMode::Hybrid,
        SelectMode::Points,
        SelectMode::Splats,
        SelectMode::Ewa,
    ] {
        let nothing = render(&volume, &grey(0.0), &full(select), &camera);
        assert!(
            nothing.rgba.iter().all(|p| *p == [0.0; 4]),
            "{select:?}: opacity 0 is seen"
        );
        for shape in KernelShape::ALL {
            let options = with_samples(full(select), |samples| samples.kernel = shape);
            let solid =
                resample_tests::volumes::scenes::volume([5, 5, 5], DAffine3::IDENTITY, |_| 1.0);
            let image = render(&solid, &grey(1.0), &options, &camera);
            let middle = image.pixel(12, 12);
            if select != SelectMode::Points {
                assert!(
                    middle[3] > 0.9999,
                    "{select:?}, {shape:?}: a wall lets light through: {middle:?}"
                );
            }
        }
    }
}

/// An opacity of 1e-12 shows in the colour to f32's relative error; alpha, which is 1 - T, has lost it (by 1e-12).
#[test]
fn opacity_of_a_millionth_of_a_millionth() {
    let camera = orthographic(DVec3::new(0.0, 0.0, -5.0), DVec3::ZERO, 3.0, [3, 3]);
    let image = render(
        &single_voxel(DVec3::ZERO),
        &grey(1e-12),
        &full(SelectMode::Splats),
        &camera,
    );
    let truth =
        1e-12 * ReferenceKernel::new(KernelShape::Gaussian).line_integral(0.0, f64::NEG_INFINITY);
    let [red, .., alpha] = image.pixel(1, 1);
    println!("opacity 1e-12: red {red:e}, truly {truth:e}, alpha {alpha:e}");
    assert!(
        (f64::from(red) / truth - 1.0).abs() < 1e-4,
        "red {red:e}, expected {truth:e}"
    );
    assert!(
        (f64::from(alpha) - truth).abs() < 2e-12,
        "alpha {alpha:e}, expected {truth:e}"
    );
}
