//! The transfer function: from a scalar to a colour and an opacity, and from an opacity to the extinction that pictures sum.
//!
//! Takes colour knots and opacity knots, returns both at any scalar. Between knots the colour (linear light) and the
//! opacity are interpolated linearly, beyond the ends they are constant. Two knots at one value are a step, and the
//! upper side of the step holds from that value on: with knots (71, 0) and (71, 1), a scalar of 71 is opaque.
//! Opacity is meant per unit of length; 1 is allowed, and the renderer bounds the extinction that follows from it.
//! Readers and makers of transfer functions are in the other files of this folder; all of them end in knots.

use crate::volume::histogram::share_of;
use resample_core::OpacityMode;

use crate::Error;

/// Scalar to colour and opacity, both piecewise linear.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    pub(crate) colours: Vec<ColourKnot>,
    pub(crate) opacities: Vec<OpacityKnot>,
}

/// The colour at one scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourKnot {
    /// The scalar, finite.
    pub value: f64,
    /// Red, green, blue in linear light, each finite and at least 0.
    pub rgb: [f32; 3],
}

/// The opacity at one scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpacityKnot {
    /// The scalar, finite.
    pub value: f64,
    /// Opacity over one unit of length, 0..=1.
    pub opacity: f64,
}

/// The meaning of the numbers of a colour in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum ColourEncoding {
    /// Proportional to light
    #[default]
    Linear,
    /// As on a screen; interpolated as written, then decoded
    Srgb,
}

impl TransferFunction {
    /// A transfer function of at least one knot each, in ascending order of their scalars; equal ones are steps.
    ///
    /// Refused with [`Error::Option`], naming the knot: descending or non-finite scalars, negative or non-finite
    /// colours, opacities outside 0..=1.
    ///
    /// ```
    /// use resample_volume::TransferFunction;
    /// use resample_volume::transfer::{ColourKnot, OpacityKnot};
    ///
    /// let black = ColourKnot { value: 0.0, rgb: [0.0; 3] };
    /// let white = ColourKnot { value: 100.0, rgb: [1.0; 3] };
    /// let clear = OpacityKnot { value: 20.0, opacity: 0.0 };
    /// let opaque = OpacityKnot { value: 60.0, opacity: 1.0 };
    /// let function = TransferFunction::new(vec![black, white], vec![clear, opaque])?;
    /// assert_eq!(function.opacity(40.0), 0.5);
    /// assert_eq!(function.colour(50.0), [0.5; 3]);
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn new(colours: Vec<ColourKnot>, opacities: Vec<OpacityKnot>) -> Result<Self, Error> {
        check_ascending("colour", colours.iter().map(|knot| knot.value))?;
        check_ascending("opacity", opacities.iter().map(|knot| knot.value))?;
        let is_colour = |knot: &ColourKnot| {
            knot.rgb
                .iter()
                .all(|&channel| channel >= 0.0 && channel.is_finite())
        };
        if let Some(place) = colours.iter().position(|knot| !is_colour(knot)) {
            let rgb = colours[place].rgb;
            return Err(Error::Option(format!(
                "colour knot {place} is {rgb:?}: expected finite values from 0 on"
            )));
        }
        if let Some(place) = opacities
            .iter()
            .position(|knot| !(0.0..=1.0).contains(&knot.opacity))
        {
            let opacity = opacities[place].opacity;
            return Err(Error::Option(format!(
                "opacity knot {place} is {opacity}: expected 0 to 1"
            )));
        }
        Ok(Self { colours, opacities })
    }

    /// A function of knots that the caller has checked: at least one of each, as [`TransferFunction::new`] expects them, but values may
    /// be equal, as those of a preset are in a volume of one value.
    pub fn of_checked(colours: Vec<ColourKnot>, opacities: Vec<OpacityKnot>) -> Self {
        Self { colours, opacities }
    }

