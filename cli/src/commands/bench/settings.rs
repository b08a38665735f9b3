//! Measuring a list of settings beside one another: error against one picture, CPU time, counts.
//!
//! Takes the words of a command and of each setting; every setting is prepared as the command itself would be, and frames
//! take turns, so that what disturbs the machine hits all of them.

use anyhow::{Context, Result};
use resample_core::metrics::{self, Comparison, Mask};
use resample_core::{Camera, Image};

use super::median;
use crate::commands::{self, Prepared};
use crate::figures::Steps;
use crate::interrupt;
use crate::report::Verbosity;
use crate::sequence;
use crate::words;

/// A scene and the settings that it is measured under.
pub(super) struct Bench {
    /// Words of the command, with a name for a picture that is never written.
    pub(super) words: Vec<String>,
    /// Words of each setting.
    pub(super) settings: Vec<&'static str>,
    /// Frames of each setting.
    pub(super) reps: u16,
}

/// One setting.
pub(super) struct Measured {
    pub(super) setting: &'static str,
    pub(super) comparison: Comparison,
    /// Error of the change from picture to picture, and largest change over median change.
    pub(super) flicker: Option<f64>,
    pub(super) jump: Option<f64>,
    /// Median CPU time of a frame, ms.
    pub(super) cpu_ms: f64,
    /// Points, splats and pixels touched.
    pub(super) counts: [f64; 3],
}

/// What the settings are compared with.
pub(super) enum Against {
    /// The picture of a setting.
    Setting(&'static str),
    /// A picture that is known.
    Picture(Image),
}

/// Further cameras, made of the first one.
pub(super) enum Motion {
    /// None.
    Still,
    /// Steps over which a picture should change evenly.
    Even(fn(&Camera) -> Vec<Camera>),
    /// Steps over which a picture should change as the reference does.
    Shimmer(fn(&Camera) -> Vec<Camera>),
}

impl Bench {
    /// Measures every setting.
    pub(super) fn measured(
        &self,
        against: Against,
        motion: &Motion,
        verbosity: Verbosity,
    ) -> Result<Vec<Measured>> {
        let mut exact = match &against {
            Against::Setting(setting) => Some(self.prepared(setting)?),
            Against::Picture(_) => None,
        };
        let mut all = self
            .settings
            .iter()
            .map(|s| self.prepared(s))
            .collect::<Result<Vec<_>>>()?;
        let first = all
            .first()
            .and_then(|prepared| prepared.cameras.first().copied());
        let camera = first.context("there is no camera to draw from")?;
        let views = match motion {
            Motion::Still => Vec::new(),
            Motion::Even(steps) | Motion::Shimmer(steps) => steps(&camera),
        };
        let pictures_of = |prepared: &mut Prepared| -> Result<Vec<Image>> {
            views
                .iter()
                .map(|view| Ok((prepared.render)(view)?.image))
                .collect()
        };
        let (reference, moving) = match (against, &mut exact) {
            (Against::Picture(picture), _) => (picture, Vec::new()),
            (_, Some(exact)) => {
                let shimmers = matches!(motion, Motion::Shimmer(_));
                let moving = if shimmers {
                    pictures_of(exact)?
                } else {
                    Vec::new()
                };
                ((exact.render)(&camera)?.image, moving)
            }
            (Against::Setting(_), None) => return Ok(Vec::new()),
        };
        let mask = Mask::from_alpha(&reference);
        let mut times = vec![Vec::new(); all.len()];
        let bar = sequence::progress(usize::from(self.reps), verbosity);
        for _ in 0..self.reps {
            for (times, prepared) in times.iter_mut().zip(&mut all) {
                times.push(number(&(prepared.render)(&camera)?.account.keys, "cpu_ms"));
            }
            bar.inc(1);
            if interrupt::asked() {
                break;
            }
        }
        bar.finish_and_clear();
        let mut rows = Vec::with_capacity(all.len());
        for ((setting, prepared), times) in self.settings.iter().zip(&mut all).zip(times) {
            let drawn = (prepared.render)(&camera)?;
            let own = pictures_of(prepared)?;
            let keys = drawn.account.keys;
            rows.push(Measured {
                setting,
                comparison: metrics::compare(&drawn.image, &reference, Some(&mask))?,
                flicker: flicker(&own, &moving),
                jump: matches!(motion, Motion::Even(_))
                    .then(|| jump(&own))
                    .flatten(),
                cpu_ms: median(times),
                counts: ["points", "splats", "pixels_touched"].map(|name| number(&keys, name)),
            });
        }
        Ok(rows)
    }

    fn prepared(&self, setting: &str) -> Result<Prepared> {
        let setting: Vec<String> = setting.split_whitespace().map(str::to_owned).collect();
        commands::prepared(&words::parsed(&words::with(&self.words, &setting))?.command)
    }
}

fn number(keys: &serde_json::Value, name: &str) -> f64 {
    keys.get(name)
        .and_then(serde_json::Value::as_f64)
        .unwrap_or(0.0)
}

fn flicker(own: &[Image], expected: &[Image]) -> Option<f64> {
    let mut steps = Steps::default();
    own.iter()
        .zip(expected)
        .for_each(|(own, expected)| steps.add(own.clone(), expected.clone(), None));
    steps.flicker()
}

/// Largest over median change (root mean square) between neighbouring pictures: 1 where all change alike.
fn jump(pictures: &[Image]) -> Option<f64> {
    let change = |pair: &[Image]| {
        let pixels = pair[0].rgba.iter().zip(&pair[1].rgba);
        pixels
            .map(|(a, b)| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>())
            .sum::<f64>()
            .sqrt()
    };
    let changes: Vec<f64> = pictures.windows(2).map(change).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let middle = median(changes);
    (middle > 0.0).then(|| largest / middle)
}
