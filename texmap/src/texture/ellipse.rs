//! A Gaussian over the texels of one level, and the sum that it gathers.
//!
//! Perspective is exact: with a texel's offset delta from the pixel's coordinates, and h the relative change of 1/w per
//! texel, the offset that the Jacobian at the pixel would give is delta / (1 - h delta), and the area that the texel
//! stands for changes by the third power of the same factor (Sherman and Morrison on the homography's rows).

use std::ops::AddAssign;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16};
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::simd::{Vectors, exp2};
use resample_mesh::scene::Wrap;

use crate::prepare::level::wrapped;
use crate::prepare::maps::MAPS;
use crate::prepare::mip::{Level, LevelTexels, Pyramid};
use crate::project::surface::UvAt;
use crate::screen::{IOTA, LANES};
use crate::texture::taps::Kind;

/// The pixel's variance, px^2.
pub(crate) const PIXEL_VARIANCE: f32 = (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX) as f32;

/// A pixel on a textured plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelOnTexture<'a> {
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) at: UvAt,
    /// Relative change of 1/w per px along x and y; 0 neglects perspective within the footprint.
    pub(crate) over_w_slope: [f32; 2],
}

/// Texels that were looked at, each counted for each pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Laid {
    pub(crate) points: u64,
    /// Magnified ones.
    pub(crate) splats: u64,
}

impl AddAssign for Laid {
    fn add_assign(&mut self, more: Self) {
        self.points += more.points;
        self.splats += more.splats;
    }
}

/// A gathered colour.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    pub(crate) rgba: Vec4,
    pub(crate) laid: Laid,
}

impl Gathered {
    /// Of so many texels as points.
    pub(crate) fn of_points(rgba: Vec4, texels: u32) -> Self {
        let (points, splats) = (u64::from(texels), 0);
        let laid = Laid { points, splats };
        Self { rgba, laid }
    }
}

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
        // Of an ellipse that is some thousand times longer than wide, rounding may make a hyperbola, whose weights grow without bound: what is left of a
        // difference is to be ten times what is rounded off. Rows and columns are whole numbers of 32 bits.
        let [ixx, ixy, iyy] = ellipse.inverse;
        let is_ellipse = determinant > 0.0 && ixx * iyy - ixy * ixy > 1e-6 * ixx * iyy;
        let is_near = ellipse.centre.iter().all(|at| at.abs() < 1e9);
        (finite && is_ellipse && is_near).then_some(ellipse)
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

    /// The means of levels of one size, and how many texels of each there are; `None` if none counts.
    pub(crate) fn gather_levels(
        &self,
        levels: &[&Level],
        wrap: [Wrap; 2],
        simd: Vectors,
        means: &mut [Vec4],
    ) -> Option<u32> {
        dispatch!(simd, simd => gather_together(simd, self, (levels, wrap), means))
    }

    #[inline(always)]
    fn gather<S: Simd, K: Kind>(
        &self,
        simd: S,
        level: &Level,
        wrap: [Wrap; 2],
    ) -> Option<Gathered> {
        let mut sums = LevelSum::<S, K>::new(simd, level, wrap);
        let (texels, total) = self.weigh(simd, &mut sums)?;
        let rgba = sums.mean(total);
        Some(Gathered::of_points(rgba, texels))
    }

    /// Adds every texel of the footprint to `sums`, with its weight. Returns the number of texels and their total weight.
    #[inline(always)]
    fn weigh<S: Simd>(&self, simd: S, sums: &mut impl WeightSink<S>) -> Option<(u32, f32)> {
        let [ixx, ixy, iyy] = self.inverse;
        let reach = self.cut / (1.0 - self.change);
        let [first, last] = whole(self.centre[1], reach * self.extent_v);
        // Far more than any level that callers choose: it bounds the time of a degenerate footprint.
        if last.saturating_sub(first) > MAX_SIDE || reach * reach > ixx * (MAX_SIDE as f32).powi(2)
        {
            return None;
        }
        let (slant, per_ixx) = (ixy / ixx, 1.0 / ixx);
        let mut total = f32x8::splat(simd, 0.0);
        let mut texels = 0;
        // Two short rows fill one vector.
        let mut held: Option<Chord> = None;
        for row in first..=last {
            let dv = row as f32 - self.centre[1];
            // The row's chord of the ellipse: ixx du^2 + 2 ixy du dv + iyy dv^2 = reach^2.
            let middle = -slant * dv;
            let left = (reach * reach - (iyy - ixy * slant) * dv * dv).max(0.0) * per_ixx;
            let [start, end] = whole(self.centre[0] + middle, left.sqrt());
            if start > end {
                continue;
            }
            let chord = Chord {
                row,
                start,
                len: (end - start + 1) as usize,
            };
            texels += chord.len as u32;
            if chord.len > 8 {
                self.weigh_short(simd, [held.take(), None], &mut total, sums);
                self.weigh_long(simd, &chord, &mut total, sums);
            } else if held.is_some() {
                self.weigh_short(simd, [held.take(), Some(chord)], &mut total, sums);
            } else {
                held = Some(chord);
            }
        }
        self.weigh_short(simd, [held, None], &mut total, sums);
        let total = total.reduce_sum();
        (total > 0.0).then_some((texels, total))
    }

    /// Adds up to two rows of at most eight texels each.
    #[inline(always)]
    fn weigh_short<S: Simd>(
        &self,
        simd: S,
        chords: [Option<Chord>; 2],
        total: &mut f32x8<S>,
        sums: &mut impl WeightSink<S>,
    ) {
        let [Some(one), two] = chords else { return };
        let other = two.unwrap_or(one);
        let columns = f32x8::from_slice(simd, &IOTA[..8]);
        let offset = |chord: &Chord| {
            let du = chord.start as f32 - self.centre[0];
            let dv = chord.row as f32 - self.centre[1];
            (columns + f32x8::splat(simd, du), f32x8::splat(simd, dv))
        };
        let ((du, dv), (other_du, other_dv)) = (offset(&one), offset(&other));
        let weights = self.weights(simd, du.combine(other_du), dv.combine(other_dv));
        let (low, high) = weights.split();
        *total += low;
        sums.start_row(one.row);
        sums.add(simd, one.start, &low.as_slice()[..one.len]);
        if let Some(two) = two {
            *total += high;
            sums.start_row(two.row);
            sums.add(simd, two.start, &high.as_slice()[..two.len]);
        }
    }

    /// Adds a row, sixteen texels at a time.
    #[inline(always)]
    fn weigh_long<S: Simd>(
        &self,
        simd: S,
        chord: &Chord,
        total: &mut f32x8<S>,
        sums: &mut impl WeightSink<S>,
    ) {
        sums.start_row(chord.row);
        let dv = f32x16::splat(simd, chord.row as f32 - self.centre[1]);
        let columns = f32x16::from_slice(simd, &IOTA);
        let mut done = 0;
        while done < chord.len {
            let column = chord.start + done as i32;
            let du = f32x16::splat(simd, column as f32 - self.centre[0]);
            let weights = self.weights(simd, columns + du, dv);
            let (low, high) = weights.split();
            *total += low + high;
            let len = (chord.len - done).min(16);
            sums.add(simd, column, &weights.as_slice()[..len]);
            done += 16;
        }
    }

    /// The weights of texels at these offsets; 0 beyond the ellipse.
    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, du: f32x16<S>, dv: f32x16<S>) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let nearness = splat(1.0) - dv * self.perspective[1] - du * self.perspective[0];
        let tau = splat(1.0) / nearness;
        let (du, dv) = (du * tau, dv * tau);
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

