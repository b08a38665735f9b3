//! A Gaussian over the texels of one level, and the sum that it gathers.
//!
//! Perspective is exact: with a texel's offset delta from the pixel's coordinates, and h the relative change of 1/w per
//! texel, the offset that the Jacobian at the pixel would give is delta / (1 - h delta), and the area that the texel
//! stands for changes by the third power of the same factor (Sherman and Morrison on the homography's rows).

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16};
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::lanes::IOTA;
use crate::mip::{Level, LevelTexels};
use crate::pixel::{Gathered, PixelOnTexture};
use crate::scene::Wrap;
use crate::taps::Kind;
use crate::wrapped::wrapped;

/// A covariance (xx, xy, yy), texels squared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Covariance(pub(crate) [f32; 3]);

/// A Gaussian over texels, cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelEllipse {
    /// The pixel in texels of the level, so that texel k's centre is at k.
    centre: [f32; 2],
    /// Inverse covariance (xx, xy, yy).
    inverse: [f32; 3],
    /// Standard deviation along v.
    extent_v: f32,
    /// Relative change of 1/w per texel along u and v.
    perspective: [f32; 2],
    /// Largest relative change of 1/w within the cut.
    change: f32,
    /// Where the Gaussian is cut, standard deviations.
    cut: f32,
    /// Taken off every weight, so that the Gaussian ends at 0 if that is its value at the cut.
    pub(crate) floor: f32,
    /// Fourth cumulants along u and v that the Gaussian lacks, over 24.
    pub(crate) kappa: [f32; 2],
}

impl Covariance {
    /// All variances times `factor`.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        let [xx, xy, yy] = self.0;
        Self([factor * xx, factor * xy, factor * yy])
    }

    pub(crate) fn determinant(self) -> f32 {
        self.0[0] * self.0[2] - self.0[1] * self.0[1]
    }

    /// The smaller and the larger one.
    pub(crate) fn eigenvalues(self) -> [f32; 2] {
        let [xx, xy, yy] = self.0;
        let half_trace = 0.5 * (xx + yy);
        let large = half_trace + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        [self.determinant() / large, large]
    }

    /// The covariance with its shorter axis lengthened to a variance of `least`.
    pub(crate) fn widened(self, least: f32) -> Self {
        let [small, large] = self.eigenvalues();
        if small >= least {
            return self;
        }
        let span = large - small;
        if !(span > 0.0 && large > least) {
            return Self([least, 0.0, least]);
        }
        let [xx, xy, yy] = self.0;
        // The projection on the shorter axis is (large I - covariance) / (large - small).
        let scale = (least - small) / span;
        Self([
            xx + scale * (large - xx),
            xy - scale * xy,
            yy + scale * (large - yy),
        ])
    }
}

impl TexelEllipse {
    /// The ellipse of a pixel on a lattice with `scale` texels per texel of the full texture; `None` if it is not
    /// finite.
    pub(crate) fn new(
        pixel: &PixelOnTexture,
        scale: [f32; 2],
        covariance: Covariance,
        cut: f32,
    ) -> Option<Self> {
        let [xx, xy, yy] = covariance.0;
        let determinant = covariance.determinant();
        let [ux, uy, vx, vy] = pixel.at.jacobian;
        // h = J^-T g, in texels of the lattice.
        let area = ux * vy - uy * vx;
        let [gx, gy] = pixel.over_w_slope;
        let hu = (vy * gx - vx * gy) / (area * scale[0]);
        let hv = (ux * gy - uy * gx) / (area * scale[1]);
        let (hu, hv) = if hu.is_finite() && hv.is_finite() {
            (hu, hv)
        } else {
            (0.0, 0.0)
        };
        let change = cut
            * (hu * hu * xx + 2.0 * hu * hv * xy + hv * hv * yy)
                .max(0.0)
                .sqrt();
        let ellipse = Self {
            centre: [pixel.at.u * scale[0] - 0.5, pixel.at.v * scale[1] - 0.5],
            inverse: [yy / determinant, -xy / determinant, xx / determinant],
            extent_v: yy.sqrt(),
            perspective: [hu, hv],
            change: change.min(0.9),
            cut,
            floor: 0.0,
            kappa: [0.0; 2],
        };
        let finite = ellipse
            .inverse
            .iter()
            .chain(&ellipse.centre)
            .all(|v| v.is_finite());
        (finite && determinant > 0.0).then_some(ellipse)
    }

