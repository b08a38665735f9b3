//! The steps of planning: pilot, search, account.

use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::asked::Asked;
use super::budget::Budget;
use super::calibration::Calibration;
use super::estimate::predicted;
use super::explain::Account;
use super::found::Found;
use super::ladder::{Ladder, Rung};
use super::look::Effort;
use super::model::{Model, Work};
use super::pilot::{Pilot, Scene};
use super::search::{self, Goal, Keeps, Tried};
use crate::args::{AskArgs, Drawing};
use crate::opened::Opened;
use crate::plan::Purpose;
use crate::report::{self, Verbosity};
use crate::setting::Setting;
use crate::typed::{self, Typed};
use crate::values::BoundMetric;

/// A scene with the setting that was chosen.
pub struct Planned {
    /// The scene, read, which is drawn with that setting from now on.
    pub opened: Opened,
    /// The choice, for the stats file.
    pub record: Value,
}

/// The options of the planner.
const OWN_OPTIONS: [&str; 3] = ["max-error", "max-time", "explain"];

/// Reads the scene and chooses its setting; `None` where neither an error nor a time was asked for.
pub fn planned(drawing: &Drawing, typed: &Typed, verbosity: Verbosity) -> Result<Option<Planned>> {
    let Some(asked) = asked(drawing.ask())? else {
        return Ok(None);
    };
    let start = Instant::now();
    let setting = drawing.setting();
    let allowed = match asked {
        Asked::Error(bound) => Some(bound.value),
        Asked::Time(_) => None,
    };
    let ladder = Ladder::of(&setting, allowed)?;
    let mut scene = Scene {
        opened: Opened::read(drawing.clone(), Purpose::Compare, verbosity)?,
        typed: setting,
    };
    let calibration = match asked {
        Asked::Error(_) => Calibration::built_in()?,
        Asked::Time(_) => Calibration::of_this_machine(drawing.name())?,
    };
    let mut plan = Plan {
        asked,
        pilot: plan_pilot(asked, &mut scene, (&ladder, &calibration.model))?,
        calibration,
        tried: Vec::new(),
    };
    let chosen = plan.choose(&mut scene, &ladder)?;
    let account = Account {
        asked,
        chosen: &chosen,
        tried: &plan.tried,
        pilot: plan.pilot.as_ref(),
        calibration: &plan.calibration,
        exact: &ladder.exact,
        command: command(drawing, typed, &chosen)?,
        planning_ms: report::ms_since(start),
    };
    for line in account.said(drawing.ask().explain, verbosity)? {
        report::say(&line);
    }
    let record = account.record()?;
    scene.opened.set(&scene.typed.with(&chosen.setting)?)?;
    Ok(Some(Planned {
        opened: scene.opened,
        record,
    }))
}

fn asked(ask: &AskArgs) -> Result<Option<Asked>> {
    match (ask.max_error, ask.max_time_ms) {
        (Some(bound), _) => Ok(Some(Asked::Error(bound))),
        (None, Some(time_ms)) => Ok(Some(Asked::Time(time_ms))),
        (None, None) if ask.explain => {
            bail!("--explain: there is nothing to explain without --max-error or --max-time")
        }
        (None, None) => Ok(None),
    }
}

fn plan_pilot(
    asked: Asked,
    scene: &mut Scene,
    (ladder, model): (&Ladder, &Model),
) -> Result<Option<Pilot>> {
    let effort = match asked {
        Asked::Error(_) => Effort::Affordable,
        Asked::Time(_) => Effort::Any,
    };
    Pilot::new(scene, ladder, (effort, model))
}

/// The command that repeats the pictures without planning.
fn command(drawing: &Drawing, typed: &Typed, chosen: &Tried) -> Result<String> {
    let mut words = vec![drawing.name().to_owned()];
    words.extend(typed.words(|name| OWN_OPTIONS.contains(&name)));
    words.extend(chosen.setting.words()?);
    Ok(typed::line(&words))
}

/// A plan in the making.
struct Plan {
    asked: Asked,
    /// `None` where the exact setting is taken unseen.
    pilot: Option<Pilot>,
    calibration: Calibration,
    tried: Vec<Tried>,
}

impl Plan {
    fn choose(&mut self, scene: &mut Scene, ladder: &Ladder) -> Result<Tried> {
        let exact = Tried {
            setting: ladder.exact.clone(),
            error: 0.0,
            cost_ms: 0.0,
            keeps: Keeps::Yes,
        };
        let (goal, model) = (self.asked.goal(), &self.calibration.model);
        let Some(pilot) = self.pilot.as_mut().filter(|pilot| pilot.sees_something()) else {
            return Ok(exact);
        };
        let Some(found) = pilot.exact.clone() else {
            return Ok(exact);
        };
        let judge = Judge {
            asked: self.asked,
            pictures: pilot.pictures,
            calibration: &self.calibration,
        };
        let mut budget = full_budget(&found, pilot.pictures, model);
        let exact = judge.tried(&ladder.exact, &found);
        let mut tried = search::tried(&ladder.rungs, goal, &mut |rung: &Rung| {
            if goal == Goal::LeastCost && !budget.affords(rung.cost, pilot.model_ms) {
                return Ok(None);
            }
            let found = pilot.found(scene, &rung.setting)?;
            let tried = judge.tried(&rung.setting, &found);
            if tried.keeps == Keeps::Yes {
                budget.won(mean_ms(&found, model));
            }
            Ok(Some(tried))
        })?;
        tried.push(exact);
        let cheapest = tried.iter().min_by(|a, b| a.cost_ms.total_cmp(&b.cost_ms));
        let chosen = search::best(goal, &tried)
            .or(cheapest)
            .context("there is no setting to choose")?
            .clone();
        self.tried = tried;
        Ok(chosen)
    }
}

/// What may be spent on a run of which the exact setting is known.
fn full_budget(exact: &Found, pictures: usize, model: &Model) -> Budget {
    let exact_ms = mean_ms(exact, model);
    Budget {
        pictures: pictures as f64,
        exact_ms,
        best_ms: exact_ms,
        windows_ms: model.likely_cpu_ms(&exact.windows_work),
    }
}

/// The mean cost of the pictures that were looked at.
fn mean_ms(found: &Found, model: &Model) -> f64 {
    let sum: f64 = found
        .frames
        .iter()
        .map(|work| model.likely_cpu_ms(work))
        .sum();
    sum / found.frames.len().max(1) as f64
}

/// Compares a setting in the windows with the bound.
struct Judge<'a> {
    asked: Asked,
    pictures: usize,
    calibration: &'a Calibration,
}

impl Judge<'_> {
    fn tried(&self, setting: &Setting, found: &Found) -> Tried {
        let metric = match self.asked {
            Asked::Error(bound) => bound.metric,
            Asked::Time(_) => BoundMetric::Rms,
        };
        let error = predicted(metric, &found.errors, self.pictures);
        let cost = |(view, work): (usize, &Work)| match self.asked {
            Asked::Error(_) => self.calibration.model.likely_cpu_ms(work),
            Asked::Time(_) => self.calibration.wall_ms(found, (view, work)),
        };
        let cost_ms = found
            .frames
            .iter()
            .enumerate()
            .map(cost)
            .fold(0.0, f64::max);
        let keeps = match self.asked {
            Asked::Error(bound) => error <= bound.value,
            Asked::Time(time_ms) => cost_ms <= time_ms,
        };
        Tried {
            setting: setting.clone(),
            error,
            cost_ms,
            keeps: if keeps { Keeps::Yes } else { Keeps::No },
        }
    }
}
