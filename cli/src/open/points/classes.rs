//! Colours in 8 bits: one for each class of points.

use resample_cloud::input::class_colour;
use resample_core::image::srgb_from_linear;
use resample_core::narrow::code8;
use volsplat::transfer::ColourMap;

/// The colour of a class, sRGB. Numbers beyond the standard's lie on a circle of hues, a golden section from one to the next, so
/// that those which follow one another differ.
pub(super) fn colour(class: u8) -> [u8; 3] {
    /// Of a circle.
    const GOLDEN_SECTION: f64 = 0.618_034;
    if let Some(colour) = class_colour(class) {
        return colour;
    }
    let circle: Option<ColourMap> = "sinebow".parse().ok();
    let place = (f64::from(class) * GOLDEN_SECTION).fract();
    let light = circle.unwrap_or_default().colour(place);
    srgb8(light)
}

/// Linear light as sRGB of 8 bits.
pub(super) fn srgb8(light: [f32; 3]) -> [u8; 3] {
    light.map(|part| in_8_bits(srgb_from_linear(part)))
}

/// A share from 0 to 1 in 8 bits.
pub(super) fn in_8_bits(share: f32) -> u8 {
    code8(255.0 * f64::from(share) + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_classes_look_different() {
        let far = |a: [u8; 3], b: [u8; 3]| {
            let sum: u32 = (0..3).map(|i| u32::from(a[i].abs_diff(b[i]))).sum();
            sum > 20
        };
        for class in 0..u8::MAX {
            assert!(far(colour(class), colour(class + 1)), "{class}");
        }
    }
}
