//! The feature part of FLIP: how much edges and points differ.
//!
//! Takes the luminance of both pictures, gives a factor in 0..=1 per pixel. Edges are found by the first and points
//! by the second derivative of a Gaussian as wide as the eye's own edge detector; the larger of the two differences
//! counts. Each kernel's positive taps sum to 1 and its negative ones to -1, so a step from black to white has length 1.
//!
//! Source: the feature pipeline of the FLIP paper (cited in the parent module).
//!
//! Limits: luminance only, as in the paper.

use crate::metrics::convolve::{Border, along_columns, along_rows, normalised, sampled_taps};
use crate::metrics::inputs::ScalarMap;
use rayon::prelude::*;

/// Width of the feature detector in degrees of the visual field.
const FEATURE_WIDTH_DEG: f64 = 0.082;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f64 = 0.5;

/// The feature difference of two luminance maps (the Y of YCxCz, -16..=100).
pub(super) fn difference(
    image: &ScalarMap,
    reference: &ScalarMap,
    pixels_per_degree: f64,
) -> ScalarMap {
    let kernels = Kernels::new(pixels_per_degree);
    let image_features = kernels.detect(image);
    let reference_features = kernels.detect(reference);
    let values = (image_features.par_iter().zip(&reference_features))
        .map(|(a, b)| {
            let edge = (a.edge - b.edge).abs();
            let point = (a.point - b.point).abs();
            // Lengths go up to the square root of 2, where both axes see a full step.
            (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT)
        })
        .collect();
    ScalarMap {
        width: image.width,
        height: image.height,
        values,
    }
}

/// Strength of the features at one pixel.
struct Feature {
    edge: f64,
    point: f64,
}

/// A Gaussian and its first two derivatives as taps.
struct Kernels {
    smooth: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Kernels {
    fn new(pixels_per_degree: f64) -> Self {
        // The detector's width is the distance of the derivative's two extrema, which lie one deviation to each side.
        let sigma_px = 0.5 * FEATURE_WIDTH_DEG * pixels_per_degree;
        let radius = (3.0 * sigma_px).ceil() as usize;
        let gaussian = |x: f64| (-0.5 * (x / sigma_px).powi(2)).exp();
        Self {
            smooth: normalised(sampled_taps(radius, gaussian)),
            first: balanced(sampled_taps(radius, |x| -x * gaussian(x))),
            second: balanced(sampled_taps(radius, |x| {
                ((x / sigma_px).powi(2) - 1.0) * gaussian(x)
            })),
        }
    }

    fn detect(&self, luminance: &ScalarMap) -> Vec<Feature> {
        let values = luminance
            .values
            .iter()
            .map(|y| (y + 16.0) / 116.0)
            .collect();
        let relative = ScalarMap {
            values,
            ..*luminance
        };
        let rows = |taps: &[f64]| along_rows(&relative, taps, Border::Replicate);
        let columns =
            |map: &ScalarMap, taps: &[f64]| along_columns(map, taps, Border::Replicate).values;
        let smooth_in_x = rows(&self.smooth);
        let edge_x = columns(&rows(&self.first), &self.smooth);
        let edge_y = columns(&smooth_in_x, &self.first);
        let point_x = columns(&rows(&self.second), &self.smooth);
        let point_y = columns(&smooth_in_x, &self.second);
        (0..edge_x.len())
            .into_par_iter()
            .map(|i| Feature {
                edge: edge_x[i].hypot(edge_y[i]),
                point: point_x[i].hypot(point_y[i]),
            })
            .collect()
    }
}

/// The taps with the positive ones scaled to sum 1 and the negative ones to sum -1.
fn balanced(mut taps: Vec<f64>) -> Vec<f64> {
    let positive: f64 = taps.iter().filter(|&&tap| tap > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|&&tap| tap < 0.0).sum::<f64>();
    for tap in &mut taps {
        *tap /= if *tap > 0.0 { positive } else { negative };
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balanced_taps_sum_to_one_on_each_side() {
        let kernels = Kernels::new(super::super::DEFAULT_PIXELS_PER_DEGREE);
        for taps in [&kernels.first, &kernels.second] {
            let positive: f64 = taps.iter().filter(|&&tap| tap > 0.0).sum();
            let total: f64 = taps.iter().sum();
            assert!(
                (positive - 1.0).abs() < 1e-12 && total.abs() < 1e-12,
                "sums {positive} and {total}"
            );
        }
    }

    #[test]
    fn a_full_step_against_nothing_has_the_closed_form() {
        // Between the two columns at the step the derivative sees nearly all of the step: the taps on one side sum
        // to 1. The pixel right of the step misses none of the positive taps, as the centre tap is 0.
        let step = ScalarMap {
            width: 64,
            height: 8,
            values: (0..512)
                .map(|at| if at % 64 < 32 { -16.0 } else { 100.0 })
                .collect(),
        };
        let flat = ScalarMap {
            values: vec![-16.0; 512],
            ..step
        };
        let found =
            difference(&step, &flat, super::super::DEFAULT_PIXELS_PER_DEGREE).values[4 * 64 + 32];
        let expected = std::f64::consts::FRAC_1_SQRT_2.sqrt();
        assert!(
            (found - expected).abs() < 1e-12,
            "feature difference {found}, expected {expected}"
        );
    }
}
