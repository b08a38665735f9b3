//! Statistics of the plain pixel difference: RMSE, PSNR, bias, maximum, percentiles.
//!
//! Takes two checked images and a mask, gives numbers. Only image minus reference of the selected pixels is kept; each
//! figure is then one pass over it. The signal's peak is 1, the brightest value that a display can show, so PSNR is
//! -10 log10 of the mean square.
//!
//! Limits: the caller has checked sizes, finiteness, and that at least one pixel is selected.

use super::inputs::Mask;
use crate::Image;

/// Image minus reference for every selected pixel.
pub(super) struct Differences {
    rgba: Vec<[f64; 4]>,
}

impl Differences {
    pub(super) fn new(image: &Image, reference: &Image, mask: Option<&Mask>) -> Self {
        let inside = |at: usize| mask.is_none_or(|mask| mask.inside()[at]);
        let pairs = image.rgba.iter().zip(&reference.rgba).enumerate();
        let rgba = pairs
            .filter(|&(at, _)| inside(at))
            .map(|(_, (a, b))| minus(a, b))
            .collect();
        Self { rgba }
    }

    pub(super) fn pixel_count(&self) -> usize {
        self.rgba.len()
    }

    /// Root mean square over red, green and blue.
    pub(super) fn rmse(&self) -> f64 {
        self.colour_mean(|d| d * d).sqrt()
    }

    pub(super) fn psnr_db(&self) -> f64 {
        psnr_db(self.colour_mean(|d| d * d))
    }

    pub(super) fn alpha_psnr_db(&self) -> f64 {
        psnr_db(self.rgba.iter().map(|d| d[3] * d[3]).sum::<f64>() / self.rgba.len() as f64)
    }

    pub(super) fn mean_signed(&self) -> f64 {
        self.colour_mean(|d| d)
    }

    pub(super) fn max_abs(&self) -> f64 {
        self.rgba.iter().map(largest_abs).fold(0.0, f64::max)
    }

    /// Quantile (0..=1) over pixels of the largest absolute colour difference.
    pub(super) fn quantile_abs(&self, quantile: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantile_interpolates_between_ranks() {
        // Five values have ranks 0..=4; quantile 0.9 is rank 3.6, which is 0.6 of the way from 40 to 50.
        let value = interpolated_quantile(&mut [50.0, 10.0, 40.0, 20.0, 30.0], 0.9);
        assert!((value - 46.0).abs() < 1e-12, "quantile {value} is not 46");
        assert_eq!(
            interpolated_quantile(&mut [7.0], 0.999),
            7.0,
            "a single value is every quantile"
        );
        assert_eq!(
            interpolated_quantile(&mut [1.0, 2.0], 1.0),
            2.0,
            "quantile 1 is the maximum"
        );
    }

    #[test]
    fn psnr_of_a_tenth_is_twenty_decibels() {
        assert!(
            (psnr_db(0.01) - 20.0).abs() < 1e-12,
            "a mean square of 0.01 must be 20 dB"
        );
        assert_eq!(
            psnr_db(0.0),
            f64::INFINITY,
            "no difference must be infinite"
        );
    }
}
