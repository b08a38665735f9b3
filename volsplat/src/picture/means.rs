//! The means of pixels from their sub-pixels and their neighbours'.
//!
//! The mean of a pixel's sub-pixels is the midpoint rule. The first term of its error, by the Euler-Maclaurin formula, is
//! h^2/24 times the change of the picture's slope over the pixel along both axes, h being the distance of sub-pixels. The slope
//! at a side is the difference of the half-pixels, or of the single samples, that meet there. All weights of sub-pixels
//! are positive, so that a mean stays among the values that it is made of.
//! Limits: at the picture's rim an axis without a neighbour is left as it is.

use std::ops::Range;

use rayon::prelude::*;
use resample_core::tile::TILE_PX;

use super::tiles::{TileSlot, Values};

/// Four numbers of a pixel, the last its opacity; 0 stands for nothing.
pub(super) type Four = [f32; 4];

/// How pixels lie in tiles and in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelGrid {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Sub-pixels along a pixel's side.
    pub(super) subpixels: usize,
}

/// The means of all pixels of a picture, corrected; `picked` takes four numbers of a pixel, or of its slopes.
pub(super) fn correct(
    tiles: &[TileSlot],
    grid: PixelGrid,
    picked: impl Fn(&Values) -> Four + Sync,
    means: &mut [Four],
) {
    let (width, side) = (grid.width, TILE_PX / grid.subpixels);
    // The halves of a pixel are half a pixel apart, single samples a whole one.
    let apart = if grid.subpixels == 1 { 1.0 } else { 0.5 };
    let scale = 1.0 / (24.0 * apart * (grid.subpixels * grid.subpixels) as f32);
    let bands = means.par_chunks_mut(side * width).enumerate();
    bands.for_each_init(Band::default, |band, (number, rows)| {
        band.read(tiles, grid, number, &picked);
        for (row, means) in rows.chunks_mut(width).enumerate() {
            let y = number * side + row;
            let is_inner = y > 0 && y + 1 < grid.height;
            for columns in band.near.clone() {
                band.correct(row + 1, (columns, is_inner), scale, means);
            }
        }
    });
}

/// The rows of a row of tiles, with one above and one below.
#[derive(Default)]
struct Band {
    width: usize,
    means: Vec<Four>,
    /// Half of the difference between the halves of a pixel, along x and along y; empty where there is one sample.
    slopes: [Vec<Four>; 2],
    /// The columns of pixels in and beside the tiles that show something.
    near: Vec<Range<usize>>,
}

impl Band {
    /// Reads the row of tiles of this number, and the rows of pixels above and below.
    fn read(
        &mut self,
        tiles: &[TileSlot],
        grid: PixelGrid,
        number: usize,
        picked: impl Fn(&Values) -> Four,
    ) {
        let PixelGrid { width, height, .. } = grid;
        let side = TILE_PX / grid.subpixels;
        let columns = width.div_ceil(side);
        self.clear(width, width * (side + 2), grid.subpixels > 1);
        let mut shown = vec![false; columns];
        for row in 0..side + 2 {
            // Counted from the row above the tiles.
            let Some(y) = (number * side + row).checked_sub(1).filter(|&y| y < height) else {
                continue;
            };
            let of_row = &tiles[y / side * columns..][..columns];
            for (column, tile) in of_row.iter().enumerate() {
                let Some((pixels, slopes)) = tile.row(y % side, side) else {
                    continue;
                };
                shown[column] = true;
                let at = row * width + column * side;
                let range = at..(at + side).min((row + 1) * width);
                for (mean, pixel) in self.means[range.clone()].iter_mut().zip(pixels) {
                    *mean = picked(&pixel.values());
                }
                let [along_x, along_y] = &mut self.slopes;
                for (i, [x, y]) in range.zip(slopes) {
                    (along_x[i], along_y[i]) = (picked(x), picked(y));
                }
            }
        }
        self.find_near(&shown, side);
    }

    fn clear(&mut self, width: usize, count: usize, with_slopes: bool) {
        self.width = width;
        self.means.clear();
        self.means.resize(count, [0.0; 4]);
        for slopes in &mut self.slopes {
            slopes.clear();
            slopes.resize(if with_slopes { count } else { 0 }, [0.0; 4]);
        }
    }

    /// The columns of pixels in and beside these tiles.
    fn find_near(&mut self, shown: &[bool], side: usize) {
        self.near.clear();
        for (column, _) in shown.iter().enumerate().filter(|(_, shown)| **shown) {
            let start = (column * side).saturating_sub(1);
            let end = ((column + 1) * side + 1).min(self.width);
            match self.near.last_mut() {
                Some(last) if start <= last.end => last.end = end,
                _ => self.near.push(start..end),
            }
        }
    }

    /// Corrects the means of a part of a row; `is_inner` where the picture has a row above and one below.
    fn correct(
        &self,
        row: usize,
        (columns, is_inner): (Range<usize>, bool),
        scale: f32,
        means: &mut [Four],
    ) {
        let width = self.width;
        let inner = columns.start.max(1)..columns.end.min(width - 1);
        let [above, own, below] = rows_around(&self.means, row, width);
        means[columns.clone()].copy_from_slice(&own[columns.clone()]);
        for x in inner.clone() {
            add_curvature(&mut means[x], scale, [own[x - 1], own[x], own[x + 1]]);
        }
        if is_inner {
            for x in columns.clone() {
                add_curvature(&mut means[x], scale, [above[x], own[x], below[x]]);
            }
        }
        let [along_x, along_y] = &self.slopes;
        if !along_x.is_empty() {
            let [_, own, _] = rows_around(along_x, row, width);
            for x in inner {
                add_difference(&mut means[x], scale, [own[x - 1], own[x + 1]]);
            }
            let [above, _, below] = rows_around(along_y, row, width);
            for x in columns.clone().filter(|_| is_inner) {
                add_difference(&mut means[x], scale, [above[x], below[x]]);
            }
        }
        // Rounding may lead below nothing, and opacities beyond 1.
        for mean in &mut means[columns] {
            *mean = mean.map(|value| value.max(0.0));
            mean[3] = mean[3].min(1.0);
        }
    }
}

/// A row with the one above and the one below.
fn rows_around(values: &[Four], row: usize, width: usize) -> [&[Four]; 3] {
    [row - 1, row, row + 1].map(|row| &values[row * width..][..width])
}

#[inline(always)]
fn add_curvature(mean: &mut Four, scale: f32, [before, own, after]: [Four; 3]) {
    for k in 0..4 {
        mean[k] += scale * ((before[k] - own[k]) + (after[k] - own[k]));
    }
}

#[inline(always)]
fn add_difference(mean: &mut Four, scale: f32, [before, after]: [Four; 2]) {
    for k in 0..4 {
        mean[k] += scale * (before[k] - after[k]);
    }
}
