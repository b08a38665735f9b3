//! The error of a picture of every sample against its reference, and its bound.

use resample_core::{Camera, FootprintMode, OpacityMode, SelectMode};
use resample_tests::choices::with_samples;
use resample_tests::twins::samples::{Scene, render as reference};
use resample_tests::volumes::scenes::{coloured, full, render};
use volsplat::{DepthPlane, RenderOptions, Volume};

/// Error of the every-sample renderer, beyond what swaps of near-ties may cost.
pub(super) fn worst(volume: &Volume, camera: &Camera) -> f64 {
    worst_with(volume, camera, &full(SelectMode::Splats))
}

pub(super) fn worst_with(volume: &Volume, camera: &Camera, options: &RenderOptions) -> f64 {
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

/// Prints and bounds an error.
pub(super) fn hold(what: &str, error: f64, bound: f64) {
    println!("{what}: {error:.1e}");
    assert!(error < bound, "{what}: off by {error}, bound {bound}");
}

/// Returns true if any pixel shows something: a test of an empty picture tests nothing.
pub(super) fn shows(volume: &Volume, camera: &Camera) -> bool {
    render(volume, &coloured(0.6), &full(SelectMode::Splats), camera)
        .rgba
        .iter()
        .any(|p| p[3] > 1e-3)
}
