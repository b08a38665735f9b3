//! Reconstruction kernels: the shape that a sample has in its own grid, before it is projected.
//!
//! A kernel is radially symmetric, compact, and reaches 0 at its radius. Lengths are in grid units (one voxel), and
//! the integral over space is 1, so that the kernels of a regular grid sum to 1 up to the ripple that
//! [`Kernel::lattice_ripple`] states. Because of the symmetry, its integral along any line depends only on the
//! distance of the line from the centre: that function is the footprint (Westover 1990), here in closed form.

use std::f64::consts::PI;

/// The shape of a reconstruction kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum KernelShape {
    /// Gaussian, truncated at three sigmas and shifted to reach 0 there.
    Gaussian,
    /// (1 - r^2/R^2)^3: smallest support, no exponential.
    Polynomial,
    /// Cubic B-spline of the distance, radius 2.
    BSpline,
}

impl KernelShape {
    /// Every shape, for tests that sweep over them.
    pub const ALL: [Self; 3] = [Self::Gaussian, Self::Polynomial, Self::BSpline];
}

/// Sigma of the Gaussian, grid units. The sum over the lattice ripples by about 6 exp(-2 pi^2 variance), from the six
/// nearest replicas of the spectrum, and the variance after truncation is 0.30: 1.3 % measured. Sigma 0.5 would ripple
/// by 6 %, 0.7 by 0.2 %: less ripple is bought with blur and with area. The middle is a guess, to be measured.
const GAUSSIAN_SIGMA: f64 = 0.6;

/// Support of the Gaussian in sigmas: the value cut off, exp(-4.5) of the peak, is 1.1 % and is subtracted.
const GAUSSIAN_CUTOFF_SIGMAS: f64 = 3.0;

/// Support of the polynomial kernel. The spectrum of (1 - r^2/R^2)^3 in space is J_{9/2}(kR)/(kR)^{9/2}; its first
/// zero, kR = 8.182561, laid on the nearest lattice frequency k = 2 pi, removes the six strongest replicas. The rest
/// ripple by 1.8 %.
const POLYNOMIAL_RADIUS: f64 = 8.182_561_452_571_1 / (2.0 * PI);

/// A reconstruction kernel with unit integral over space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    shape: KernelShape,
    radius: f64,
    /// Factor that makes the integral over space 1.
    scale: f64,
}

impl Kernel {
    /// The kernel of this shape, at its own radius.
    pub fn new(shape: KernelShape) -> Self {
        let radius = match shape {
            KernelShape::Gaussian => GAUSSIAN_SIGMA * GAUSSIAN_CUTOFF_SIGMAS,
            KernelShape::Polynomial => POLYNOMIAL_RADIUS,
            KernelShape::BSpline => 2.0,
        };
        let mut kernel = Self {
            shape,
            radius,
            scale: 1.0,
        };
        kernel.scale = 1.0 / kernel.radial_moment(2);
        kernel
    }

    /// The shape.
    pub fn shape(&self) -> KernelShape {
        self.shape
    }

    /// The support radius, grid units: the kernel is 0 there and beyond.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The kernel's value at a squared distance (grid units squared) from its centre.
    ///
    /// ```
    /// use resample_core::{Kernel, KernelShape};
    ///
    /// let kernel = Kernel::new(KernelShape::BSpline);
    /// assert!(kernel.value(0.0) > kernel.value(1.0));
    /// assert_eq!(kernel.value(kernel.radius().powi(2)), 0.0);
    /// ```
    pub fn value(&self, distance2: f64) -> f64 {
        if distance2 >= self.radius * self.radius {
            return 0.0;
        }
        self.scale
            * match self.shape {
                KernelShape::Gaussian => gaussian(distance2) - gaussian(self.radius * self.radius),
                KernelShape::Polynomial => (1.0 - distance2 / (self.radius * self.radius)).powi(3),
                KernelShape::BSpline => {
                    let r = distance2.sqrt();
                    if r < 1.0 {
                        2.0 / 3.0 - distance2 + 0.5 * r * distance2
                    } else {
                        (2.0 - r).powi(3) / 6.0
                    }
                }
            }
    }

    /// The integral along a whole line at this squared distance from the centre, grid units.
    pub fn line_integral(&self, distance2: f64) -> f64 {
        2.0 * self.line_integral_from(distance2, 0.0)
    }

