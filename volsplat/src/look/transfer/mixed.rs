//! The mean of two transfer functions, weighted: what lies between two keys of an animation.
//!
//! Both are piecewise linear, and so is their weighted mean; it may bend or step only where one of them does. So the
//! mean has its knots at the union of theirs, and where either steps, two of them: the limits from below and above.
//! Limits: opacities are mixed, not extinctions; an opaque surface that fades is half opaque half way.

use resample_volume::volume::histogram::share_of;

use crate::look::transfer::{ColourKnot, OpacityKnot, TransferFunction};

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
