//! Structural similarity (SSIM) with a Gaussian window.
//!
//! Takes two images, gives one value per pixel and its mean. In a Gaussian window around each pixel the means,
//! variances and the covariance of the two pictures are formed; their combination is 1 where the pictures agree and
//! falls with differences of brightness, contrast and structure. Colour is handled as the mean over red, green, blue.
//!
//! Source: Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image Quality Assessment: From Error Visibility to
//! Structural Similarity", IEEE Transactions on Image Processing 13(4), 2004: the window and constants of section III.
//!
//! Limits: the input is linear light clamped to 0..=1, not display-encoded, so dark parts weigh less than they would
//! on a screen. Window weights are not corrected for sample size.

use super::convolve::{Border, along_both, normalised, sampled_taps};
use super::inputs::{Mask, MetricsError, ScalarMap, check_pair};
use crate::Image;
use rayon::prelude::*;

/// Standard deviation of the window in pixels, from the paper.
const WINDOW_SIGMA_PX: f64 = 1.5;
/// The paper's window is 11 x 11 pixels.
const WINDOW_RADIUS_PX: usize = 5;
/// `(K1 L)^2` with the paper's K1 = 0.01 and a data range L of 1: keeps dark windows from dividing by nothing.
const LUMINANCE_STABILISER: f64 = 0.01 * 0.01;
/// `(K2 L)^2` with the paper's K2 = 0.03: the same for flat windows.
const CONTRAST_STABILISER: f64 = 0.03 * 0.03;

/// The SSIM of every pixel, in -1..=1, averaged over red, green and blue; the border is mirrored.
///
/// # Errors
/// As [`super::compare`], for sizes, lengths and values that are not finite.
pub fn map(image: &Image, reference: &Image) -> Result<ScalarMap, MetricsError> {
    check_pair(image, reference)?;
    let mut sum = channel_map(image, reference, 0);
    for channel in 1..3 {
        let one = channel_map(image, reference, channel);
        sum.values
            .iter_mut()
            .zip(one.values)
            .for_each(|(total, value)| *total += value);
    }
    sum.values.iter_mut().for_each(|value| *value /= 3.0);
    Ok(sum)
}

/// The mean of an SSIM map.
///
/// With a mask: over its pixels. Without: over the pixels whose window lies inside the picture, as is the custom; if
/// there is none, because a side is shorter than the window, over all pixels. NaN for an empty mask.
pub fn mean(map: &ScalarMap, mask: Option<&Mask>) -> f64 {
    let values = match mask {
        Some(_) => map.selected(mask),
        None => interior(map),
    };
    values.iter().sum::<f64>() / values.len() as f64
}

/// The values at least one window radius away from the border, or all values of a smaller picture.
fn interior(map: &ScalarMap) -> Vec<f64> {
    let smallest_side = map.width.min(map.height);
    let margin = if smallest_side > 2 * WINDOW_RADIUS_PX {
        WINDOW_RADIUS_PX
    } else {
        0
    };
    let rows = map
        .values
        .chunks(map.width)
        .skip(margin)
        .take(map.height - 2 * margin);
    rows.flat_map(|row| &row[margin..map.width - margin])
        .copied()
        .collect()
}

fn channel_map(image: &Image, reference: &Image, channel: usize) -> ScalarMap {
    let a = clamped_channel(image, channel);
    let b = clamped_channel(reference, channel);
    let taps = normalised(sampled_taps(WINDOW_RADIUS_PX, |x| {
        (-0.5 * (x / WINDOW_SIGMA_PX).powi(2)).exp()
    }));
    let window_mean = |map: &ScalarMap| along_both(map, &taps, Border::Mirror).values;
    let (mean_a, mean_b) = (window_mean(&a), window_mean(&b));
    let (mean_aa, mean_bb) = (window_mean(&product(&a, &a)), window_mean(&product(&b, &b)));
    let mean_ab = window_mean(&product(&a, &b));
    let values = (0..a.values.len())
        .into_par_iter()
        .map(|i| {
            Moments {
                a: mean_a[i],
                b: mean_b[i],
                aa: mean_aa[i],
                bb: mean_bb[i],
                ab: mean_ab[i],
            }
            .ssim()
        })
        .collect();
    ScalarMap {
        width: a.width,
        height: a.height,
        values,
    }
}