    /// The integral along a ray that starts at `start` (grid units) on a line at this squared distance from the
    /// centre; `start` is 0 at the point nearest to the centre, negative before it.
    pub fn line_integral_from(&self, distance2: f64, start: f64) -> f64 {
        let inside2 = self.radius * self.radius - distance2;
        if !(inside2 > 0.0) {
            return 0.0;
        }
        let end = inside2.sqrt();
        let start = start.clamp(-end, end);
        self.scale * (self.antiderivative(distance2, end) - self.antiderivative(distance2, start))
    }

    /// The variance along one axis, grid units squared: what adds under convolution with another filter.
    pub fn variance(&self) -> f64 {
        self.radial_moment(4) / 3.0
    }

    /// Largest departure from 1 of the sum of the kernels of a unit lattice, by evaluation at 17^3 points of a cell.
    pub fn lattice_ripple(&self) -> f64 {
        const STEPS: i32 = 16;
        let reach = self.radius.ceil() as i32 + 1;
        let mut worst = 0.0f64;
        for step in 0..(STEPS + 1).pow(3) {
            let at = [step, step / (STEPS + 1), step / (STEPS + 1).pow(2)]
                .map(|i| f64::from(i % (STEPS + 1)) / f64::from(STEPS));
            worst = worst.max((self.lattice_sum(at, reach) - 1.0).abs());
        }
        worst
    }

