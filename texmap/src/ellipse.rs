//! A Gaussian over the texels of one level, and the sum that it gathers.
//!
//! Perspective is exact: with a texel's offset delta from the pixel's coordinates, and h the relative change of 1/w per
//! texel, the offset that the Jacobian at the pixel would give is delta / (1 - h delta), and the area that the texel
//! stands for changes by the third power of the same factor (Sherman and Morrison on the homography's rows).

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::mip::{Level, wrapped};
use crate::pixel::{Gathered, PixelOnTexture};
use crate::scene::Wrap;

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
    fn gather(&self, level: &Level, wrap: [Wrap; 2]) -> Option<Gathered> {
        let [ixx, ixy, iyy] = self.inverse;
        let reach = self.cut / (1.0 - self.change);
        let (mut sum, mut total) = (Vec4::ZERO, 0.0);
        let mut texels = 0;
        let [first, last] = whole(self.centre[1], reach * self.extent_v);
        // Far more than any level that callers choose: it bounds the time of a degenerate footprint.
        if last.saturating_sub(first) > MAX_SIDE || reach * reach > ixx * (MAX_SIDE as f32).powi(2)
        {
            return None;
        }
        for row in first..=last {
            let dv = row as f32 - self.centre[1];
            // The row's chord of the ellipse: ixx du^2 + 2 ixy du dv + iyy dv^2 = reach^2.
            let middle = -ixy * dv / ixx;
            let left = (reach * reach - (iyy - ixy * ixy / ixx) * dv * dv).max(0.0) / ixx;
            let [start, end] = whole(self.centre[0] + middle, left.sqrt());
            let mut column = start;
            while column <= end {
                let count = ((end - column) as usize + 1).min(BATCH);
                let mut weights = [0.0f32; BATCH];
                for (k, weight) in weights.iter_mut().enumerate() {
                    *weight = self.weight((column + k as i32) as f32 - self.centre[0], dv);
                }
                add_row(level, wrap, (row, column), &weights[..count], &mut sum);
                total += weights[..count].iter().sum::<f32>();
                texels += count as u32;
                column += BATCH as i32;
            }
        }
        (total > 0.0).then(|| Gathered {
            rgba: sum / total,
            texels,
        })
    }

    /// What a texel at this offset counts.
    #[inline(always)]
    fn weight(&self, du: f32, dv: f32) -> f32 {
        let nearness = 1.0 - self.perspective[0] * du - self.perspective[1] * dv;
        let tau = 1.0 / nearness;
        let (du, dv) = (du * tau, dv * tau);
        let [ixx, ixy, iyy] = self.inverse;
        let (tu, tv) = (ixx * du + ixy * dv, ixy * du + iyy * dv);
        let q = tu * du + tv * dv;
        let hermite = |t: f32, s: f32| t * t * (t * t - 6.0 * s) + 3.0 * s * s;
        let series = 1.0 + self.kappa[0] * hermite(tu, ixx) + self.kappa[1] * hermite(tv, iyy);
        let weight =
            (exp2(q * (-0.5 * std::f32::consts::LOG2_E)) * series - self.floor) * tau * tau * tau;
        // What is not before the eye has no place on the screen.
        if q <= self.cut * self.cut && nearness > 0.0 {
            weight
        } else {
            0.0
        }
    }
}

/// Most rows, and most columns of a row.
const MAX_SIDE: i32 = 1 << 14;

/// Texels whose weights are computed together.
const BATCH: usize = 8;

/// Adds to `sum` the texels from `column` of `row` on, times the weights, with what lies beyond the level's borders.
#[inline(always)]
fn add_row(
    level: &Level,
    wrap: [Wrap; 2],
    (row, column): (i32, i32),
    weights: &[f32],
    sum: &mut Vec4,
) {
    let start = level.row_start(row, wrap[1]);
    let texels = &level.texels[start..start + level.size[0]];
    let inside = usize::try_from(column)
        .ok()
        .and_then(|first| texels.get(first..first + weights.len()));
    match inside {
        Some(texels) => {
            for (&weight, texel) in weights.iter().zip(texels) {
                *sum += *texel * weight;
            }
        }
        None => {
            for (&weight, column) in weights.iter().zip(column..) {
                *sum += texels[wrapped(column, level.size[0], wrap[0])] * weight;
            }
        }
    }
}

#[simd]
fn gather_texels<S: Simd>(
    _: S,
    ellipse: &TexelEllipse,
    level: &Level,
    wrap: [Wrap; 2],
) -> Option<Gathered> {
    ellipse.gather(level, wrap)
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

/// 2^x for x <= 0, as 2^-126 below that; no branch and no call, so that loops over it become vector code.
#[inline(always)]
fn exp2(x: f32) -> f32 {
    let x = x.max(-126.0);
    let rounded = x + ROUND_MAGIC;
    let f = x - (rounded - ROUND_MAGIC);
    let [c0, c1, c2, c3, c4] = EXP2M1;
    let power = f * (c0 + f * (c1 + f * (c2 + f * (c3 + f * c4))));
    let scale = f32::from_bits((rounded.to_bits() << 23).wrapping_add(1f32.to_bits()));
    scale + scale * power
}

/// The whole numbers within `half` of `middle`.
#[inline(always)]
fn whole(middle: f32, half: f32) -> [i32; 2] {
    [
        (middle - half).ceil() as i32,
        (middle + half).floor() as i32,
    ]
}
