//! The sRGB curve, and its codes of 8 bits.

use std::sync::LazyLock;

/// The sRGB transfer curve (IEC 61966-2-1): linear light in 0..=1 to the encoded value in 0..=1.
///
/// Values outside 0..=1 are clamped; NaN becomes 0.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let linear = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of [`srgb_from_linear`].
///
/// ```
/// use resample_core::image::{linear_from_srgb, srgb_from_linear};
///
/// let light = linear_from_srgb(0.5);
/// assert!((light - 0.214).abs() < 1e-3);
/// assert!((srgb_from_linear(light) - 0.5).abs() < 1e-6);
/// ```
pub fn linear_from_srgb(encoded: f32) -> f32 {
    let encoded = if encoded > 0.0 { encoded.min(1.0) } else { 0.0 };
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// The code of 8 bits of [`srgb_from_linear`], rounded to the nearest.
///
/// It comes from a table: 13 binary orders of magnitude of 128 steps each, so fine that at most one code begins within a step.
///
/// ```
/// use resample_core::image::srgb8_from_linear;
///
/// // Half of the light of white (IEC 61966-2-1).
/// assert_eq!(srgb8_from_linear(0.5), 188);
/// ```
pub fn srgb8_from_linear(linear: f32) -> u8 {
    static CODES: LazyLock<Codes> = LazyLock::new(Codes::new);
    CODES.of(linear)
}

/// Light below 2^-13 has code 0: 255 times 12.92 times it is 0.4.
const LEAST: f32 = 1.0 / 8192.0;

/// Bits of a number's fraction that are left out of its step.
const SHIFT: u32 = 16;

/// Steps from [`LEAST`] up to 1.
const STEPS: usize = 13 << (23 - SHIFT);

/// Codes of 8 bits.
struct Codes {
    /// The code at the beginning of each step.
    first: [u8; STEPS],
    /// The least light of each code.
    least: [f32; 257],
}

impl Codes {
    fn new() -> Self {
        let mut least = [f32::INFINITY; 257];
        least[0] = 0.0;
        for code in 1..=255u8 {
            let has_less = |bits: &u32| rounded(f32::from_bits(*bits)) < code;
            // Numbers above 0 are in the order of their bits.
            let (mut low, mut high) = (0, 1f32.to_bits());
            while low < high {
                let middle = low.midpoint(high);
                match has_less(&middle) {
                    true => low = middle + 1,
                    false => high = middle,
                }
            }
            least[usize::from(code)] = f32::from_bits(low);
        }
        let start = |step: usize| LEAST.to_bits() + ((step as u32) << SHIFT);
        Self {
            first: std::array::from_fn(|step| rounded(f32::from_bits(start(step)))),
            least,
        }
    }

    #[inline(always)]
    fn of(&self, linear: f32) -> u8 {
        // NaN is not at least anything.
        if !(linear >= LEAST) {
            return 0;
        }
        if linear >= 1.0 {
            return 255;
        }
        let step = (linear.to_bits() - LEAST.to_bits()) >> SHIFT;
        let first = self.first[step as usize];
        let is_next = linear >= self.least[usize::from(first) + 1];
        first + u8::from(is_next)
    }
}

/// The code by its definition, without the table.
fn rounded(linear: f32) -> u8 {
    (srgb_from_linear(linear) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trip_is_exact_to_eight_bits() {
        for code in 0..=255u8 {
            let encoded = f32::from(code) / 255.0;
            let back = srgb_from_linear(linear_from_srgb(encoded));
            assert!(
                (back - encoded).abs() < 1e-5,
                "code {code}: {back} against {encoded}"
            );
        }
        assert_eq!(srgb_from_linear(f32::NAN), 0.0, "NaN must not reach a file");
    }

    #[test]
    fn codes_of_eight_bits_are_rounded() {
        let check = |bits: u32| {
            let light = f32::from_bits(bits);
            assert_eq!(srgb8_from_linear(light), rounded(light), "{light:e}");
        };
        // All around the borders of codes and of steps, and a part of all numbers between.
        let codes = Codes::new();
        let steps = (0..STEPS as u32).map(|step| LEAST.to_bits() + (step << SHIFT));
        let borders = codes.least[1..256].iter().map(|least| least.to_bits());
        steps
            .chain(borders)
            .flat_map(|bits| bits - 20..bits + 20)
            .for_each(check);
        (0..1f32.to_bits()).step_by(9_973).for_each(check);
        for light in [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            -0.0,
            1.0,
            7.0,
            f32::MIN_POSITIVE,
        ] {
            check(light.to_bits());
        }
    }
}
