//! The samples inside ramps by eights along a row, so that a round of spreading takes eight at once.
//!
//! A block has the two surfaces of its samples and the weights of their neighbours; the disparities of all samples lie in a plane
//! with a rim of unknown ones, so that a neighbour's place needs no check.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use super::choice::Choice;

/// Samples of a block.
pub(super) const LANES: usize = 8;

/// A number of each sample of a block.
pub(super) type Lanes = [f32; LANES];

/// Difference of two colours, after a square root, that halves the weight of one for the other, squared: 0.05 is well above
/// the noise of photographs, and below most edges.
const HALVING2: f32 = 0.05 * 0.05;

/// Steps along x and y to the eight neighbours.
pub(super) const NEIGHBOURS: [[isize; 2]; 8] = [
    [-1, -1],
    [0, -1],
    [1, -1],
    [-1, 0],
    [1, 0],
    [-1, 1],
    [0, 1],
    [1, 1],
];

/// A number of each sample.
#[inline(always)]
fn lanes<T>(of: impl Fn(usize) -> T) -> [T; LANES] {
    std::array::from_fn(of)
}

/// Samples side by side of which some are inside ramps.
pub(super) struct Block {
    /// The place of its first sample in a plane.
    first: usize,
    is_inside: [bool; LANES],
    /// Disparity on the surface of less and on that of more.
    low: Lanes,
    high: Lanes,
    /// How far depth leans to the second one.
    lean: Lanes,
    /// Bit 0: the first surface turns back at once. Bit 1: the second one.
    turns: [u8; LANES],
    /// Weights of each of the neighbours, in 255ths.
    weights: [[u8; LANES]; 8],
}

/// A number for each sample, with a rim of NaN.
pub(super) struct Plane {
    values: Vec<f32>,
    stride: usize,
}

impl Plane {
    /// Of the values of `height` rows of `width` samples.
    pub(super) fn new(width: usize, height: usize, value: impl Fn(usize) -> f32 + Sync) -> Self {
        let stride = width.next_multiple_of(LANES) + 2;
        let mut values = vec![f32::NAN; stride * (height + 2)];
        let rows = values[stride..].par_chunks_mut(stride).take(height);
        rows.enumerate().for_each(|(y, row)| {
            for (x, to) in row[1..=width].iter_mut().enumerate() {
                *to = value(y * width + x);
            }
        });
        Self { values, stride }
    }

    /// The values from a place on.
    #[inline(always)]
    fn from(&self, first: usize) -> &[f32] {
        &self.values[first..first + LANES]
    }

    /// Those beside a block's, `k` of the neighbours away.
    #[inline(always)]
    fn beside(&self, first: usize, k: usize) -> &[f32] {
        let [dx, dy] = NEIGHBOURS[k];
        self.from(first.wrapping_add_signed(dy * self.stride as isize + dx))
    }

    /// Takes what was `found` for the samples of a block that are inside ramps.
    #[inline(always)]
    pub(super) fn take(&mut self, block: &Block, found: &Lanes) {
        let to = &mut self.values[block.first..block.first + LANES];
        for l in 0..LANES {
            to[l] = if block.is_inside[l] { found[l] } else { to[l] };
        }
    }

    /// Writes the values to rows of `width` samples.
    pub(super) fn give_back(&self, to: &mut [f32], width: usize) {
        let rows = self.values[self.stride..].par_chunks(self.stride);
        to.par_chunks_mut(width)
            .zip(rows)
            .for_each(|(to, row)| to.copy_from_slice(&row[1..=width]));
    }
}

impl Block {
    /// Disparity on the surface of less and on that of more.
    #[inline(always)]
    pub(super) fn sides<S: Simd>(&self, simd: S) -> [f32x8<S>; 2] {
        [&self.low, &self.high].map(|side| f32x8::from_slice(simd, side))
    }

