//! Named colour maps, and the transfer functions of voxels that are colours, each of whose components tints the channel that gives the opacity.
//!
//! Takes a name, returns linear colours along 0..1. The tables come from the crate colorous (the schemes of matplotlib,
//! ColorBrewer and d3), which gives 8-bit sRGB; they are decoded to linear light here. It lacks `coolwarm` and `hot`, which simulations and
//! PET are shown in: their steps are here. `greys` is our own: black to white, so that a projection shows high values bright. Every name with `_r` behind it is the map from its end to its beginning.

use std::str::FromStr;

use crate::volume::{Described, VoxelType};
use resample_core::image::linear_from_srgb;
use resample_core::narrow::{cell, single};

use crate::transfer::{ColourKnot, OpacityKnot, TransferFunction};

/// A named colour map. `parse` gives one by name; the default is viridis.
#[derive(Clone, Copy, Debug)]
pub struct ColourMap {
    name: &'static str,
    scheme: Scheme,
    direction: Direction,
}

/// Where a map's colours come from.
#[derive(Clone, Copy, Debug)]
enum Scheme {
    Table(colorous::Gradient),
    /// Colours in equal steps, codes of sRGB, with straight lines between them.
    Steps(&'static [[u8; 3]]),
    /// Black to white in equal steps of sRGB.
    Greys,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Ascending,
    Reversed,
}

/// The suffix of a reversed map's name.
const REVERSED: &str = "_r";

/// Colours that a map is sampled at: the tables behind the schemes have at most 256 entries.
const STEPS: usize = 256;

/// Blue over light grey to red: the map of Moreland, "Diverging Color Maps for Scientific Visualization" (2009), by his formula
/// between (59, 76, 192) and (180, 4, 38).
const COOL_WARM: [[u8; 3]; 33] = [
    [59, 76, 192],
    [68, 90, 204],
    [78, 104, 215],
    [88, 117, 225],
    [98, 130, 234],
    [108, 142, 241],
    [119, 154, 247],
    [130, 165, 251],
    [141, 176, 254],
    [152, 185, 255],
    [163, 194, 255],
    [174, 201, 253],
    [184, 208, 249],
    [194, 213, 244],
    [204, 217, 238],
    [213, 219, 230],
    [221, 221, 221],
    [229, 216, 209],
    [236, 211, 198],
    [241, 204, 185],
    [245, 196, 173],
    [247, 187, 160],
    [247, 177, 148],
    [247, 166, 135],
    [244, 154, 123],
    [241, 141, 111],
    [236, 127, 99],
    [229, 112, 87],
    [222, 97, 76],
    [213, 80, 66],
    [203, 62, 56],
    [192, 40, 47],
    [180, 4, 38],
];

/// Black, red, yellow and white, as metal glows: MATLAB's map, whose channels rise one after another over 3, 3 and 2 eighths.
const HOT: [[u8; 3]; 9] = [
    [0, 0, 0],
    [85, 0, 0],
    [170, 0, 0],
    [255, 0, 0],
    [255, 85, 0],
    [255, 170, 0],
    [255, 255, 0],
    [255, 255, 128],
    [255, 255, 255],
];

const MAPS: [(&str, Scheme); 40] = [
    ("viridis", Scheme::Table(colorous::VIRIDIS)),
    ("inferno", Scheme::Table(colorous::INFERNO)),
    ("magma", Scheme::Table(colorous::MAGMA)),
    ("plasma", Scheme::Table(colorous::PLASMA)),
    ("cividis", Scheme::Table(colorous::CIVIDIS)),
    ("turbo", Scheme::Table(colorous::TURBO)),
    ("coolwarm", Scheme::Steps(&COOL_WARM)),
    ("hot", Scheme::Steps(&HOT)),
    ("greys", Scheme::Greys),
    ("blues", Scheme::Table(colorous::BLUES)),
    ("greens", Scheme::Table(colorous::GREENS)),
    ("oranges", Scheme::Table(colorous::ORANGES)),
    ("purples", Scheme::Table(colorous::PURPLES)),
    ("reds", Scheme::Table(colorous::REDS)),
    ("warm", Scheme::Table(colorous::WARM)),
    ("cool", Scheme::Table(colorous::COOL)),
    ("cubehelix", Scheme::Table(colorous::CUBEHELIX)),
    ("bugn", Scheme::Table(colorous::BLUE_GREEN)),
    ("bupu", Scheme::Table(colorous::BLUE_PURPLE)),
    ("gnbu", Scheme::Table(colorous::GREEN_BLUE)),
    ("orrd", Scheme::Table(colorous::ORANGE_RED)),
    ("pubugn", Scheme::Table(colorous::PURPLE_BLUE_GREEN)),
    ("pubu", Scheme::Table(colorous::PURPLE_BLUE)),
    ("purd", Scheme::Table(colorous::PURPLE_RED)),
    ("rdpu", Scheme::Table(colorous::RED_PURPLE)),
    ("ylgnbu", Scheme::Table(colorous::YELLOW_GREEN_BLUE)),
    ("ylgn", Scheme::Table(colorous::YELLOW_GREEN)),
    ("ylorbr", Scheme::Table(colorous::YELLOW_ORANGE_BROWN)),
    ("ylorrd", Scheme::Table(colorous::YELLOW_ORANGE_RED)),
    ("brbg", Scheme::Table(colorous::BROWN_GREEN)),
    ("prgn", Scheme::Table(colorous::PURPLE_GREEN)),
    ("piyg", Scheme::Table(colorous::PINK_GREEN)),
    ("puor", Scheme::Table(colorous::PURPLE_ORANGE)),
    ("rdbu", Scheme::Table(colorous::RED_BLUE)),
    ("rdgy", Scheme::Table(colorous::RED_GREY)),
    ("rdylbu", Scheme::Table(colorous::RED_YELLOW_BLUE)),
    ("rdylgn", Scheme::Table(colorous::RED_YELLOW_GREEN)),
    ("spectral", Scheme::Table(colorous::SPECTRAL)),
    ("rainbow", Scheme::Table(colorous::RAINBOW)),
    ("sinebow", Scheme::Table(colorous::SINEBOW)),
];

impl ColourMap {
    /// All names, the usual ones first; each also stands reversed, with `_r` behind it.
    pub fn names() -> impl Iterator<Item = &'static str> {
        MAPS.iter().map(|(name, _)| *name)
    }

