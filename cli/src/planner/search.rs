//! The search: the default first; up the ladder until a setting keeps the bound, or down it while one does.
//!
//! For a time every setting that may fit is timed, its error is measured, and the best is drawn. No order of the ladder is presumed: a dearer
//! setting can have a larger error, as where narrow peaks of a transfer function are drawn along rays. Parts of a picture can miss where its
//! time goes, so a prediction that is near the limit is replaced by the measured time of a whole picture, and corrects the others.
//! Limits: one drawing of a picture is one measurement of its time; other work on the machine lengthens it.

use anyhow::Result;

use crate::open::setting::{Choices, Setting};
use crate::planner::ladder::{Ladder, Rung};
use crate::planner::pilot::{
    Asked, Candidate, DRAWS, Pilot, PlannedScene, SHARE_OF_EXACT, effort, side_px,
};
use crate::values::BoundMetric;
use resample_core::metrics::estimate::{predicted, seen};

/// A setting that was tried.
#[derive(Clone, Debug)]
pub(super) struct Tried {
    pub(super) choices: Choices,
    /// The error of the worst picture: predicted with a margin for an error, and seen in the windows for a time.
    pub(super) error: Option<f64>,
    /// Work of a picture, of one under the default setting.
    pub(super) work: f64,
    /// Time of the slowest picture, ms.
    pub(super) time_ms: f64,
    pub(super) keeps: Keeps,
}

/// The result of testing a setting against the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keeps {
    Yes,
    No,
    /// It keeps the bound, but the default, which is dearer, has a smaller error.
    Worse,
}

/// The result of a search.
pub(super) struct Found {
    /// `None` where even a preview costs more than it can save.
    pub(super) pilot: Option<Pilot>,
    pub(super) tried: Vec<Tried>,
    /// The place of the best among those that were tried; without one the exact setting is taken.
    pub(super) best: Option<usize>,
    /// The reason for the exact setting, where that is taken.
    pub(super) why_exact: &'static str,
}

impl Found {
    /// The chosen setting beyond the typed one.
    pub(super) fn choices<'a>(&'a self, ladder: &'a Ladder) -> &'a Choices {
        match self.best {
            Some(place) => &self.tried[place].choices,
            None => &ladder.exact().choices,
        }
    }
}

const TOO_DEAR: &str = "too few or too small pictures for trial renders to pay off";
const NOTHING_SEEN: &str = "a preview shows nothing to measure on";
const NOTHING_KEEPS: &str = "no cheaper setting is predicted to keep the bound";

/// Draws of each picture at most.
const MOST_DRAWS: usize = 24;

/// Draws in all from which on a cheaper setting than a volume's default is tried: those of a sequence of sixteen pictures. With
/// four, one of 350 random pictures took a setting of twelve times the predicted error.
const UNDERCUT_DRAWS: usize = 16;

/// Over the number of draws it is the part of the error that these do not show. Calibrated: without it nine of 800 random
/// pictures were over their bound, eight of them by less than the factor of 2 that four draws get, and one whose default this
/// factor leaves in doubt.
const UNSEEN_DRAWS: f64 = 4.0;

/// Part of a run under the exact setting that looking may take where the default does not keep the bound, to know better which
/// settings lie above it. Where only the margin is in the way, looking may take as much as a run under the default: a dearer
/// setting would take two to four times as much.
const SHARE_WHERE_IT_FAILS: f64 = 0.08;

/// A setting below the best one is no gain unless it takes less work than this part.
const LEAST_GAIN: f64 = 0.8;

/// CPU time of windows after which no more are added for a time, ms: a quarter of the tenth of a second that planning may take.
const ENOUGH_MS: f64 = 25.0;

/// The same where the exact setting is drawn in the windows too, most of whose time it takes.
const ENOUGH_WITH_ERRORS_MS: f64 = 60.0;

/// The time of a picture grows at least by this part of the growth of its work. A guess; it saves tries.
const LEAST_GROWTH: f64 = 0.3;

/// The verdict of the windows on the default: it keeps the bound, breaks it, or is in doubt.
enum Verdict {
    Keeps,
    /// Over the bound even without a margin.
    Fails,
    Unsure,
}

pub(super) struct Search<'a, 'b> {
    asked: Asked,
    pub(super) scene: &'a mut PlannedScene<'b>,
    pub(super) ladder: &'a Ladder,
    pub(super) pilot: Pilot,
    pub(super) default: Candidate,
    exact: Candidate,
    pub(super) tried: Vec<Tried>,
    /// Measured over predicted time of a whole picture under the default, where that was drawn; else 1.
    pub(super) time_scale: f64,
    pub(super) default_is_measured: bool,
}

