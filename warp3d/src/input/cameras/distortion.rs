//! Lens distortion: where a lens with a curved image puts what a pinhole would put elsewhere.
//!
//! Takes and gives positions on the plane at camera z = 1. One model is that of Brown and Conrady with OpenCV's six
//! radial coefficients, of which SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV of COLMAP and the keys `k1` to `k4`,
//! `p1`, `p2` of NeRF's files are special cases. The other is the fish eye of Kannala and Brandt, whose radius is a
//! polynomial of the angle to the axis. Source: OpenCV's documentation of camera calibration.
//!
//! Limits: what a fish eye sees beyond the pinhole of its focal length and size is left out.

use glam::DVec2;

/// A lens's distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    model: Model,
    /// From this radius on the polynomial folds back: no ray of the lens is there.
    reach: f64,
}

/// Coefficients of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Model {
    Brown {
        /// k1, k2, k3 of the numerator and k4, k5, k6 of the denominator, of the 2nd, 4th and 6th power of the radius.
        radial: [f64; 6],
        /// p1 and p2.
        tangential: [f64; 2],
        /// k4 of NeRF's files, of the 8th power of the radius in the numerator.
        eighth: f64,
    },
    /// k1 to k4 of the 3rd, 5th, 7th and 9th power of the angle.
    FishEye([f64; 4]),
}

/// Step and end of the search for the radius where a polynomial folds back, in tangents of the angle to the axis: 20
/// is 87 degrees, and a thousandth is below a pixel for focal lengths up to 1000 px.
const REACH_STEP: f64 = 1e-3;
const FARTHEST: f64 = 20.0;

impl Distortion {
    /// OpenCV's coefficients; `None` where all of them are 0.
    ///
    /// ```
    /// use glam::DVec2;
    /// use warp3d::input::cameras::Distortion;
    ///
    /// let barrel = Distortion::new([-0.2, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]).ok_or("no distortion")?;
    /// let corner = barrel.distort(DVec2::new(0.5, 0.5)).ok_or("beyond the lens")?;
    /// assert!(corner.x < 0.5);
    /// assert!(Distortion::new([0.0; 6], [0.0; 2]).is_none());
    /// # Ok::<(), &str>(())
    /// ```
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
        let model = Model::Brown {
            radial,
            tangential,
            eighth,
        };
        (!is_plain).then(|| Self::of(model))
    }

    /// A fish eye: the radius is the angle times 1 and these coefficients of its 2nd, 4th, 6th and 8th power.
    pub fn fish_eye(coefficients: [f64; 4]) -> Self {
        Self::of(Model::FishEye(coefficients))
    }

    fn of(model: Model) -> Self {
        let reach = model.first_fold();
        Self { model, reach }
    }

    /// Where the lens puts the ray that a pinhole puts at `undistorted`; `None` where its polynomial folds back.
    pub fn distort(&self, undistorted: DVec2) -> Option<DVec2> {
        let r2 = undistorted.length_squared();
        if r2 >= self.reach * self.reach {
            return None;
        }
        let factor = self.model.factor(r2);
        let Model::Brown {
            tangential: [p1, p2],
            ..
        } = self.model
        else {
            return Some(undistorted * factor);
        };
        let DVec2 { x, y } = undistorted;
        let shift = DVec2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        Some(undistorted * factor + shift)
    }
}

impl Model {
    /// By how much a place at this squared radius is farther from the axis than a pinhole's.
    fn factor(&self, r2: f64) -> f64 {
        match *self {
            Self::Brown { radial, eighth, .. } => {
                let [k1, k2, k3, k4, k5, k6] = radial;
                let upper = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * eighth)));
                upper / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
            }
            Self::FishEye([k1, k2, k3, k4]) => {
                let radius = r2.sqrt();
                let angle2 = radius.atan().powi(2);
                let upper = 1.0 + angle2 * (k1 + angle2 * (k2 + angle2 * (k3 + angle2 * k4)));
                // At the axis the angle is the radius.
                upper
                    * if radius > 0.0 {
                        radius.atan() / radius
                    } else {
                        1.0
                    }
            }
        }
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
    fn a_fish_eye_puts_a_ray_at_its_angle() {
        let plain = Distortion::fish_eye([0.0; 4]);
        let angle = 0.9f64;
        let at = plain.distort(DVec2::new(0.0, angle.tan())).expect("within");
        assert!((at - DVec2::new(0.0, angle)).length() < 1e-12, "{at}");
        assert_eq!(plain.distort(DVec2::ZERO), Some(DVec2::ZERO));
        let bent = Distortion::fish_eye([0.1, -0.01, 0.002, -0.0003]);
        let at = bent.distort(0.6 * angle.tan() * DVec2::X + 0.8 * angle.tan() * DVec2::Y);
        // 0.9 (1 + 0.081 - 0.006561 + 0.001062882 - 0.000129140163), worked out by hand.
        let expected = 0.967_835_467_653_3 * DVec2::new(0.6, 0.8);
        assert!(
            at.is_some_and(|at| (at - expected).length() < 1e-12),
            "{at:?}"
        );
    }

    #[test]
    fn a_polynomial_that_folds_back_has_an_end() {
        // r (1 - 0.3 r^2) grows up to r = 1 / sqrt(0.9).
        let lens = Distortion::new([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]).expect("distorted");
        assert!(lens.distort(DVec2::new(1.05, 0.0)).is_some());
        assert_eq!(lens.distort(DVec2::new(1.06, 0.0)), None);
    }
}
