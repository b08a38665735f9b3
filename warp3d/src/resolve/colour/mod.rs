//! The colour of a surface at a place in the reference, filtered as the new screen asks.
//!
//! Where the screen magnifies, the cubic spline through the reference's samples, which is sharp and adds no variance.
//! Where it minifies m times, the screen's Gaussian less what the reference's own pixels already blur:
//! sigma^2 (m^2 - 1) in reference px^2, along each axis of the footprint. Small variances are taken by the spline's own
//! second derivatives, larger ones by a five-point rule on cubic lookups, the largest by a Gaussian sum over the samples,
//! so that one family runs through all scales. Only samples on the same surface count.

mod cubic;
mod filters;
mod rim;

use std::ops::{Add, Mul, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, f64x8};
use fearless_simd_macros::simd;
use glam::{DMat2, DVec2};
use resample_core::point::PIXEL_SIGMA_PX;

pub(crate) use crate::resolve::colour::filters::{EightFilters, FILTERS, through};
pub(crate) use crate::surfaces::colours::{Coefficients, Colours, NOWHERE, eight_samples};
use cubic::across;
pub(crate) use cubic::held;
pub(crate) use cubic::{Axis, EightWeights, Taps, Weights, by_place};

use crate::project::narrow;
use crate::project::prepared::Prepared;
use crate::surfaces::patch::{Hit, Patch};
use crate::surfaces::surface::Surfaces;
use crate::view::keys::weights;

/// From this variance on (reference px^2) a Gaussian sum over the samples themselves is a filter: its ripple,
/// 2 exp(-2 pi^2 v), is 0.5 % and is normalised away.
const SAMPLED_VARIANCE: f64 = 0.3;

/// Up to this variance (reference px^2) a Gaussian is taken by second derivatives of the spline. At the highest frequency
/// of the samples that passes 85.2 % where the Gaussian passes 86.2 %.
pub(crate) const BENT_VARIANCE: f64 = 0.03;

/// Least variance that is filtered at all, reference px^2: 0.01 % at the highest frequency.
pub(crate) const LEAST_VARIANCE: f64 = 2e-5;

/// Largest sigma along an axis of a footprint, reference px: bounds the cost where a surface is seen nearly edge-on.
const MAX_SIGMA_PX: f64 = 32.0;

/// A lookup: where, on which plane, on which surfaces.
#[derive(Clone, Copy)]
pub(crate) struct Lookup<'a> {
    /// The samples' colours.
    pub(crate) colours: &'a Colours,
    /// Their surfaces.
    pub(crate) surfaces: &'a Surfaces,
    /// The plane on which samples count.
    pub(crate) patch: Patch,
}

/// Axes of the filter in the reference: unit directions with their variances, px^2, the larger first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    along: DVec2,
    across: DVec2,
    variance: [f64; 2],
}

impl Footprint {
    /// Of a footprint with this longer axis, a unit vector, and these minifications along and across it, squared.
    #[inline(always)]
    pub(crate) fn of_axes(along: DVec2, minification2: [f64; 2]) -> Self {
        let sigma2 = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX;
        let variance = |m2: f64| (sigma2 * (m2 - 1.0)).clamp(0.0, MAX_SIGMA_PX * MAX_SIGMA_PX);
        Self {
            along,
            across: along.perp(),
            variance: [variance(minification2[0]), variance(minification2[1])],
        }
    }

    /// The screen's Gaussian in the reference, less the reference's own.
    pub(crate) fn new(reference_from_screen: DMat2) -> Self {
        let Squares {
            form: [xx, xy, yy],
            middle,
            spread,
            ..
        } = Squares::new(reference_from_screen.to_cols_array(), 0.5, f64::sqrt);
        let (large, small) = (middle + spread, middle - spread);
        // The longer of the two equivalent forms of the eigenvector.
        let along = if xx >= yy {
            DVec2::new(large - yy, xy)
        } else {
            DVec2::new(xy, large - xx)
        };
        let along = along.try_normalize().unwrap_or(DVec2::X);
        Self::of_axes(along, [large, small])
    }
}

