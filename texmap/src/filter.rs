//! The pixel's filter: a Gaussian over sub-pixels, cut at three standard deviations.
//!
//! Sub-pixels stand on a sheared lattice: in every pixel no two share a row or a column, so that an upright or level
//! edge is seen in `n^2` steps where a plain n x n lattice has n.

use resample_core::point::PIXEL_SIGMA_PX;

/// How far the filter reaches: 3 sigma, where the Gaussian has fallen to 1.1 %.
pub(crate) const REACH_PX: f64 = 1.5;

/// Pixels around a tile whose sub-pixels its filter needs.
pub(crate) const BORDER_PX: usize = 1;

/// The weights and the lattice for one number of sub-pixels.
#[derive(Clone, Debug)]
pub(crate) struct PixelFilter {
    /// Sub-pixels along a pixel's side.
    pub(crate) subpixels: usize,
    /// Offset from a sub-pixel's corner, in px, along x by its row and along y by its column, modulo `subpixels`.
    pub(crate) offset_px: Vec<f32>,
    /// Weights of the 3n x 3n sub-pixels around a pixel, rows from the top; their sum is 1.
    pub(crate) weights: Vec<f32>,
}

impl PixelFilter {
    pub(crate) fn new(subpixels: usize) -> Self {
        let n = subpixels as f64;
        let offset = |k: usize| (k as f64 + 0.5) / (n * n);
        let side = 3 * subpixels;
        let mut weights = Vec::with_capacity(side * side);
        for j in 0..side {
            for i in 0..side {
                let x = i as f64 / n + offset(j % subpixels) - REACH_PX;
                let y = j as f64 / n + offset(i % subpixels) - REACH_PX;
                weights.push((-0.5 * (x * x + y * y) / (PIXEL_SIGMA_PX * PIXEL_SIGMA_PX)).exp());
            }
        }
        let sum: f64 = weights.iter().sum();
        Self {
            subpixels,
            offset_px: (0..subpixels).map(|k| offset(k) as f32).collect(),
            weights: weights.iter().map(|w| (w / sum) as f32).collect(),
        }
    }

    /// Position of a sub-pixel, px from the corner of the first.
    #[inline(always)]
    pub(crate) fn position_px(&self, column: usize, row: usize) -> [f32; 2] {
        let n = self.subpixels;
        let step = 1.0 / n as f32;
        [column as f32 * step + self.offset_px[row % n], row as f32 * step + self.offset_px[column % n]]
    }
}
