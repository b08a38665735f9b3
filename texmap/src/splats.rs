//! Splats: the texels around each sub-pixel that some pixel is made from, summed there; and sub-pixels to pixels.
//!
//! Rows of sub-pixels are laid together, in vector code (`rows`). Where the place of an edge is known, sub-pixels are
//! corrected before anything translucent is laid over them; translucent layers are rows too, one for each rank in depth.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;

use crate::filter::PixelFilter;
use crate::row::RowWork;
use crate::rows::{RowIds, lay_ids};
use crate::span::{NONE, SPAN_PX, TILE_PX};
use crate::tile::{Tile, TileImage, TileWork};
use crate::visibility::Layer;

/// Pixels that are filtered together: four of four channels fill one 512-bit vector.
const GROUP_PX: usize = 4;

/// Which groups of pixels of a tile are made from sub-pixels.
type Groups = [[bool; TILE_PX / GROUP_PX]; TILE_PX];

/// The pixels of a tile.
type Pixels = [[Vec4; TILE_PX]; TILE_PX];

impl Tile<'_> {
    /// Colours of the sub-pixels that some pixel wants: splats, and translucent surfaces over those behind.
    pub(crate) fn lay_splats(&self, work: &mut TileWork, image: &mut TileImage) {
        if work.from_subpixels.is_empty() {
            return;
        }
        work.colours.resize(work.visibility.ids.len(), [0.0; 4]);
        image.splats += 4 * dispatch!(self.frame.simd, simd => lay_rows(simd, self, work));
        let per_pixel = self.frame.filter.per_pixel;
        correct_edges(work, per_pixel);
        if !work.visibility.layers.is_empty() {
            image.splats += 4 * dispatch!(self.frame.simd, simd => lay_layers(simd, self, work));
        }
    }

    /// Filters sub-pixels down to the pixels that are made from them.
    pub(crate) fn resolve(&self, work: &TileWork, image: &mut TileImage) {
        let place = |pixel: u16| [usize::from(pixel) % TILE_PX, usize::from(pixel) / TILE_PX];
        let mut wanted = Groups::default();
        for [x, y] in work.from_subpixels.iter().copied().map(place) {
            wanted[y][x / GROUP_PX] = true;
        }
        let mut pixels = [[Vec4::ZERO; TILE_PX]; TILE_PX];
        let filter = self.frame.filter;
        dispatch!(self.frame.simd, simd => filter_groups(simd, filter, &work.colours, &wanted, &mut pixels));
        for &pixel in &work.from_subpixels {
            let [x, y] = place(pixel);
            // The corrections at edges are exact only in their sum, and may leave a remainder of either sign.
            let sum = pixels[y][x].max(Vec4::ZERO);
            image.rgba[usize::from(pixel)] = sum.truncate().extend(sum.w.min(1.0)).to_array();
        }
    }
}

/// Lays the splats of every wanted sub-pixel; how many sub-pixels there were.
#[simd]
fn lay_rows<S: Simd>(simd: S, tile: &Tile, work: &mut TileWork) -> u64 {
    let filter = tile.frame.filter;
    let TileWork {
        visibility,
        surfaces,
        colours,
        wanted,
        ..
    } = work;
    let mut row_work = RowWork::default();
    let mut count = 0;
    for row in 0..SPAN_PX * filter.per_pixel {
        let wanted = &wanted[row / filter.per_pixel * SPAN_PX..][..SPAN_PX];
        let ids = &visibility.ids[row * SPAN_PX..][..SPAN_PX];
        let shown = RowIds { row, ids, wanted };
        count += lay_ids(simd, tile, surfaces, &shown, &mut row_work);
        let colours = &mut colours[row * SPAN_PX..][..SPAN_PX];
        for (out, colour) in colours.iter_mut().zip(&row_work.colours.base) {
            *out = colour.to_array();
        }
    }
    count
}

