//! A Gaussian over the texels of one level, and the sum that it gathers.
//!
//! Perspective is exact: with a texel's offset delta from the pixel's coordinates, and h the relative change of 1/w per
//! texel, the offset that the Jacobian at the pixel would give is delta / (1 - h delta), and the area that the texel
//! stands for changes by the third power of the same factor (Sherman and Morrison on the homography's rows).

use glam::Vec4;

use crate::mip::{Level, wrapped};
use crate::points::{Gathered, PixelOnTexture};
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
        Self([xx + scale * (large - xx), xy - scale * xy, yy + scale * (large - yy)])
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
        let (hu, hv) = if hu.is_finite() && hv.is_finite() { (hu, hv) } else { (0.0, 0.0) };
        let change = cut * (hu * hu * xx + 2.0 * hu * hv * xy + hv * hv * yy).max(0.0).sqrt();
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
        let finite = ellipse.inverse.iter().chain(&ellipse.centre).all(|v| v.is_finite());
        (finite && determinant > 0.0).then_some(ellipse)
    }

    /// The mean of a level's texels, each as often as it counts; `None` if none does.
    pub(crate) fn gather_level(&self, level: &Level, wrap: [Wrap; 2]) -> Option<Gathered> {
        self.gather(|column, row| {
            level.texels[level.row_start(row, wrap[1]) + wrapped(column, level.size[0], wrap[0])]
        })
    }

    /// The mean of what `texel` gives by column and row.
    #[inline(always)]
    pub(crate) fn gather(&self, texel: impl Fn(i32, i32) -> Vec4) -> Option<Gathered> {
        let [ixx, ixy, iyy] = self.inverse;
        let reach = self.cut / (1.0 - self.change);
        let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
        let mut texels = 0;
        let [first, last] = whole(self.centre[1], reach * self.extent_v);
        for row in first..=last {
            let dv = row as f32 - self.centre[1];
            // The row's chord of the ellipse: ixx du^2 + 2 ixy du dv + iyy dv^2 = reach^2.
            let middle = -ixy * dv / ixx;
            let left = (reach * reach - (iyy - ixy * ixy / ixx) * dv * dv).max(0.0) / ixx;
            let [start, end] = whole(self.centre[0] + middle, left.sqrt());
            for column in start..=end {
                let weight = self.weight(column as f32 - self.centre[0], dv);
                sum += texel(column, row) * weight;
                weights += weight;
                texels += 1;
            }
        }
        (weights > 0.0).then(|| Gathered { rgba: sum / weights, texels })
    }

    /// What a texel at this offset counts.
    #[inline(always)]
    fn weight(&self, du: f32, dv: f32) -> f32 {
        let tau = 1.0 / (1.0 - self.perspective[0] * du - self.perspective[1] * dv);
        let (du, dv) = (du * tau, dv * tau);
        let [ixx, ixy, iyy] = self.inverse;
        let (tu, tv) = (ixx * du + ixy * dv, ixy * du + iyy * dv);
        let q = tu * du + tv * dv;
        if q > self.cut * self.cut {
            return 0.0;
        }
        let hermite = |t: f32, s: f32| t * t * (t * t - 6.0 * s) + 3.0 * s * s;
        let series = 1.0 + self.kappa[0] * hermite(tu, ixx) + self.kappa[1] * hermite(tv, iyy);
        ((-0.5 * q).exp() * series - self.floor) * tau * tau * tau
    }
}

/// The whole numbers within `half` of `middle`.
#[inline(always)]
fn whole(middle: f32, half: f32) -> [i32; 2] {
    [(middle - half).ceil() as i32, (middle + half).floor() as i32]
}
