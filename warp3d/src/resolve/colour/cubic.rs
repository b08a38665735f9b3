//! The cubic spline at a place: weights of four samples along each axis, and the sum over sixteen samples.
//!
//! A Gaussian of small variance needs no more samples than the spline itself: the spline plus half the variance times
//! its second derivatives, which are sums over the same sixteen.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16};

use crate::resolve::colour::Coefficients;

/// Weights of four samples around eight places, each some way past the second, and their first and second derivatives.
#[derive(Clone, Copy)]
pub(crate) struct EightWeights<S: Simd> {
    pub(crate) value: [f32x8<S>; 4],
    pub(crate) slope: [f32x8<S>; 4],
    bend: [f32x8<S>; 4],
}

impl<S: Simd> EightWeights<S> {
    /// The cubic B-spline at `t` from 0 to 1.
    #[inline(always)]
    pub(crate) fn new(simd: S, t: f32x8<S>) -> Self {
        let constant = |v: f32| f32x8::splat(simd, v);
        let (one, half, sixth) = (constant(1.0), constant(0.5), constant(1.0 / 6.0));
        let s = one - t;
        let (t2, s2) = (t * t, s * s);
        let (three_t, two) = (constant(3.0) * t, constant(2.0));
        // 3 t^3 - 6 t^2 + 4, and the same from the other side.
        let inner = |t: f32x8<S>, t2: f32x8<S>| {
            t2.mul_add(constant(3.0) * t - constant(6.0), constant(4.0))
        };
        let inner_slope = |t: f32x8<S>, t2: f32x8<S>| constant(1.5).mul_add(t2, -(two * t));
        Self {
            value: [
                sixth * s2 * s,
                sixth * inner(t, t2),
                sixth * inner(s, s2),
                sixth * t2 * t,
            ],
            slope: [
                -(half * s2),
                inner_slope(t, t2),
                -inner_slope(s, s2),
                half * t2,
            ],
            bend: [s, three_t - two, one - three_t, t],
        }
    }

    /// The weights of the `k`-th samples with Gaussians of these small variances, px^2.
    #[inline(always)]
    pub(crate) fn widened(&self, simd: S, k: usize, variance: f32x8<S>) -> f32x8<S> {
        let half = f32x8::splat(simd, 0.5) * variance;
        half.mul_add(self.bend[k], self.value[k])
    }
}

/// Weights of four samples around a place `t` past the second, and their first and second derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) value: [f32; 4],
    slope: [f32; 4],
    bend: [f32; 4],
}

impl Axis {
    /// The cubic B-spline at `t` from 0 to 1.
    #[inline(always)]
    pub(crate) fn new(t: f32) -> Self {
        let (t2, t3, s) = (t * t, t * t * t, 1.0 - t);
        let sixth = 1.0 / 6.0;
        Self {
            value: [
                sixth * s * s * s,
                sixth * (3.0 * t3 - 6.0 * t2 + 4.0),
                sixth * (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0),
                sixth * t3,
            ],
            slope: [
                -0.5 * s * s,
                1.5 * t2 - 2.0 * t,
                -1.5 * t2 + t + 0.5,
                0.5 * t2,
            ],
            bend: [s, 3.0 * t - 2.0, 1.0 - 3.0 * t, t],
        }
    }

    /// The weights with a Gaussian of this small variance, px^2.
    #[inline(always)]
    fn widened(&self, variance: f32) -> [f32; 4] {
        let half = 0.5 * variance;
        let mut out = self.value;
        for (out, bend) in out.iter_mut().zip(self.bend) {
            *out += half * bend;
        }
        out
    }
}

/// Weights of four samples along x, then of four along y.
pub(crate) type Taps = [f32; 8];

/// Eight weights of eight places, place by place: a transposed matrix.
#[inline(always)]
pub(crate) fn by_place<S: Simd>(mut rows: [f32x8<S>; 8]) -> [f32x8<S>; 8] {
    // Each round moves a bit of the number of the row to the number of the column.
    for _ in 0..3 {
        let before = rows;
        for i in 0..4 {
            (rows[2 * i], rows[2 * i + 1]) = before[i].interleave(before[i + 4]);
        }
    }
    rows
}

