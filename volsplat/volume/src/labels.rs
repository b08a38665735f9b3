//! Labels: a volume whose scalars are names, and the table that says how each of them looks.
//!
//! Takes a label, returns a colour and an opacity. Labels are never mixed: a sample has the label of its nearest voxel. A
//! label that a table does not list is not drawn. Tables are made of colours that are easy to tell apart (Tableau 10 and the map
//! "sinebow", from the crate colorous), or read from files (`label_files`).
//! Limits: labels are whole numbers up to 2^53 in size; at most [`MAX_LABELS`] of a volume can be drawn at once.

use std::collections::BTreeMap;

use resample_core::image::linear_from_srgb;

use crate::Error;

/// Most labels of a volume that can be drawn: what the table of a transfer function holds, whose place they take.
pub const MAX_LABELS: usize = 4096;

/// How labels look.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelTable {
    looks: Looks,
    opacity_scale: f64,
}

/// How one label looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelLook {
    /// Red, green, blue in linear light, each finite and at least 0.
    pub rgb: [f32; 3],
    /// Opacity over one unit of length, 0..=1.
    pub opacity: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Looks {
    /// Every label but 0 has a colour of its own.
    Distinct,
    Listed(BTreeMap<i64, LabelLook>),
}

impl LabelTable {
    /// Opaque colours that are easy to tell apart, for every label but 0, which is not drawn.
    ///
    /// Labels 1 to 10 have the colours of Tableau 10; further ones go around the hues in steps of the golden ratio.
    ///
    /// ```
    /// use resample_volume::LabelTable;
    ///
    /// let table = LabelTable::distinct();
    /// assert_ne!(table.look(1).rgb, table.look(2).rgb);
    /// assert_eq!(table.look(0).opacity, 0.0);
    /// ```
    pub fn distinct() -> Self {
        Self {
            looks: Looks::Distinct,
            opacity_scale: 1.0,
        }
    }

    /// A table of labels and their looks; of a label that occurs twice the last look holds.
    ///
    /// [`Error::Option`] names a label whose colour is negative or not finite, or whose opacity is not 0 to 1.
    ///
    /// ```
    /// use resample_volume::{LabelLook, LabelTable};
    ///
    /// let red = LabelLook {
    ///     rgb: [1.0, 0.0, 0.0],
    ///     opacity: 0.5,
    /// };
    /// let table = LabelTable::new([(3, red)])?;
    /// assert_eq!(table.look(3).opacity, 0.5);
    /// assert_eq!(table.look(4).opacity, 0.0, "labels that are not listed are not drawn");
    /// # Ok::<(), resample_volume::Error>(())
    /// ```
    pub fn new(looks: impl IntoIterator<Item = (i64, LabelLook)>) -> Result<Self, Error> {
        let listed: BTreeMap<i64, LabelLook> = looks.into_iter().collect();
        let is_good = |look: &LabelLook| {
            look.rgb.iter().all(|c| c.is_finite() && *c >= 0.0)
                && (0.0..=1.0).contains(&look.opacity)
        };
        match listed.iter().find(|(_, look)| !is_good(look)) {
            Some((label, look)) => Err(Error::Option(format!(
                "label {label} has the colour {:?} and the opacity {}: expected finite values from 0 on, and 0 to 1",
                look.rgb, look.opacity
            ))),
            None => Ok(Self {
                looks: Looks::Listed(listed),
                opacity_scale: 1.0,
            }),
        }
    }

    /// The table with the extinction of every label multiplied: an opacity A becomes 1 - (1 - A)^scale.
    #[must_use]
    pub fn with_opacity_scaled(mut self, scale: f64) -> Self {
        self.opacity_scale *= scale;
        self
    }

    /// Returns true if a label is drawn; as [`LabelTable::look`], without making a colour.
    pub fn shows(&self, label: i64) -> bool {
        let is_shown = match &self.looks {
            Looks::Distinct => label != 0,
            Looks::Listed(listed) => listed.get(&label).is_some_and(|look| look.opacity > 0.0),
        };
        is_shown && self.opacity_scale > 0.0
    }

    /// How a label looks; an opacity of 0 where it is not drawn.
    pub fn look(&self, label: i64) -> LabelLook {
        let hidden = LabelLook {
            rgb: [0.0; 3],
            opacity: 0.0,
        };
        let look = match &self.looks {
            Looks::Distinct if label == 0 => hidden,
            Looks::Distinct => LabelLook {
                rgb: distinct_colour(label),
                opacity: 1.0,
            },
            Looks::Listed(listed) => listed.get(&label).copied().unwrap_or(hidden),
        };
        LabelLook {
            opacity: -((self.opacity_scale * (-look.opacity).ln_1p()).exp_m1()),
            ..look
        }
    }
}

/// Linear red, green, blue of a label in the built-in table.
fn distinct_colour(label: i64) -> [f32; 3] {
    let scheme = colorous::TABLEAU10;
    let place = label.unsigned_abs();
    let colour = match usize::try_from(place)
        .ok()
        .and_then(|place| scheme.get(place.wrapping_sub(1)))
    {
        Some(colour) => *colour,
        None => {
            // The fraction of multiples of the golden ratio never comes near an earlier one for long.
            let golden = 0.618_033_988_749_894_9;
            colorous::SINEBOW.eval_continuous(((place % (1 << 20)) as f64 * golden).fract())
        }
    };
    let encoded: [u8; 3] = colour.as_array();
    encoded.map(|channel| linear_from_srgb(f32::from(channel) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_colours_differ_and_hide_the_background() {
        let table = LabelTable::distinct();
        assert_eq!(table.look(0).opacity, 0.0, "0 is the background");
        for a in 1..=40i64 {
            for b in 1..a {
                let [x, y] = [a, b].map(|label| table.look(label).rgb);
                assert!(x != y, "labels {a} and {b} look alike");
            }
        }
        for label in [-1, i64::MIN, i64::MAX] {
            let look = table.look(label);
            assert!(
                look.rgb.iter().all(|c| (0.0..=1.0).contains(c)) && look.opacity == 1.0,
                "label {label}"
            );
        }
    }

    #[test]
    fn opacities_scale_with_the_extinction() {
        let table = LabelTable::new([(
            1,
            LabelLook {
                rgb: [1.0; 3],
                opacity: 0.19,
            },
        )])
        .expect("valid");
        let half = table.clone().with_opacity_scaled(0.5);
        assert!((half.look(1).opacity - 0.1).abs() < 1e-15, "1 - sqrt(0.81)");
        assert!(
            LabelTable::new([(
                1,
                LabelLook {
                    rgb: [f32::NAN; 3],
                    opacity: 0.0
                }
            )])
            .is_err(),
            "no colour"
        );
        let bad = LabelTable::new([(
            5,
            LabelLook {
                rgb: [0.0; 3],
                opacity: 1.1,
            },
        )]);
        assert!(
            bad.expect_err("no opacity").to_string().contains("label 5"),
            "the label is named"
        );
    }
}
