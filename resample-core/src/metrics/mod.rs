//! Image comparison: how far a picture is from its reference, in figures that others can reproduce.
//!
//! Takes two [`Image`]s of one size and perhaps a [`Mask`], and gives a [`Comparison`]. Differences are taken in
//! linear light on premultiplied colour, which is what the pipeline computes; SSIM and FLIP see the same colours
//! clamped to 0..=1, that is, the picture on black. All arithmetic is f64, and sums run in one fixed order, so the
//! figures do not depend on the number of threads.
//!
//! Sources: PSNR, the maximum and the percentile are plain statistics; SSIM and FLIP name their papers in their own
//! modules. Over time [`Flicker`] compares changes from picture to picture. Limits: no HDR-FLIP; depth and extra planes are not compared.

mod convolve;
pub mod estimate;
mod flicker;
pub mod flip;
mod inputs;
#[cfg(test)]
mod patterns;
pub mod ssim;
#[cfg(test)]
mod tests;
pub mod windows;

use crate::Image;
use crate::metrics::inputs::{check_mask, check_pair};

pub use crate::metrics::flicker::Flicker;
pub use crate::metrics::flip::FlipSummary;
pub use crate::metrics::inputs::{Mask, MetricsError, ScalarMap};

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

/// Image minus reference for every selected pixel.
struct Differences {
    rgba: Vec<[f64; 4]>,
}

impl Differences {
    fn new(image: &Image, reference: &Image, mask: Option<&Mask>) -> Self {
        let inside = |at: usize| mask.is_none_or(|mask| mask.inside()[at]);
        let pairs = image.rgba.iter().zip(&reference.rgba).enumerate();
        let rgba = pairs
            .filter(|&(at, _)| inside(at))
            .map(|(_, (a, b))| minus(a, b))
            .collect();
        Self { rgba }
    }

    fn pixel_count(&self) -> usize {
        self.rgba.len()
    }

    /// Root mean square over red, green and blue.
    fn rmse(&self) -> f64 {
        self.colour_mean(|d| d * d).sqrt()
    }

    fn psnr_db(&self) -> f64 {
        psnr_db(self.colour_mean(|d| d * d))
    }

    fn alpha_psnr_db(&self) -> f64 {
        psnr_db(self.rgba.iter().map(|d| d[3] * d[3]).sum::<f64>() / self.rgba.len() as f64)
    }

    fn mean_signed(&self) -> f64 {
        self.colour_mean(|d| d)
    }

    fn max_abs(&self) -> f64 {
        self.rgba.iter().map(largest_abs).fold(0.0, f64::max)
    }

    /// Quantile (0..=1) over pixels of the largest absolute colour difference.
    fn quantile_abs(&self, quantile: f64) -> f64 {
        interpolated_quantile(
            &mut self.rgba.iter().map(largest_abs).collect::<Vec<_>>(),
            quantile,
        )
    }

    /// Mean of `value` over the three colour channels of all pixels.
    fn colour_mean(&self, value: impl Fn(f64) -> f64) -> f64 {
        let sum: f64 = self
            .rgba
            .iter()
            .map(|d| value(d[0]) + value(d[1]) + value(d[2]))
            .sum();
        sum / (3 * self.rgba.len()) as f64
    }
}

/// The quantile of unsorted values, linear between the two neighbouring ranks; rank `quantile * (n - 1)` from 0.
///
/// `values` is reordered and must not be empty.
fn interpolated_quantile(values: &mut [f64], quantile: f64) -> f64 {
    let rank = quantile * (values.len() - 1) as f64;
    let (_, &mut low, above) = values.select_nth_unstable_by(rank as usize, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + rank.fract() * (high - low)
}

/// Decibels for a peak of 1; +infinity for a mean square of 0.
fn psnr_db(mean_square: f64) -> f64 {
    -10.0 * mean_square.log10()
}

fn minus(image: &[f32; 4], reference: &[f32; 4]) -> [f64; 4] {
    std::array::from_fn(|c| f64::from(image[c]) - f64::from(reference[c]))
}

fn largest_abs(difference: &[f64; 4]) -> f64 {
    difference[0]
        .abs()
        .max(difference[1].abs())
        .max(difference[2].abs())
}