/// Lays the translucent layers of every wanted sub-pixel over what lies behind, the farthest first; how many there were.
#[simd]
fn lay_layers<S: Simd>(simd: S, tile: &Tile, work: &mut TileWork) -> u64 {
    let filter = tile.frame.filter;
    let TileWork {
        visibility,
        surfaces,
        colours,
        wanted,
        ..
    } = work;
    let mut row_work = RowWork::default();
    let mut count = 0;
    let mut layers: &[Layer] = &visibility.layers;
    for row in 0..SPAN_PX * filter.per_pixel {
        let wanted = &wanted[row / filter.per_pixel * SPAN_PX..][..SPAN_PX];
        // Where the layers of each column begin; they are sorted.
        let mut starts = [0; SPAN_PX + 1];
        let mut most = 0;
        for column in 0..SPAN_PX {
            let subpixel = (row * SPAN_PX + column) as u32;
            let mut end = starts[column];
            while layers
                .get(end)
                .is_some_and(|layer| layer.subpixel == subpixel)
            {
                end += 1;
            }
            most = most.max(end - starts[column]);
            starts[column + 1] = end;
        }
        for rank in 0..most {
            let mut ids = [NONE; SPAN_PX];
            for column in 0..SPAN_PX {
                if starts[column] + rank < starts[column + 1] {
                    ids[column] = layers[starts[column] + rank].id;
                }
            }
            let shown = RowIds {
                row,
                ids: &ids,
                wanted,
            };
            count += lay_ids(simd, tile, surfaces, &shown, &mut row_work);
            for column in 0..SPAN_PX {
                if ids[column] != NONE && wanted[column] {
                    let behind = &mut colours[row * SPAN_PX + column];
                    let front = row_work.colours.base[column];
                    *behind = (front + (1.0 - front.w) * Vec4::from(*behind)).to_array();
                }
            }
        }
        layers = &layers[starts[SPAN_PX]..];
    }
    count
}

/// Filters the sub-pixels of the wanted groups of pixels.
#[simd]
fn filter_groups<S: Simd>(
    _: S,
    filter: &PixelFilter,
    colours: &[[f32; 4]],
    wanted: &Groups,
    pixels: &mut Pixels,
) {
    const NUMBERS: usize = 4 * GROUP_PX;
    for y in 0..TILE_PX {
        for group in (0..TILE_PX / GROUP_PX).filter(|&group| wanted[y][group]) {
            let first = y * filter.per_pixel * SPAN_PX + group * GROUP_PX;
            let mut sums = [0.0; NUMBERS];
            for window in &filter.rows {
                let colours =
                    colours[first + window.row * SPAN_PX + window.column..].as_flattened();
                for (k, weight) in window.weights.iter().enumerate() {
                    for (sum, colour) in sums.iter_mut().zip(&colours[4 * k..4 * k + NUMBERS]) {
                        *sum += colour * weight;
                    }
                }
            }
            for (pixel, sum) in pixels[y][group * GROUP_PX..]
                .iter_mut()
                .zip(sums.chunks_exact(4))
            {
                *pixel = Vec4::from_slice(sum);
            }
        }
    }
}

/// Adds to the colours of neighbouring sub-pixels what the place of the edge between them makes of the jump.
fn correct_edges(work: &mut TileWork, per_pixel: usize) {
    let TileWork {
        edges,
        colours,
        wanted,
        jumps,
        ..
    } = work;
    let wanted =
        |at: u32| wanted[at as usize / SPAN_PX / per_pixel * SPAN_PX + at as usize % SPAN_PX];
    jumps.clear();
    jumps.extend(
        edges
            .all
            .iter()
            .map(|edge| match edge.between.map(&wanted) {
                [true, true] => {
                    let [p, q] = edge.between.map(|at| Vec4::from(colours[at as usize]));
                    p - q
                }
                _ => Vec4::ZERO,
            }),
    );
    for (edge, jump) in edges.all.iter().zip(jumps) {
        for (at, share) in edge.between.into_iter().zip(edge.shares) {
            let colour = &mut colours[at as usize];
            *colour = (Vec4::from(*colour) + *jump * share).to_array();
        }
    }
}
