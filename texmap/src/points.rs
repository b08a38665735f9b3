//! Minified texels as points: the texels of one surface around a pixel, gathered by the pixel's Gaussian.
//!
//! The picture is the pixel's Gaussian applied to the texture as its own kernel (a tent, say) reconstructs it. So a
//! texel at offset d from the pixel counts by Gaussian * kernel at d, times the area of the screen that it stands for.
//! That product is taken as a Gaussian whose covariance is the sum of the two (in texels: J J^T / 4 plus the
//! kernel's variance), corrected in fourth order for what a tent is not a Gaussian: an Edgeworth series. A coarser
//! level counts the same way, with the variance and the fourth cumulant of its own filter taken off.
//!
//! Perspective is exact: with a texel's offset delta from the pixel's coordinates, and h the relative change of 1/w per
//! texel, the offset that the Jacobian at the pixel would give is delta / (1 - h delta), and the area that the texel
//! stands for changes by the third power of the same factor (Sherman and Morrison on the homography's rows).
//!
//! Limits: a single plane; the Gaussian is cut at [`CUT`] standard deviations.

use resample_core::point::PIXEL_SIGMA_PX;

use crate::mip::{Level, Pyramid};
use crate::options::LevelChoice;
use crate::surface::UvAt;

/// Where the Gaussian is cut, standard deviations.
const CUT: f32 = 3.0;

/// A level is coarse enough only while the texels' Gaussian keeps this variance (texels of that level) along its
/// shorter axis: the lattice of texels then shows through by 2 exp(-2 pi^2 / 2) = 1e-4.
const LEAST_VARIANCE: f32 = 0.5;

/// The pixel's variance, px^2.
const PIXEL_VARIANCE: f32 = (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX) as f32;

/// What gathering needs to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointSettings {
    pub(crate) level: LevelChoice,
    pub(crate) max_texels: u32,
}

/// The texels around a pixel and what each counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointFootprint<'a> {
    level: &'a Level,
    pyramid: &'a Pyramid,
    /// The pixel in texels of the level, so that texel k's centre is at k.
    centre: [f32; 2],
    /// Inverse covariance (xx, xy, yy) and the half extents at one standard deviation.
    inverse: [f32; 3],
    extent: [f32; 2],
    /// Relative change of 1/w per texel along u and v.
    perspective: [f32; 2],
    /// Largest relative change of 1/w within the cut.
    change: f32,
    /// Fourth cumulants that the Gaussian lacks, over 24.
    kappa: [f32; 2],
}

/// A gathered colour.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    pub(crate) rgba: [f32; 4],
    pub(crate) texels: u32,
}

/// A covariance (xx, xy, yy), texels squared.
#[derive(Clone, Copy)]
struct Covariance([f32; 3]);

impl Covariance {
    fn determinant(self) -> f32 {
        self.0[0] * self.0[2] - self.0[1] * self.0[1]
    }

    fn eigenvalues(self) -> [f32; 2] {
        let [xx, xy, yy] = self.0;
        let half_trace = 0.5 * (xx + yy);
        let large = half_trace + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        [self.determinant() / large, large]
    }
}

/// Pixel and kernel covariance in one level, less what its filter has done already.
fn covariance(pyramid: &Pyramid, level: &Level, at: &UvAt) -> Covariance {
    let [su, sv] = level.scale;
    let [ux, uy, vx, vy] = at.jacobian;
    let kernel = pyramid.kernel()[0];
    Covariance([
        su * su * (PIXEL_VARIANCE * (ux * ux + uy * uy) + kernel) - level.variance[0],
        su * sv * PIXEL_VARIANCE * (ux * vx + uy * vy),
        sv * sv * (PIXEL_VARIANCE * (vx * vx + vy * vy) + kernel) - level.variance[1],
    ])
}

impl<'a> PointFootprint<'a> {
    /// `None` where the texture is magnified, or nearly: its texels are splats there.
    ///
    /// `over_w_slope` is the relative change of 1/w per px along x and y; zero makes the footprint affine.
    pub(crate) fn new(
        pyramid: &'a Pyramid,
        at: &UvAt,
        over_w_slope: [f32; 2],
        settings: &PointSettings,
    ) -> Option<Self> {
        let full = &pyramid.levels[0];
        let mut chosen = (full, covariance(pyramid, full, at));
        if !(chosen.1.eigenvalues()[0] >= LEAST_VARIANCE) {
            return None;
        }
        if settings.level == LevelChoice::Auto {
            chosen = coarsest(pyramid, at, settings.max_texels, chosen);
        }
        let (level, covariance) = chosen;
        let [xx, xy, yy] = widened(covariance).0;
        let determinant = xx * yy - xy * xy;
        let inverse = [yy / determinant, -xy / determinant, xx / determinant];
        let [su, sv] = level.scale;
        let [ux, uy, vx, vy] = at.jacobian;
        // h = J^-T g, in texels of the level.
        let area = ux * vy - uy * vx;
        let [gx, gy] = over_w_slope;
        let perspective = [(vy * gx - vx * gy) / (area * su), (ux * gy - uy * gx) / (area * sv)];
        let [hu, hv] = perspective;
        let change = CUT * (hu * hu * xx + 2.0 * hu * hv * xy + hv * hv * yy).max(0.0).sqrt();
        let fourth = |k: usize| (pyramid.kernel()[1] * level.scale[k].powi(4) - level.kappa[k]) / 24.0;
        let footprint = Self {
            level,
            pyramid,
            centre: [at.u * su - 0.5, at.v * sv - 0.5],
            inverse,
            extent: [xx.sqrt(), yy.sqrt()],
            perspective,
            change: change.min(0.9),
            kappa: [fourth(0), fourth(1)],
        };
        let finite = inverse.iter().chain(&footprint.centre).chain(&perspective).all(|v| v.is_finite());
        finite.then_some(footprint)
    }

