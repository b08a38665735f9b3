//! The choices that are tested, and the test of one picture against its reference.

use glam::DVec3;
use resample_core::{Camera, KernelShape, SelectMode};
use resample_tests::choices::{samples, sheets, with_samples, with_sheets};
use resample_tests::twins::kernel_sheets::render as reference;
use resample_tests::twins::samples::Scene;
use resample_tests::volumes::scenes::{orthographic, perspective, render};
use volsplat::{Classify, Interpolate, RenderOptions, Subpixels, TransferFunction, Volume};

pub(super) const KERNELS: [KernelShape; 3] = [
    KernelShape::Gaussian,
    KernelShape::Polynomial,
    KernelShape::BSpline,
];

pub(super) const CLASSIFY: [Classify; 2] = [Classify::Pre, Classify::Post];

pub(super) fn options(kernel: KernelShape, classify: Classify) -> RenderOptions {
    with_sheets(
        with_samples(
            RenderOptions {
                subpixels: Subpixels::Fixed(1),
                min_transmittance: 0.0,
                ..RenderOptions::default()
            },
            |samples| {
                samples.kernel = kernel;
                samples.select = SelectMode::Splats;
            },
        ),
        |sheets| sheets.classify = classify,
    )
}

pub(super) fn bound(options: &RenderOptions) -> f64 {
    let residual = if sheets(options).interpolate == Interpolate::On {
        1e-3
    } else {
        0.0
    };
    residual
        + match (samples(options).kernel, samples(options).select) {
            (_, SelectMode::Points | SelectMode::Hybrid) => 8e-3,
            (KernelShape::BSpline, _) => 2e-3,
            _ => 2e-4,
        }
}

pub(super) fn hold(
    name: &str,
    (volume, look): (&Volume, &TransferFunction),
    camera: &Camera,
    options: &RenderOptions,
) {
    let image = render(volume, look, options, camera);
    let truth = reference(&Scene {
        volume,
        transfer: look,
        camera,
        options,
    });
    let errors = image.rgba.iter().zip(&truth);
    let worst = errors
        .flat_map(|(got, truth)| got.iter().zip(truth))
        .map(|(got, truth)| (f64::from(*got) - truth).abs())
        .fold(0.0, f64::max);
    let seen = truth.iter().filter(|p| p[3] > 0.1).count();
    let (kernel, select) = (samples(options).kernel, samples(options).select);
    let classify = sheets(options).classify;
    println!("{name}, {kernel:?}, {classify:?}, {select:?}: off by {worst:.1e}, {seen} px seen");
    assert!(seen > 10, "{name}: nothing is seen, so nothing is tested");
    let bound = bound(options);
    assert!(
        worst < bound,
        "{name}, {kernel:?}, {classify:?}, {select:?}: off by {worst:.1e}, allowed {bound:.1e}"
    );
}

pub(super) fn cameras(middle: DVec3, size: f64) -> [Camera; 2] {
    let eye = middle + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, middle, 40.0, [15, 13]),
        orthographic(eye, middle, 0.9 * size, [15, 13]),
    ]
}