/// The texels of a row that lie within the cut.
#[derive(Clone, Copy)]
struct Chord {
    row: i32,
    /// The first column.
    start: i32,
    len: usize,
}

/// Most rows, and most columns of a row.
const MAX_SIDE: i32 = 1 << 14;

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

#[simd]
fn gather_together<S: Simd>(
    simd: S,
    ellipse: &TexelEllipse,
    (levels, wrap): (&[&Level], [Wrap; 2]),
    means: &mut [Vec4],
) -> Option<u32> {
    let mut sums = LevelsSum::new(simd, levels, wrap);
    let (texels, total) = ellipse.weigh(simd, &mut sums)?;
    sums.write_means(simd, total, means);
    Some(texels)
}

/// The whole numbers within `half` of `middle`.
#[inline(always)]
fn whole(middle: f32, half: f32) -> [i32; 2] {
    [
        (middle - half).ceil() as i32,
        (middle + half).floor() as i32,
    ]
}

// Sums of texels that count differently: of one level, or of several at the same places.
//
// Takes rows of weights, gives sums of colours in four parts, so that no addition waits for the one before.

/// A receiver of the weights of texels.
trait WeightSink<S: Simd> {
    /// The weights that follow are of this row.
    fn start_row(&mut self, row: i32);

    /// Adds the texels of the row from `column` on, times the weights; at most sixteen.
    fn add(&mut self, simd: S, column: i32, weights: &[f32]);
}

/// The sums of one level.
struct LevelSum<'a, S: Simd, K> {
    level: &'a Level,
    wrap: [Wrap; 2],
    of_row: &'a [K],
    rgba: [f32x4<S>; 4],
}

impl<'a, S: Simd, K: Kind> LevelSum<'a, S, K> {
    #[inline(always)]
    pub(crate) fn new(simd: S, level: &'a Level, wrap: [Wrap; 2]) -> Self {
        Self {
            level,
            wrap,
            of_row: &[],
            rgba: [f32x4::splat(simd, 0.0); 4],
        }
    }

