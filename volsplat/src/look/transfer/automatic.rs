//! A transfer function from nothing but the histogram.
//!
//! Takes counts, gives opacity knots, and colours from a named map. Otsu's threshold divides the scalars into a lower
//! class, the background, and an upper one, the object. The ramp begins where the background is over, which lies
//! below the threshold when the background is narrow, so that thin and faint parts of the object stay.
//! Source: Otsu, "A Threshold Selection Method from Gray-Level Histograms", IEEE Trans. SMC 9(1), 1979.
//! Limits: what is bright is the object; data with a bright background needs its own function.

use crate::look::transfer::{ColourMap, Histogram, OpacityKnot, TransferFunction};

impl TransferFunction {
    /// A sensible one for a volume of which nothing is known but its values: the background is left out, the object
    /// is translucent at its faintest and dense at its brightest, and the colour map spans what is seen.
    ///
    /// The background is the lower side of the histogram, so data with a bright background needs its own function.
    /// A volume of one value is visible as a whole.
    ///
    /// ```
    /// use volsplat::volume::procedural::blobs;
    /// use volsplat::{ColourMap, Described, TransferFunction};
    ///
    /// let function = TransferFunction::automatic(&blobs(16)?.histogram(), ColourMap::default());
    /// assert_eq!(function.opacity(0.0), 0.0, "the empty space is transparent");
    /// # Ok::<(), volsplat::Error>(())
    /// ```
    pub fn automatic(histogram: &Histogram, map: ColourMap) -> Self {
        transfer(histogram, map)
    }

    /// One for the greatest, least or mean value of a ray: the map spans all values but the brightest few, and the darkest tenth
    /// of it fades to nothing.
    pub fn projection(histogram: &Histogram, map: ColourMap) -> Self {
        let low = histogram.range().0;
        let high = histogram.value_below_brightest().max(low);
        let knot = |share: f64, opacity: f64| OpacityKnot {
            value: low * (1.0 - share) + high * share,
            opacity,
        };
        Self {
            colours: map.knots(low, high),
            opacities: vec![knot(0.0, 0.0), knot(FADED_SHARE, 1.0)],
        }
    }
}

/// Share of the range over which a projection fades to nothing, so that the background does not hide what is behind the picture.
const FADED_SHARE: f64 = 0.1;

/// The background is taken to reach this many standard deviations above its mean. A guess, looked at on CT of an engine,
/// a head, a lobster, a walnut and vessels: with 3, resin and noise begin to show; with 5, thin vessels fade.
const BACKGROUND_DEVIATIONS: f64 = 4.0;

/// Opacity per unit of length at the mean of the object: two voxels deep half of what is behind is still hidden. A guess.
const OBJECT_OPACITY: f64 = 0.5;

/// Opacity per unit of length at the greatest scalar. A guess.
const BRIGHTEST_OPACITY: f64 = 0.9;

/// Lower and upper class of the scalars.
#[derive(Debug)]
struct Classes {
    /// The scalar that divides them.
    threshold: f64,
    background_mean: f64,
    background_deviation: f64,
    object_mean: f64,
}

pub(crate) fn transfer(histogram: &Histogram, map: ColourMap) -> TransferFunction {
    let opacities = opacities(histogram);
    let low = opacities[0].value;
    // A range of almost all of f64 can round the last knot past the end; the order of knots does not depend on it.
    let high = histogram.range().1.max(low);
    TransferFunction {
        colours: map.knots(low, high),
        opacities,
    }
}

/// At least one knot, ascending.
pub(crate) fn opacities(histogram: &Histogram) -> Vec<OpacityKnot> {
    let (low, high) = histogram.range();
    let Some(classes) = otsu(histogram) else {
        return vec![OpacityKnot {
            value: low,
            opacity: OBJECT_OPACITY,
        }];
    };
    let begin = classes.background_end().clamp(low, high);
    let middle = classes.object_mean.clamp(begin, high);
    let mut knots = vec![
        OpacityKnot {
            value: begin,
            opacity: 0.0,
        },
        OpacityKnot {
            value: middle,
            opacity: OBJECT_OPACITY,
        },
    ];
    // Two values only: the object has no brighter part.
    if middle < high {
        knots.push(OpacityKnot {
            value: high,
            opacity: BRIGHTEST_OPACITY,
        });
    }
    knots
}

/// The scalar at which the background is over; the least scalar where there is no background.
pub(crate) fn background_end(histogram: &Histogram) -> f64 {
    let (low, high) = histogram.range();
    otsu(histogram).map_or(low, |classes| classes.background_end().clamp(low, high))
}

impl Classes {
    fn background_end(&self) -> f64 {
        let end = self.background_mean + BACKGROUND_DEVIATIONS * self.background_deviation;
        end.min(self.threshold)
    }
}

/// `None` if there are no two different values.
fn otsu(histogram: &Histogram) -> Option<Classes> {
    let counts = histogram.counts();
    let split = best_split(counts)?;
    let (background_mean, background_deviation) = moments(&counts[..split])?;
    let (object_mean, _) = moments(&counts[split..])?;
    // Bins to scalars; a deviation is a distance, so it is taken between two scalars.
    let scalar = |bin: f64| {
        let (low, high) = histogram.range();
        let place = bin / (counts.len() - 1) as f64;
        low * (1.0 - place) + high * place
    };
    Some(Classes {
        threshold: scalar(split as f64 - 0.5),
        background_mean: scalar(background_mean),
        background_deviation: scalar(background_mean + background_deviation)
            - scalar(background_mean),
        object_mean: scalar(object_mean + split as f64),
    })
}

/// The first bin of the upper class: the split with the greatest variance between the classes. Where empty bins make
/// several equal, the middle one.
fn best_split(counts: &[u64]) -> Option<usize> {
    let total: f64 = counts.iter().map(|&count| count as f64).sum();
    let moment: f64 = counts
        .iter()
        .enumerate()
        .map(|(bin, &count)| bin as f64 * count as f64)
        .sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    let (mut best, mut first, mut last) = (0.0, 0, 0);
    for (bin, &count) in counts.iter().enumerate() {
        below += count as f64;
        moment_below += bin as f64 * count as f64;
        if below == 0.0 || below == total {
            continue;
        }
        let difference = moment_below / below - (moment - moment_below) / (total - below);
        let variance = below * (total - below) * difference * difference;
        if variance > best {
            (best, first, last) = (variance, bin + 1, bin + 1);
        } else if count == 0 && last == bin {
            // An empty bin moves nothing, so it belongs to the same plateau.
            last = bin + 1;
        }
    }
    (best > 0.0).then_some(first.midpoint(last))
}

/// Mean and standard deviation of the bins' numbers, by counts; `None` without counts.
fn moments(counts: &[u64]) -> Option<(f64, f64)> {
    let total: f64 = counts.iter().map(|&count| count as f64).sum();
    if total == 0.0 {
        return None;
    }
    let weighted = |power: &dyn Fn(f64) -> f64| {
        let sum: f64 = counts
            .iter()
            .enumerate()
            .map(|(bin, &count)| power(bin as f64) * count as f64)
            .sum();
        sum / total
    };
    let mean = weighted(&|bin| bin);
    let variance = weighted(&|bin| (bin - mean) * (bin - mean));
    Some((mean, variance.sqrt()))
}

#[cfg(test)]
mod tests;
