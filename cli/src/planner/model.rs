//! The cost of a picture from its counts: a sum of counts times coefficients that are not negative.
//!
//! Counts are those of the stats file, the same on every machine; coefficients are milliseconds of CPU time per count,
//! fitted to measured frames by least squares over relative errors, so that short and long frames weigh alike. A kind
//! of work that was never measured is predicted by the coefficients of the nearest kind.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::measure::{Time, number};

/// Number of counts: frames; bricks, triangles or samples; tile pairs; points; splats; pixels touched; edge pixels; pixels.
/// The first two belong to a frame however much of it is drawn; the others add up over the parts of a picture.
pub(crate) const COUNTS: usize = 8;

/// How many of the counts belong to the whole frame.
pub(crate) const OF_FRAME: usize = 2;

/// Counts of one picture, or of a part of it.
pub(crate) type Counts = [f64; COUNTS];

/// The work of one picture, or of a part of it.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// Its kind: works of one kind take times of one model.
    pub(crate) kind: String,
    /// Its counts.
    pub(crate) counts: Counts,
}

/// Sweeps over the coefficients: the sums converge long before.
const SWEEPS: usize = 2000;

/// Coefficients by kind of work.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(crate) struct Model {
    /// Milliseconds of CPU time per count.
    pub(crate) cpu_ms: BTreeMap<String, Counts>,
    /// Elapsed over CPU time, by application, with the threads that the model was measured with.
    pub(crate) wall_per_cpu: BTreeMap<String, f64>,
}

/// One measured frame.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// Its work.
    pub(crate) work: Work,
    /// Its time.
    pub(crate) time: Time,
}

/// The counts in a renderer's account.
pub(crate) fn counts(keys: &Value, pixels: f64) -> Counts {
    if let Some(views) = keys.get("views").and_then(Value::as_array) {
        let mut sum = [0.0; COUNTS];
        for view in views {
            let of_view = counts(view, pixels / views.len() as f64);
            sum.iter_mut()
                .zip(of_view)
                .for_each(|(sum, count)| *sum += count);
        }
        return sum;
    }
    let number = |name: &str| number(keys, name);
    [
        1.0,
        number("bricks") + number("triangles") + number("samples"),
        (number("tile_pairs") - number("hidden_pairs")).max(0.0),
        number("points"),
        number("splats"),
        number("pixels_touched") + number("seen"),
        number("edge_pixels"),
        pixels,
    ]
}

impl Model {
    /// Fits coefficients to measured frames.
    pub(crate) fn fitted(samples: &[Sample]) -> Self {
        let mut by_kind: BTreeMap<&str, Vec<&Sample>> = BTreeMap::new();
        let mut model = Self::default();
        for sample in samples.iter().filter(|sample| sample.time.cpu_ms > 0.0) {
            let Sample { work, time } = sample;
            by_kind.entry(&work.kind).or_default().push(sample);
            // Other work on the machine lengthens elapsed time alone, so the least disturbed frame counts.
            let ratio = time.wall_ms / time.cpu_ms;
            let least = model
                .wall_per_cpu
                .entry(application(&work.kind).to_owned())
                .or_insert(f64::INFINITY);
            *least = least.min(ratio);
        }
        model.cpu_ms = by_kind
            .into_iter()
            .map(|(kind, samples)| (kind.to_owned(), fit(&samples)))
            .collect();
        model
    }

    /// Whether a kind of work was measured.
    pub(crate) fn knows(&self, kind: &str) -> bool {
        self.cpu_ms.contains_key(kind)
    }

    /// CPU time of a frame; for a kind of work that was never measured by the coefficients of the nearest kind.
    pub(crate) fn likely_cpu_ms(&self, work: &Work) -> f64 {
        let coefficients = self.likely(&work.kind);
        let terms = coefficients.iter().zip(&work.counts);
        terms.map(|(ms, count)| ms * count).sum()
    }

    /// The part of it that depends on how much of a frame is drawn, ms.
    pub(crate) fn growing_ms(&self, work: &Work) -> f64 {
        let coefficients = self.likely(&work.kind);
        let terms = coefficients.iter().zip(&work.counts).skip(OF_FRAME);
        terms.map(|(ms, count)| ms * count).sum()
    }