    /// The name of this map, lower case.
    pub fn name(&self) -> String {
        match self.direction {
            Direction::Ascending => self.name.to_owned(),
            Direction::Reversed => format!("{}{REVERSED}", self.name),
        }
    }

    /// Black to white: what a projection of values is shown in.
    pub fn greys() -> Self {
        Self {
            name: "greys",
            scheme: Scheme::Greys,
            direction: Direction::Ascending,
        }
    }

    /// Linear RGB at a place along the map; places outside 0..=1 give the ends.
    ///
    /// ```
    /// use resample_volume::ColourMap;
    ///
    /// let viridis: ColourMap = "viridis".parse()?;
    /// let [_, green_low, _] = viridis.colour(0.0);
    /// let [_, green_high, _] = viridis.colour(1.0);
    /// assert!(green_high > green_low);
    /// # Ok::<(), String>(())
    /// ```
    pub fn colour(&self, place: f64) -> [f32; 3] {
        let place = match self.direction {
            Direction::Ascending => place.clamp(0.0, 1.0),
            Direction::Reversed => 1.0 - place.clamp(0.0, 1.0),
        };
        match self.scheme {
            Scheme::Table(gradient) => {
                let colour = gradient.eval_continuous(place);
                [colour.r, colour.g, colour.b].map(|code| linear_from_srgb(f32::from(code) / 255.0))
            }
            Scheme::Steps(steps) => {
                let along = place * (steps.len() - 1) as f64;
                let before = cell(single(along)).min(steps.len() - 2);
                let share = single(along - before as f64);
                [0, 1, 2].map(|channel| {
                    let [from, to] = [0, 1].map(|next| f32::from(steps[before + next][channel]));
                    linear_from_srgb((from + share * (to - from)) / 255.0)
                })
            }
            Scheme::Greys => [linear_from_srgb(place as f32); 3],
        }
    }