/// Looks for the cheapest setting that keeps an error, or for the most exact one that keeps a time.
pub(super) fn found(scene: &mut PlannedScene, ladder: &Ladder, asked: Asked) -> Result<Found> {
    let Some(effort) = effort(scene, asked) else {
        return Ok(Found {
            pilot: None,
            tried: Vec::new(),
            best: None,
            why_exact: TOO_DEAR,
        });
    };
    let mut search = Search {
        asked,
        pilot: Pilot::new(scene, ladder, &effort)?,
        scene,
        ladder,
        default: Candidate::new(&ladder.default),
        exact: Candidate::new(ladder.exact()),
        tried: Vec::new(),
        time_scale: 1.0,
        default_is_measured: false,
    };
    let (best, why_exact) = match asked {
        _ if !search.pilot.sees_something() => (None, NOTHING_SEEN),
        Asked::Error(_) if !search.looked_for_errors()? => (None, TOO_DEAR),
        Asked::Error(_) => (search.best()?, NOTHING_KEEPS),
        Asked::Time(most_ms) => {
            let has_errors = search.looked_for_times()?;
            let best = match has_errors {
                true => search.best_in_time(most_ms)?,
                false => search.best()?,
            };
            (best.or(search.shortest()), NOTHING_KEEPS)
        }
    };
    Ok(Found {
        pilot: Some(search.pilot),
        tried: search.tried,
        best,
        why_exact,
    })
}

impl Search<'_, '_> {
    /// Adds windows under the exact and the default setting until their errors are clear; whether that is worth its cost.
    fn looked_for_errors(&mut self) -> Result<bool> {
        let pictures = self.pilot.pictures as f64;
        let previews = self.pilot.work;
        self.pilot.add_windows(1);
        self.pilot.measure(self.scene, &mut self.exact)?;
        // The default costs no more than the exact setting.
        let windows = 2.0 * DRAWS as f64 * (self.pilot.work - previews);
        // Pictures that rank cells for a largest error are drawn, whatever is chosen.
        let counted = if self.pilot.is_ranked() {
            0.0
        } else {
            previews
        };
        if counted + windows > SHARE_OF_EXACT * pictures * self.pilot.picture_work(&self.exact) {
            return Ok(false);
        }
        let mut draws = 1;
        while draws < MOST_DRAWS {
            // Where the default is far below a largest error, two windows show it.
            let more = match draws {
                1 if self.pilot.is_ranked() => 1,
                _ => DRAWS - draws % DRAWS,
            };
            self.pilot.add_windows(more);
            draws += more;
            self.pilot.measure(self.scene, &mut self.exact)?;
            self.pilot.measure(self.scene, &mut self.default)?;
            let verdict = self.verdict();
            if draws < DRAWS && !matches!(verdict, Verdict::Keeps) {
                continue;
            }
            let default_run = pictures * self.pilot.picture_work(&self.default);
            let exact_run = pictures * self.pilot.picture_work(&self.exact);
            let most = match verdict {
                Verdict::Keeps => break,
                Verdict::Fails => default_run.min(SHARE_WHERE_IT_FAILS * exact_run),
                Verdict::Unsure => default_run.min(SHARE_OF_EXACT * exact_run),
            };
            // Previews are drawn for where to look, and are not looked at.
            if self.pilot.work - previews > most {
                break;
            }
        }
        let share = self.pilot.picture_work(&self.default) / self.pilot.picture_work(&self.exact);
        self.place_default(self.exact.rung.work * share);
        Ok(true)
    }

    /// Adds windows under the exact and the default setting until there are enough to know the default's time; false where
    /// there are no parts to see errors in, because each window would be a whole picture.
    fn looked_for_times(&mut self) -> Result<bool> {
        let has_errors = side_px(self.scene) < u32::MAX;
        let previews_ms = self.pilot.cpu_ms;
        for draw in 1..=MOST_DRAWS {
            self.pilot.add_windows(1);
            if has_errors {
                self.pilot.measure(self.scene, &mut self.exact)?;
            }
            self.pilot.measure(self.scene, &mut self.default)?;
            let own_ms = self.pilot.cpu_ms - previews_ms;
            let (enough_ms, least) = match has_errors {
                true => (ENOUGH_WITH_ERRORS_MS, DRAWS),
                false => (ENOUGH_MS, 1),
            };
            if own_ms > enough_ms && draw >= least {
                break;
            }
        }
        self.pilot.measure_fixed(self.scene, &mut self.default)?;
        if self.default.rung.work == 0.0 {
            let mut cheapest = Candidate::new(self.ladder.cheapest());
            self.pilot.measure(self.scene, &mut cheapest)?;
            let share = self.pilot.picture_work(&self.default) / self.pilot.picture_work(&cheapest);
            self.place_default(cheapest.rung.work * share);
        }
        Ok(has_errors)
    }

