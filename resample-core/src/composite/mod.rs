//! Compositing of one screen tile: points and splats over one another, front to back.
//!
//! A splat adds optical depth tau F(d) to each pixel; the pixel's opacity for it is 1 - exp(-tau F), so the product
//! of the transmittances of overlapping splats is exp(-integral of the reconstructed extinction), exactly; only the
//! order of colours inside an overlap is approximated. Points do not cover a pixel, so those within a depth range (a
//! sheet) are summed first and composited once, with the extinction-weighted mean colour.
//!
//! In slices ([`composite_slices`]) everything of one slice is summed before it is composited, splats as well.
//!
//! The hot loop works on whole rows of a tile, structure of arrays, generic over the vector width.
//! Source: Yuan et al. 2003, section 4.1 (order, sheets of points); Westover 1990 for the linear opacity.

pub mod maps;

mod points;
mod slices;
mod splat;
mod state;
#[cfg(test)]
mod tests;

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use crate::dispatch;
use crate::sort::entry_index;
use crate::tile::{POINT_ROWS, Primitive};

use points::{close_sheet, gather_point};
pub use slices::composite_slices;
use splat::composite_splat;
pub use splat::opacity;
use state::ENTRIES_PER_CHECK;
pub use state::{
    DepthRule, IndexRule, Lost, OpacityMode, Sheet, SliceSums, TileCounts, TilePixels,
    TileSettings, TileWork,
};

/// From this many entries on, what rounding takes from each sum is kept. Each entry rounds by 2^-25 at most, so that a
/// shorter list is off by 1e-3 at most.
const MANY: usize = 1 << 15;

/// Composites the sorted `entries` of the tile whose first pixel is `corner_px` onto `pixels`.
pub fn composite_tile(
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [usize; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let corner_px = corner_px.map(|c| c as f32);
    if entries.len() > MANY {
        tile.lost = Lost::default();
        return dispatch!(settings.level, simd => composite_many(simd, settings, tile, corner_px, entries, chunks));
    }
    dispatch!(settings.level, simd => composite_few(simd, settings, tile, corner_px, entries, chunks))
}

#[simd]
fn composite_few<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    composite_entries::<S, false>(simd, settings, tile, corner_px, entries, chunks)
}

#[simd]
fn composite_many<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    composite_entries::<S, true>(simd, settings, tile, corner_px, entries, chunks)
}

#[inline(always)]
fn composite_entries<S: Simd, const KEPT: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let mut counts = TileCounts::default();
    let sheets_per_unit = 1.0 / settings.sheet_thickness;
    let mut gathered = [Primitive::default(); ENTRIES_PER_CHECK];
    for block in entries.chunks(ENTRIES_PER_CHECK) {
        // Depth order is random order in memory: fetched together, the misses of a block overlap.
        for (slot, &entry) in gathered.iter_mut().zip(block) {
            let index = entry_index(entry) as usize;
            *slot = chunks[index >> 16][index & 0xffff];
        }
        for primitive in &gathered[..block.len()] {
            if primitive.rows == POINT_ROWS {
                let number = (primitive.depth * sheets_per_unit) as u32;
                if number != tile.sheet.number {
                    close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
                    tile.sheet.number = number;
                }
                counts.pixels_touched +=
                    gather_point(settings, &mut tile.sheet, corner_px, primitive);
            } else {
                close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
                counts.pixels_touched +=
                    composite_splat::<S, false, KEPT>(simd, settings, tile, corner_px, primitive);
            }
        }
        counts.composited += block.len();
        if tile.pixels.is_opaque(simd, settings.min_transmittance) {
            break;
        }
    }
    close_sheet::<S, KEPT>(simd, settings, tile, &mut counts);
    counts
}
