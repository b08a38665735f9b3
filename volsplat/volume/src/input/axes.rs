//! The channels of an image and its points in time, as the file's metadata tells them.
//!
//! Microscopes write several channels into one file: OME-TIFF, ImageJ's stacks, OME-Zarr and Imaris. Readers of these formats make the types of this
//! file. Limits: components of vectors and colours are no channels.

use std::path::Path;

/// A channel of an image, as the file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageChannel {
    /// Its name, such as that of a dye.
    pub name: Option<String>,
    /// Its display colour (sRGB).
    pub rgb: Option<[u8; 3]>,
    /// The value that is shown black, and the greater one that is shown in full colour.
    pub window: Option<[f64; 2]>,
    /// Returns false where the file says that the channel is switched off.
    pub is_shown: bool,
}

impl Default for ImageChannel {
    /// A channel of which nothing is known.
    fn default() -> Self {
        Self {
            name: None,
            rgb: None,
            window: None,
            is_shown: true,
        }
    }
}

/// The axes of an image beside those of space.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageAxes {
    /// The channels, at least one.
    pub channels: Vec<ImageChannel>,
    /// Points in time, at least 1.
    pub times: usize,
}

impl Default for ImageAxes {
    /// One channel at one time.
    fn default() -> Self {
        Self {
            channels: vec![ImageChannel::default()],
            times: 1,
        }
    }
}

impl ImageAxes {
    /// The channels by number and name, for a person.
    pub fn numbered_names(&self) -> String {
        let name = |(number, channel): (usize, &ImageChannel)| match &channel.name {
            Some(name) => format!("{number} {name}"),
            None => number.to_string(),
        };
        let names: Vec<String> = self.channels.iter().enumerate().map(name).collect();
        names.join(", ")
    }

    /// The number of a channel by its number or its name, in any case; of an image of one channel any number, which is that of a component of
    /// its vectors.
    ///
    /// # Errors
    /// A word that names no channel, for a person.
    pub fn number_of(&self, word: &str) -> Result<usize, String> {
        let count = self.channels.len();
        let number = word.parse::<usize>().ok();
        if let Some(number) = number.filter(|&number| count == 1 || number < count) {
            return Ok(number);
        }
        let is_named = |channel: &ImageChannel| {
            let name = channel.name.as_deref().map(str::to_lowercase);
            name.is_some_and(|name| name == word.to_lowercase())
        };
        let found = self.channels.iter().position(is_named);
        found.ok_or_else(|| {
            format!(
                "no such channel; expected a number from 0 to {} or a name: {}",
                count - 1,
                self.numbered_names()
            )
        })
    }

    /// Leaves out colours that tell nothing apart: of several channels all have the same, as where a program fills in white.
    pub(crate) fn without_equal_colours(mut self) -> Self {
        let first = self.channels[0].rgb;
        if self.channels.len() > 1 && self.channels.iter().all(|channel| channel.rgb == first) {
            self.channels
                .iter_mut()
                .for_each(|channel| channel.rgb = None);
        }
        self
    }
}

/// The window between two values of a file; `None` unless both are finite and the second is greater.
pub(crate) fn window(low: Option<f64>, high: Option<f64>) -> Option<[f64; 2]> {
    let window = [low?, high?];
    (window[0] < window[1] && window.iter().all(|end| end.is_finite())).then_some(window)
}

/// The sign of a unit of length by its name or sign; `None` for pixels, and for names that are no length.
pub(crate) fn unit(name: &str) -> Option<String> {
    let sign = match name.trim().to_lowercase().as_str() {
        "micrometer" | "micrometre" | "micron" | "microns" | "um" | "µm" | "μm" | "\\u00b5m" => {
            "µm"
        }
        "nanometer" | "nanometre" | "nm" => "nm",
        "angstrom" | "ångström" | "å" => "Å",
        "millimeter" | "millimetre" | "mm" => "mm",
        "centimeter" | "centimetre" | "cm" => "cm",
        "meter" | "metre" | "m" => "m",
        "inch" | "in" => "in",
        _ => return None,
    };
    Some(sign.to_owned())
}

/// The remark of a reader that takes the first of several points in time.
pub(crate) fn first_of(times: usize, path: &Path) -> String {
    let name = path.display();
    format!(
        "{name}: holds {times} volumes over time, the first is read: {name}#time=N names another, from 0 on"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(channels: &[(Option<&str>, Option<[u8; 3]>)]) -> ImageAxes {
        let channel = |&(name, rgb): &(Option<&str>, _)| ImageChannel {
            name: name.map(str::to_owned),
            rgb,
            ..ImageChannel::default()
        };
        ImageAxes {
            channels: channels.iter().map(channel).collect(),
            times: 1,
        }
    }

    #[test]
    fn channels_have_numbers_and_names_in_any_case() {
        let stained = axes(&[(Some("DAPI"), None), (None, None), (Some("GFP 2"), None)]);
        assert_eq!(stained.numbered_names(), "0 DAPI, 1, 2 GFP 2");
        for (word, number) in [("0", 0), ("2", 2), ("dapi", 0), ("gfp 2", 2)] {
            assert_eq!(stained.number_of(word), Ok(number), "{word}");
        }
        for word in ["3", "gfp", "-1", ""] {
            let error = stained.number_of(word).expect_err(word);
            assert!(
                error.contains("from 0 to 2 or a name: 0 DAPI, 1, 2 GFP 2"),
                "{error}"
            );
        }
        assert_eq!(
            axes(&[(None, None)]).number_of("5"),
            Ok(5),
            "a component of vectors"
        );
    }

    #[test]
    fn colours_that_are_alike_tell_nothing() {
        let (white, green) = (Some([255; 3]), Some([0, 255, 0]));
        let colours = |channels: &[_]| {
            let kept = axes(channels).without_equal_colours();
            kept.channels
                .iter()
                .map(|channel| channel.rgb)
                .collect::<Vec<_>>()
        };
        assert_eq!(colours(&[(None, white), (None, white)]), [None, None]);
        assert_eq!(colours(&[(None, white), (None, green)]), [white, green]);
        assert_eq!(
            colours(&[(None, green)]),
            [green],
            "of one channel it is all that is known"
        );
    }

    #[test]
    fn windows_rise_and_units_are_lengths() {
        assert_eq!(window(Some(-1.0), Some(4.0)), Some([-1.0, 4.0]));
        for (low, high) in [
            (None, Some(1.0)),
            (Some(1.0), None),
            (Some(2.0), Some(2.0)),
            (Some(3.0), Some(2.0)),
            (Some(0.0), Some(f64::INFINITY)),
            (Some(f64::NAN), Some(1.0)),
        ] {
            assert_eq!(window(low, high), None, "{low:?} to {high:?}");
        }
        for (name, sign) in [
            (" Micron ", "µm"),
            ("nanometer", "nm"),
            ("Ångström", "Å"),
            ("Å", "Å"),
            ("MM", "mm"),
            ("cm", "cm"),
            ("metre", "m"),
            ("inch", "in"),
            ("pixel", ""),
        ] {
            assert_eq!(unit(name).unwrap_or_default(), sign, "{name}");
        }
    }
}
