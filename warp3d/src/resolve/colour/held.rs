//! Magnified colours are held near the samples that they lie between.
//!
//! A cubic spline swings beside a hard edge of colour, by 13 % of the edge along one axis and more at corners. At the size of
//! the samples nobody sees that; magnified it is a band along the edge. So a colour may leave the range of the four
//! samples around it only where the second derivatives of two neighbours agree on a top or a bottom between them.
//!
//! Limits: places beside cuts are bounded elsewhere (`rim`); filters from a minification on are not.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16};

use super::Coefficients;
use super::cubic::side_by_side;

/// From the first of these resolutions on, reference px per screen px, colours are held near their samples, below the second one
/// wholly: magnified by a third, a swing of the spline is as wide as a pixel.
const HELD_FROM: f32 = 0.75;
const HELD_WHOLLY: f32 = 0.5;

/// How far a colour is held near its samples at a resolution: from 0 to 1.
#[inline(always)]
fn held_share(resolution: f32) -> f32 {
    // What is no number is not magnified.
    if resolution < HELD_FROM {
        ((HELD_FROM - resolution) / (HELD_FROM - HELD_WHOLLY)).min(1.0)
    } else {
        0.0
    }
}

/// `colour`, the spline's at a place, as the resolution there asks for it; `samples` are the first of the sixteen around and the
/// width of their rows.
#[inline(always)]
pub(crate) fn held<S: Simd>(
    simd: S,
    colour: f32x4<S>,
    resolution: f32,
    samples: (&Coefficients, usize, usize),
) -> f32x4<S> {
    let share = held_share(resolution);
    if share == 0.0 {
        return colour;
    }
    let bounded = bounded(simd, colour, samples);
    (bounded - colour).mul_add(f32x4::splat(simd, share), colour)
}

/// The range of a magnified colour beyond the four samples around its place: along each axis as far as the bends of both samples
/// agree on a top or a bottom, and no more than this part of the largest of the four. 0.02 is seen by nobody, and holds the
/// tops of patterns of eight samples and more.
const BEYOND: f32 = 0.02;

/// `sum`, the spline at a place among the sixteen samples whose first is `first`, moved towards the range of the four samples
/// around the place where it leaves it: a hard edge of colour makes a spline swing, which a magnified picture shows as
/// bands along the edge.
#[inline(always)]
fn bounded<S: Simd>(
    simd: S,
    sum: f32x4<S>,
    (samples, first, width): (&Coefficients, usize, usize),
) -> f32x4<S> {
    let row = |j: usize| f32x16::from_slice(simd, samples.sixteen(first + j * width));
    let rows = [row(0), row(1), row(2), row(3)];
    let (four, sixth) = (f32x16::splat(simd, 4.0), f32x16::splat(simd, 1.0 / 6.0));
    let value = |j: usize| sixth * rows[j + 1].mul_add(four, rows[j] + rows[j + 2]);
    let inner = [four_of(value(0)), four_of(value(1))];
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| inner[i / 2].value(simd, i % 2));
    let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    let held = sum.max(low).min(high);
    // The fourth number says nothing.
    if held.simd_eq(sum).to_bitmask() & 0b0111 == 0b0111 {
        return sum;
    }
    let bend = |j: usize| rows[j] - (rows[j + 1] + rows[j + 1]) + rows[j + 2];
    let down = [four_of(bend(0)), four_of(bend(1))];
    let along = inner.map(|row| [row.bend(0), row.bend(1)]);
    let across = [0, 1].map(|i| [down[0].value(simd, i), down[1].value(simd, i)]);
    let cap = f32x4::splat(simd, BEYOND) * high;
    let (zero, eighth) = (f32x4::splat(simd, 0.0), f32x4::splat(simd, 0.125));
    // A parabola whose bend is b rises by b / 8 between two samples.
    let tops = |[p, q]: [[f32x4<S>; 2]; 2]| {
        let top = |[a, b]: [f32x4<S>; 2]| (-a).min(-b);
        (top(p).max(top(q)) * eighth).min(cap).max(zero)
    };
    let bottoms = |[p, q]: [[f32x4<S>; 2]; 2]| {
        let bottom = |[a, b]: [f32x4<S>; 2]| a.min(b);
        (bottom(p).max(bottom(q)) * eighth).min(cap).max(zero)
    };
    let above = tops(along) + tops(across);
    let below = bottoms(along) + bottoms(across);
    sum.max(low - below).min(high + above)
}

/// Four samples side by side.
#[derive(Clone, Copy)]
struct Four<S: Simd>([f32x4<S>; 4]);

#[inline(always)]
fn four_of<S: Simd>(packed: f32x16<S>) -> Four<S> {
    let (left, right) = side_by_side(packed).split();
    let ((a, b), (c, d)) = (left.split(), right.split());
    Four([a, b, c, d])
}

impl<S: Simd> Four<S> {
    /// The spline of these coefficients at the second sample (0) or the third (1).
    #[inline(always)]
    fn value(&self, simd: S, i: usize) -> f32x4<S> {
        let inner = self.0[i + 1] * f32x4::splat(simd, 4.0);
        (self.0[i] + inner + self.0[i + 2]) * f32x4::splat(simd, 1.0 / 6.0)
    }

    /// Its second derivative there.
    #[inline(always)]
    fn bend(&self, i: usize) -> f32x4<S> {
        self.0[i] - (self.0[i + 1] + self.0[i + 1]) + self.0[i + 2]
    }
}