    fn lattice_sum(&self, at: [f64; 3], reach: i32) -> f64 {
        let mut sum = 0.0;
        for z in -reach..=reach {
            for y in -reach..=reach {
                for x in -reach..=reach {
                    let d = [
                        at[0] - f64::from(x),
                        at[1] - f64::from(y),
                        at[2] - f64::from(z),
                    ];
                    sum += self.value(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                }
            }
        }
        sum
    }

    /// 4 pi times the integral of value(r) r^power, by Simpson's rule on 4096 intervals
    /// (relative error below 1e-12: every kernel is at least three times differentiable between its knots, and the
    /// knots fall on grid points).
    fn radial_moment(&self, power: i32) -> f64 {
        const INTERVALS: u32 = 4096;
        let step = self.radius / f64::from(INTERVALS);
        let mut sum = 0.0;
        for i in 0..=INTERVALS {
            let r = f64::from(i) * step;
            let weight = if i == 0 || i == INTERVALS {
                1.0
            } else {
                f64::from(2 + 2 * (i % 2))
            };
            sum += weight * self.value(r * r) * r.powi(power);
        }
        4.0 * PI * sum * step / 3.0
    }

    /// An antiderivative along the line, of the unscaled kernel, at t inside the support.
    fn antiderivative(&self, distance2: f64, t: f64) -> f64 {
        let radius2 = self.radius * self.radius;
        match self.shape {
            KernelShape::Gaussian => {
                let root = GAUSSIAN_SIGMA * 2f64.sqrt();
                let along = GAUSSIAN_SIGMA * (0.5 * PI).sqrt() * libm::erf(t / root);
                gaussian(distance2) * along - gaussian(radius2) * t
            }
            KernelShape::Polynomial => {
                // With s = t/R and u = 1 - d^2/R^2: the integral of (u - s^2)^3.
                let (u, s) = (1.0 - distance2 / radius2, t / self.radius);
                let s2 = s * s;
                self.radius * s * (u * u * u - u * u * s2 + 0.6 * u * s2 * s2 - s2 * s2 * s2 / 7.0)
            }
            KernelShape::BSpline => bspline_antiderivative(distance2, t),
        }
    }
}

fn gaussian(distance2: f64) -> f64 {
    (-distance2 / (2.0 * GAUSSIAN_SIGMA * GAUSSIAN_SIGMA)).exp()
}

/// The antiderivative, odd in t, of the cubic B-spline of sqrt(d^2 + t^2), with its change of piece at distance 1.
fn bspline_antiderivative(distance2: f64, t: f64) -> f64 {
    let inner = |t: f64| {
        let [_, r2, r3] = power_antiderivatives(distance2, t);
        2.0 / 3.0 * t - r2 + 0.5 * r3
    };
    let outer = |t: f64| {
        let [r1, r2, r3] = power_antiderivatives(distance2, t);
        (8.0 * t - 12.0 * r1 + 6.0 * r2 - r3) / 6.0
    };
    let magnitude = t.abs();
    let knot = (1.0 - distance2).max(0.0).sqrt();
    let integral = if magnitude <= knot {
        inner(magnitude)
    } else {
        inner(knot) + outer(magnitude) - outer(knot)
    };
    integral.copysign(t)
}

/// Integrals from 0 to t of r, r^2 and r^3, with r = sqrt(d^2 + t^2).
fn power_antiderivatives(distance2: f64, t: f64) -> [f64; 3] {
    let r = (distance2 + t * t).sqrt();
    // d^2 asinh(t/d) tends to 0 with d.
    let log_term = if distance2 > 0.0 {
        distance2 * (t / distance2.sqrt()).asinh()
    } else {
        0.0
    };
    let r1 = 0.5 * (t * r + log_term);
    [
        r1,
        distance2 * t + t * t * t / 3.0,
        0.25 * t * r * r * r + 0.75 * distance2 * r1,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_over_space_is_one() {
        for shape in KernelShape::ALL {
            let kernel = Kernel::new(shape);
            // The line integrals over the plane, an independent way to the same volume integral.
            let steps = 20_000;
            let step = kernel.radius() / f64::from(steps);
            let total: f64 = (0..steps)
                .map(|i| (f64::from(i) + 0.5) * step)
                .map(|d| 2.0 * PI * d * kernel.line_integral(d * d) * step)
                .sum();
            assert!(
                (total - 1.0).abs() < 1e-7,
                "{shape:?} integrates to {total}"
            );
        }
    }

    #[test]
    fn line_integral_equals_numeric_quadrature_from_any_start() {
        for shape in KernelShape::ALL {
            let kernel = Kernel::new(shape);
            for i in 0..20 {
                let distance2 = (kernel.radius() * f64::from(i) / 20.0).powi(2);
                for start in [-9.0, -0.7, 0.0, 0.3, 1.1] {
                    let steps = 40_000;
                    let from = f64::max(start, -kernel.radius());
                    let step = (kernel.radius() - from) / f64::from(steps);
                    let numeric: f64 = (0..steps)
                        .map(|k| from + (f64::from(k) + 0.5) * step)
                        .map(|t| kernel.value(distance2 + t * t) * step)
                        .sum();
                    let closed = kernel.line_integral_from(distance2, start);
                    assert!(
                        (numeric - closed).abs() < 1e-6,
                        "{shape:?} {distance2} {start}: {numeric} {closed}"
                    );
                }
            }
        }
    }

    #[test]
    fn reaches_zero_at_the_radius_and_stays_there() {
        for shape in KernelShape::ALL {
            let kernel = Kernel::new(shape);
            let radius2 = kernel.radius().powi(2);
            assert!(
                kernel.value(radius2 * (1.0 - 1e-9)) < 1e-7,
                "{shape:?} value at the edge"
            );
            assert_eq!(kernel.value(radius2), 0.0);
            assert_eq!(kernel.line_integral(radius2), 0.0);
            assert_eq!(kernel.line_integral(f64::NAN), 0.0, "NaN is outside");
        }
    }

    #[test]
    fn lattice_ripple_is_what_the_docs_say() {
        let ripple = |shape| Kernel::new(shape).lattice_ripple();
        let (gaussian, polynomial, bspline) = (
            ripple(KernelShape::Gaussian),
            ripple(KernelShape::Polynomial),
            ripple(KernelShape::BSpline),
        );
        println!(
            "ripple: Gaussian {gaussian:.5}, polynomial {polynomial:.5}, B-spline {bspline:.5}"
        );
        assert!((gaussian - 0.0127).abs() < 1e-3, "Gaussian {gaussian}");
        assert!(
            (polynomial - 0.0176).abs() < 1e-3,
            "polynomial {polynomial}"
        );
        assert!((bspline - 0.0021).abs() < 1e-3, "B-spline {bspline}");
    }

    #[test]
    fn variance_is_the_second_moment_along_an_axis() {
        for shape in KernelShape::ALL {
            let kernel = Kernel::new(shape);
            // In the plane, the footprint has the same variance along each axis.
            let steps = 20_000;
            let step = kernel.radius() / f64::from(steps);
            let numeric: f64 = (0..steps)
                .map(|i| (f64::from(i) + 0.5) * step)
                .map(|d| PI * d.powi(3) * kernel.line_integral(d * d) * step)
                .sum();
            assert!(
                (numeric - kernel.variance()).abs() < 1e-6,
                "{shape:?}: {numeric} {}",
                kernel.variance()
            );
        }
    }
}
