//! Lens distortion: where a lens with a curved image puts what a pinhole would put elsewhere.
//!
//! Takes and gives positions on the plane at camera z = 1. The model is that of Brown and Conrady with OpenCV's six
//! radial coefficients, of which SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV of COLMAP and the keys `k1` to `k4`,
//! `p1`, `p2` of NeRF's files are special cases. Source: OpenCV's documentation of camera calibration.

use glam::DVec2;

/// Coefficients of a lens's distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// k1, k2, k3 of the numerator and k4, k5, k6 of the denominator, of the 2nd, 4th and 6th power of the radius.
    radial: [f64; 6],
    /// p1 and p2.
    tangential: [f64; 2],
    /// k4 of NeRF's files, of the 8th power of the radius in the numerator.
    eighth: f64,
    /// From this radius on the polynomial folds back: no ray of the lens is there.
    reach: f64,
}

/// Step and end of the search for the radius where a polynomial folds back, in tangents of the angle to the axis: 20
/// is 87 degrees, and a thousandth is below a pixel for focal lengths up to 1000 px.
const REACH_STEP: f64 = 1e-3;
const FARTHEST: f64 = 20.0;

impl Distortion {
    /// OpenCV's coefficients; `None` where all of them are 0.
    pub fn new(radial: [f64; 6], tangential: [f64; 2]) -> Option<Self> {
        Self::with_eighth(radial, tangential, 0.0)
    }

    /// As above, and a coefficient of the 8th power of the radius.
    pub fn with_eighth(radial: [f64; 6], tangential: [f64; 2], eighth: f64) -> Option<Self> {
        let is_plain = radial
            .iter()
            .chain(&tangential)
            .chain([&eighth])
            .all(|&k| k == 0.0);
        let mut distortion = Self {
            radial,
            tangential,
            eighth,
            reach: FARTHEST,
        };
        distortion.reach = distortion.first_fold();
        (!is_plain).then_some(distortion)
    }

    /// Where the lens puts the ray that a pinhole puts at `undistorted`; `None` where its polynomial folds back.
    pub fn distort(&self, undistorted: DVec2) -> Option<DVec2> {
        let r2 = undistorted.length_squared();
        if r2 >= self.reach * self.reach {
            return None;
        }
        let DVec2 { x, y } = undistorted;
        let [p1, p2] = self.tangential;
        let shift = DVec2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        Some(undistorted * self.factor(r2) + shift)
    }

    fn factor(&self, r2: f64) -> f64 {
        let [k1, k2, k3, k4, k5, k6] = self.radial;
        let upper = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * self.eighth)));
        upper / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    }

    /// The first radius at which a larger one is not put farther out.
    fn first_fold(&self) -> f64 {
        let put = |r: f64| r * self.factor(r * r);
        let steps = (FARTHEST / REACH_STEP) as u32;
        (0..steps)
            .map(|step| f64::from(step) * REACH_STEP)
            .find(|&r| !(put(r + REACH_STEP) > put(r)))
            .unwrap_or(FARTHEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_of_zero_are_no_distortion() {
        assert_eq!(Distortion::new([0.0; 6], [0.0; 2]), None);
    }

    #[test]
    fn a_radius_is_scaled_by_the_polynomial_and_shifted_by_the_tilt() {
        let radial = [0.1, -0.02, 0.003, 0.05, 0.0, 0.0];
        let lens = Distortion::new(radial, [0.01, -0.02]).expect("distorted");
        let at = lens.distort(DVec2::new(0.6, 0.3)).expect("within reach");
        // r^2 = 0.45, worked out by hand from OpenCV's formula.
        let factor = (1.0 + 0.045 - 0.00405 + 0.000_273_375) / 1.0225;
        let expected = DVec2::new(
            0.6 * factor + 0.0036 - 0.02 * (0.45 + 0.72),
            0.3 * factor + 0.01 * (0.45 + 0.18) - 0.0072,
        );
        assert!((at - expected).length() < 1e-12, "{at}, not {expected}");
    }

    #[test]
    fn a_polynomial_that_folds_back_has_an_end() {
        // r (1 - 0.3 r^2) grows up to r = 1 / sqrt(0.9).
        let lens = Distortion::new([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]).expect("distorted");
        assert!(lens.distort(DVec2::new(1.05, 0.0)).is_some());
        assert_eq!(lens.distort(DVec2::new(1.06, 0.0)), None);
    }
}
