//! Transfer functions from a window, and more or less of an opacity.
//!
//! Takes a level and a width and gives the ramp that radiologists know; takes a function and a factor and gives the
//! function with its extinction multiplied by it. A scaled opacity is 1 - (1 - opacity)^s, which bends each straight
//! segment; the bent curve is cut at its middle, again and again, until straight pieces follow it.
//! Limits: the pieces miss the curve by at most [`MAX_ERROR`], apart from the last 2^-32 of a segment; see there.

use crate::Error;
use crate::look::transfer::{ColourMap, OpacityKnot, TransferFunction};

/// Most by which a piece misses the scaled opacity: a thirty-second of one of 256 levels. With it, the slope at opacity
/// 0, which decides how a long haze looks, is right within some 2 % for a factor of 2.
const MAX_ERROR: f64 = 1.0 / 8192.0;

/// Most halvings of a segment. Below a factor of 1 the curve rises ever more steeply towards opacity 1, and no number
/// of pieces follows it to the end; what is left is 2^-32 of the segment, narrower than 32-bit data can tell.
const MAX_HALVINGS: u32 = 32;

impl TransferFunction {
    /// The window of a radiologist: the scalars from `level - width / 2` to `level + width / 2` span the colour map and an
    /// opacity from 0 to 1; below all is transparent, above all is opaque.
    ///
    /// Refused with [`Error::Option`]: a width that is not above 0, and ends that are not finite.
    ///
    /// ```
    /// use volsplat::{ColourMap, TransferFunction};
    ///
    /// // Level 40, width 400: opacity rises from -160 to 240.
    /// let function = TransferFunction::window(40.0, 400.0, ColourMap::default())?;
    /// assert_eq!(function.value_range(), (-160.0, 240.0));
    /// # Ok::<(), volsplat::Error>(())
    /// ```
    pub fn window(level: f64, width: f64, map: ColourMap) -> Result<Self, Error> {
        let (low, high) = (level - 0.5 * width, level + 0.5 * width);
        if !(width > 0.0 && low.is_finite() && high.is_finite()) {
            return Err(Error::Option(format!(
                "a window of level {level} and width {width}: expected finite ends and a width above 0"
            )));
        }
        let opacities = vec![
            OpacityKnot {
                value: low,
                opacity: 0.0,
            },
            OpacityKnot {
                value: high,
                opacity: 1.0,
            },
        ];
        Ok(Self {
            colours: map.knots(low, high),
            opacities,
        })
    }

    /// The same colours, all of them opaque.
    pub(crate) fn opaque(&self) -> Self {
        let value = self.value_range().0;
        Self {
            colours: self.colours.clone(),
            opacities: vec![OpacityKnot {
                value,
                opacity: 1.0,
            }],
        }
    }

    /// The same function with its extinction multiplied by `scale`: an opacity a becomes 1 - (1 - a)^scale.
    ///
    /// Opacities 0 and 1 stay. Bent segments get knots enough to be within 1/8192 of the curve, except in the last 2^-32
    /// of a segment. Refused with [`Error::Option`]: a scale that is not above 0 and finite.
    pub fn with_opacity_scaled(mut self, scale: f64) -> Result<Self, Error> {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Error::Option(format!(
                "an opacity scale of {scale}: expected a number above 0"
            )));
        }
        let mut knots = Vec::with_capacity(self.opacities.len());
        for pair in self.opacities.windows(2) {
            knots.push(scaled(pair[0], scale));
            bend([pair[0], pair[1]], scale, MAX_HALVINGS, &mut knots);
        }
        knots.extend(self.opacities.last().map(|&knot| scaled(knot, scale)));
        self.opacities = knots;
        Ok(self)
    }
}

/// The knot with its extinction multiplied.
fn scaled(knot: OpacityKnot, scale: f64) -> OpacityKnot {
    // Small opacities keep all their digits this way.
    let opacity = -(scale * (-knot.opacity).ln_1p()).exp_m1();
    // The logarithm of 0 times a scale is infinite or not, but never gives less than nothing or more than all.
    OpacityKnot {
        value: knot.value,
        opacity: opacity.clamp(0.0, 1.0),
    }
}

/// Adds the knots between two, in ascending order.
fn bend(ends: [OpacityKnot; 2], scale: f64, halvings: u32, knots: &mut Vec<OpacityKnot>) {
    let [from, to] = ends;
    if halvings == 0 || chord_error(from.opacity, to.opacity, scale) <= MAX_ERROR {
        return;
    }
    let middle = OpacityKnot {
        value: from.value.midpoint(to.value),
        opacity: from.opacity.midpoint(to.opacity),
    };
    // Where the scalars have no number between them, there is no curve between them either.
    if !(from.value < middle.value && middle.value < to.value) {
        return;
    }
    bend([from, middle], scale, halvings - 1, knots);
    knots.push(scaled(middle, scale));
    bend([middle, to], scale, halvings - 1, knots);
}

