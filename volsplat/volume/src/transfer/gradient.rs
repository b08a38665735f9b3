//! Opacity by the gradient: flat regions become clear, and the skins between them stay.
//!
//! Takes words or the knots of a file, gives a factor of the extinction for a length of the gradient.
//! Limits: one curve for all channels, whatever the scalar.

use std::str::FromStr;

use crate::Error;

/// A factor of the extinction over the length of the gradient (M. Levoy, "Display of Surfaces from Volume Data", 1988).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(transparent)
)]
pub struct GradientOpacity {
    /// Lengths of the gradient, value per world unit, from 0 on and never falling, and the factors there, 0 to 1. Factors are straight between
    /// two knots and level beyond the first and the last.
    pub knots: Vec<[f64; 2]>,
}

impl GradientOpacity {
    /// Most knots of a curve: each costs some operations a sample. Files and hands have two to six.
    pub const MOST_KNOTS: usize = 16;

    /// From 0 at `low` to 1 at `high`.
    pub fn ramp(low: f64, high: f64) -> Self {
        Self {
            knots: vec![[low, 0.0], [high, 1.0]],
        }
    }

    /// The factor at a length of the gradient.
    ///
    /// ```
    /// use resample_volume::transfer::GradientOpacity;
    ///
    /// let skins: GradientOpacity = "0:0.1,10:0.1,40:1".parse()?;
    /// assert_eq!([5.0, 25.0, 99.0].map(|length| skins.at(length)), [0.1, 0.55, 1.0]);
    /// # Ok::<(), String>(())
    /// ```
    pub fn at(&self, length: f64) -> f64 {
        let first = self.knots.first().map_or(1.0, |knot| knot[1]);
        let rises = self.knots.windows(2).map(|pair| {
            let ([from, low], [to, high]) = (pair[0], pair[1]);
            let share = match to > from {
                true => ((length - from) / (to - from)).clamp(0.0, 1.0),
                false => f64::from(u8::from(length >= to)),
            };
            share * (high - low)
        });
        first + rises.sum::<f64>()
    }

    /// The same curve over lengths that are `factor` times as large.
    pub fn scaled(&self, factor: f64) -> Self {
        let knots = self.knots.iter();
        Self {
            knots: knots
                .map(|&[length, share]| [length * factor, share])
                .collect(),
        }
    }

    /// Checks that the curve is one.
    ///
    /// # Errors
    /// Too few or too many knots, lengths below 0, falling or not finite, or factors outside 0 to 1.
    pub fn validate(&self) -> Result<(), Error> {
        match fault(&self.knots) {
            None => Ok(()),
            Some(fault) => Err(Error::Option(format!("opacity by the gradient: {fault}"))),
        }
    }
}

/// The fault of the knots of a curve.
fn fault(knots: &[[f64; 2]]) -> Option<String> {
    let most = GradientOpacity::MOST_KNOTS;
    if !(2..=most).contains(&knots.len()) {
        return Some(format!("{} knots, expected 2 to {most}", knots.len()));
    }
    if let Some([length, _]) = knots
        .iter()
        .find(|[length, _]| !(*length >= 0.0 && length.is_finite()))
    {
        return Some(format!(
            "the gradient {length}, expected a number from 0 on"
        ));
    }
    if let Some([_, share]) = knots.iter().find(|[_, share]| !(0.0..=1.0).contains(share)) {
        return Some(format!("the factor {share}, expected 0 to 1"));
    }
    let falls = |pair: &[[f64; 2]]| pair[1][0] < pair[0][0];
    if let Some(pair) = knots.windows(2).find(|pair| falls(pair)) {
        let [before, behind] = [pair[0][0], pair[1][0]];
        return Some(format!(
            "the gradient {behind} comes after {before}: expected rising numbers"
        ));
    }
    let (first, last) = (knots[0][0], knots[knots.len() - 1][0]);
    (first >= last)
        .then(|| format!("all knots are at the gradient {first}: expected two or more gradients"))
}

impl FromStr for GradientOpacity {
    type Err = String;

    /// `LOW,HIGH` or `GRADIENT:FACTOR,GRADIENT:FACTOR...`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let number = |word: &str| word.trim().parse::<f64>().ok();
        let pair = |word: &str| {
            let (length, share) = word.split_once(':')?;
            Some([number(length)?, number(share)?])
        };
        let words: Vec<&str> = text.split(',').collect();
        let ramp = match words[..] {
            [low, high] => number(low).zip(number(high)),
            _ => None,
        };
        let knots = match ramp {
            Some((low, high)) => Some(vec![[low, 0.0], [high, 1.0]]),
            None => words.into_iter().map(pair).collect(),
        };
        let Some(knots) = knots else {
            return Err(
                "expected two gradients, such as 5,40, or gradients with factors from 0 to 1, such as 0:0.1,10:0.1,40:1"
                    .into(),
            );
        };
        match fault(&knots) {
            None => Ok(Self { knots }),
            Some(fault) => Err(fault),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_and_a_curve_are_read() {
        let ramp: GradientOpacity = "5,40".parse().expect("a ramp");
        assert_eq!(ramp, GradientOpacity::ramp(5.0, 40.0));
        let curve: GradientOpacity = "0:0.2, 10:0.2, 10:0.8, 30:0".parse().expect("a curve");
        let found = [0.0, 9.0, 10.0, 20.0, 30.0, 1e9].map(|length| curve.at(length));
        for (found, expected) in found.into_iter().zip([0.2, 0.2, 0.8, 0.4, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-12, "{found}, {expected}");
        }
        assert_eq!(curve.scaled(2.0).at(20.0), curve.at(10.0));
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        for (text, named) in [
            ("5", "expected two gradients"),
            ("5,x", "expected two gradients"),
            ("1:0,2", "expected two gradients"),
            ("40,5", "comes after"),
            ("5,5", "all knots are at"),
            ("-1,5", "from 0 on"),
            ("0,inf", "from 0 on"),
            ("NaN,4", "from 0 on"),
            ("0:0,5:1.5", "expected 0 to 1"),
            ("0:0.5", "expected 2 to 16"),
        ] {
            let fault = text.parse::<GradientOpacity>().expect_err(text);
            assert!(fault.contains(named), "{text}: {fault}");
        }
        let many = GradientOpacity {
            knots: (0..17).map(|i| [f64::from(i), 0.5]).collect(),
        };
        assert!(many.validate().is_err());
    }
}