    /// The map as knots over a range of scalars; one knot where the range is empty.
    pub(crate) fn knots(&self, low: f64, high: f64) -> Vec<ColourKnot> {
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
        let (name, scheme) = MAPS[0];
        Self {
            name,
            scheme,
            direction: Direction::Ascending,
        }
    }
}

impl FromStr for ColourMap {
    type Err = String;

    /// Case does not matter. The error lists all names.
    fn from_str(text: &str) -> Result<Self, String> {
        let written = text.trim().to_lowercase();
        let (base, direction) = match written.strip_suffix(REVERSED) {
            Some(base) => (base, Direction::Reversed),
            None => (written.as_str(), Direction::Ascending),
        };
        let wanted = match base {
            "grey" | "gray" | "grays" => "greys",
            other => other,
        };
        let found = MAPS.iter().find(|(name, _)| *name == wanted);
        found
            .map(|&(name, scheme)| Self {
                name,
                scheme,
                direction,
            })
            .ok_or_else(|| {
                let names: Vec<_> = Self::names().collect();
                format!(
                    "unknown colour map '{text}': expected one of {}; NAME_r is the reversed map",
                    names.join(", ")
                )
            })
    }
}

/// The transfer function of a colour component (0 is red): from its sRGB code to linear light.
pub fn tint(component: usize, volume: &dyn Described) -> TransferFunction {
    let most = match volume.voxel_type() {
        VoxelType::U16 => u16::MAX,
        _ => u16::from(u8::MAX),
    };
    let knot = |code: u16| {
        let share = f32::from(code) / f32::from(u8::MAX);
        let mut rgb = [0.0; 3];
        rgb[component] = linear_from_srgb(share);
        ColourKnot {
            value: f64::from(share) * f64::from(most),
            rgb,
        }
    };
    let opaque = OpacityKnot {
        value: 0.0,
        opacity: 1.0,
    };
    TransferFunction {
        colours: (0..=u16::from(u8::MAX)).map(knot).collect(),
        opacities: vec![opaque],
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
        for alias in ["gray", "grey", "grays", "greys"] {
            let map = alias.parse::<ColourMap>().expect("alias");
            assert_eq!(
                (map.name(), map.colour(0.0)),
                ("greys".to_owned(), [0.0; 3])
            );
            assert_eq!(map.colour(1.0), [1.0; 3], "high values are bright");
        }
        let text = "jet".parse::<ColourMap>().expect_err("no such map");
        assert!(
            text.contains("'jet'") && text.contains("viridis, inferno") && text.contains("sinebow"),
            "{text}"
        );
    }

    #[test]
    fn a_reversed_map_begins_at_the_end() {
        for name in ColourMap::names() {
            let [map, reversed]: [ColourMap; 2] =
                [name.to_owned(), format!("{name}_R")].map(|name| name.parse().expect("a name"));
            assert_eq!(reversed.name(), format!("{name}_r"));
            for place in [0.0, 0.25, 1.0] {
                assert_eq!(map.colour(place), reversed.colour(1.0 - place), "{name}");
            }
        }
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
    fn maps_of_steps_pass_through_them() {
        let map: ColourMap = "coolwarm".parse().expect("a name");
        let decoded = |code: [u8; 3]| code.map(|code| linear_from_srgb(f32::from(code) / 255.0));
        assert_eq!(map.colour(0.0), decoded([59, 76, 192]), "blue");
        assert_eq!(map.colour(0.5), decoded([221, 221, 221]), "light grey");
        assert_eq!(map.colour(1.0), decoded([180, 4, 38]), "red");
        let hot: ColourMap = "hot".parse().expect("a name");
        let half = linear_from_srgb(0.5 * 85.0 / 255.0);
        assert_eq!(hot.colour(1.0 / 16.0), [half, 0.0, 0.0], "half a step");
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