/// Greatest distance between the scaled opacity and its chord over a segment of opacities.
///
/// The power t^s of the transparency t has no inflection, so the distance is greatest where its slope is the chord's.
fn chord_error(from: f64, to: f64, scale: f64) -> f64 {
    let (low, high) = (1.0 - from.max(to), 1.0 - from.min(to));
    if low >= high || scale == 1.0 {
        return 0.0;
    }
    let slope = (high.powf(scale) - low.powf(scale)) / (high - low);
    let place = (slope / scale).powf(1.0 / (scale - 1.0)).clamp(low, high);
    (low.powf(scale) + slope * (place - low) - place.powf(scale)).abs()
}

#[cfg(test)]
mod tests {
    use super::super::ColourKnot;
    use super::*;

    fn ramp(knots: &[(f64, f64)]) -> TransferFunction {
        let opacities = knots
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
    fn a_window_spans_the_map_and_the_ramp() {
        let map = ColourMap::default();
        let function = TransferFunction::window(40.0, 400.0, map).expect("a window");
        assert_eq!(
            function.value_range(),
            (-160.0, 240.0),
            "level -+ half the width"
        );
        for (value, opacity) in [
            (-1000.0, 0.0),
            (-160.0, 0.0),
            (-60.0, 0.25),
            (40.0, 0.5),
            (240.0, 1.0),
            (3000.0, 1.0),
        ] {
            assert_eq!(function.opacity(value), opacity, "opacity at {value}");
        }
        assert_eq!(
            function.colour(-160.0),
            map.colour(0.0),
            "the map begins at the low end"
        );
        assert_eq!(
            function.colour(240.0),
            map.colour(1.0),
            "the map ends at the high end"
        );
    }

    #[test]
    fn faulty_windows_and_scales_are_refused() {
        for (level, width) in [
            (0.0, 0.0),
            (0.0, -1.0),
            (f64::NAN, 1.0),
            (0.0, f64::INFINITY),
            (1.7e308, 1e308),
        ] {
            let window = TransferFunction::window(level, width, ColourMap::default());
            assert!(
                window.is_err(),
                "level {level}, width {width} must be refused"
            );
        }
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(
                ramp(&[(0.0, 0.5)]).with_opacity_scaled(scale).is_err(),
                "scale {scale} must be refused"
            );
        }
    }

    #[test]
    fn scaled_opacity_follows_the_power_within_the_stated_error() {
        let original = ramp(&[
            (0.0, 0.0),
            (10.0, 1.0),
            (12.0, 0.3),
            (12.0, 0.9),
            (20.0, 0.0),
        ]);
        for scale in [0.01, 0.1, 0.5, 0.99, 1.0, 1.5, 2.0, 7.0, 100.0, 1e6] {
            let function = original.clone().with_opacity_scaled(scale).expect("valid");
            for step in 0..=40_000 {
                let value = f64::from(step) / 2000.0;
                let expected = 1.0 - (1.0 - original.opacity(value)).powf(scale);
                let error = (function.opacity(value) - expected).abs();
                // 1e-12 is for rounding; a segment's last 2^-32 lies between the samples.
                assert!(
                    error <= MAX_ERROR + 1e-12,
                    "scale {scale}: {error} at {value}"
                );
            }
            let count = function.opacity_knots().len();
            assert!(
                count < 1200,
                "scale {scale} needs {count} knots for three segments"
            );
        }
    }

    #[test]
    fn scaling_keeps_ends_steps_and_straight_parts() {
        let flat = ramp(&[(0.0, 0.0), (5.0, 0.0), (5.0, 1.0), (9.0, 1.0)]);
        assert_eq!(
            flat.clone().with_opacity_scaled(3.0).expect("valid"),
            flat,
            "0 and 1 do not change"
        );
        assert_eq!(
            ramp(&[(0.0, 0.75)])
                .with_opacity_scaled(0.5)
                .expect("valid")
                .opacity(0.0),
            0.5
        );
        let faint = ramp(&[(0.0, 1e-12)])
            .with_opacity_scaled(3.0)
            .expect("valid")
            .opacity(0.0);
        assert!(
            (faint / 3e-12 - 1.0).abs() < 1e-9,
            "small opacities keep their digits: {faint}"
        );
    }

    #[test]
    fn scaling_by_one_changes_nothing_but_rounding() {
        let original = ramp(&[(0.0, 0.1), (4.0, 0.8)]);
        let same = original.clone().with_opacity_scaled(1.0).expect("valid");
        assert_eq!(same.opacity_knots().len(), 2, "no knots are added");
        for (a, b) in same.opacity_knots().iter().zip(original.opacity_knots()) {
            assert!(
                (a.opacity - b.opacity).abs() < 1e-15,
                "{a:?} instead of {b:?}"
            );
        }
    }
}