    /// The windows' figures of the default so far.
    fn verdict(&self) -> Verdict {
        let Asked::Error(bound) = self.asked else {
            return Verdict::Unsure;
        };
        let errors = self.pilot.errors(&self.default);
        let predicted =
            self.unseen(bound.metric) * predicted(bound.metric, &errors, self.pilot.pictures);
        if predicted <= bound.value {
            Verdict::Keeps
        } else if seen(bound.metric, &errors) > bound.value {
            Verdict::Fails
        } else {
            Verdict::Unsure
        }
    }

    /// Factor on a volume's predicted error for what a few draws in all cannot show: draws that agree have no spread, and miss
    /// errors that stand in few cells.
    fn unseen(&self, metric: BoundMetric) -> f64 {
        let draws = (self.pilot.draws * self.pilot.size().0).max(1) as f64;
        match (&self.scene.typed, metric) {
            (Setting::Volume(_), BoundMetric::Rms) if !self.pilot.compared_all() => {
                1.0 + UNSEEN_DRAWS / draws
            }
            _ => 1.0,
        }
    }

    fn place_default(&mut self, work: f64) {
        if self.default.rung.work == 0.0 {
            self.default.rung.work = work;
        }
    }

    /// Goes along the ladder from the default: towards cheaper settings (for a time, more exact ones) while they keep the bound,
    /// else the other way until one does.
    fn best(&mut self) -> Result<Option<usize>> {
        let mut best = self.push(self.judged(&self.default));
        let is_error = matches!(self.asked, Asked::Error(_));
        if is_error && best.is_some() {
            best = self.checked_default()?;
        }
        let (keeps, mut last) = (best.is_some(), self.default.rung.clone());
        let (below, above) = self.ladder.around(&last);
        if is_error && keeps && !self.may_undercut() {
            return Ok(best);
        }
        let rungs: Vec<&Rung> = match keeps == is_error {
            true => below.iter().rev().collect(),
            false => above.iter().collect(),
        };
        for rung in rungs {
            if is_error && keeps && rung.work > LEAST_GAIN * last.work {
                continue;
            }
            // For an error the exact setting needs no try; for a time a step may be too large to be worth one.
            let is_exact = is_error && rung.choices == self.ladder.exact().choices;
            if is_exact || (keeps && self.is_too_slow(rung, &last)) {
                break;
            }
            let (mut candidate, mut found) = self.note(rung)?;
            if is_error && keeps && self.is_worse_than_default() {
                break;
            }
            if is_error && found.is_some() {
                found = self.checked(&mut candidate)?;
            }
            best = found.or(best);
            if found.is_some() != keeps {
                break;
            }
            last = rung.clone();
        }
        Ok(best)
    }

    /// Returns true if a setting surely takes more than the time that is asked for, by the time of the last one that was tried.
    fn is_too_slow(&self, rung: &Rung, last: &Rung) -> bool {
        match (self.asked, self.tried.last()) {
            (Asked::Time(most_ms), Some(tried)) => {
                tried.time_ms * LEAST_GROWTH * rung.work / last.work > most_ms
            }
            _ => false,
        }
    }

    /// Returns true if so much was looked at that a volume's default may be left for less: a few windows of a single picture cannot
    /// show which of two settings has the smaller error, and more of them cost as much as is saved.
    fn may_undercut(&self) -> bool {
        let is_volume = matches!(self.scene.typed, Setting::Volume(_));
        !is_volume || self.pilot.draws * self.pilot.size().0 >= UNDERCUT_DRAWS
    }

    /// Returns true if the last one tried has a larger error than the default, which came first. Windows miss errors that stand in a
    /// few pixels alone, and a volume's long steps have such errors: a bound is no licence to draw worse than the default.
    fn is_worse_than_default(&mut self) -> bool {
        let default = self.tried[0].error;
        let is_volume = matches!(self.scene.typed, Setting::Volume(_));
        match self.tried.last_mut() {
            Some(last) if is_volume && last.error > default => {
                if last.keeps == Keeps::Yes {
                    last.keeps = Keeps::Worse;
                }
                true
            }
            _ => false,
        }
    }

