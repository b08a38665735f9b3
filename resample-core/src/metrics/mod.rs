//! Image comparison: how far a picture is from its reference, in figures that others can reproduce.
//!
//! Takes two [`Image`]s of one size and perhaps a [`Mask`], and gives a [`Comparison`]. Differences are taken in
//! linear light on premultiplied colour, which is what the pipeline computes; SSIM and FLIP see the same colours
//! clamped to 0..=1, that is, the picture on black. All arithmetic is f64, and sums run in one fixed order, so the
//! figures do not depend on the number of threads.
//!
//! Sources: PSNR, the maximum and the percentile are plain statistics; SSIM and FLIP name their papers in their own
//! modules. Limits: neither HDR-FLIP nor any measure over time; depth and extra planes are not compared.

mod convolve;
mod difference;
pub mod flip;
mod inputs;
#[cfg(test)]
mod patterns;
pub mod ssim;
#[cfg(test)]
mod tests;

use crate::Image;
use difference::Differences;
pub use flip::FlipSummary;
pub use inputs::{Mask, MetricsError, ScalarMap};
use inputs::{check_mask, check_pair};

/// All figures of one comparison, each over the mask, or over the whole picture without one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Number of pixels compared.
    pub pixel_count: usize,
    /// Root mean square difference of red, green and blue (linear, premultiplied).
    pub rmse: f64,
    /// Peak signal-to-noise ratio of red, green and blue in decibels for a peak of 1; +infinity without difference.
    pub psnr_db: f64,
    /// The same for alpha alone, in decibels.
    pub alpha_psnr_db: f64,
    /// Mean of image minus reference over red, green and blue: the brightness bias.
    pub mean_signed: f64,
    /// Largest absolute difference in any of red, green and blue.
    pub max_abs: f64,
    /// 99th percentile over pixels of the largest absolute colour difference, interpolated linearly between ranks.
    pub p99_abs: f64,
    /// The 99.9th.
    pub p999_abs: f64,
    /// Mean structural similarity, at most 1; see [`ssim::mean`] for what a mask changes.
    pub ssim: f64,
    /// FLIP at [`flip::DEFAULT_PIXELS_PER_DEGREE`], pooled.
    pub flip: FlipSummary,
}

/// Compares `image` with `reference` over `mask`, or over all pixels.
///
/// # Errors
/// Sizes that differ, buffers of the wrong length, an empty selection, and any pixel (masked or not) that is not
/// finite: the filters of SSIM and FLIP would spread it.
pub fn compare(
    image: &Image,
    reference: &Image,
    mask: Option<&Mask>,
) -> Result<Comparison, MetricsError> {
    check_pair(image, reference)?;
    check_mask(image, mask)?;
    let differences = Differences::new(image, reference, mask);
    let flip_map = flip::map(image, reference, flip::DEFAULT_PIXELS_PER_DEGREE)?;
    let ssim_map = ssim::map(image, reference)?;
    Ok(Comparison {
        pixel_count: differences.pixel_count(),
        rmse: differences.rmse(),
        psnr_db: differences.psnr_db(),
        alpha_psnr_db: differences.alpha_psnr_db(),
        mean_signed: differences.mean_signed(),
        max_abs: differences.max_abs(),
        p99_abs: differences.quantile_abs(0.99),
        p999_abs: differences.quantile_abs(0.999),
        ssim: ssim::mean(&ssim_map, mask),
        flip: FlipSummary::new(flip_map.selected(mask)),
    })
}
