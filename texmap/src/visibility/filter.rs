//! The pixel's filter: a Gaussian over sub-pixels, cut at four standard deviations.
//!
//! Sub-pixels stand on a square lattice turned so that it repeats from pixel to pixel: with n along a side it has the
//! steps (1, n) and (n, -1) over n^2 + 1. No two of a pixel's n^2 + 1 share a row or a column, so an upright or level
//! edge is seen in n^2 + 1 steps; and as a true lattice it sums smooth functions with the spectral accuracy of the
//! trapezoid rule, which sub-pixels jittered in each pixel do not. A row of sub-pixels holds one in each pixel.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use resample_core::point::PIXEL_SIGMA_PX;

use crate::project::surface::Batch;
use crate::screen::{BORDER_PX, LANES, REACH_PX, SPAN_HEIGHT, SPAN_WIDTH, WINDOW_PX};
use crate::visibility::runs::Pair;

/// The lattice of sub-pixels and the weights of those around a pixel.
#[derive(Clone, Debug)]
pub(crate) struct PixelFilter {
    /// Sub-pixels of a pixel, and their rows.
    pub(crate) per_pixel: usize,
    /// The lattice's number n.
    side: usize,
    /// Their distance, px.
    pub(crate) spacing_px: f32,
    /// Distance of two rows, px.
    pub(crate) row_px: f32,
    /// Position within the pixel along x, px, by row.
    pub(crate) offset_px: Vec<f32>,
    /// The rows within reach of the pixel (0, 0) of a tile whose border is [`BORDER_PX`] wide.
    pub(crate) rows: Vec<WindowRow>,
    /// The rows of a tile, from the second on, and those above.
    pub(crate) above: Vec<Pair>,
    /// The lattice's two shortest steps, at right angles.
    pub(crate) steps: [LatticeStep; 2],
    /// The filter's second moments along x and y, px^2.
    pub(crate) variance_px2: [f32; 2],
    /// By row from the border's corner, for the first row of pixels: the weights of a sub-pixel in the tile's last column, by
    /// pixel; those in other columns begin so many pixels later.
    weights: Vec<f32>,
}

/// Pixels from the first that a sub-pixel in the last column may be in to the last that one in the first column may be in.
const BY_PIXEL: usize = SPAN_WIDTH - 1 + LANES;

/// A step from one sub-pixel to a neighbour.
#[derive(Clone, Debug)]
pub(crate) struct LatticeStep {
    /// Row by row: sub-pixels of a tile, and those one step from them.
    pub(crate) pairs: Vec<Pair>,
    /// The step, px.
    pub(crate) vector_px: [f32; 2],
}

/// One row of sub-pixels as a pixel's filter sees it.
#[derive(Clone, Debug)]
pub(crate) struct WindowRow {
    /// Row, counted from the border's corner, for the tile's first pixel.
    pub(crate) row: usize,
    /// First column, counted from the border's corner, for the tile's first pixel.
    pub(crate) column: usize,
    /// Weights from that column on. Those of all rows sum to 1.
    pub(crate) weights: Vec<f32>,
}

impl PixelFilter {
    /// The lattice with `n` sub-pixels along a pixel's side, or a single one in the middle.
    pub(crate) fn new(n: usize) -> Self {
        Self::of_width(n, PIXEL_SIGMA_PX)
    }

    /// As narrow as the mean over a pixel's square, whose standard deviation this is.
    pub(crate) fn as_square(n: usize) -> Self {
        Self::of_width(n, 1.0 / 12f64.sqrt())
    }