    /// The mean, where the weights sum to `total`.
    #[inline(always)]
    pub(crate) fn mean(&self, total: f32) -> Vec4 {
        mean_of::<S, K>(self.rgba, total)
    }
}

impl<S: Simd, K: Kind> WeightSink<S> for LevelSum<'_, S, K> {
    #[inline(always)]
    fn start_row(&mut self, row: i32) {
        let of_row = self.level.row_start(row, self.wrap[1]);
        self.of_row = &K::of(self.level)[of_row..of_row + self.level.size[0]];
    }

    #[inline(always)]
    fn add(&mut self, simd: S, column: i32, weights: &[f32]) {
        add_row(
            simd,
            self.of_row,
            (column, self.wrap[0]),
            weights,
            &mut self.rgba,
        );
    }
}

/// The sums of levels of one size. Weights wait, so that levels are seldom changed.
struct LevelsSum<'a, S: Simd> {
    levels: &'a [&'a Level],
    wrap: [Wrap; 2],
    row: i32,
    chunks: [Chunk; BLOCK],
    waiting: usize,
    rgba: [[f32x4<S>; 4]; MOST_TOGETHER],
}

/// Most levels that are summed together: the base texture and the maps of light.
pub(crate) const MOST_TOGETHER: usize = 1 + MAPS;

/// Chunks that wait: few enough that they stay in the nearest cache.
const BLOCK: usize = 16;

/// Texels beside each other in a row, and their weights.
#[derive(Clone, Copy, Default)]
struct Chunk {
    row: i32,
    column: i32,
    count: usize,
    weights: [f32; LANES],
}

impl<'a, S: Simd> LevelsSum<'a, S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, levels: &'a [&'a Level], wrap: [Wrap; 2]) -> Self {
        Self {
            levels,
            wrap,
            row: 0,
            chunks: [Chunk::default(); BLOCK],
            waiting: 0,
            rgba: [[f32x4::splat(simd, 0.0); 4]; MOST_TOGETHER],
        }
    }

    /// Writes the mean of each level, where the weights sum to `total`.
    #[inline(always)]
    fn write_means(&mut self, simd: S, total: f32, means: &mut [Vec4]) {
        self.add_waiting(simd);
        for ((mean, level), rgba) in means.iter_mut().zip(self.levels).zip(self.rgba) {
            *mean = match level.texels {
                LevelTexels::Unorm16(_) => mean_of::<S, [u16; 4]>(rgba, total),
                LevelTexels::Srgb8(_) => mean_of::<S, [u8; 4]>(rgba, total),
                LevelTexels::Float(_) => mean_of::<S, Vec4>(rgba, total),
            };
        }
    }

    #[inline(always)]
    fn add_waiting(&mut self, simd: S) {
        let chunks = &self.chunks[..self.waiting];
        for (level, rgba) in self.levels.iter().zip(&mut self.rgba) {
            let level = (*level, self.wrap);
            match level.0.texels {
                LevelTexels::Unorm16(_) => add_chunks::<S, [u16; 4]>(simd, level, chunks, rgba),
                LevelTexels::Srgb8(_) => add_chunks::<S, [u8; 4]>(simd, level, chunks, rgba),
                LevelTexels::Float(_) => add_chunks::<S, Vec4>(simd, level, chunks, rgba),
            }
        }
        self.waiting = 0;
    }
}

impl<S: Simd> WeightSink<S> for LevelsSum<'_, S> {
    #[inline(always)]
    fn start_row(&mut self, row: i32) {
        self.row = row;
    }

    #[inline(always)]
    fn add(&mut self, simd: S, column: i32, weights: &[f32]) {
        let chunk = &mut self.chunks[self.waiting];
        (chunk.row, chunk.column, chunk.count) = (self.row, column, weights.len());
        chunk.weights[..weights.len()].copy_from_slice(weights);
        self.waiting += 1;
        if self.waiting == BLOCK {
            self.add_waiting(simd);
        }
    }
}

#[inline(always)]
fn add_chunks<S: Simd, K: Kind>(
    simd: S,
    (level, wrap): (&Level, [Wrap; 2]),
    chunks: &[Chunk],
    rgba: &mut [f32x4<S>; 4],
) {
    for chunk in chunks {
        let of_row = level.row_start(chunk.row, wrap[1]);
        let of_row = &K::of(level)[of_row..of_row + level.size[0]];
        let weights = &chunk.weights[..chunk.count];
        add_row(simd, of_row, (chunk.column, wrap[0]), weights, rgba);
    }
}

#[inline(always)]
fn mean_of<S: Simd, K: Kind>([a, b, c, d]: [f32x4<S>; 4], total: f32) -> Vec4 {
    let sum = (a + b) + (c + d);
    Vec4::from_slice(sum.as_slice()) * (K::SCALE / total)
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
