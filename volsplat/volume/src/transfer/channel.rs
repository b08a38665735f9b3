//! The look of a channel of a microscope: one colour or a colour map, a window, and a curve of brightness.
//!
//! Takes a [`ChannelStyle`] and the histogram of the channel, returns a transfer function. A window maps values to shares from 0 to 1, and gamma
//! bends them, as a microscope's program shows a channel on a display: the share to the power of gamma is the display code, black to full
//! colour. Colours do not darken with the share: opacity does, in linear light.

use resample_core::image::linear_from_srgb;

use crate::Error;
use crate::transfer::automatic::background_end;
use crate::transfer::{ColourKnot, ColourMap, Histogram, OpacityKnot, TransferFunction};

/// How a channel is shown.
#[derive(Clone, Debug)]
pub struct ChannelStyle {
    /// The colour of its values.
    pub colours: ChannelColours,
    /// The value that shows nothing and the greater one that is shown in full; `None` takes the end of the background and the value that
    /// the brightest few exceed.
    pub window: Option<[f64; 2]>,
    /// Power of the share of the window; above 0. 1 is linear on a display, less shows dim values brighter.
    pub gamma: f64,
    /// Opacity at the upper end of the window, 0 to 1. In emission it holds over one unit of opacity, in a projection for the pixel.
    pub opacity: f64,
}

/// The colours of a channel.
#[derive(Clone, Debug)]
pub enum ChannelColours {
    /// One colour in linear light.
    One([f32; 3]),
    /// A colour map over the window.
    Map(ColourMap),
}

/// Opacity of a channel in full colour over one unit in emission: a few voxels of it hide what lies behind, dim parts do not. A guess, looked at
/// on nuclei of two channels.
pub const EMISSION_OPACITY: f64 = 0.5;

/// Knots of the curve of brightness: straight pieces between them miss it by at most 1/2000 at gamma 1.
const CURVE_KNOTS: u32 = 32;

/// Display colours (sRGB) of channels that bring none, by the number of channels: all eyes tell two apart, and of more the first three
/// mix to all hues.
const PAIR: [[u8; 3]; 2] = [[0, 255, 0], [255, 0, 255]];
const SEVERAL: [[u8; 3]; 7] = [
    [0, 255, 255],
    [255, 0, 255],
    [255, 255, 0],
    [255, 0, 0],
    [0, 255, 0],
    [0, 0, 255],
    [255, 128, 0],
];

/// The display colour (sRGB) of a channel that brings none: white alone, green and magenta of two, then cyan, magenta, yellow, red, green,
/// blue and orange, over and over.
pub fn usual_colour(number: usize, channels: usize) -> [u8; 3] {
    match channels {
        0 | 1 => [255; 3],
        2 => PAIR[number % 2],
        _ => SEVERAL[number % SEVERAL.len()],
    }
}

impl ChannelStyle {
    /// One colour in linear light, the window of the data, gamma 1, all of `opacity`.
    pub fn new(rgb: [f32; 3], opacity: f64) -> Self {
        Self {
            colours: ChannelColours::One(rgb),
            window: None,
            gamma: 1.0,
            opacity,
        }
    }

    /// The given window, else that of the data.
    pub fn window_of(&self, histogram: &Histogram) -> [f64; 2] {
        self.window.unwrap_or_else(|| {
            let (least, most) = histogram.range();
            let low = background_end(histogram);
            let high = histogram.value_below_brightest();
            if low < high {
                rounded(low, high)
            } else {
                [least, most]
            }
        })
    }

    /// The transfer function of a channel with this histogram.
    ///
    /// # Errors
    /// [`Error::Option`] for a window that does not ascend, a gamma that is not above 0, and an opacity outside 0 to 1.
    ///
    /// ```
    /// use resample_volume::transfer::ChannelStyle;
    /// use resample_volume::{Described, Volume, Voxels};
    ///
    /// let voxels = Voxels::U8((0..=255).collect());
    /// let volume = Volume::new([16, 16, 1], voxels, glam::DAffine3::IDENTITY)?;
    /// let style = ChannelStyle { window: Some([10.0, 100.0]), ..ChannelStyle::new([0.0, 1.0, 0.0], 1.0) };
    /// let function = style.transfer(&volume.histogram())?;
    /// assert_eq!([function.opacity(10.0), function.opacity(100.0)], [0.0, 1.0]);
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn transfer(&self, histogram: &Histogram) -> Result<TransferFunction, Error> {
        let [low, high] = self.window_of(histogram);
        let refused = |what: String| Err(Error::Option(what));
        let ends_are_right = low.is_finite() && high.is_finite() && low <= high;
        if !ends_are_right || self.window.is_some() && low == high {
            return refused(format!(
                "the window of a channel is {low} to {high}: expected two finite values, the smaller one first"
            ));
        }
        if !(self.gamma > 0.0 && self.gamma.is_finite()) {
            return refused(format!(
                "the gamma of a channel is {}: expected a number above 0",
                self.gamma
            ));
        }
        if !(0.0..=1.0).contains(&self.opacity) {
            return refused(format!(
                "the opacity of a channel is {}: expected 0 to 1",
                self.opacity
            ));
        }
        let knot = |number: u32| {
            let share = f64::from(number) / f64::from(CURVE_KNOTS);
            OpacityKnot {
                value: low * (1.0 - share) + high * share,
                opacity: self.opacity * light_of_code(share.powf(self.gamma)),
            }
        };
        let colours = match &self.colours {
            ChannelColours::One(rgb) => vec![ColourKnot {
                value: low,
                rgb: *rgb,
            }],
            ChannelColours::Map(map) => map.knots(low, high),
        };
        // A channel of one value shows nothing.
        let nothing = OpacityKnot {
            value: low,
            opacity: 0.0,
        };
        let opacities = if low < high {
            (0..=CURVE_KNOTS).map(knot).collect()
        } else {
            vec![nothing]
        };
        TransferFunction::new(colours, opacities)
    }
}