    /// The share of a frame that does not depend on how much of it is drawn.
    pub(crate) fn fixed_share(&self, work: &Work) -> f64 {
        let all_ms = self.likely_cpu_ms(work);
        ((all_ms - self.growing_ms(work)) / all_ms.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Coefficients of a kind of work, or of the first that shares its method, its sub-pixels or its application.
    fn likely(&self, kind: &str) -> Counts {
        let own: Vec<&str> = kind.split(' ').collect();
        let alike = |other: &str, places: &[usize]| {
            let other: Vec<&str> = other.split(' ').collect();
            places
                .iter()
                .all(|&place| other.get(place) == own.get(place))
        };
        [&[0, 1, 2][..], &[0, 1], &[0, 2], &[0]]
            .into_iter()
            .find_map(|places| self.cpu_ms.iter().find(|(other, _)| alike(other, places)))
            .map_or([1.0; COUNTS], |(_, coefficients)| *coefficients)
    }

    /// Elapsed over CPU time.
    pub(crate) fn wall_per_cpu(&self, kind: &str) -> f64 {
        self.wall_per_cpu
            .get(application(kind))
            .copied()
            .unwrap_or(1.0)
    }
}

/// The application of a kind of work.
fn application(kind: &str) -> &str {
    kind.split(' ').next().unwrap_or_default()
}

/// Coefficients that are not negative, for which the squares of the relative errors are least: each in turn is set to
/// its best value, the others held (coordinate descent, which ends in the only minimum of a convex function).
fn fit(samples: &[&Sample]) -> Counts {
    let rows: Vec<Counts> = samples
        .iter()
        .map(|sample| sample.work.counts.map(|count| count / sample.time.cpu_ms))
        .collect();
    let mut gram = [[0.0; COUNTS]; COUNTS];
    let mut right = [0.0; COUNTS];
    for row in &rows {
        for i in 0..COUNTS {
            right[i] += row[i];
            for j in 0..COUNTS {
                gram[i][j] += row[i] * row[j];
            }
        }
    }
    let mut coefficients = [0.0; COUNTS];
    for _ in 0..SWEEPS {
        for i in 0..COUNTS {
            if gram[i][i] > 0.0 {
                let others: f64 = (0..COUNTS)
                    .filter(|&j| j != i)
                    .map(|j| gram[i][j] * coefficients[j])
                    .sum();
                coefficients[i] = ((right[i] - others) / gram[i][i]).max(0.0);
            }
        }
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn sample(counts: Counts, cpu_ms: f64) -> Sample {
        Sample {
            work: Work {
                kind: "volsplat x".into(),
                counts,
            },
            time: Time {
                wall_ms: 0.5 * cpu_ms,
                cpu_ms,
            },
        }
    }

    #[test]
    fn coefficients_are_found_again() {
        let truth: Counts = [0.5, 0.0, 0.01, 0.0, 0.002, 0.0001, 0.0, 0.0];
        let samples: Vec<Sample> = (1..30_i32)
            .map(|k| {
                let wave = |m: i32| 1.0 + f64::from(k * m % 17);
                let counts = [
                    1.0,
                    10.0 * wave(5),
                    100.0 * wave(3),
                    0.0,
                    50.0 * wave(7),
                    9e3 * wave(11),
                    0.0,
                    1e4,
                ];
                sample(counts, truth.iter().zip(counts).map(|(t, c)| t * c).sum())
            })
            .collect();
        let model = Model::fitted(&samples);
        for sample in &samples {
            let found = model.likely_cpu_ms(&sample.work);
            assert!(
                (found / sample.time.cpu_ms - 1.0).abs() < 0.01,
                "{found} for {}",
                sample.time.cpu_ms
            );
        }
        assert!(
            model.cpu_ms["volsplat x"].iter().all(|&c| c >= 0.0),
            "none is negative"
        );
        assert_eq!(model.wall_per_cpu("volsplat x"), 0.5);
        assert!(
            model.knows("volsplat x") && !model.knows("volsplat y"),
            "never measured"
        );
    }

    #[test]
    fn views_of_a_sheet_add_up() {
        let keys = json!({"views": [{"seen": 3, "samples": 5, "cpu_ms": 1.5}, {"seen": 4, "samples": 5, "cpu_ms": 2.0}]});
        let found = counts(&keys, 100.0);
        assert_eq!(
            (found[0], found[1], found[5], found[7]),
            (2.0, 10.0, 7.0, 100.0)
        );
    }
}
