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

use crate::kernels::kernel::{Kernel, KernelShape};
use crate::kernels::table::{FootprintProfile, solve};

/// Powers of u^2. Eight leave 2e-5 of the peak for the Gaussian, and 3e-4 for the B-spline, whose third derivative jumps.
pub const ALONG: usize = 8;

/// Powers of u^2 that the polynomial kernel needs, whose share has four.
pub const ALONG_POLYNOMIAL: usize = 4;

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
    powers: Powers,
}

/// How many powers of u^2 a table has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Powers {
    /// [`ALONG_POLYNOMIAL`], the same for every distance.
    Few,
    /// [`ALONG`].
    All,
}

/// Integrals of a kernel along rays at one distance; made once for all sections of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Chord<F, const POWERS: usize> {
    /// The whole line integral, grid units.
    pub whole: F,
    /// 1 over half the length of the chord, in grid units.
    pub per_half: F,
    coefficients: [F; POWERS],
}

impl SectionProfile {
    /// Interpolates the share at Chebyshev nodes in u^2 and y. That of the polynomial kernel is known.
    pub fn new(kernel: &Kernel) -> Self {
        let (footprint, radius) = (FootprintProfile::new(kernel), kernel.radius() as f32);
        if kernel.shape() == KernelShape::Polynomial {
            // The integral of (1 - u^2)^3 over that from -1 to 1, which is 32/35: no distance in it.
            let mut coefficients = [[0.0; ACROSS]; ALONG];
            for (powers, c) in coefficients.iter_mut().zip([1.0, -1.0, 0.6, -1.0 / 7.0]) {
                powers[0] = c * 35.0 / 32.0;
            }
            return Self {
                footprint,
                coefficients,
                radius,
                powers: Powers::Few,
            };
        }
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
        let mut coefficients: [[f64; ACROSS]; ALONG] = std::array::from_fn(|j| {
            solve(powers(&across), std::array::from_fn(|i| at_nodes[i][j]))
        });
        // At the end of the chord the share is 1: P(1, y) is 1/2, whatever y.
        for i in 0..ACROSS {
            let sum: f64 = coefficients.iter().map(|c| c[i]).sum();
            coefficients[ALONG - 1][i] += if i == 0 { 0.5 } else { 0.0 } - sum;
        }
        let coefficients = coefficients.map(|c| c.map(|c| c as f32));
        Self {
            footprint,
            coefficients,
            radius,
            powers: Powers::All,
        }
    }

    /// How many powers a chord of this kernel needs.
    pub fn powers(&self) -> Powers {
        self.powers
    }

    /// The chords of rays at these squared distances (grid units squared) from the centre; `None` where none meets the
    /// kernel. `POWERS` is what [`SectionProfile::powers`] says.
    #[inline(always)]
    pub fn chord<S, F, const POWERS: usize>(
        &self,
        simd: S,
        distance2: F,
    ) -> Option<Chord<F, POWERS>>
    where
        S: Simd,
        F: SimdFloat<S, Element = f32>,
    {
        let constant = |x: f32| F::splat(simd, x);
        let y = (constant(1.0) - distance2 * constant(1.0 / (self.radius * self.radius)))
            .max(constant(0.0));
        if y.simd_gt(constant(0.0)).all_false() {
            return None;
        }
        let root = y.sqrt();
        let mut coefficients = [constant(0.0); POWERS];
        let whole = if POWERS == ALONG_POLYNOMIAL {
            for (c, powers) in coefficients.iter_mut().zip(&self.coefficients) {
                *c = constant(powers[0]);
            }
            constant(self.footprint.coefficients[2]) * (y * y)
        } else {
            for (c, powers) in coefficients.iter_mut().zip(&self.coefficients) {
                *c = polynomial(simd, y, powers);
            }
            polynomial(simd, y, &self.footprint.coefficients)
        };
        // On the rim the chord has no length; any number will do for its inverse, as the whole is 0.
        let per_half = constant(1.0) / (root * constant(self.radius)).max(constant(1e-6));
        Some(Chord {
            whole: y * root * whole,
            per_half,
            coefficients,
        })
    }
}

impl<F, const POWERS: usize> Chord<F, POWERS> {
    /// The share of the whole before these places on the chord (-1 to 1), less a half.
    #[inline(always)]
    pub fn share<S>(&self, place: F) -> F
    where
        S: Simd,
        F: SimdFloat<S, Element = f32>,
    {
        let square = place * place;
        let mut sum = self.coefficients[POWERS - 1];
        for &c in self.coefficients[..POWERS - 1].iter().rev() {
            sum = sum.mul_add(square, c);
        }
        place * sum
    }
}

/// A polynomial by its coefficients, constant term first.
#[inline(always)]
fn polynomial<S: Simd, F: SimdFloat<S, Element = f32>>(simd: S, x: F, coefficients: &[f32]) -> F {
    let (&last, rest) = match coefficients.split_last() {
        Some(split) => split,
        None => return F::splat(simd, 0.0),
    };
    rest.iter().rev().fold(F::splat(simd, last), |sum, &c| {
        sum.mul_add(x, F::splat(simd, c))
    })
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
    use fearless_simd::f32x4;

    use super::*;
    use crate::dispatch;
    use crate::simd::SimdLevel;

    /// A section between two places on a ray, in grid units from the point nearest to the centre.
    fn integral(profile: &SectionProfile, distance2: f64, ends: [f64; 2]) -> f64 {
        let value = match profile.powers() {
            Powers::Few => section::<ALONG_POLYNOMIAL>(profile, distance2, ends),
            Powers::All => section::<ALONG>(profile, distance2, ends),
        };
        f64::from(value)
    }

    fn section<const POWERS: usize>(
        profile: &SectionProfile,
        distance2: f64,
        ends: [f64; 2],
    ) -> f32 {
        dispatch!(SimdLevel::Baseline.resolve(), simd => {
            let four = |x: f64| f32x4::splat(simd, x as f32);
            let Some(chord) = profile.chord::<_, _, POWERS>(simd, four(distance2)) else { return 0.0 };
            let share = |t: f64| chord.share((four(t) * chord.per_half).max(four(-1.0)).min(four(1.0)));
            (chord.whole * (share(ends[1]) - share(ends[0]))).to_array()[0]
        })
    }

    #[test]
    fn sections_keep_their_stated_bounds() {
        for (shape, bound) in [
            (KernelShape::Gaussian, 5e-5),
            (KernelShape::Polynomial, 5e-6),
            (KernelShape::BSpline, 2e-3),
        ] {
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
                profile
                    .footprint
                    .line_integral((distance2 / Kernel::new(shape).radius().powi(2)) as f32),
            );
            let parts: f64 = (-8..8)
                .map(|k| {
                    integral(
                        &profile,
                        distance2,
                        [0.3 * f64::from(k), 0.3 * f64::from(k + 1)],
                    )
                })
                .sum();
            // The coefficients are of order 10, in f32.
            assert!(
                (parts - whole).abs() < 1e-5,
                "{shape:?}: {parts} instead of {whole}"
            );
        }
    }
}
