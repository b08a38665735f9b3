//! Classes of points as the ASPRS numbers them in LAS: their names, and a colour for each number.

use resample_core::image::srgb_from_linear;
use resample_core::narrow::code8;
use volsplat::transfer::ColourMap;

/// Name and sRGB colour of the classes of LAS 1.4, from 0 on.
const CLASSES: [(&str, [u8; 3]); 19] = [
    ("never classified", [170, 170, 170]),
    ("unclassified", [205, 205, 205]),
    ("ground", [166, 124, 82]),
    ("low vegetation", [184, 214, 122]),
    ("medium vegetation", [112, 180, 80]),
    ("high vegetation", [44, 122, 54]),
    ("building", [214, 96, 77]),
    ("low noise", [255, 0, 255]),
    ("model key point", [255, 220, 0]),
    ("water", [67, 147, 211]),
    ("rail", [110, 90, 160]),
    ("road surface", [120, 120, 130]),
    ("overlap", [240, 200, 160]),
    ("wire guard", [255, 170, 0]),
    ("wire conductor", [255, 120, 0]),
    ("transmission tower", [140, 40, 140]),
    ("wire connector", [200, 100, 0]),
    ("bridge deck", [90, 60, 50]),
    ("high noise", [255, 0, 140]),
];

/// The name of a class; numbers beyond the standard's have none.
pub(crate) fn name(class: u8) -> Option<&'static str> {
    CLASSES.get(usize::from(class)).map(|(name, _)| *name)
}

/// The colour of a class, sRGB. Numbers beyond the standard's lie on a circle of hues, a golden section from one to the next, so
/// that those which follow one another differ.
pub(crate) fn colour(class: u8) -> [u8; 3] {
    /// Of a circle.
    const GOLDEN_SECTION: f64 = 0.618_034;
    if let Some((_, colour)) = CLASSES.get(usize::from(class)) {
        return *colour;
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
        assert_eq!((name(2), name(200)), (Some("ground"), None));
    }
}