    /// With a Gaussian of this standard deviation, px.
    fn of_width(n: usize, sigma_px: f64) -> Self {
        let per_pixel = if n > 1 { n * n + 1 } else { 1 };
        let place = |k: usize| (k as f64 + 0.5) / per_pixel as f64;
        let offset = |row: usize| place(row * n % per_pixel);
        let centre = BORDER_PX as f64 + 0.5;
        let mut rows: Vec<WindowRow> = Vec::new();
        let mut sum = 0.0;
        for row in 0..(2 * BORDER_PX + 1) * per_pixel {
            let y = row as f64 / per_pixel as f64 + place(0) - centre;
            let columns: Vec<(usize, f64)> = (0..2 * BORDER_PX + 1)
                .map(|column| (column, column as f64 + offset(row % per_pixel) - centre))
                .filter(|(_, x)| x * x + y * y <= REACH_PX * REACH_PX)
                .map(|(column, x)| (column, (-0.5 * (x * x + y * y) / sigma_px.powi(2)).exp()))
                .collect();
            sum += columns.iter().map(|(_, weight)| weight).sum::<f64>();
            if let Some(&(column, _)) = columns.first() {
                rows.push(WindowRow {
                    row,
                    column,
                    weights: columns.iter().map(|(_, w)| *w as f32).collect(),
                });
            }
        }
        rows.iter_mut()
            .flat_map(|row| &mut row.weights)
            .for_each(|w| *w = (f64::from(*w) / sum) as f32);
        let mut weights = vec![0.0; WINDOW_PX * per_pixel * BY_PIXEL];
        for row in &rows {
            for (k, weight) in row.weights.iter().enumerate() {
                weights[row.row * BY_PIXEL + SPAN_WIDTH - 1 - (row.column + k)] = *weight;
            }
        }
        let from_centre = |row: &WindowRow, k: usize| {
            let x = (row.column + k) as f64 + offset(row.row % per_pixel) - centre;
            let y = row.row as f64 / per_pixel as f64 + place(0) - centre;
            [x, y]
        };
        let mut variance = [0.0; 2];
        for row in &rows {
            for (k, weight) in row.weights.iter().enumerate() {
                let [x, y] = from_centre(row, k);
                variance[0] += f64::from(*weight) * x * x;
                variance[1] += f64::from(*weight) * y * y;
            }
        }
        Self {
            variance_px2: variance.map(|v| v as f32),
            above: (1..SPAN_HEIGHT * per_pixel)
                .map(|row| Pair::of_rows([row, row - 1], 0))
                .collect(),
            steps: steps(n, per_pixel),
            weights,
            per_pixel,
            side: n,
            spacing_px: (1.0 / (per_pixel as f64).sqrt()) as f32,
            row_px: (1.0 / per_pixel as f64) as f32,
            offset_px: (0..per_pixel).map(|row| offset(row) as f32).collect(),
            rows,
        }
    }

    /// Position along y of a row, px from the border's corner.
    #[inline(always)]
    pub(crate) fn y_px(&self, row: usize) -> f32 {
        (row as f32 + 0.5) * self.row_px
    }

    /// A sub-pixel's position from the centre of the tile's first pixel, px, by row and column from the border's corner.
    #[inline(always)]
    pub(crate) fn centred_px(&self, row: usize, column: usize) -> [f32; 2] {
        let [x, y] = self.position_px(column, row);
        let centre = BORDER_PX as f32 + 0.5;
        [x - centre, y - centre]
    }

    /// Weights of a sub-pixel, by its place in the tile's span, in the sixteen pixels of row `y` of the tile.
    #[inline(always)]
    pub(crate) fn weights<S: Simd>(&self, simd: S, y: usize, subpixel: usize) -> f32x16<S> {
        let row = (subpixel / SPAN_WIDTH).wrapping_sub(y * self.per_pixel);
        if row >= WINDOW_PX * self.per_pixel {
            return f32x16::splat(simd, 0.0);
        }
        let start = row * BY_PIXEL + SPAN_WIDTH - 1 - subpixel % SPAN_WIDTH;
        f32x16::from_slice(simd, &self.weights[start..start + LANES])
    }

    /// Sub-pixels of a tile by their places in its span.
    #[inline(always)]
    pub(crate) fn batch<S: Simd>(&self, simd: S, subpixels: &[u32], count: usize) -> Batch {
        let splat = |x: f32| f32x16::splat(simd, x);
        let half = splat(0.5);
        // Numbers of at most 2^16: halves keep them clear of the next whole number.
        let place: f32x16<S> = u32x16::from_slice(simd, &subpixels[..LANES]).to_float();
        let row = ((place + half) * splat(1.0 / SPAN_WIDTH as f32)).floor();
        let column = place - row * splat(SPAN_WIDTH as f32);
        let y = (row + half) * splat(self.row_px);
        let within = row - y.floor() * splat(self.per_pixel as f32);
        // Its place among the columns of its pixel, less whole pixels.
        let along = (within * splat(self.side as f32) + half) * splat(self.row_px);
        let mut batch = Batch {
            x: [0.0; LANES],
            y: [0.0; LANES],
            count,
        };
        (column + along - along.floor()).store_slice(&mut batch.x);
        y.store_slice(&mut batch.y);
        batch
    }

