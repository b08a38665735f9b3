//! Slab sections of a kernel: its integral along a ray between two planes, from the cumulative line integral.
//!
//! A ball looks the same from everywhere, so what a ray collects of a kernel up to some point depends on two numbers: the
//! distance of the ray from the centre and the place of the point on the chord. That share of the whole line integral is
//! tabulated once a kernel; a section between any two planes, however thick the slab, however oblique the ray and whatever
//! the perspective, is the difference of two of its values. The table holds polynomial coefficients, because vector units
//! have no cheap gather: with u = -1..1 along the chord and y = 1 - (d/R)^2, the share is 1/2 + u P(u^2, y), and the
//! polynomial is made to reach 0 and 1 at the ends, so that the sections of a ray add up to its line integral exactly.
//! Source: K. Mueller, R. Crawfis, IEEE Visualization 1998, for section tables; the cumulative form is ours.

use fearless_simd::prelude::*;

use crate::kernel::Kernel;
use crate::table::{FootprintProfile, solve};

/// Powers of u^2. Eight leave 2e-5 of the peak for the Gaussian, and 3e-4 for the B-spline, whose third derivative jumps.
const ALONG: usize = 8;

/// Powers of y.
const ACROSS: usize = 5;

/// A kernel's section table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionProfile {
    /// The whole line integral.
    pub footprint: FootprintProfile,
    /// Coefficients of P: powers of u^2, and for each the powers of y.
    coefficients: [[f32; ACROSS]; ALONG],
    radius: f32,
}

impl SectionProfile {
    /// Interpolates the share at Chebyshev nodes in u^2 and y.
    pub fn new(kernel: &Kernel) -> Self {
        let radius2 = kernel.radius() * kernel.radius();
        let odd_part = |v: f64, y: f64| {
            let (u, distance2) = (v.sqrt(), radius2 * (1.0 - y));
            let after = kernel.line_integral_from(distance2, u * (radius2 * y).sqrt());
            (0.5 - after / kernel.line_integral(distance2)) / u
        };
        let across: [f64; ACROSS] = nodes();
        let along: [f64; ALONG] = nodes();
        // For each y a polynomial in u^2, and then each of its coefficients a polynomial in y.
        let at_nodes = across.map(|y| solve(powers(&along), along.map(|v| odd_part(v, y))));
        let mut coefficients: [[f64; ACROSS]; ALONG] =
            std::array::from_fn(|j| solve(powers(&across), std::array::from_fn(|i| at_nodes[i][j])));
        // At the end of the chord the share is 1: P(1, y) is 1/2, whatever y.
        for i in 0..ACROSS {
            let sum: f64 = coefficients.iter().map(|c| c[i]).sum();
            coefficients[ALONG - 1][i] += if i == 0 { 0.5 } else { 0.0 } - sum;
        }
        Self {
            footprint: FootprintProfile::new(kernel),
            coefficients: coefficients.map(|c| c.map(|c| c as f32)),
            radius: kernel.radius() as f32,
        }
    }

    /// The integral (grid units) along rays at these squared distances (grid units squared) from the centre, between
    /// two places on each ray, grid units from the point nearest to the centre, `from` not after `to`.
    #[inline(always)]
    pub fn integral<S, F>(&self, simd: S, distance2: F, [from, to]: [F; 2]) -> F
    where
        S: Simd,
        F: SimdFloat<S, Element = f32>,
    {
        let constant = |x: f32| F::splat(simd, x);
        let y = (constant(1.0) - distance2 * constant(1.0 / (self.radius * self.radius))).max(constant(0.0));
        let root = y.sqrt();
        let coefficients = &self.footprint.coefficients;
        let mut whole = constant(coefficients[coefficients.len() - 1]);
        for &c in coefficients[..coefficients.len() - 1].iter().rev() {
            whole = whole.mul_add(y, constant(c));
        }
        // On the rim the chord has no length; any number will do for its inverse, as the whole is 0.
        let inverse = constant(1.0) / (root * constant(self.radius)).max(constant(1e-6));
        let mut sums = [constant(0.0); 2];
        let clamped = |t: F| (t * inverse).max(constant(-1.0)).min(constant(1.0));
        let u = [clamped(from), clamped(to)];
        let v = [u[0] * u[0], u[1] * u[1]];
        for powers in self.coefficients.iter().rev() {
            let mut c = constant(powers[ACROSS - 1]);
            for &power in powers[..ACROSS - 1].iter().rev() {
                c = c.mul_add(y, constant(power));
            }
            sums = [sums[0].mul_add(v[0], c), sums[1].mul_add(v[1], c)];
        }
        let share = (u[1] * sums[1] - u[0] * sums[0]).max(constant(0.0));
        y * root * whole * share
    }
}

/// Chebyshev nodes of 0..1.
fn nodes<const N: usize>() -> [f64; N] {
    std::array::from_fn(|i| 0.5 - 0.5 * (std::f64::consts::PI * (i as f64 + 0.5) / N as f64).cos())
}

/// The powers 0.. of each node, a row each.
fn powers<const N: usize>(nodes: &[f64; N]) -> [[f64; N]; N] {
    nodes.map(|x| std::array::from_fn(|k| x.powi(k as i32)))
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch, f32x4};

    use super::*;
    use crate::kernel::KernelShape;

    fn integral(profile: &SectionProfile, distance2: f64, ends: [f64; 2]) -> f64 {
        let ends = ends.map(|t| t as f32);
        let value = dispatch!(Level::fallback(), simd => {
            let four = |x: f32| f32x4::splat(simd, x);
            profile.integral(simd, four(distance2 as f32), [four(ends[0]), four(ends[1])]).to_array()[0]
        });
        f64::from(value)
    }

    #[test]
    fn sections_keep_their_stated_bounds() {
        for (shape, bound) in
            [(KernelShape::Gaussian, 5e-5), (KernelShape::Polynomial, 5e-6), (KernelShape::BSpline, 2e-3)]
        {
            let (kernel, profile) = (Kernel::new(shape), SectionProfile::new(&Kernel::new(shape)));
            let mut worst = 0.0f64;
            for i in 0..60 {
                let distance = kernel.radius() * (f64::from(i) + 0.5) / 60.0;
                for j in -40..40 {
                    for length in [0.05, 0.5, 1.0, 5.0] {
                        let from = f64::from(j) * 0.05;
                        let exact = kernel.line_integral_from(distance * distance, from)
                            - kernel.line_integral_from(distance * distance, from + length);
                        let got = integral(&profile, distance * distance, [from, from + length]);
                        worst = worst.max((got - exact).abs());
                    }
                }
            }
            let relative = worst / kernel.line_integral(0.0);
            println!("{shape:?}: sections are off by {relative:.1e} of the peak");
            assert!(relative < bound, "{shape:?}: {relative:.1e} of the peak");
        }
    }

    #[test]
    fn sections_of_a_ray_add_up_to_its_line_integral() {
        for shape in KernelShape::ALL {
            let profile = SectionProfile::new(&Kernel::new(shape));
            let distance2 = 0.37;
            let whole = f64::from(
                profile.footprint.line_integral((distance2 / Kernel::new(shape).radius().powi(2)) as f32),
            );
            let parts: f64 = (-8..8)
                .map(|k| integral(&profile, distance2, [0.3 * f64::from(k), 0.3 * f64::from(k + 1)]))
                .sum();
            // The coefficients are of order 10, in f32.
            assert!((parts - whole).abs() < 1e-5, "{shape:?}: {parts} instead of {whole}");
        }
    }
}