/// J J^T of a footprint with the Jacobian J: its eigenvalues are the minifications along its axes, squared, `middle` + `spread` and
/// `middle` - `spread`.
struct Squares<T> {
    /// Its entries xx, xy, yy.
    form: [T; 3],
    middle: T,
    /// Half of xx - yy.
    difference: T,
    spread: T,
}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Squares<T> {
    /// Of the columns of J.
    #[inline(always)]
    fn new([ax, ay, bx, by]: [T; 4], half: T, root: impl Fn(T) -> T) -> Self {
        let (xx, xy, yy) = (ax * ax + bx * bx, ax * ay + bx * by, ay * ay + by * by);
        let (middle, difference) = (half * (xx + yy), half * (xx - yy));
        Self {
            form: [xx, xy, yy],
            middle,
            difference,
            spread: root(difference * difference + xy * xy),
        }
    }
}

/// The form (xx, xy, yy) of the filter of a footprint, px^2, 0 where nothing is filtered; `None` from [`BENT_VARIANCE`] on.
/// As [`small_form`] has it for eight.
#[inline(always)]
fn small_filter(reference_from_screen: DMat2) -> Option<[f32; 3]> {
    let Squares {
        form: [xx, xy, yy],
        middle,
        spread,
        ..
    } = Squares::new(reference_from_screen.to_cols_array(), 0.5, f64::sqrt);
    // Magnified, there is nothing to filter.
    if xx + yy <= 1.0 {
        return Some([0.0; 3]);
    }
    let sigma2 = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX;
    let along = sigma2 * (middle + spread - 1.0);
    if along < LEAST_VARIANCE {
        return Some([0.0; 3]);
    }
    if !(along < BENT_VARIANCE) {
        return None;
    }
    let small = middle - spread;
    let across = (sigma2 * (small - 1.0)).max(0.0);
    let share = if spread > 0.5e-9 {
        0.5 * (along - across) / spread
    } else {
        0.0
    };
    let form = [
        across + share * (xx - small),
        share * xy,
        across + share * (yy - small),
    ];
    Some(form.map(|v| v as f32))
}

/// Of eight footprints, whose columns `map` holds: the longer axis, a unit vector, and the minifications along and across it,
/// squared. As [`Footprint::new`] has them.
#[inline(always)]
pub(crate) fn eight_axes<S: Simd>(simd: S, map: [f32x8<S>; 4]) -> [f32x8<S>; 4] {
    let constant = |v: f32| f32x8::splat(simd, v);
    let Squares {
        form: [_, xy, _],
        middle,
        difference,
        spread,
    } = Squares::new(map, constant(0.5), |v| v.sqrt());
    // The longer of the two equivalent forms of the eigenvector.
    let wide = difference.simd_ge(constant(0.0));
    let (x, y) = (
        wide.select(spread + difference, xy),
        wide.select(xy, spread - difference),
    );
    let length = (x * x + y * y).sqrt();
    let round = length.simd_le(constant(1e-6) * middle);
    let (x, y) = (
        round.select(constant(1.0), x / length),
        round.select(constant(0.0), y / length),
    );
    [x, y, middle + spread, middle - spread]
}

/// Variance along the longer axis of eight footprints, reference px^2, and the form (xx, xy, yy) of the filter: the positive
/// part of sigma^2 (J J^T - 1), 0 where nothing is filtered. `map` holds the columns of J.
#[inline(always)]
pub(crate) fn small_form<S: Simd>(simd: S, map: [f32x8<S>; 4]) -> (f32x8<S>, [f32x8<S>; 3]) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let (zero, one) = (constant(0.0), constant(1.0));
    let Squares {
        form: [xx, xy, yy],
        middle,
        spread,
        ..
    } = Squares::new(map, constant(0.5), |v| v.sqrt());
    let (large, small) = (middle + spread, middle - spread);
    let sigma2 = constant((PIXEL_SIGMA_PX * PIXEL_SIGMA_PX) as f32);
    let (along, across) = (
        (sigma2 * (large - one)).max(zero),
        (sigma2 * (small - one)).max(zero),
    );
    // The projection on the longer axis is (J J^T - small) / (large - small); without one, both are the same.
    let gap = large - small;
    let round = gap.simd_le(constant(1e-6));
    let share = round.select(zero, (along - across) / gap);
    let wanted = along.simd_ge(constant(LEAST_VARIANCE as f32));
    let form = [
        wanted.select(across + share * (xx - small), zero),
        wanted.select(share * xy, zero),
        wanted.select(across + share * (yy - small), zero),
    ];
    (along, form)
}