    /// Position of a sub-pixel, px from the border's corner.
    #[inline(always)]
    pub(crate) fn position_px(&self, column: usize, row: usize) -> [f32; 2] {
        [
            column as f32 + self.offset_px[row % self.per_pixel],
            self.y_px(row),
        ]
    }
}

/// Cells that a pixel's filter reaches.
pub(crate) const AROUND: usize = WINDOW_PX * WINDOW_PX;

/// Number of the k-th of the cells that the filter of pixel (x, y) reaches.
#[inline(always)]
pub(crate) fn around([x, y]: [usize; 2], k: usize) -> usize {
    (y + k / WINDOW_PX) * SPAN_WIDTH + x + k % WINDOW_PX
}

/// The steps (n, 1) and (-1, n) over n^2 + 1; without a lattice, to the next column and to the next row.
fn steps(n: usize, per_pixel: usize) -> [LatticeStep; 2] {
    let step = |rows: usize, columns: isize| {
        // Column numbers within a pixel run through all residues: a step that leaves them changes the pixel.
        let shift = |row: usize| {
            ((row % per_pixel * n % per_pixel) as isize + columns).div_euclid(per_pixel as isize)
        };
        LatticeStep {
            pairs: (0..SPAN_HEIGHT * per_pixel - rows)
                .map(|row| Pair::of_rows([row, row + rows], shift(row)))
                .collect(),
            vector_px: [columns, rows as isize].map(|steps| steps as f32 / per_pixel as f32),
        }
    };
    if per_pixel == 1 {
        return [step(0, 1), step(1, 0)];
    }
    [step(1, n as isize), step(n, -1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    fn moments(filter: &PixelFilter) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for row in &filter.rows {
            for (k, &weight) in row.weights.iter().enumerate() {
                let at = filter
                    .position_px(row.column + k, row.row)
                    .map(|p| f64::from(p) - 2.5);
                let w = f64::from(weight);
                sums[0] += w;
                sums[1] += w * (at[0] + at[1]);
                sums[2] += w * at[0] * at[0];
                sums[3] += w * at[1] * at[1];
            }
        }
        sums
    }

    #[test]
    fn weights_have_the_moments_of_the_gaussian() {
        for n in [2, 3, 4, 8] {
            let [sum, mean, xx, yy] = moments(&PixelFilter::new(n));
            assert!((sum - 1.0).abs() < 1e-5, "{n}: the weights sum to {sum}");
            assert!(
                mean.abs() < 2e-3,
                "{n}: the centre of gravity is off by {mean} px"
            );
            // The cut takes 0.3 % off the variance.
            assert!(
                (xx - 0.25).abs() < 2e-3 && (yy - 0.25).abs() < 2e-3,
                "{n}: variances {xx} {yy}"
            );
        }
    }

    #[test]
    fn positions_in_vectors_are_those_of_single_subpixels() {
        for n in [1, 2, 3, 4, 8] {
            let filter = PixelFilter::new(n);
            let all: Vec<u32> = (0..(SPAN_WIDTH * SPAN_HEIGHT * filter.per_pixel) as u32).collect();
            for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
                for some in all.chunks_exact(LANES) {
                    let batch = dispatch!(simd, simd => filter.batch(simd, some, LANES));
                    for (k, &at) in some.iter().enumerate() {
                        let at = at as usize;
                        let wanted = filter.position_px(at % SPAN_WIDTH, at / SPAN_WIDTH);
                        for (is, wanted) in batch.at(k).into_iter().zip(wanted) {
                            assert!((is - wanted).abs() < 4e-6, "{n}, {at}: {is}, not {wanted}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn no_two_subpixels_of_a_pixel_share_a_column() {
        for n in [2, 3, 4, 8] {
            let mut offsets = PixelFilter::new(n).offset_px;
            offsets.sort_by(f32::total_cmp);
            let least = offsets
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .fold(1.0, f32::min);
            assert!(
                least > 0.9 / (n * n + 1) as f32,
                "{n}: two sub-pixels are only {least} px apart"
            );
        }
    }
}