/// Window means of the two signals and their products.
struct Moments {
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
}

impl Moments {
    /// Equation 13 of the paper.
    fn ssim(&self) -> f64 {
        let variance_a = self.aa - self.a * self.a;
        let variance_b = self.bb - self.b * self.b;
        let covariance = self.ab - self.a * self.b;
        let luminance = (2.0 * self.a * self.b + LUMINANCE_STABILISER)
            / (self.a * self.a + self.b * self.b + LUMINANCE_STABILISER);
        let structure = (2.0 * covariance + CONTRAST_STABILISER)
            / (variance_a + variance_b + CONTRAST_STABILISER);
        luminance * structure
    }
}

fn clamped_channel(image: &Image, channel: usize) -> ScalarMap {
    let values = image
        .rgba
        .iter()
        .map(|pixel| f64::from(pixel[channel]).clamp(0.0, 1.0))
        .collect();
    ScalarMap {
        width: image.width,
        height: image.height,
        values,
    }
}

fn product(a: &ScalarMap, b: &ScalarMap) -> ScalarMap {
    let values = a.values.iter().zip(&b.values).map(|(a, b)| a * b).collect();
    ScalarMap {
        width: a.width,
        height: a.height,
        values,
    }
}

#[cfg(test)]
mod tests {
    use super::super::patterns::{Pattern, disc_mask};
    use super::*;

    #[test]
    fn constant_pictures_have_the_closed_form() {
        // Without variance the structure term is 1, and the luminance term alone remains.
        let (mut a, mut b) = (Image::transparent(16, 16), Image::transparent(16, 16));
        a.rgba.fill([0.25, 0.25, 0.25, 1.0]);
        b.rgba.fill([0.75, 0.75, 0.75, 1.0]);
        let expected = (2.0 * 0.25 * 0.75 + 1e-4) / (0.25f64.powi(2) + 0.75f64.powi(2) + 1e-4);
        let found = mean(&map(&a, &b).expect("valid pair"), None);
        assert!(
            (found - expected).abs() < 1e-12,
            "SSIM {found} of constants, expected {expected}"
        );
    }

    #[test]
    fn a_picture_smaller_than_the_window_is_averaged_whole() {
        let mut image = Image::transparent(3, 2);
        image.rgba.fill([2.0, -1.0, 0.5, 1.0]);
        let map = map(&image, &image).expect("valid pair");
        assert!(
            (mean(&map, None) - 1.0).abs() < 1e-12,
            "a picture must equal itself"
        );
    }

    /// Expected: scikit-image 0.26.0, `structural_similarity(test, reference, channel_axis=-1, data_range=1.0,
    /// gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True)` on the patterns as float64 arrays;
    /// the second number is the mean of the returned map (averaged over channels) inside the disc.
    #[test]
    fn patterns_agree_with_scikit_image() {
        let expected = [
            (Pattern::Ramp, 0.8758424466908296, 0.8698753721653443),
            (Pattern::Checker, 0.43373075096113484, 0.44702981173099443),
            (Pattern::Noise, 0.9997008477101725, 0.9997008913705582),
        ];
        for (pattern, whole, inside) in expected {
            let (image, reference) = pattern.pair();
            let map = map(&image, &reference).expect("valid pair");
            let found = mean(&map, None);
            assert!(
                (found - whole).abs() < 1e-9,
                "{pattern:?}: SSIM {found}, expected {whole}"
            );
            let found = mean(&map, Some(&disc_mask()));
            assert!(
                (found - inside).abs() < 1e-9,
                "{pattern:?} in the disc: SSIM {found}, expected {inside}"
            );
        }
    }
}
