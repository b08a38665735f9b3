//! The input of a comparison, and the checks that both pictures pass before: one size, finite values, a pixel that counts.

use crate::Image;

/// Most pixels per degree accepted. The eye resolves about 60, so this is far beyond any use; it bounds the filters to
/// a radius of 136 pixels.
pub const MAX_PIXELS_PER_DEGREE: f64 = 1000.0;

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
    #[error("{0} pixels per degree is not usable; give a number above 0 and up to {max}", max = MAX_PIXELS_PER_DEGREE)]
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

/// Checks that two pictures have one size, full buffers, at least one pixel, and finite values only.
pub(super) fn check_pair(image: &Image, reference: &Image) -> Result<(), MetricsError> {
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

pub(super) fn check_mask(image: &Image, mask: Option<&Mask>) -> Result<(), MetricsError> {
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