/// Weights of sixteen samples: a product of two axes, and a small part that is turned.
#[derive(Clone, Copy)]
pub(crate) struct Weights<'a> {
    pub(crate) taps: &'a Taps,
    /// Slopes along x, and slopes along y times the covariance, px^2.
    pub(crate) turned: Option<&'a Taps>,
}

impl Axis {
    /// The spline alone.
    #[inline(always)]
    pub(crate) fn plain(x: &Self, y: &Self) -> Taps {
        joined(x.value, y.value)
    }

    /// The spline with a Gaussian of the small variance (xx, xy, yy), px^2, and the part that is turned.
    #[inline(always)]
    pub(crate) fn bent(x: &Self, y: &Self, [xx, xy, yy]: [f32; 3]) -> [Taps; 2] {
        let mut slope = y.slope;
        for slope in &mut slope {
            *slope *= xy;
        }
        [joined(x.widened(xx), y.widened(yy)), joined(x.slope, slope)]
    }
}

#[inline(always)]
fn joined([a, b, c, d]: [f32; 4], [e, f, g, h]: [f32; 4]) -> Taps {
    [a, b, c, d, e, f, g, h]
}

impl Weights<'_> {
    /// The weighted sum of the sixteen samples whose first is `first`, in rows of `width`.
    #[inline(always)]
    pub(crate) fn sum<S: Simd>(
        &self,
        simd: S,
        samples: &Coefficients,
        first: usize,
        width: usize,
    ) -> f32x4<S> {
        across(self.columns(simd, samples, first, width))
    }

    /// The same by columns, four samples side by side; the fourth number of each says nothing.
    #[inline(always)]
    pub(crate) fn columns<S: Simd>(
        &self,
        simd: S,
        samples: &Coefficients,
        first: usize,
        width: usize,
    ) -> f32x16<S> {
        // Four samples a vector, and what follows them.
        let mut rows = [f32x16::splat(simd, 0.0); 4];
        for (j, row) in rows.iter_mut().enumerate() {
            *row = f32x16::from_slice(simd, samples.sixteen(first + j * width));
        }
        let mut sum = product(simd, &rows, self.taps);
        if let Some(turned) = self.turned {
            sum += product(simd, &rows, turned);
        }
        sum
    }
}

/// The sum of four samples.
#[inline(always)]
pub(crate) fn across<S: Simd>(columns: f32x16<S>) -> f32x4<S> {
    let (left, right) = columns.split();
    let (even, odd) = (left + right).split();
    even + odd
}

/// Four rows of four samples of three numbers times their weights, summed down the columns.
#[inline(always)]
fn product<S: Simd>(simd: S, rows: &[f32x16<S>; 4], taps: &Taps) -> f32x16<S> {
    let mut sum = rows[0] * f32x16::splat(simd, taps[4]);
    for j in 1..4 {
        sum = rows[j].mul_add(f32x16::splat(simd, taps[4 + j]), sum);
    }
    let pair = |i: usize| f32x4::splat(simd, taps[i]).combine(f32x4::splat(simd, taps[i + 1]));
    side_by_side(sum) * pair(0).combine(pair(2))
}

/// Four samples of three numbers each as four of four, of which the fourth says nothing.
#[inline(always)]
fn side_by_side<S: Simd>(packed: f32x16<S>) -> f32x16<S> {
    let (low, high) = packed.split();
    // r g b r, g b r g, b r g b.
    let ((first, second), (third, _)) = (low.split(), high.split());
    let left = first.combine(first.slide::<3>(second));
    let right = second.slide::<2>(third).combine(third.slide::<1>(third));
    left.combine(right)
}

// Magnified colours are held near the samples that they lie between.
//
// A cubic spline swings beside a hard edge of colour, by 13 % of the edge along one axis and more at corners. At the size of
// the samples nobody sees that; magnified it is a band along the edge. So a colour may leave the range of the four
// samples around it only where the second derivatives of two neighbours agree on a top or a bottom between them.
//
// Limits: places beside cuts are bounded elsewhere (`rim`); filters from a minification on are not.

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
