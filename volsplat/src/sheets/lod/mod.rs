//! Level of detail: bricks of cells whose blocks of 2^3, 4^3 or 8^3 cells are drawn as one homogeneous sample each.
//!
//! A brick that is seen at less than 0.3 pixels a voxel may be drawn from blocks (`blocks`): the mean extinction and
//! the extinction-weighted mean colour of the post-classified field over each block. A ray then takes steps 2^L times
//! as long ([`walk`]); a level whose predicted change is too large for `--lod-error` is not used (`choose`). Bricks that nothing may replace are drawn as ever, from the same samples on the same planes, and
//! merged bricks count the planes that they stand for, so that a homogeneous brick is the same at every level.
//!
//! # The bound
//!
//! Let a ray meet bricks i = 1, 2, ... front to back, T_i the transmittance in front of brick i, a_i its opacity, and
//! D_i the error of the optical depth that a brick's replacement adds to this ray; the same is said of each colour
//! channel, with extinction times colour in the place of extinction. The change of the ray is at most
//! sum_i T_i |D_i| (to first order, with colours from 0 to 1). If every brick has |D_i| <= e a_i, the sum is at most
//! e sum_i T_i a_i <= e: it telescopes, however many bricks there are. That is rigorous, and too timid: the
//! noise of a scanner alone makes |D_i| a tenth of a_i, and `--lod-error` is a five-hundredth.
//!
//! A pixel is the mean over many rays, and blocks keep their means. So for a brick three numbers are kept per level,
//! each the worst over the three axes and over extinction and the three colours:
//! 1. the spread: the root mean square of D over the columns of the brick. To first order D averages out over the
//!    pixel; what is left is a share that grows with the block's size on the screen, because blocks stick out of
//!    the pixel and because what lies in front varies across them: spread * SHARE * (pixels a block).
//! 2. the curvature of exp(-x): half the spread squared, for deviations that add up along the ray through all bricks
//!    (spread <= e a_i for every i telescopes as above), which is the worst case.
//! 3. the drift: the mean over columns of D up to some depth within the brick, at its worst depth. It says how far
//!    matter has been moved along the ray, in every ray alike; by parts, it changes the pixel by at most drift * a_i.
//!
//! # Skipped sheets
//!
//! Where blocks would change too much, the cells themselves are sampled on fewer sheets ([`skip`]): of a pixel's rows of
//! sub-pixels each takes one sheet in 2, 4 or 8, in turns. No ray is blurred across, and a pixel sees every sheet:
//! forced on everything, one sheet in two changes pixels five to twenty times less than blocks of two cells. The
//! spread is measured in the same way, over columns and over where the sheets begin.
//!
//! A choice is taken where SAFETY times the sum is at most `--lod-error` times the brick's opacity. That is a model
//! and not a proof: rays are taken as samples of their pixel, and the shares are measured. Its constants are
//! calibrated (`choose`), and `tests/tests/lod.rs` holds the change of every pixel below `--lod-error` in views and
//! volumes that they were not tuned on.

pub(crate) mod blocks;
pub(crate) mod choose;
mod count;
mod look;
pub(crate) mod merged;
mod samples;
pub(crate) mod skip;
pub(crate) mod walk;

pub(crate) use self::blocks::{Blocks, Detail, details};
pub(crate) use self::choose::LevelChoice;
pub(crate) use self::count::count_levels;

/// Coarser levels than the cells: blocks of 2, 4 and 8 cells a side.
pub(crate) const LEVELS: usize = 3;

/// Strides over the sheets beyond 1: 2, 4 and 8.
pub(crate) const STRIDES: usize = 3;

/// What a brick is drawn from in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Choice<'a> {
    /// Its cells, on every sheet.
    EverySheet,
    /// Its cells, where a row of sub-pixels takes one in 2, 4 or 8 sheets.
    Skipping(Stride),
    /// Its blocks.
    Merged(Merged<'a>),
}

/// One in so many sheets: a power of two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stride(pub(crate) u32);

/// A brick's level in one frame: blocks of 2^level cells, and the blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merged<'a> {
    /// 1 to [`LEVELS`].
    pub(crate) level: usize,
    pub(crate) blocks: &'a Blocks,
}

impl Choice<'_> {
    /// 0 for cells, else the level of the blocks.
    pub(crate) fn level(&self) -> usize {
        match self {
            Self::EverySheet | Self::Skipping(_) => 0,
            Self::Merged(merged) => merged.level,
        }
    }

    /// Binary logarithm of the stride over sheets.
    pub(crate) fn log2_stride(&self) -> usize {
        match self {
            Self::EverySheet | Self::Merged(_) => 0,
            Self::Skipping(Stride(stride)) => stride.trailing_zeros() as usize,
        }
    }
}
