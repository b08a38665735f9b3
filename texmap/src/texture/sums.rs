//! Sums of texels that count differently: of one level, or of several at the same places.
//!
//! Takes rows of weights, gives sums of colours in four parts, so that no addition waits for the one before.

use fearless_simd::f32x4;
use fearless_simd::prelude::*;
use glam::Vec4;
use resample_mesh::scene::Wrap;

use crate::prepare::level::wrapped;
use crate::prepare::mip::{Level, LevelTexels};
use crate::prepare::usage::MAPS;
use crate::screen::lanes::LANES;
use crate::texture::taps::Kind;

/// A receiver of the weights of texels.
pub(crate) trait WeightSink<S: Simd> {
    /// The weights that follow are of this row.
    fn start_row(&mut self, row: i32);

    /// Adds the texels of the row from `column` on, times the weights; at most sixteen.
    fn add(&mut self, simd: S, column: i32, weights: &[f32]);
}

/// The sums of one level.
pub(crate) struct LevelSum<'a, S: Simd, K> {
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
pub(crate) struct LevelsSum<'a, S: Simd> {
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
    pub(crate) fn write_means(&mut self, simd: S, total: f32, means: &mut [Vec4]) {
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