    /// The mean of the texels, each as often as it counts.
    pub(crate) fn gather(&self) -> Gathered {
        let level = self.level;
        if level.size == [1, 1] {
            return Gathered { rgba: level.texels[0], texels: 1 };
        }
        let [ixx, ixy, iyy] = self.inverse;
        let reach = CUT / (1.0 - self.change);
        let rows = whole(self.centre[1], reach * self.extent[1]);
        let mut sum = [0.0f32; 5];
        let mut texels = 0;
        for row in rows[0]..=rows[1] {
            let dv = row as f32 - self.centre[1];
            // The row's chord of the ellipse: ixx du^2 + 2 ixy du dv + iyy dv^2 = reach^2.
            let middle = -ixy * dv / ixx;
            let left = (reach * reach - (iyy - ixy * ixy / ixx) * dv * dv).max(0.0) / ixx;
            let columns = whole(self.centre[0] + middle, left.sqrt());
            let start = level.row_start(row, self.pyramid.wrap[1]);
            for column in columns[0]..=columns[1] {
                let du = column as f32 - self.centre[0];
                let weight = self.weight(du, dv);
                let place = crate::mip::wrapped(column, level.size[0], self.pyramid.wrap[0]);
                let texel = &level.texels[start + place];
                for (s, c) in sum.iter_mut().zip(texel) {
                    *s += weight * c;
                }
                sum[4] += weight;
                texels += 1;
            }
        }
        let scale = 1.0 / sum[4];
        Gathered { rgba: [0, 1, 2, 3].map(|k| sum[k] * scale), texels }
    }

    /// What a texel at this offset counts.
    #[inline(always)]
    fn weight(&self, du: f32, dv: f32) -> f32 {
        let tau = 1.0 / (1.0 - self.perspective[0] * du - self.perspective[1] * dv);
        let (du, dv) = (du * tau, dv * tau);
        let [ixx, ixy, iyy] = self.inverse;
        let (tu, tv) = (ixx * du + ixy * dv, ixy * du + iyy * dv);
        let q = tu * du + tv * dv;
        if q > CUT * CUT {
            return 0.0;
        }
        let hermite = |t: f32, s: f32| t * t * (t * t - 6.0 * s) + 3.0 * s * s;
        let series = 1.0 + self.kappa[0] * hermite(tu, ixx) + self.kappa[1] * hermite(tv, iyy);
        (-0.5 * q).exp() * series * tau * tau * tau
    }
}

/// The whole numbers within `half` of `middle`.
#[inline(always)]
fn whole(middle: f32, half: f32) -> [i32; 2] {
    [(middle - half).ceil() as i32, (middle + half).floor() as i32]
}

/// The coarsest level whose texels still see the footprint as smooth, or a coarser one if that holds too many.
fn coarsest<'a>(
    pyramid: &'a Pyramid,
    at: &UvAt,
    max_texels: u32,
    full: (&'a Level, Covariance),
) -> (&'a Level, Covariance) {
    let mut chosen = full;
    for level in &pyramid.levels[1..] {
        let next = covariance(pyramid, level, at);
        let texels = std::f32::consts::PI * CUT * CUT * chosen.1.determinant().max(0.0).sqrt();
        if !(next.eigenvalues()[0] >= LEAST_VARIANCE || texels > max_texels as f32) {
            break;
        }
        chosen = (level, widened(next));
    }
    chosen
}

/// The covariance with its shorter axis lengthened to what the lattice of texels can carry.
fn widened(covariance: Covariance) -> Covariance {
    let [small, large] = covariance.eigenvalues();
    if small >= LEAST_VARIANCE {
        return covariance;
    }
    let [xx, xy, yy] = covariance.0;
    let add = LEAST_VARIANCE - small;
    let span = large - small;
    if !(span > 0.0) {
        return Covariance([LEAST_VARIANCE, 0.0, LEAST_VARIANCE]);
    }
    // The projection on the shorter axis is (large I - covariance) / (large - small).
    let scale = add / span;
    let out = [xx + scale * (large - xx), xy - scale * xy, yy + scale * (large - yy)];
    Covariance(out)
}