impl Lookup<'_> {
    /// The filtered colour at a hit.
    #[inline(always)]
    pub(crate) fn filtered<S: Simd>(&self, simd: S, hit: &Hit) -> [f32; 3] {
        let at = hit.pos_in_reference;
        match small_filter(hit.reference_from_screen) {
            Some(form) => {
                let resolution = hit.reference_from_screen.determinant().abs().sqrt();
                first_three(self.bent(simd, at, form, resolution as f32))
            }
            None => {
                let footprint = Footprint::new(hit.reference_from_screen);
                first_three(self.wide(simd, at, &footprint))
            }
        }
    }

    /// Variances from [`BENT_VARIANCE`] on. Not generated anew for each caller: it takes much code, and much time itself.
    #[simd]
    pub(crate) fn wide<S: Simd>(&self, simd: S, at: DVec2, footprint: &Footprint) -> f32x4<S> {
        let [large, small] = footprint.variance;
        if large < SAMPLED_VARIANCE {
            return self.five_points(simd, at, footprint);
        }
        let blend = (small / SAMPLED_VARIANCE).min(1.0) as f32;
        let mut sum = f32x4::splat(simd, 0.0);
        if blend < 1.0 {
            let line = self.line(simd, at, footprint.along, large);
            sum = line.mul_add(f32x4::splat(simd, 1.0 - blend), sum);
        }
        if blend > 0.0 {
            let ellipse = self.ellipse(simd, at, footprint);
            sum = ellipse.mul_add(f32x4::splat(simd, blend), sum);
        }
        sum
    }

    /// Variances below [`SAMPLED_VARIANCE`] along both axes: the Gauss rule of three points along each.
    #[inline(always)]
    fn five_points<S: Simd>(&self, simd: S, at: DVec2, footprint: &Footprint) -> f32x4<S> {
        let mut points = [at; 8];
        let mut weights = [0.0; 5];
        weights[0] = 1.0;
        let mut count = 1;
        for (direction, variance) in [footprint.along, footprint.across]
            .into_iter()
            .zip(footprint.variance)
        {
            if variance > LEAST_VARIANCE {
                let step = (3.0 * variance).sqrt() * direction;
                (points[count], points[count + 1]) = (at + step, at - step);
                (weights[count], weights[count + 1]) = (1.0 / 6.0, 1.0 / 6.0);
                weights[0] -= 1.0 / 3.0;
                count += 2;
            }
        }
        self.cubics(simd, &points, &weights[..count])
    }

    /// The weighted sum of the cubic reconstructions at the first of eight places.
    #[inline(always)]
    fn cubics<S: Simd>(&self, simd: S, points: &[DVec2; 8], weights: &[f32]) -> f32x4<S> {
        let width = self.surfaces.size[0];
        let (mut splines, mut bases) = ([[[0.0f32; 8]; 4]; 2], [[0.0f64; 8]; 2]);
        for axis in 0..2 {
            let mut at = [0.0; 8];
            for (at, point) in at.iter_mut().zip(points) {
                *at = point[axis];
            }
            let corner = f64x8::simd_from(simd, at) - f64x8::splat(simd, 0.5);
            let base = (corner + f64x8::splat(simd, 1e-6)).floor();
            let past = narrow(corner - base).max(f32x8::splat(simd, 0.0));
            base.store_slice(&mut bases[axis]);
            let spline = EightWeights::new(simd, past);
            for (value, to) in spline.value.iter().zip(&mut splines[axis]) {
                value.store_slice(to);
            }
        }
        // Places with no cut around are summed by columns, and the columns once.
        let (mut columns, mut sum) = (f32x16::splat(simd, 0.0), f32x4::splat(simd, 0.0));
        for (k, &weight) in weights.iter().enumerate() {
            let mut taps = [0.0; 8];
            for (i, tap) in taps.iter_mut().enumerate() {
                *tap = splines[i / 4][i % 4][k];
            }
            let base = DVec2::new(bases[0][k], bases[1][k]);
            match self.clear_at(base) {
                Some(index) => {
                    for value in &mut taps[4..] {
                        *value *= weight;
                    }
                    let weights = Weights {
                        taps: &taps,
                        turned: None,
                    };
                    let samples = &self.colours.coefficients;
                    columns += weights.columns(simd, samples, index - width - 1, width);
                }
                None => {
                    let value = self.cubic_at_rim(simd, base, &taps);
                    sum = value.mul_add(f32x4::splat(simd, weight), sum);
                }
            }
        }
        sum + across(columns)
    }

    /// The cubic reconstruction at a place.
    #[inline(always)]
    fn cubic<S: Simd>(&self, simd: S, at: DVec2) -> f32x4<S> {
        self.bent(simd, at, [0.0; 3], 1.0)
    }

    /// The cubic reconstruction with a Gaussian of the small variance `form` (xx, xy, yy), px^2, at a resolution.
    #[inline(always)]
    fn bent<S: Simd>(&self, simd: S, at: DVec2, form: [f32; 3], resolution: f32) -> f32x4<S> {
        let corner = at - 0.5;
        // A place that rounding has put just before a sample is at it: otherwise the row before the first is asked for.
        let base = (corner + 1e-6).floor();
        let along_x = Axis::new((corner.x - base.x).max(0.0) as f32);
        let along_y = Axis::new((corner.y - base.y).max(0.0) as f32);
        let bends = form != [0.0; 3];
        let [taps, turned] = if bends {
            Axis::bent(&along_x, &along_y, form)
        } else {
            [Axis::plain(&along_x, &along_y), [0.0; 8]]
        };
        let weights = Weights {
            taps: &taps,
            turned: bends.then_some(&turned),
        };
        let width = self.surfaces.size[0];
        match self.clear_at(base) {
            Some(index) => {
                let (samples, first) = (&self.colours.coefficients, index - width - 1);
                let colour = weights.sum(simd, samples, first, width);
                held(simd, colour, resolution, (samples, first, width))
            }
            None => self.cubic_at_rim(simd, base, &taps),
        }
    }

    /// Returns true if no cut is among the sixteen samples around the place behind the sample `index`, [`NOWHERE`] for one beside
    /// which there are not sixteen.
    #[inline(always)]
    pub(crate) fn is_clear(surfaces: &Surfaces, index: u32) -> bool {
        let clearance = surfaces.clearance.get(index as usize);
        clearance.is_some_and(|&clearance| clearance >= 3)
    }

    /// The sample at `base` if the sixteen around the place behind it exist, with no cut among them.
    #[inline(always)]
    fn clear_at(&self, base: DVec2) -> Option<usize> {
        let [width, height] = self.surfaces.size;
        let inside = base.x >= 1.0
            && base.y >= 1.0
            && base.x + 2.0 < width as f64
            && base.y + 2.0 < height as f64;
        let index = inside.then(|| base.y as usize * width + base.x as usize)?;
        (self.surfaces.clearance[index] >= 3).then_some(index)
    }

    /// Returns true if no cut is within `reach` samples.
    fn clear_around(&self, at: DVec2, reach: usize) -> bool {
        let [width, height] = self.surfaces.size;
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width as f64 && at.y < height as f64;
        inside
            && usize::from(self.surfaces.clearance[at.y as usize * width + at.x as usize])
                > reach + 1
    }

    /// Returns true if a sample lies on the patch's plane, as far from the patch as it is.
    #[inline]
    fn counts(&self, x: usize, y: usize, index: usize) -> bool {
        let offset = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.patch.place;
        let expected = self.patch.disparity + self.patch.slope.dot(offset);
        let found = f64::from(self.surfaces.disparity[index]);
        let allowed = f64::from(self.surfaces.tolerance) * (2.0 + offset.abs().max_element());
        (found - expected).abs() <= allowed * found.abs()
    }
}

/// The reference's picture at a place, across all surfaces: the cubic of Keys (1981), which needs no coefficients.
pub(crate) fn as_taken(prepared: &Prepared, pos_in_reference: DVec2) -> [f32; 3] {
    let corner = pos_in_reference - 0.5;
    let base = corner.floor();
    let (wx, wy) = (weights(corner.x - base.x), weights(corner.y - base.y));
    let size = prepared.surfaces.size.map(|n| n as i64);
    let mut sum = [0.0; 3];
    for (dy, wy) in (-1..).zip(wy) {
        for (dx, wx) in (-1..).zip(wx) {
            let x = (base.x as i64 + dx).clamp(0, size[0] - 1);
            let y = (base.y as i64 + dy).clamp(0, size[1] - 1);
            let sample = prepared.colours.taken.get((y * size[0] + x) as usize);
            sum = std::array::from_fn(|c| sum[c] + wx * wy * sample[c]);
        }
    }
    sum.map(|v| v.max(0.0))
}

/// The colour; a spline may overshoot below 0, where there is no light.
#[inline(always)]
fn first_three<S: Simd>(sum: f32x4<S>) -> [f32; 3] {
    [sum[0].max(0.0), sum[1].max(0.0), sum[2].max(0.0)]
}