    /// The mean of a level's texels, each as often as it counts; `None` if none does.
    pub(crate) fn gather_level(
        &self,
        level: &Level,
        wrap: [Wrap; 2],
        simd: Vectors,
    ) -> Option<Gathered> {
        dispatch!(simd, simd => gather_texels(simd, self, level, wrap))
    }

    #[inline(always)]
    fn gather<S: Simd, K: Kind>(
        &self,
        simd: S,
        level: &Level,
        wrap: [Wrap; 2],
    ) -> Option<Gathered> {
        let [ixx, ixy, iyy] = self.inverse;
        let reach = self.cut / (1.0 - self.change);
        let [first, last] = whole(self.centre[1], reach * self.extent_v);
        // Far more than any level that callers choose: it bounds the time of a degenerate footprint.
        if last.saturating_sub(first) > MAX_SIDE || reach * reach > ixx * (MAX_SIDE as f32).powi(2)
        {
            return None;
        }
        let (slant, per_ixx) = (ixy / ixx, 1.0 / ixx);
        let mut sums = Sums {
            rgba: [f32x4::splat(simd, 0.0); 4],
            weight: f32x8::splat(simd, 0.0),
        };
        let mut texels = 0;
        for row in first..=last {
            let dv = row as f32 - self.centre[1];
            // The row's chord of the ellipse: ixx du^2 + 2 ixy du dv + iyy dv^2 = reach^2.
            let middle = -slant * dv;
            let left = (reach * reach - (iyy - ixy * slant) * dv * dv).max(0.0) * per_ixx;
            let [start, end] = whole(self.centre[0] + middle, left.sqrt());
            if start > end {
                continue;
            }
            let of_row = level.row_start(row, wrap[1]);
            let of_row = &K::of(level)[of_row..of_row + level.size[0]];
            texels += (end - start + 1) as u32;
            let mut column = start;
            while column <= end {
                let left = (end - column + 1) as usize;
                let du = column as f32 - self.centre[0];
                if left > 8 {
                    let weights = self.weights16(simd, du, dv);
                    let (low, high) = weights.split();
                    sums.weight += low + high;
                    add_row(
                        simd,
                        of_row,
                        (column, wrap[0]),
                        &weights.as_slice()[..left.min(16)],
                        &mut sums.rgba,
                    );
                    column += 16;
                } else {
                    let weights = self.weights8(simd, du, dv);
                    sums.weight += weights;
                    add_row(
                        simd,
                        of_row,
                        (column, wrap[0]),
                        &weights.as_slice()[..left],
                        &mut sums.rgba,
                    );
                    column += 8;
                }
            }
        }
        let total = sums.weight.reduce_sum();
        let [a, b, c, d] = sums.rgba;
        let sum = (a + b) + (c + d);
        (total > 0.0).then(|| Gathered {
            rgba: Vec4::from_slice(sum.as_slice()) * (K::SCALE / total),
            texels,
        })
    }

    #[inline(always)]
    fn weights16<S: Simd>(&self, simd: S, du: f32, dv: f32) -> f32x16<S> {
        let columns = f32x16::from_slice(simd, &IOTA);
        self.weights(simd, columns + f32x16::splat(simd, du), dv)
    }

    #[inline(always)]
    fn weights8<S: Simd>(&self, simd: S, du: f32, dv: f32) -> f32x8<S> {
        let columns = f32x8::from_slice(simd, &IOTA[..8]);
        self.weights(simd, columns + f32x8::splat(simd, du), dv)
    }

    /// What texels at these offsets count; nothing beyond the ellipse.
    #[inline(always)]
    fn weights<S, F>(&self, simd: S, du: F, dv: f32) -> F
    where
        S: Simd,
        F: SimdFloat<S, Element = f32>,
        F::Bits: SimdInt<S, Element = u32>,
    {
        let splat = |x: f32| F::splat(simd, x);
        let nearness = splat(1.0 - self.perspective[1] * dv) - splat(self.perspective[0]) * du;
        let tau = splat(1.0) / nearness;
        let (du, dv) = (du * tau, tau * dv);
        let [ixx, ixy, iyy] = self.inverse;
        let (tu, tv) = (du * ixx + dv * ixy, du * ixy + dv * iyy);
        let q = tu * du + tv * dv;
        let (tu2, tv2) = (tu * tu, tv * tv);
        let of_u = tu2 * (tu2 - splat(6.0 * ixx)) + splat(3.0 * ixx * ixx);
        let of_v = tv2 * (tv2 - splat(6.0 * iyy)) + splat(3.0 * iyy * iyy);
        let series = splat(1.0) + of_u * self.kappa[0] + of_v * self.kappa[1];
        let weight = (exp2(simd, q * (-0.5 * std::f32::consts::LOG2_E)) * series
            - splat(self.floor))
            * (tau * tau * tau);
        // What is not before the eye has no place on the screen.
        let seen = q.simd_le(splat(self.cut * self.cut)) & nearness.simd_gt(splat(0.0));
        seen.select(weight, splat(0.0))
    }
}