    /// Compares the picture of a volume under the setting that was tried last with one of more rays and one of longer steps, all over,
    /// and judges it again by what of each change the windows hold; its place where it still keeps the bound. The change of the default, which
    /// decided where windows stand, need not be where a dearer setting errs.
    fn checked(&mut self, candidate: &mut Candidate) -> Result<Option<usize>> {
        let place = self.tried.len() - 1;
        let Asked::Error(bound) = self.asked else {
            return Ok(Some(place));
        };
        let is_volume = matches!(self.scene.typed, Setting::Volume(_));
        if is_volume && bound.metric == BoundMetric::Max && self.pilot.is_ranked() {
            self.look_where_it_changes(candidate)?;
            let keeps = self.judged_again(candidate);
            return Ok(keeps.then_some(place));
        }
        if !is_volume || bound.metric != BoundMetric::Rms || !self.pilot.compared_all() {
            return Ok(Some(place));
        }
        let long = self
            .pilot
            .recompare(self.scene, self.ladder, &candidate.rung)?;
        if self.judged_again(candidate) {
            self.pilot
                .recompare_steps(self.scene, self.ladder, &candidate.rung, &long)?;
            self.judged_again(candidate);
        }
        Ok((self.tried[place].keeps == Keeps::Yes).then_some(place))
    }

    /// Draws windows where a setting itself changes most from a coarser one.
    fn look_where_it_changes(&mut self, candidate: &mut Candidate) -> Result<()> {
        self.pilot
            .rank_again(self.scene, self.ladder, &candidate.rung)?;
        self.pilot.add_windows(DRAWS);
        self.pilot.measure(self.scene, &mut self.exact)?;
        self.pilot.measure(self.scene, candidate)
    }

    /// The same for the default, whose rays are compared from the beginning: its steps.
    fn checked_default(&mut self) -> Result<Option<usize>> {
        let long = std::mem::take(&mut self.pilot.default_long);
        if long.is_empty() || !self.pilot.compared_all() {
            return Ok(Some(0));
        }
        let default = &self.default.rung;
        self.pilot
            .recompare_steps(self.scene, self.ladder, default, &long)?;
        let again = self.judged(&self.default);
        let before = &mut self.tried[0];
        if again.error > before.error {
            *before = again;
        }
        Ok((before.keeps == Keeps::Yes).then_some(0))
    }

    /// Judges the setting that was tried last by another change of pictures, if its error is larger by that; true where it still keeps
    /// the bound.
    fn judged_again(&mut self, candidate: &Candidate) -> bool {
        let again = self.judged(candidate);
        let Some(before) = self.tried.last_mut() else {
            return false;
        };
        if again.error > before.error {
            *before = again;
        }
        before.keeps == Keeps::Yes
    }

    /// Tries a rung; its place where it keeps the bound.
    fn note(&mut self, rung: &Rung) -> Result<(Candidate, Option<usize>)> {
        let mut candidate = Candidate::new(rung);
        self.pilot.measure(self.scene, &mut candidate)?;
        if matches!(self.asked, Asked::Time(_)) {
            self.pilot.measure_fixed(self.scene, &mut candidate)?;
        }
        let place = self.push(self.judged(&candidate));
        Ok((candidate, place))
    }

    fn push(&mut self, tried: Tried) -> Option<usize> {
        let keeps = tried.keeps == Keeps::Yes;
        self.tried.push(tried);
        keeps.then_some(self.tried.len() - 1)
    }

    pub(super) fn judged(&self, candidate: &Candidate) -> Tried {
        let error = |metric| {
            let errors = self.pilot.errors(candidate);
            self.unseen(metric) * predicted(metric, &errors, self.pilot.pictures)
        };
        let time_ms = self.pilot.picture_ms(candidate);
        let (error, keeps) = match self.asked {
            Asked::Error(bound) => {
                let error = error(bound.metric);
                (Some(error), error <= bound.value)
            }
            Asked::Time(most_ms) => (None, time_ms <= most_ms),
        };
        Tried {
            choices: candidate.rung.choices.clone(),
            error,
            work: self.pilot.picture_work(candidate) / self.pilot.picture_work(&self.default),
            time_ms,
            keeps: if keeps { Keeps::Yes } else { Keeps::No },
        }
    }
}

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
