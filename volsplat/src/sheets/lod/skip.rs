//! Skipped sheets: the cells of a far brick, sampled in steps of 2, 4 or 8 sheets.
//!
//! A row of sub-pixels takes one sample for so many sheets, in the middle of those that lie inside the brick. Rows
//! begin their steps at different sheets, in turns, so that a pixel of enough rows samples as densely as ever.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::tile::TILE_PX;

use super::walk::Rays;
use crate::cells::CellBrick;
use crate::sheets::cell_sample::{CellBox, LANES, in_box_cells, interpolated};
use crate::sheets::frame::SheetSettings;

/// The sheet, of 0..stride, at which a row's steps begin (stride: 1, 2, 4 or 8).
///
/// As many neighbouring rows begin at every sheet once. The order keeps changing, so that a slanted surface does not
/// meet the same choice in row after row: for two sheets it is the sequence of Thue and Morse, which sums to 0 against
/// any pattern of eight rows that repeats after 1, 2 or 4.
#[inline(always)]
pub(super) fn first_sheet(row: usize, stride: u32) -> u32 {
    const CHOICES: [[u8; TILE_PX]; 4] = [
        [0; TILE_PX],
        [0, 1, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 1, 1, 0],
        [0, 2, 1, 3, 3, 1, 2, 0, 2, 0, 3, 1, 1, 3, 0, 2],
        [0, 4, 2, 6, 1, 5, 3, 7, 7, 3, 5, 1, 6, 2, 4, 0],
    ];
    u32::from(CHOICES[stride.trailing_zeros() as usize & 3][row % TILE_PX])
}

/// Colour and strength of the field at some planes of the rays.
#[inline(always)]
pub(super) fn read_cells<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    (brick, cells): (&CellBrick, &CellBox),
    rays: &Rays<S>,
    plane: f32x8<S>,
) -> [f32x8<S>; 4] {
    let at = std::array::from_fn(|axis| plane.mul_add(rays.step[axis], rays.start[axis]));
    // Every lane is read: what lies outside counts on from a cell inside, and has no planes.
    let located = in_box_cells(simd, cells, at);
    let scalar = interpolated(simd, &brick.scalars, &located.places, located.share);
    let places = settings.table.places(simd, scalar).to_array();
    let mut values = [[0.0f32; LANES]; 4];
    for lane in 0..LANES {
        let entry = settings.table.entry(places[lane]);
        for channel in 0..4 {
            values[channel][lane] = entry[channel];
        }
    }
    let load = |channel: usize| f32x8::from_slice(simd, &values[channel]);
    [load(0), load(1), load(2), load(3)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_rows_begin_at_every_sheet_once() {
        for stride in [1u32, 2, 4, 8] {
            for first in (0..TILE_PX).step_by(stride as usize) {
                let mut sheets: Vec<u32> = (first..first + stride as usize)
                    .map(|row| first_sheet(row, stride))
                    .collect();
                sheets.sort_unstable();
                let all: Vec<u32> = (0..stride).collect();
                assert_eq!(sheets, all, "rows from {first}, stride {stride}");
            }
        }
    }
}