/// Most rows, and most columns of a row.
const MAX_SIDE: i32 = 1 << 14;

/// The sums of one gathering: colours in four parts, so that no addition waits for the one before.
struct Sums<S: Simd> {
    rgba: [f32x4<S>; 4],
    weight: f32x8<S>,
}

/// Adds to `sums` the texels of a row from `column` on, times the weights, with what lies beyond the level's borders.
#[inline(always)]
fn add_row<S: Simd, K: Kind>(
    simd: S,
    texels: &[K],
    (column, wrap): (i32, Wrap),
    weights: &[f32],
    sums: &mut [f32x4<S>; 4],
) {
    let first = column as usize;
    if column >= 0 && first + weights.len() <= texels.len() {
        let texels = &texels[first..first + weights.len()];
        let mut k = 0;
        while k + 4 <= weights.len() {
            let (one, two) = (K::two(simd, texels, k), K::two(simd, texels, k + 2));
            sums[0] = one[0].mul_add(f32x4::splat(simd, weights[k]), sums[0]);
            sums[1] = one[1].mul_add(f32x4::splat(simd, weights[k + 1]), sums[1]);
            sums[2] = two[0].mul_add(f32x4::splat(simd, weights[k + 2]), sums[2]);
            sums[3] = two[1].mul_add(f32x4::splat(simd, weights[k + 3]), sums[3]);
            k += 4;
        }
        while k < weights.len() {
            let weight = f32x4::splat(simd, weights[k]);
            sums[0] = K::one(simd, texels, k).mul_add(weight, sums[0]);
            k += 1;
        }
        return;
    }
    for (at, &weight) in (column..).zip(weights) {
        let texel = K::one(simd, texels, wrapped(at, texels.len(), wrap));
        sums[0] = texel.mul_add(f32x4::splat(simd, weight), sums[0]);
    }
}

#[simd]
fn gather_texels<S: Simd>(
    simd: S,
    ellipse: &TexelEllipse,
    level: &Level,
    wrap: [Wrap; 2],
) -> Option<Gathered> {
    match level.texels {
        LevelTexels::Unorm16(_) => ellipse.gather::<S, [u16; 4]>(simd, level, wrap),
        LevelTexels::Srgb8(_) => ellipse.gather::<S, [u8; 4]>(simd, level, wrap),
        LevelTexels::Float(_) => ellipse.gather::<S, Vec4>(simd, level, wrap),
    }
}

/// Adding this rounds a float of magnitude under 2^22 to an integer and leaves that integer in the low bits.
const ROUND_MAGIC: f32 = 12_582_912.0;

/// 2^f - 1 = f (c0 + c1 f + ... + c4 f^4) for |f| <= 1/2, fitted for the smallest relative error: 4.3e-7.
const EXP2M1: [f32; 5] = [
    std::f32::consts::LN_2,
    0.240_223_5,
    0.055_505,
    0.009_666_245,
    0.001_333_353_3,
];

/// 2^x for x <= 0, as 2^-126 below that.
#[inline(always)]
fn exp2<S, F>(simd: S, x: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    let splat = |x: f32| F::splat(simd, x);
    let x = x.max(splat(-126.0));
    let rounded = x + splat(ROUND_MAGIC);
    let f = x - (rounded - splat(ROUND_MAGIC));
    let [c0, c1, c2, c3, c4] = EXP2M1;
    let mut poly = f * c4 + splat(c3);
    poly = poly * f + splat(c2);
    poly = poly * f + splat(c1);
    poly = poly * f + splat(c0);
    let scale = F::from_bits((rounded.to_bits() << 23) + F::Bits::splat(simd, 1f32.to_bits()));
    scale + scale * (f * poly)
}

/// The whole numbers within `half` of `middle`.
#[inline(always)]
fn whole(middle: f32, half: f32) -> [i32; 2] {
    [
        (middle - half).ceil() as i32,
        (middle + half).floor() as i32,
    ]
}