/// A window at least as wide, with ends of three digits of its width, so that a person can read and type it.
fn rounded(low: f64, high: f64) -> [f64; 2] {
    let digits = 2 - (high - low).log10().floor() as i32;
    let (unit, is_fraction) = (10f64.powi(digits.abs()), digits > 0);
    // Powers of ten are exact, their fractions are not.
    let [a, b] = [low, high].map(|end| if is_fraction { end * unit } else { end / unit });
    // A division can leave a whole number a rounding error too high or too low.
    let ends = [(a + 1e-9).floor(), (b - 1e-9).ceil()]
        .map(|end| if is_fraction { end / unit } else { end * unit });
    if ends.iter().all(|end| end.is_finite()) {
        ends
    } else {
        [low, high]
    }
}

/// Linear light of a display code, both from 0 to 1.
fn light_of_code(code: f64) -> f64 {
    f64::from(linear_from_srgb(code as f32)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use crate::volume::Voxels;

    use super::*;

    fn histogram() -> Histogram {
        // 900 voxels of background about 2, and some of each value up to 100.
        let background = (0..900u32).map(|i| (i % 5) as u8);
        let voxels = Voxels::U8(background.chain(1..=100).collect());
        Histogram::over(&voxels, 0.0, 100.0, true)
    }

    #[test]
    fn codes_of_a_display_are_linear_in_the_window_and_gamma_bends_them() {
        let style = ChannelStyle {
            window: Some([20.0, 60.0]),
            ..ChannelStyle::new([0.0, 1.0, 0.0], 0.8)
        };
        let code = |style: &ChannelStyle, value: f64| {
            let function = style.transfer(&histogram()).expect("right");
            resample_core::image::srgb_from_linear((function.opacity(value) / 0.8) as f32)
        };
        for (value, expected) in [
            (0.0, 0.0),
            (20.0, 0.0),
            (30.0, 0.25),
            (40.0, 0.5),
            (70.0, 1.0),
        ] {
            let got = code(&style, value);
            assert!((got - expected).abs() < 1e-4, "{value}: {got}");
        }
        let bright = ChannelStyle {
            gamma: 0.5,
            ..style.clone()
        };
        assert!((code(&bright, 30.0) - 0.5).abs() < 1e-4);
        // Between knots, straight pieces are near the curve.
        for step in 0..400 {
            let value = 20.0 + 0.1 * f64::from(step);
            let function = style.transfer(&histogram()).expect("right");
            let exact = 0.8 * light_of_code((value - 20.0) / 40.0);
            assert!(
                (function.opacity(value) - exact).abs() < 1.0 / 2000.0,
                "{value}"
            );
        }
    }

    #[test]
    fn a_channel_without_a_window_takes_that_of_its_data() {
        let style = ChannelStyle::new([1.0; 3], 1.0);
        let [low, high] = style.window_of(&histogram());
        assert!(0.0 < low && low < high && high <= 100.0, "{low} {high}");
        assert_eq!(rounded(318.61, 1672.6), [310.0, 1680.0]);
        assert_eq!(rounded(0.012_345, 0.056_789), [0.0123, 0.0568]);
        let [low, high] = rounded(-1e300, 1e300);
        assert!((low / -1e300 - 1.0).abs() < 1e-9 && (high / 1e300 - 1.0).abs() < 1e-9);
        let flat = Histogram::over(&Voxels::U8(vec![7; 10]), 7.0, 7.0, true);
        assert_eq!(style.window_of(&flat), [7.0, 7.0]);
        style.transfer(&flat).expect("one value is no error");
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let right = ChannelStyle::new([1.0; 3], 1.0);
        for wrong in [
            ChannelStyle {
                window: Some([3.0, 3.0]),
                ..right.clone()
            },
            ChannelStyle {
                window: Some([3.0, f64::NAN]),
                ..right.clone()
            },
            ChannelStyle {
                gamma: 0.0,
                ..right.clone()
            },
            ChannelStyle {
                opacity: 1.5,
                ..right.clone()
            },
        ] {
            assert!(wrong.transfer(&histogram()).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn usual_colours_of_a_few_channels_differ() {
        for channels in 1..=7 {
            let mut colours: Vec<_> = (0..channels).map(|n| usual_colour(n, channels)).collect();
            colours.sort_unstable();
            colours.dedup();
            assert_eq!(colours.len(), channels);
        }
    }
}
