//! The pixel's filter: a Gaussian over sub-pixels, cut at four standard deviations.
//!
//! Sub-pixels stand on a sheared lattice: in every pixel no two share a row or a column, so that an upright or level
//! edge is seen in `n^2` steps where a plain n x n lattice has n.

use resample_core::point::PIXEL_SIGMA_PX;

/// How far the filter reaches: 4 sigma. A Gaussian cut at 3 sigma has lost 5 % of its variance over the plane, which
/// limits a picture to some 55 dB; at 4 sigma it is 0.3 %.
pub(crate) const REACH_PX: f64 = 2.0;

/// Pixels around a tile whose sub-pixels its filter needs.
pub(crate) const BORDER_PX: usize = 2;

/// The weights and the lattice for one number of sub-pixels.
#[derive(Clone, Debug)]
pub(crate) struct PixelFilter {
    /// Sub-pixels along a pixel's side.
    pub(crate) subpixels: usize,
    /// Offset from a sub-pixel's corner, in px, along x by its row and along y by its column, modulo `subpixels`.
    pub(crate) offset_px: Vec<f32>,
    /// Sub-pixels along a side of the window that a pixel sees.
    pub(crate) window: usize,
    /// Weights of the window's sub-pixels, rows from the top; their sum is 1.
    pub(crate) weights: Vec<f32>,
}

impl PixelFilter {
    pub(crate) fn new(subpixels: usize) -> Self {
        let n = subpixels as f64;
        let offset = |k: usize| (k as f64 + 0.5) / (n * n);
        // One sub-pixel a pixel stands in its middle, so that it takes one more to reach equally far to both sides.
        let window = 2 * BORDER_PX * subpixels + subpixels % 2;
        let first = first_in_window(subpixels);
        let from_centre = BORDER_PX as f64 + 0.5;
        let mut weights = Vec::with_capacity(window * window);
        for j in first..first + window {
            for i in first..first + window {
                let x = i as f64 / n + offset(j % subpixels) - from_centre;
                let y = j as f64 / n + offset(i % subpixels) - from_centre;
                weights.push((-0.5 * (x * x + y * y) / (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX)).exp());
            }
        }
        let sum: f64 = weights.iter().sum();
        Self {
            subpixels,
            window,
            offset_px: (0..subpixels).map(|k| offset(k) as f32).collect(),
            weights: weights.iter().map(|w| (w / sum) as f32).collect(),
        }
    }

    /// Row and column, from those of the tile's pixel (0, 0), at which the window of a pixel begins: for pixel (x, y) of
    /// the tile, `subpixels` times x and y more.
    #[inline(always)]
    pub(crate) fn first(&self) -> usize {
        first_in_window(self.subpixels)
    }

    /// Position of a sub-pixel, px from the corner of the first.
    #[inline(always)]
    pub(crate) fn position_px(&self, column: usize, row: usize) -> [f32; 2] {
        let n = self.subpixels;
        let step = 1.0 / n as f32;
        [column as f32 * step + self.offset_px[row % n], row as f32 * step + self.offset_px[column % n]]
    }
}

/// First sub-pixel of the window of the tile's pixel (0, 0), which lies [`BORDER_PX`] from the border's corner.
fn first_in_window(subpixels: usize) -> usize {
    // The middle of the pixel less as many sub-pixels as the border has: the border cancels.
    subpixels / 2
}
