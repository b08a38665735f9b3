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
#[cfg(test)]
mod patterns;
pub mod ssim;
#[cfg(test)]
mod tests;

use crate::Image;
use difference::Differences;
pub use flip::FlipSummary;

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

/// Why two pictures could not be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// The two sizes differ.
    #[error(
        "the image is {image:?} pixels and the reference {reference:?}; render both at one size"
    )]
    SizesDiffer {
        /// Width and height of the image.
        image: [usize; 2],
        /// Width and height of the reference.
        reference: [usize; 2],
    },
    /// A buffer does not hold one entry per pixel.
    #[error(
        "the {which} has {found} entries, but its size is {size:?} pixels; one entry per pixel is expected"
    )]
    WrongLength {
        /// "image", "reference" or "mask".
        which: &'static str,
        /// Claimed width and height.
        size: [usize; 2],
        /// Entries found.
        found: usize,
    },
    /// The mask is for another size.
    #[error(
        "the mask is for {mask:?} pixels, but the pictures are {image:?}; build it from one of them"
    )]
    MaskSizeDiffers {
        /// Width and height of the mask.
        mask: [usize; 2],
        /// Width and height of the pictures.
        image: [usize; 2],
    },
    /// No pixel to compare.
    #[error(
        "there is no pixel to compare: the picture is empty or the mask selects nothing; compare without a mask"
    )]
    NothingToCompare,
    /// NaN or infinity.
    #[error(
        "pixel ({x}, {y}) of the {which} is not finite: {value:?}; repair the renderer or mask it before"
    )]
    NotFinite {
        /// "image" or "reference".
        which: &'static str,
        /// Column.
        x: usize,
        /// Row from the top.
        y: usize,
        /// Red, green, blue, alpha.
        value: [f32; 4],
    },
    /// A viewing condition that FLIP cannot use.
    #[error("{0} pixels per degree is not usable; give a number above 0 and up to {max}", max = flip::MAX_PIXELS_PER_DEGREE)]
    BadPixelsPerDegree(f64),
}

/// The pixels that count in a comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    inside: Vec<bool>,
}

impl Mask {
    /// A mask from one flag per pixel, rows from the top.
    ///
    /// # Errors
    /// [`MetricsError::WrongLength`] unless there are `width * height` flags.
    pub fn new(width: usize, height: usize, inside: Vec<bool>) -> Result<Self, MetricsError> {
        check_length("mask", [width, height], inside.len())?;
        Ok(Self {
            width,
            height,
            inside,
        })
    }

    /// The pixels that an 8-bit picture would show as more than one step of alpha: alpha above 1/255.
    ///
    /// Made from the reference, this is "inside the object".
    pub fn from_alpha(image: &Image) -> Self {
        let inside = image
            .rgba
            .iter()
            .map(|pixel| pixel[3] > 1.0 / 255.0)
            .collect();
        Self {
            width: image.width,
            height: image.height,
            inside,
        }
    }

    /// One flag per pixel, rows from the top.
    pub fn inside(&self) -> &[bool] {
        &self.inside
    }

    /// Number of pixels selected.
    pub fn count(&self) -> usize {
        self.inside.iter().filter(|&&inside| inside).count()
    }
}

/// One f64 per pixel: an error map or one filtered channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarMap {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Values, rows from the top.
    pub values: Vec<f64>,
}

impl ScalarMap {
    /// The values that a mask selects, in pixel order; all of them without a mask.
    pub fn selected(&self, mask: Option<&Mask>) -> Vec<f64> {
        match mask {
            None => self.values.clone(),
            Some(mask) => self
                .values
                .iter()
                .zip(&mask.inside)
                .filter(|&(_, &inside)| inside)
                .map(|(&v, _)| v)
                .collect(),
        }
    }
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

/// Checks that two pictures have one size, full buffers, at least one pixel, and finite values only.
fn check_pair(image: &Image, reference: &Image) -> Result<(), MetricsError> {
    let (size, reference_size) = (
        [image.width, image.height],
        [reference.width, reference.height],
    );
    if size != reference_size {
        return Err(MetricsError::SizesDiffer {
            image: size,
            reference: reference_size,
        });
    }
    check_length("image", size, image.rgba.len())?;
    check_length("reference", size, reference.rgba.len())?;
    if image.rgba.is_empty() {
        return Err(MetricsError::NothingToCompare);
    }
    check_finite("image", image)?;
    check_finite("reference", reference)
}

fn check_length(which: &'static str, size: [usize; 2], found: usize) -> Result<(), MetricsError> {
    if size[0].checked_mul(size[1]) == Some(found) {
        return Ok(());
    }
    Err(MetricsError::WrongLength { which, size, found })
}

fn check_finite(which: &'static str, image: &Image) -> Result<(), MetricsError> {
    match image
        .rgba
        .iter()
        .position(|pixel| !pixel.iter().all(|v| v.is_finite()))
    {
        None => Ok(()),
        Some(at) => Err(MetricsError::NotFinite {
            which,
            x: at % image.width,
            y: at / image.width,
            value: image.rgba[at],
        }),
    }
}

fn check_mask(image: &Image, mask: Option<&Mask>) -> Result<(), MetricsError> {
    let Some(mask) = mask else { return Ok(()) };
    let (mask_size, size) = ([mask.width, mask.height], [image.width, image.height]);
    if mask_size != size {
        return Err(MetricsError::MaskSizeDiffers {
            mask: mask_size,
            image: size,
        });
    }
    if mask.count() == 0 {
        Err(MetricsError::NothingToCompare)
    } else {
        Ok(())
    }
}
