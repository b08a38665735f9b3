//! Point accumulation: a minified sample is a point, gathered by the circular Gaussian at each pixel.
//!
//! The Gaussian is separable, so a point needs four weights along each axis. They are normalised to sum to 1 for every
//! position of the point between the pixels: what a sample brings is on the screen in full, wherever it falls.

/// Pixels along one axis that a point reaches.
pub const TAPS: usize = 4;

/// Sigma of the pixel's Gaussian, px: the usual antialiasing filter of that width (variance 1/4 px^2) passes 8 % at the
/// pixel grid's own frequency, where a box passes 0 and a point sample 100 %.
pub const PIXEL_SIGMA_PX: f64 = 0.5;

/// Positions between two pixels at which the weights are tabulated. The nearest one is at most 1/512 px away, which
/// moves a point by as much and changes no sum.
const PHASES: usize = 256;

/// The weights of the pixel's Gaussian at tabulated positions.
#[derive(Clone, Debug)]
pub struct PixelFilter {
    weights: Vec<[f32; TAPS]>,
}

/// Where a point falls along one axis: the first of its four pixels and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisWeights {
    /// First pixel; may be outside the picture, even negative.
    pub first: i32,
    /// Weights of `first` and the three pixels after it; their sum is 1.
    pub weights: [f32; TAPS],
}

impl PixelFilter {
    /// Tabulates the Gaussian of [`PIXEL_SIGMA_PX`], shifted to reach 0 at 2 px, where pixels enter and leave.
    pub fn new() -> Self {
        let reach = TAPS as f64 / 2.0;
        let gaussian = |d: f64| (-0.5 * (d / PIXEL_SIGMA_PX).powi(2)).exp();
        let weights = (0..PHASES).map(|phase| {
            let t = (phase as f64 + 0.5) / PHASES as f64;
            let raw: [f64; TAPS] =
                std::array::from_fn(|tap| gaussian(tap as f64 - 1.0 - t) - gaussian(reach))
                    .map(|w| w.max(0.0));
            let sum: f64 = raw.iter().sum();
            raw.map(|w| (w / sum) as f32)
        });
        Self {
            weights: weights.collect(),
        }
    }

    /// The pixels and weights of a point at `position_px` along one axis.
    pub fn along_axis(&self, position_px: f32) -> AxisWeights {
        // Pixel centres are at +0.5: the point lies t past the centre of pixel first + 1.
        let from_centre = position_px - 0.5;
        let cell = from_centre.floor();
        let phase = ((from_centre - cell) * PHASES as f32) as usize;
        AxisWeights {
            first: cell as i32 - 1,
            weights: self.weights[phase.min(PHASES - 1)],
        }
    }
}

impl Default for PixelFilter {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_follow_the_point() {
        let filter = PixelFilter::new();
        for i in 0..1000 {
            let position = 5.0 + i as f32 * 0.003;
            let axis = filter.along_axis(position);
            let sum: f32 = axis.weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-6, "sum {sum} at {position}");
            let mean: f32 = axis
                .weights
                .iter()
                .zip(0..)
                .map(|(w, tap)| w * ((axis.first + tap) as f32 + 0.5))
                .sum();
            assert!(
                (mean - position).abs() < 0.03,
                "centre of gravity {mean} for a point at {position}"
            );
            assert!(axis.weights.iter().all(|&w| w >= 0.0), "{axis:?}");
        }
    }

    #[test]
    fn a_point_on_a_pixel_centre_is_symmetric() {
        let axis = PixelFilter::new().along_axis(7.5 + 1e-6);
        assert_eq!(axis.first, 6);
        assert!((axis.weights[0] - axis.weights[2]).abs() < 0.01, "{axis:?}");
    }
}