    /// Linear RGB and opacity at a scalar; a NaN scalar gives the first knots.
    pub fn sample(&self, value: f64) -> ([f32; 3], f64) {
        (self.colour(value), self.opacity(value))
    }

    /// Linear RGB at a scalar.
    pub fn colour(&self, value: f64) -> [f32; 3] {
        let above = self.colours.partition_point(|knot| knot.value <= value);
        let (Some(low), Some(high)) = (
            above.checked_sub(1).map(|k| &self.colours[k]),
            self.colours.get(above),
        ) else {
            return self.colours[above.saturating_sub(1)].rgb;
        };
        let share = share_of(value, low.value, high.value) as f32;
        [0, 1, 2].map(|channel| low.rgb[channel] + share * (high.rgb[channel] - low.rgb[channel]))
    }

    /// Opacity per unit of length at a scalar, 0..=1.
    pub fn opacity(&self, value: f64) -> f64 {
        let above = self.opacities.partition_point(|knot| knot.value <= value);
        let (Some(low), Some(high)) = (
            above.checked_sub(1).map(|k| &self.opacities[k]),
            self.opacities.get(above),
        ) else {
            return self.opacities[above.saturating_sub(1)].opacity;
        };
        let mixed =
            low.opacity + share_of(value, low.value, high.value) * (high.opacity - low.opacity);
        // Rounding must not lift it above the knots, which bound it.
        mixed.clamp(low.opacity.min(high.opacity), low.opacity.max(high.opacity))
    }

    /// The least closed interval of scalars outside which the opacity is 0; `None` if it is 0 everywhere.
    ///
    /// An end is infinite where the opacity stays above 0 beyond the last knot.
    ///
    /// ```
    /// use resample_volume::TransferFunction;
    /// use resample_volume::transfer::{ColourKnot, OpacityKnot};
    ///
    /// let black = ColourKnot { value: 0.0, rgb: [0.0; 3] };
    /// let white = ColourKnot { value: 100.0, rgb: [1.0; 3] };
    /// let clear = OpacityKnot { value: 20.0, opacity: 0.0 };
    /// let opaque = OpacityKnot { value: 60.0, opacity: 1.0 };
    /// let function = TransferFunction::new(vec![black, white], vec![clear, opaque])?;
    /// assert_eq!(function.visible_range(), Some((20.0, f64::INFINITY)));
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn visible_range(&self) -> Option<(f64, f64)> {
        let knots = &self.opacities;
        let first = knots.iter().position(|knot| knot.opacity > 0.0)?;
        let last = knots.iter().rposition(|knot| knot.opacity > 0.0)?;
        let low = first
            .checked_sub(1)
            .map_or(f64::NEG_INFINITY, |before| knots[before].value);
        let high = knots
            .get(last + 1)
            .map_or(f64::INFINITY, |after| after.value);
        Some((low, high))
    }

    /// The same shape with its knots, from the first to the last of both kinds, moved to span `low..=high`.
    ///
    /// For colour maps that are written over 0..1 or -1..1. A function of one scalar only cannot span a range and is
    /// returned unchanged, as it is for a range that is not finite and ascending.
    ///
    /// ```
    /// use resample_volume::TransferFunction;
    /// use resample_volume::transfer::{ColourKnot, OpacityKnot};
    ///
    /// let black = ColourKnot { value: 0.0, rgb: [0.0; 3] };
    /// let white = ColourKnot { value: 100.0, rgb: [1.0; 3] };
    /// let clear = OpacityKnot { value: 20.0, opacity: 0.0 };
    /// let opaque = OpacityKnot { value: 60.0, opacity: 1.0 };
    /// let function = TransferFunction::new(vec![black, white], vec![clear, opaque])?;
    /// assert_eq!(function.rescaled(0.0, 200.0).opacity(80.0), 0.5);
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn rescaled(mut self, low: f64, high: f64) -> Self {
        let (first, last) = self.value_range();
        if !(last > first && high > low && (high - low).is_finite()) {
            return self;
        }
        let moved = |value: f64| low + share_of(value, first, last) * (high - low);
        self.colours
            .iter_mut()
            .for_each(|knot| knot.value = moved(knot.value));
        self.opacities
            .iter_mut()
            .for_each(|knot| knot.value = moved(knot.value));
        self
    }

