//! Named colour maps.
//!
//! Takes a name, gives linear colours along 0..1. The tables come from the crate colorous (the schemes of matplotlib,
//! ColorBrewer and d3), which gives 8-bit sRGB; they are decoded to linear light here.

use std::str::FromStr;

use resample_core::image::linear_from_srgb;

use crate::transfer::ColourKnot;

/// A named colour map. `parse` gives one by name; the default is viridis.
#[derive(Clone, Copy, Debug)]
pub struct ColourMap {
    name: &'static str,
    gradient: colorous::Gradient,
}

/// Colours that a map is sampled at: the tables behind the schemes have at most 256 entries.
const STEPS: usize = 256;

const MAPS: [(&str, colorous::Gradient); 38] = [
    ("viridis", colorous::VIRIDIS),
    ("inferno", colorous::INFERNO),
    ("magma", colorous::MAGMA),
    ("plasma", colorous::PLASMA),
    ("cividis", colorous::CIVIDIS),
    ("turbo", colorous::TURBO),
    ("greys", colorous::GREYS),
    ("blues", colorous::BLUES),
    ("greens", colorous::GREENS),
    ("oranges", colorous::ORANGES),
    ("purples", colorous::PURPLES),
    ("reds", colorous::REDS),
    ("warm", colorous::WARM),
    ("cool", colorous::COOL),
    ("cubehelix", colorous::CUBEHELIX),
    ("bugn", colorous::BLUE_GREEN),
    ("bupu", colorous::BLUE_PURPLE),
    ("gnbu", colorous::GREEN_BLUE),
    ("orrd", colorous::ORANGE_RED),
    ("pubugn", colorous::PURPLE_BLUE_GREEN),
    ("pubu", colorous::PURPLE_BLUE),
    ("purd", colorous::PURPLE_RED),
    ("rdpu", colorous::RED_PURPLE),
    ("ylgnbu", colorous::YELLOW_GREEN_BLUE),
    ("ylgn", colorous::YELLOW_GREEN),
    ("ylorbr", colorous::YELLOW_ORANGE_BROWN),
    ("ylorrd", colorous::YELLOW_ORANGE_RED),
    ("brbg", colorous::BROWN_GREEN),
    ("prgn", colorous::PURPLE_GREEN),
    ("piyg", colorous::PINK_GREEN),
    ("puor", colorous::PURPLE_ORANGE),
    ("rdbu", colorous::RED_BLUE),
    ("rdgy", colorous::RED_GREY),
    ("rdylbu", colorous::RED_YELLOW_BLUE),
    ("rdylgn", colorous::RED_YELLOW_GREEN),
    ("spectral", colorous::SPECTRAL),
    ("rainbow", colorous::RAINBOW),
    ("sinebow", colorous::SINEBOW),
];

impl ColourMap {
    /// All names, the usual ones first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        MAPS.iter().map(|(name, _)| *name)
    }

    /// The name of this map, lower case.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Linear RGB at a place along the map; places outside 0..=1 give the ends.
    pub fn colour(&self, place: f64) -> [f32; 3] {
        let colour = self.gradient.eval_continuous(place.clamp(0.0, 1.0));
        [colour.r, colour.g, colour.b].map(|code| linear_from_srgb(f32::from(code) / 255.0))
    }

    /// The map as knots over a range of scalars; one knot where the range is empty.
    pub(super) fn knots(&self, low: f64, high: f64) -> Vec<ColourKnot> {
        if low >= high {
            return vec![ColourKnot {
                value: low,
                rgb: self.colour(1.0),
            }];
        }
        let last = (STEPS - 1) as f64;
        let places = (0..STEPS).map(|step| step as f64 / last);
        // Weighted ends instead of low + place * (high - low), which can overflow.
        places
            .map(|place| ColourKnot {
                value: low * (1.0 - place) + high * place,
                rgb: self.colour(place),
            })
            .collect()
    }
}

impl Default for ColourMap {
    fn default() -> Self {
        let (name, gradient) = MAPS[0];
        Self { name, gradient }
    }
}

impl FromStr for ColourMap {
    type Err = String;

    /// Case does not matter. The error lists all names.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = match text.trim().to_lowercase().as_str() {
            "grey" | "gray" | "grays" => "greys".to_owned(),
            other => other.to_owned(),
        };
        let found = MAPS.iter().find(|(name, _)| *name == wanted);
        found
            .map(|&(name, gradient)| Self { name, gradient })
            .ok_or_else(|| {
                let names: Vec<_> = Self::names().collect();
                format!(
                    "unknown colour map '{text}': expected one of {}",
                    names.join(", ")
                )
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_any_case_and_unknown_ones_list_all() {
        for name in ColourMap::names() {
            let map: ColourMap = name.to_uppercase().parse().expect("a listed name");
            assert_eq!(map.name(), name);
        }
        assert_eq!("gray".parse::<ColourMap>().expect("alias").name(), "greys");
        let text = "jet".parse::<ColourMap>().expect_err("no such map");
        assert!(
            text.contains("'jet'") && text.contains("viridis, inferno") && text.contains("sinebow"),
            "{text}"
        );
    }

    #[test]
    fn colours_are_decoded_to_linear_light() {
        // The ends of viridis are #440154 and #fde725.
        let first = ColourMap::default().colour(0.0);
        let last = ColourMap::default().colour(1.0);
        for (channel, code) in [0x44, 0x01, 0x54].into_iter().enumerate() {
            assert_eq!(
                first[channel],
                linear_from_srgb(code as f32 / 255.0),
                "channel {channel}"
            );
        }
        assert!(
            (last[0] - linear_from_srgb(253.0 / 255.0)).abs() < 1e-6,
            "{last:?}"
        );
        assert_eq!(ColourMap::default().colour(7.0), last, "beyond the end");
    }

    #[test]
    fn knots_span_the_range_without_overflow() {
        let knots = ColourMap::default().knots(-1e308, 1e308);
        assert!(
            knots.windows(2).all(|pair| pair[0].value < pair[1].value),
            "ascending"
        );
        assert_eq!((knots[0].value, knots[STEPS - 1].value), (-1e308, 1e308));
        assert_eq!(ColourMap::default().knots(3.0, 3.0).len(), 1);
    }
}
