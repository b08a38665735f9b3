//! Exposure and tone map: the light of a finished picture brought into the range of a screen.
//!
//! Takes and gives linear premultiplied colour, and leaves alpha as it is. Both steps divide by alpha first, so that a half covered pixel shows half the light of
//! a whole one.
//! Source: Khronos PBR Neutral Tone Mapper, Khronos Group, 2024.

use rayon::prelude::*;
use resample_core::Image;

use crate::options::ToneMap;

/// Applies both to a picture.
pub(crate) fn apply(exposure: f32, tone_map: ToneMap, image: &mut Image) {
    if exposure == 0.0 && tone_map == ToneMap::None {
        return;
    }
    let gain = exposure.exp2();
    image.rgba.par_iter_mut().for_each(|pixel| {
        let [r, g, b, alpha] = *pixel;
        let part = |light: f32| {
            if alpha > 0.0 {
                light / alpha * gain
            } else {
                0.0
            }
        };
        let straight = [part(r), part(g), part(b)];
        let shown = match tone_map {
            ToneMap::None => straight,
            ToneMap::Neutral => neutral(straight),
        };
        *pixel = [shown[0] * alpha, shown[1] * alpha, shown[2] * alpha, alpha];
    });
}

/// The reflectance of a dielectric, which the standard takes off so that base colours come out as they are.
const FRESNEL: f32 = 0.04;

/// From here on light is compressed.
const START: f32 = 0.8 - FRESNEL;

/// How fast compressed colours turn white.
const DESATURATION: f32 = 0.15;

/// The standard's tone map of linear light.
fn neutral(colour: [f32; 3]) -> [f32; 3] {
    let least = colour[0].min(colour[1]).min(colour[2]);
    let offset = match least < 2.0 * FRESNEL {
        true => least - least * least / (4.0 * FRESNEL),
        false => FRESNEL,
    };
    let colour = colour.map(|light| light - offset);
    let peak = colour[0].max(colour[1]).max(colour[2]);
    if peak < START {
        return colour;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    colour.map(|light| {
        let light = light * (compressed / peak);
        light + (compressed - light) * white
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(pixel: [f32; 4], exposure: f32, tone_map: ToneMap) -> [f32; 4] {
        let mut image = Image::transparent(1, 1);
        image.rgba[0] = pixel;
        apply(exposure, tone_map, &mut image);
        image.rgba[0]
    }

    #[test]
    fn a_stop_doubles_light_and_leaves_alpha() {
        assert_eq!(
            one([0.1, 0.2, 0.05, 0.5], 1.0, ToneMap::None),
            [0.2, 0.4, 0.1, 0.5]
        );
        assert_eq!(one([0.0; 4], 3.0, ToneMap::Neutral), [0.0; 4]);
    }

    #[test]
    fn base_colours_come_out_as_they_are_and_lamps_stay_below_white() {
        // A white matt surface of base colour 0.5 in even light of 1 shows 0.5 and the reflection of 0.04.
        let [r, g, b, _] = one([0.54, 0.34, 0.24, 1.0], 0.0, ToneMap::Neutral);
        for (found, expected) in [(r, 0.5), (g, 0.3), (b, 0.2)] {
            assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
        }
        let mut before = 0.0;
        for light in [0.5, 0.8, 1.0, 2.0, 10.0, 1000.0, 1e30] {
            let [r, g, b, _] = one(
                [light, 0.5 * light, 0.25 * light, 1.0],
                0.0,
                ToneMap::Neutral,
            );
            assert!(
                r > before && r <= 1.0 && g <= r && b <= g,
                "{light}: {r} {g} {b}"
            );
            before = r - 1e-6;
        }
    }

    #[test]
    fn half_a_pixel_has_half_of_what_the_whole_has() {
        let whole = one([3.0, 2.0, 1.0, 1.0], -0.5, ToneMap::Neutral);
        let half = one([1.5, 1.0, 0.5, 0.5], -0.5, ToneMap::Neutral);
        for k in 0..4 {
            assert!(
                (half[k] - 0.5 * whole[k]).abs() < 1e-6,
                "{half:?} of {whole:?}"
            );
        }
    }
}