    /// The scalars of the first and the last knot of either kind.
    pub fn value_range(&self) -> (f64, f64) {
        let colours = self.colours.iter().map(|knot| knot.value);
        colours
            .chain(self.opacities.iter().map(|knot| knot.value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
    }

    /// The scale of colours: the values between which colours change and something is shown, and 256 colours from the first to the last.
    pub fn scale(&self) -> ([f64; 2], Vec<[f32; 3]>) {
        let (low, high) = self.value_range();
        let (low, high) = match self.visible_range() {
            Some((least, most)) => (low.max(least), high.min(most)),
            None => (low, high),
        };
        let colour = |step: u32| {
            let share = f64::from(step) / 255.0;
            self.colour(low * (1.0 - share) + high * share)
        };
        ([low, high], (0..256).map(colour).collect())
    }

    /// The colour knots, ascending.
    pub fn colour_knots(&self) -> &[ColourKnot] {
        &self.colours
    }

    /// The opacity knots, ascending.
    pub fn opacity_knots(&self) -> &[OpacityKnot] {
        &self.opacities
    }
}

fn check_ascending(kind: &str, values: impl Iterator<Item = f64>) -> Result<(), Error> {
    let mut before = f64::NEG_INFINITY;
    let mut count = 0;
    for value in values {
        if !value.is_finite() || value < before {
            return Err(Error::Option(format!(
                "{kind} knot {count} is at {value}: expected finite values in ascending order"
            )));
        }
        before = value;
        count += 1;
    }
    if count == 0 {
        Err(Error::Option(format!(
            "a transfer function needs at least one {kind} knot"
        )))
    } else {
        Ok(())
    }
}

/// Extinction of a fully opaque voxel, per opacity unit: exp(-87) is the edge of what f32 holds as a normal number,
/// so more would change no pixel.
const MAX_EXTINCTION: f64 = 87.0;

/// Colour and strength of a scalar.
pub fn classified(transfer: &TransferFunction, mode: OpacityMode, value: f64) -> [f32; 4] {
    let (rgb, opacity) = transfer.sample(value);
    [rgb[0], rgb[1], rgb[2], strength_of(opacity, mode)]
}

/// Strength of an opacity: extinction per opacity unit, or with linear opacity the opacity.
pub fn strength_of(opacity: f64, mode: OpacityMode) -> f32 {
    let strength = match mode {
        OpacityMode::Extinction => (-(-opacity).ln_1p()).min(MAX_EXTINCTION),
        OpacityMode::Linear => opacity,
    };
    strength as f32
}

#[cfg(test)]
mod tests {
    use crate::transfer::*;

    fn function(opacities: &[(f64, f64)]) -> TransferFunction {
        let opacities = opacities
            .iter()
            .map(|&(value, opacity)| OpacityKnot { value, opacity })
            .collect();
        TransferFunction::new(
            vec![ColourKnot {
                value: 0.0,
                rgb: [1.0; 3],
            }],
            opacities,
        )
        .expect("valid")
    }

    #[test]
    fn linear_between_knots_and_constant_beyond() {
        let colours = vec![
            ColourKnot {
                value: 1.0,
                rgb: [0.0, 0.5, 1.0],
            },
            ColourKnot {
                value: 3.0,
                rgb: [1.0, 0.5, 0.0],
            },
        ];
        let opacities = vec![
            OpacityKnot {
                value: 0.0,
                opacity: 0.5,
            },
            OpacityKnot {
                value: 4.0,
                opacity: 1.0,
            },
        ];
        let function = TransferFunction::new(colours, opacities).expect("valid");
        assert_eq!(function.sample(2.0), ([0.5, 0.5, 0.5], 0.75));
        assert_eq!(function.sample(-9.0), ([0.0, 0.5, 1.0], 0.5));
        assert_eq!(function.sample(9.0), ([1.0, 0.5, 0.0], 1.0));
        assert_eq!(function.value_range(), (0.0, 4.0));
    }

    #[test]
    fn the_upper_side_of_a_step_holds_from_its_value_on() {
        let function = function(&[
            (0.0, 0.0),
            (71.0, 0.0),
            (71.0, 0.3),
            (71.0, 1.0),
            (80.0, 0.5),
        ]);
        assert_eq!(
            (
                function.opacity(71.0f64.next_down()),
                function.opacity(71.0)
            ),
            (0.0, 1.0)
        );
    }

    #[test]
    fn the_visible_range_is_the_least_interval() {
        assert_eq!(
            function(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (3.0, 0.0), (9.0, 0.0)]).visible_range(),
            Some((1.0, 3.0))
        );
        assert_eq!(
            function(&[(0.0, 0.0), (1.0, 0.1)]).visible_range(),
            Some((0.0, f64::INFINITY))
        );
        assert_eq!(
            function(&[(0.0, 0.1)]).visible_range(),
            Some((f64::NEG_INFINITY, f64::INFINITY))
        );
        assert_eq!(function(&[(0.0, 0.0), (1.0, 0.0)]).visible_range(), None);
        assert_eq!(
            function(&[(71.0, 0.0), (71.0, 1.0)]).visible_range(),
            Some((71.0, f64::INFINITY))
        );
    }

    #[test]
    fn rescaling_moves_knots_to_the_range() {
        let function = function(&[(-1.0, 0.0), (0.0, 0.25), (1.0, 1.0)]).rescaled(100.0, 300.0);
        assert_eq!(function.value_range(), (100.0, 300.0));
        assert_eq!(function.opacity(200.0), 0.25);
        assert_eq!(
            function.clone().rescaled(5.0, 5.0),
            function,
            "an empty range changes nothing"
        );
    }

    #[test]
    fn extreme_scalars_stay_finite() {
        let function = function(&[(-1.7e308, 0.0), (1.7e308, 1.0)]);
        assert_eq!(function.opacity(0.0), 0.5);
        assert_eq!(
            (
                function.opacity(f64::INFINITY),
                function.opacity(f64::NEG_INFINITY)
            ),
            (1.0, 0.0)
        );
        assert!(function.opacity(f64::NAN).is_finite());
    }

    #[test]
    fn faulty_knots_are_named() {
        let colour = |value, red| ColourKnot {
            value,
            rgb: [red, 0.0, 0.0],
        };
        let opacity = |value, opacity| OpacityKnot { value, opacity };
        let cases = [
            (vec![], vec![opacity(0.0, 0.0)], "at least one colour knot"),
            (vec![colour(0.0, 0.0)], vec![], "at least one opacity knot"),
            (
                vec![colour(2.0, 0.0), colour(1.0, 0.0)],
                vec![opacity(0.0, 0.0)],
                "colour knot 1 is at 1",
            ),
            (
                vec![colour(f64::NAN, 0.0)],
                vec![opacity(0.0, 0.0)],
                "colour knot 0 is at NaN",
            ),
            (
                vec![colour(0.0, -0.5)],
                vec![opacity(0.0, 0.0)],
                "colour knot 0 is [-0.5",
            ),
            (
                vec![colour(0.0, f32::INFINITY)],
                vec![opacity(0.0, 0.0)],
                "colour knot 0 is [inf",
            ),
            (
                vec![colour(0.0, 0.0)],
                vec![opacity(0.0, 1.5)],
                "opacity knot 0 is 1.5",
            ),
            (
                vec![colour(0.0, 0.0)],
                vec![opacity(0.0, f64::NAN)],
                "opacity knot 0 is NaN",
            ),
        ];
        for (colours, opacities, expected) in cases {
            let text = TransferFunction::new(colours, opacities)
                .expect_err("faulty")
                .to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
