//! Transfer functions from a window, with more or less opacity, and the weighted mean of two, for animations.
//!
//! Takes a level and a width and returns the ramp that radiologists know; takes a function and a factor and returns the
//! function with its extinction multiplied by it. A scaled opacity is 1 - (1 - opacity)^s, which bends each straight
//! segment; the bent curve is cut at its middle, again and again, until straight pieces follow it.
//! Limits: the pieces miss the curve by at most [`MAX_ERROR`], apart from the last 2^-32 of a segment; see there.
//!
//! Two functions are piecewise linear, and so is their weighted mean; it may bend or step only where one of them does. So the
//! mean has its knots at the union of theirs, and where either steps, two of them: the limits from below and above.
//! Limits: opacities are mixed, not extinctions; an opaque surface that fades is half opaque half way.

use crate::volume::histogram::share_of;

use crate::Error;
use crate::transfer::{ColourKnot, ColourMap, OpacityKnot, TransferFunction};

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
    /// use resample_volume::{ColourMap, TransferFunction};
    ///
    /// // Level 40, width 400: opacity rises from -160 to 240.
    /// let function = TransferFunction::window(40.0, 400.0, ColourMap::default())?;
    /// assert_eq!(function.value_range(), (-160.0, 240.0));
    /// # Ok::<(), resample_volume::Error>(())
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

    /// The same function of other values: those of its knots mapped by `map`, which must keep their order.
    pub fn of_mapped(&self, map: impl Fn(f64) -> f64) -> Self {
        let colour = |knot: &ColourKnot| ColourKnot {
            value: map(knot.value),
            ..*knot
        };
        let opacity = |knot: &OpacityKnot| OpacityKnot {
            value: map(knot.value),
            ..*knot
        };
        Self {
            colours: self.colours.iter().map(colour).collect(),
            opacities: self.opacities.iter().map(opacity).collect(),
        }
    }

    /// The same opacities under the colours of a map that spans these values.
    pub fn coloured(&self, map: ColourMap, low: f64, high: f64) -> Self {
        Self {
            colours: map.knots(low, high),
            opacities: self.opacities.clone(),
        }
    }

    /// The same colours, all of them opaque.
    pub fn opaque(&self) -> Self {
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

/// A knot of either kind: a scalar and the numbers there.
type Knot<const N: usize> = (f64, [f64; N]);

impl TransferFunction {
    /// This function at `share` 0, `other` at 1, and between them the mean of both at every scalar: of the colours
    /// (linear light) and of the opacities. A share outside 0..=1 counts as the nearer end, and so does NaN as 0.
    pub fn mixed(&self, other: &Self, share: f64) -> Self {
        // The ends are those functions to the bit, with their own knots.
        if !(share > 0.0) {
            return self.clone();
        }
        if share >= 1.0 {
            return other.clone();
        }
        let colours = |f: &Self| {
            f.colours
                .iter()
                .map(|k| (k.value, k.rgb.map(f64::from)))
                .collect::<Vec<_>>()
        };
        let opacities = |f: &Self| {
            f.opacities
                .iter()
                .map(|k| (k.value, [k.opacity]))
                .collect::<Vec<_>>()
        };
        Self {
            colours: mixed_knots(&colours(self), &colours(other), share)
                .into_iter()
                .map(|(value, rgb)| ColourKnot {
                    value,
                    rgb: rgb.map(|channel| channel as f32),
                })
                .collect(),
            opacities: mixed_knots(&opacities(self), &opacities(other), share)
                .into_iter()
                .map(|(value, [opacity])| OpacityKnot { value, opacity })
                .collect(),
        }
    }
}

fn mixed_knots<const N: usize>(a: &[Knot<N>], b: &[Knot<N>], share: f64) -> Vec<Knot<N>> {
    let mut values: Vec<f64> = a.iter().chain(b).map(|knot| knot.0).collect();
    values.sort_by(f64::total_cmp);
    // 0 and -0 are one scalar.
    values.dedup_by(|x, y| x == y);
    let mut knots = Vec::with_capacity(values.len());
    for value in values {
        let ([a_below, a_above], [b_below, b_above]) = (limits(a, value), limits(b, value));
        let below = mean(a_below, b_below, share);
        if a_below != a_above || b_below != b_above {
            knots.push((value, below));
        }
        knots.push((value, mean(a_above, b_above, share)));
    }
    knots
}

/// The limits of a function from below a scalar and from above it.
fn limits<const N: usize>(knots: &[Knot<N>], value: f64) -> [[f64; N]; 2] {
    let first_not_below = knots.partition_point(|knot| knot.0 < value);
    let first_above = knots.partition_point(|knot| knot.0 <= value);
    if first_not_below == first_above {
        // No knot lies here.
        return [between(knots, first_above, value); 2];
    }
    // Before the first knot its value holds, and so does the last one's after it.
    [knots[first_not_below].1, knots[first_above - 1].1]
}

/// The value between the knot before a place and the one at it.
fn between<const N: usize>(knots: &[Knot<N>], place: usize, value: f64) -> [f64; N] {
    match (
        place.checked_sub(1).map(|before| &knots[before]),
        knots.get(place),
    ) {
        (Some(low), Some(high)) => mean(low.1, high.1, share_of(value, low.0, high.0)),
        _ => knots[place.saturating_sub(1)].1,
    }
}

fn mean<const N: usize>(a: [f64; N], b: [f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|channel| {
        let (low, high) = (a[channel].min(b[channel]), a[channel].max(b[channel]));
        // Rounding must not leave 0..=1.
        (a[channel] + share * (b[channel] - a[channel])).clamp(low, high)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::ColourKnot;

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

    fn function(colours: &[(f64, [f32; 3])], opacities: &[(f64, f64)]) -> TransferFunction {
        TransferFunction::new(
            colours
                .iter()
                .map(|&(value, rgb)| ColourKnot { value, rgb })
                .collect(),
            opacities
                .iter()
                .map(|&(value, opacity)| OpacityKnot { value, opacity })
                .collect(),
        )
        .expect("a valid function")
    }

    fn pair() -> [TransferFunction; 2] {
        [
            function(
                &[(0.0, [1.0, 0.0, 0.0]), (10.0, [0.0, 1.0, 0.0])],
                &[(2.0, 0.0), (2.0, 0.4), (6.0, 0.8)],
            ),
            function(
                &[(4.0, [0.0, 0.0, 1.0])],
                &[(1.0, 0.1), (3.0, 0.9), (3.0, 0.0), (8.0, 0.0)],
            ),
        ]
    }

    #[test]
    fn the_mean_holds_at_every_scalar() {
        let [a, b] = pair();
        for share in [0.0, 0.25, 0.5, 0.9, 1.0] {
            let mixed = a.mixed(&b, share);
            for i in -40..=480 {
                // Knots are among these scalars, with their steps.
                let value = f64::from(i) * 0.025;
                let ((rgb_a, opacity_a), (rgb_b, opacity_b)) = (a.sample(value), b.sample(value));
                let (rgb, opacity) = mixed.sample(value);
                let wanted = opacity_a + share * (opacity_b - opacity_a);
                assert!(
                    (opacity - wanted).abs() < 1e-12,
                    "{value}, {share}: opacity {opacity}, {wanted}"
                );
                for channel in 0..3 {
                    let wanted = rgb_a[channel] + share as f32 * (rgb_b[channel] - rgb_a[channel]);
                    assert!(
                        (rgb[channel] - wanted).abs() < 1e-6,
                        "{value}, {share}: {rgb:?}, {wanted}"
                    );
                }
            }
        }
    }

    #[test]
    fn steps_stay_steps() {
        let [a, b] = pair();
        let knots = a.mixed(&b, 0.5);
        let at = |value: f64| -> Vec<f64> {
            knots
                .opacity_knots()
                .iter()
                .filter(|k| k.value == value)
                .map(|k| k.opacity)
                .collect()
        };
        let close = |got: Vec<f64>, wanted: &[f64]| {
            assert_eq!(got.len(), wanted.len(), "{got:?}, {wanted:?}");
            got.iter()
                .zip(wanted)
                .for_each(|(g, w)| assert!((g - w).abs() < 1e-12, "{got:?}, {wanted:?}"));
        };
        // At 2 the first function rises from 0 to 0.4 and the second passes 0.5; at 3 the second falls from 0.9 to 0.
        close(at(2.0), &[0.25, 0.45]);
        close(at(3.0), &[0.7, 0.25]);
        close(at(6.0), &[0.4]);
    }

    #[test]
    fn the_ends_are_the_functions_themselves() {
        let [a, b] = pair();
        assert_eq!(a.mixed(&b, 0.0), a);
        assert_eq!(a.mixed(&b, 1.0), b);
        assert_eq!(a.mixed(&b, f64::NAN), a);
        assert_eq!(a.mixed(&b, 7.0), b);
    }
}
