//! The best picture within a time: every setting that may fit is timed, its error is measured, and the choice is drawn.
//!
//! Takes a search whose default was drawn in some windows, gives the place of the setting with the least error among those
//! that fit. No order of the ladder is presumed: a dearer setting can have a larger error, as where narrow peaks of a
//! transfer function are drawn along rays. Parts of a picture can miss where its time goes, so a prediction that is near the
//! limit is replaced by the measured time of a whole picture, and corrects the other predictions.
//! Limits: one drawing of a picture is one measurement of its time; other work on the machine lengthens it.

use anyhow::Result;

use super::candidate::Candidate;
use super::estimate::seen;
use super::search::{Keeps, Search, Tried};
use crate::values::BoundMetric;

/// A setting whose windows take so many times the allowed time ends the way up the ladder.
const TOO_LONG: f64 = 2.0;

/// After a setting took longer than predicted, the others are taken only below this part: no second picture is drawn to find
/// that out, so that planning costs a few times the allowed time at most.
const SHORT_AFTER_ONE_TOO_LONG: f64 = 0.5;

/// A prediction below this part of the allowed time needs no measurement: the largest known error of a prediction is a
/// factor of 3, for two narrow peaks.
const SURELY_SHORT: f64 = 0.25;

impl Search<'_, '_> {
    /// The place of the setting with the least error within a time; `None` where no setting fits.
    pub(super) fn best_in_time(&mut self, most_ms: f64) -> Result<Option<usize>> {
        let mut default = self.timed_in_windows(&self.default, most_ms);
        if (SURELY_SHORT * most_ms..TOO_LONG * most_ms).contains(&default.time_ms) {
            self.measure_whole(&mut default, most_ms)?;
        }
        self.tried.push(default);
        let mut rest = 0.0;
        for rung in &self.ladder.rungs {
            // Work decides only when to stop looking.
            if rest > 0.0 && rung.work >= rest {
                break;
            }
            let mut candidate = Candidate::new(rung);
            self.pilot.measure(self.scene, &mut candidate)?;
            self.pilot.measure_fixed(self.scene, &mut candidate)?;
            let tried = self.timed_in_windows(&candidate, most_ms);
            if tried.time_ms > TOO_LONG * most_ms {
                rest = TOO_LONG * rung.work;
            }
            self.tried.push(tried);
        }
        self.least_error(most_ms)
    }

    /// Draws the best of those that are predicted to fit, until one does.
    fn least_error(&mut self, most_ms: f64) -> Result<Option<usize>> {
        let mut measured = vec![false; self.tried.len()];
        measured[0] = self.default_is_measured;
        let mut sure = SURELY_SHORT;
        while let Some(place) = self.first_in_rank() {
            let is_clear = self.tried[place].time_ms <= sure * most_ms;
            if measured[place] || is_clear {
                return Ok(Some(place));
            }
            let mut tried = self.tried[place].clone();
            let ratio = self.measure_whole(&mut tried, most_ms)?;
            measured[place] = true;
            sure = SHORT_AFTER_ONE_TOO_LONG;
            self.tried[place] = tried;
            // What windows miss under one setting they miss under the others.
            if self.tried[place].keeps == Keeps::Yes {
                return Ok(Some(place));
            }
            for (other, _) in self.tried.iter_mut().zip(&measured).filter(|(_, m)| !**m) {
                other.time_ms *= ratio;
                other.keeps = kept(other.time_ms, most_ms);
                if other.time_ms > SHORT_AFTER_ONE_TOO_LONG * most_ms {
                    other.keeps = Keeps::No;
                }
            }
        }
        Ok(None)
    }

    /// The setting of the least time.
    pub(super) fn shortest(&self) -> Option<usize> {
        let times = self.tried.iter().enumerate();
        let least = times.min_by(|(_, a), (_, b)| a.time_ms.total_cmp(&b.time_ms));
        least.map(|(place, _)| place)
    }

    /// Of those that fit, the one with the least error; of several the shortest.
    fn first_in_rank(&self) -> Option<usize> {
        let rank = |tried: &Tried| (tried.error.unwrap_or_default(), tried.time_ms);
        let fitting = self.tried.iter().enumerate();
        let fitting = fitting.filter(|(_, tried)| tried.keeps == Keeps::Yes);
        let first = fitting.min_by(|(_, a), (_, b)| {
            let (a, b) = (rank(a), rank(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        first.map(|(place, _)| place)
    }

    /// A setting's error and time by its windows.
    fn timed_in_windows(&self, candidate: &Candidate, most_ms: f64) -> Tried {
        let mut tried = self.judged(candidate);
        tried.time_ms *= self.time_scale;
        tried.keeps = kept(tried.time_ms, most_ms);
        // Without a margin: settings are compared with one another, in the same windows.
        let errors = self.pilot.errors(candidate);
        tried.error = Some(seen(BoundMetric::Rms, &errors));
        tried
    }

    /// Takes the time of a whole picture for the predicted one; how much longer it is.
    fn measure_whole(&mut self, tried: &mut Tried, most_ms: f64) -> Result<f64> {
        let whole_ms = self.pilot.whole_ms(self.scene, &tried.choices)?;
        let ratio = whole_ms / tried.time_ms.max(f64::MIN_POSITIVE);
        if self.tried.is_empty() {
            self.time_scale = ratio;
            self.default_is_measured = true;
        }
        tried.time_ms = whole_ms;
        tried.keeps = kept(whole_ms, most_ms);
        Ok(ratio)
    }
}

fn kept(time_ms: f64, most_ms: f64) -> Keeps {
    if time_ms <= most_ms {
        Keeps::Yes
    } else {
        Keeps::No
    }
}