    /// How far depth leans to the second one.
    #[inline(always)]
    pub(super) fn lean<S: Simd>(&self, simd: S) -> f32x8<S> {
        f32x8::from_slice(simd, &self.lean)
    }

    /// The samples' own disparities.
    #[inline(always)]
    pub(super) fn own<S: Simd>(&self, simd: S, plane: &Plane) -> f32x8<S> {
        f32x8::from_slice(simd, plane.from(self.first))
    }

    /// The weight of each of the two surfaces where it is flat, or turns back at once.
    #[inline(always)]
    pub(super) fn turn_weights<S: Simd>(&self, simd: S, [flat, turn]: [f32; 2]) -> [f32x8<S>; 2] {
        [1, 2].map(|bit| {
            let of = |turns: u8| if turns & bit != 0 { turn } else { flat };
            f32x8::from_slice(simd, &self.turns.map(of))
        })
    }

    /// The disparities of one of the neighbours, and their weights, 0 where nothing is known.
    #[inline(always)]
    pub(super) fn neighbour<S: Simd>(
        &self,
        simd: S,
        plane: &Plane,
        k: usize,
    ) -> (f32x8<S>, f32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let beside = f32x8::from_slice(simd, plane.beside(self.first, k));
        let weight = f32x8::from_slice(simd, &self.weights[k].map(f32::from));
        let is_known = beside.simd_eq(beside);
        (
            is_known.select(beside, zero),
            is_known.select(weight / 255.0, zero),
        )
    }
}

/// The blocks of rows of `width` samples with these `choices` and `colours`.
pub(super) fn blocks(
    level: Vectors,
    choices: &[Choice],
    colours: &[[f32; 3]],
    width: usize,
) -> Vec<Block> {
    let height = choices.len() / width;
    // As a display shows them.
    let shown = [0, 1, 2].map(|c| Plane::new(width, height, |at| colours[at][c].max(0.0).sqrt()));
    let of_row = |(y, row): (usize, &[Choice])| {
        let blocks = row.chunks(LANES).enumerate();
        let blocks = blocks.filter(|(_, choices)| choices.iter().any(Choice::is_inside));
        let first = (y + 1) * shown[0].stride + 1;
        let blocks = blocks.map(|(k, choices)| {
            let first = first + k * LANES;
            dispatch!(level, simd => block(simd, choices, first, &shown))
        });
        blocks.collect::<Vec<_>>()
    };
    let rows = choices.par_chunks(width).enumerate();
    rows.flat_map_iter(of_row).collect()
}

/// A block whose first sample has the place `first`.
#[simd]
fn block<S: Simd>(simd: S, choices: &[Choice], first: usize, shown: &[Plane; 3]) -> Block {
    let choice = lanes(|l| choices.get(l).copied().unwrap_or_default());
    Block {
        first,
        is_inside: lanes(|l| choice[l].is_inside()),
        low: lanes(|l| choice[l].sides[0]),
        high: lanes(|l| choice[l].sides[1]),
        lean: lanes(|l| choice[l].lean),
        turns: lanes(|l| u8::from(choice[l].turns[0]) + 2 * u8::from(choice[l].turns[1])),
        weights: std::array::from_fn(|k| weights(simd, shown, first, k)),
    }
}

/// The weights of one of the neighbours by the colours; 0 where there is none.
#[inline(always)]
fn weights<S: Simd>(simd: S, shown: &[Plane; 3], first: usize, k: usize) -> [u8; LANES] {
    let [r, g, b] = [0, 1, 2].map(|c| {
        let [own, beside] = [shown[c].from(first), shown[c].beside(first, k)];
        let apart = f32x8::from_slice(simd, own) - f32x8::from_slice(simd, beside);
        apart * apart
    });
    let ratio = (r + g + b) / HALVING2;
    let weight: Lanes = (f32x8::splat(simd, 255.0) / (ratio * ratio + 1.0) + 0.5).into();
    // A colour that is no number says nothing, nor does one outside: a cast makes 0 of it.
    weight.map(|weight| weight as u8)
}
