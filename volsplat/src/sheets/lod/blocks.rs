//! The blocks of a brick: means of the post-classified field over 2^3, 4^3 and 8^3 cells.
//!
//! Only bricks with a level that some view may use keep blocks. They take 584 bytes beside 4464 of the scalars: less
//! than a seventh.

use rayon::prelude::*;

use super::look::first_look;
use super::samples::{Samples, Stray};
use super::{LEVELS, STRIDES};
use crate::cells::CellBrick;
use crate::sheets::classify::TransferTable;

/// Where a level's blocks begin.
pub(crate) const STARTS: [usize; LEVELS] = [0, 64, 72];
const BLOCKS: usize = 73;

/// Greatest code of a block's channel.
const CODES: f32 = u16::MAX as f32;

/// What may be drawn in place of a brick, and how far each choice strays from it.
#[derive(Clone, Debug)]
pub(crate) struct Detail {
    /// Root mean square error of the optical depth where only every 2nd, 4th and 8th sheet is taken, in parts of the
    /// brick's mean.
    pub(crate) skip_spreads: [f32; STRIDES],
    /// Mean optical depth through the brick at its longest, for opacity units of one voxel.
    pub(crate) depth: f32,
    pub(crate) blocks: Option<Box<Blocks>>,
}

/// The blocks of one brick at all levels, and what they leave out.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// Red, green, blue and extinction, each in parts of its scale; level 1 first, x fastest.
    codes: [[u16; 4]; BLOCKS],
    pub(crate) scales: [f32; 4],
    pub(crate) strays: [Stray; LEVELS],
}

/// The detail of every brick; nothing where `useful` says that no such stray may ever be used. Without `useful` only bricks
/// of one colour have any.
pub(crate) fn details(
    bricks: &[CellBrick],
    table: &TransferTable,
    useful: Option<impl Fn(Stray) -> bool + Sync>,
) -> Vec<Option<Detail>> {
    let detail = |brick: &CellBrick| {
        if let Some(value) = table.constant_over(brick.range) {
            return Some(Detail::homogeneous(brick, value));
        }
        let useful = useful.as_ref()?;
        if !first_look(brick, table, useful) {
            return None;
        }
        let samples = Samples::new(brick, table);
        let skip_spreads = samples.skip_spreads(useful);
        let blocks = samples
            .stray(0, useful)
            .map(|stray| Box::new(Blocks::new(&samples, stray)));
        (skip_spreads.is_some() || blocks.is_some()).then(|| Detail {
            skip_spreads: skip_spreads.unwrap_or([f32::INFINITY; STRIDES]),
            depth: samples.depth(),
            blocks,
        })
    };
    bricks.par_iter().map(detail).collect()
}

impl Detail {
    /// That of a brick whose samples are all the same: nothing strays.
    fn homogeneous(brick: &CellBrick, value: [f32; 4]) -> Self {
        let [least, greatest] = brick.bounds.range();
        let longest = (0..3)
            .map(|axis| greatest[axis] - least[axis])
            .max()
            .unwrap_or(0);
        let blocks = Blocks::of_values(&[value; BLOCKS], [Stray::default(); LEVELS]);
        Self {
            skip_spreads: [0.0; STRIDES],
            depth: f32::from(longest) * value[3],
            blocks: Some(Box::new(blocks)),
        }
    }
}

impl Blocks {
    /// `finest` is the stray of the first level.
    fn new(samples: &Samples, finest: Stray) -> Self {
        let mut values = Vec::with_capacity(BLOCKS);
        for level in 0..LEVELS {
            values.extend(samples.means(level).into_iter().map(|[r, g, b, strength]| {
                let colour = |c: f32| if strength > 0.0 { c / strength } else { 0.0 };
                [colour(r), colour(g), colour(b), strength]
            }));
        }
        let never = Stray {
            spread: f32::INFINITY,
            drift: f32::INFINITY,
        };
        let stray = |level| {
            if level == 0 {
                finest
            } else {
                samples.stray(level, |_| true).unwrap_or(never)
            }
        };
        Self::of_values(&values, std::array::from_fn(stray))
    }

    /// From colour and strength of every block.
    fn of_values(values: &[[f32; 4]], strays: [Stray; LEVELS]) -> Self {
        let most = |channel: usize| {
            values
                .iter()
                .map(|v| v[channel])
                .fold(f32::MIN_POSITIVE, f32::max)
        };
        let colour = most(0).max(most(1)).max(most(2));
        let scales = [colour, colour, colour, most(3)].map(|most| most / CODES);
        let mut codes = [[0; 4]; BLOCKS];
        for (code, value) in codes.iter_mut().zip(values) {
            *code =
                std::array::from_fn(|channel| (value[channel] / scales[channel]).round() as u16);
        }
        Self {
            codes,
            scales,
            strays,
        }
    }

    /// Red, green, blue and extinction of a block, in parts of their scales.
    #[inline(always)]
    pub(crate) fn code(&self, place: usize) -> [u16; 4] {
        self.codes[place.min(BLOCKS - 1)]
    }
}
