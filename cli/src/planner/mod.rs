//! The planner: from an error or a time that was asked for to settings, for this scene and these cameras.
//!
//! 1. ladders: what may be chosen, as words of a command line ([`ladders`]);
//! 2. pilot: windows of the pictures ([`windows`]), as many as the run can afford ([`look`]), with the exact setting
//!    ([`pilot`]);
//! 3. search: candidates in the same windows, while they are worth their cost ([`purse`]); their errors with a margin
//!    ([`estimate`]), their cost from counts ([`model`]), and the best that keeps what was asked for ([`search`]);
//! 4. the command is parsed again with the words that were chosen, and draws what was read, as if they had been typed.
//!
//! The choice for an error knows no clock: it is the same on every machine, and so is the picture. Proven bounds (early
//! termination, level of detail) are used as such: each gets a share of the error, and what is left is measured together
//! with them. Limits: what windows show of a picture is an estimate with a margin, not a proof.

mod calibration;
mod estimate;
mod explain;
mod ladders;
mod look;
mod model;
mod pilot;
mod purse;
mod search;
mod windows;

use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::json;

use self::calibration::Calibration;
use self::estimate::predicted;
use self::explain::Account;
use self::look::Effort;
use self::model::{Counts, Model};
use self::pilot::{Found, Pilot, Scene};
use self::purse::Purse;
use self::search::{Goal, Keeps, Tried};
use crate::args::{AskArgs, Command};
use crate::commands::Opened;
use crate::report::{self, Verbosity};
use crate::values::{Bound, BoundMetric};
use crate::words;

pub(crate) use self::calibration::{cache_file, measured, saved};

/// What was asked for.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// At most this error.
    Error(Bound),
    /// At most this time, ms.
    Time(f64),
}

/// Share of the allowed error that each proven bound gets. A half of it is then left for what is measured, where there
/// are two.
const PROVEN_SHARE: f64 = 0.25;

/// The options of the planner: with a value, and without.
const OWN_OPTIONS: ([&str; 2], [&str; 1]) = (["--max-error", "--max-time"], ["--explain"]);

/// The scene, read, and the command with the settings that were chosen; `None` where nothing was asked for.
pub(crate) fn planned(
    command: &Command,
    verbosity: Verbosity,
) -> Result<Option<(Opened, Command)>> {
    let Some(ask) = asked_in(command) else {
        return Ok(None);
    };
    let asked = match (ask.max_error, ask.max_time_ms) {
        (Some(bound), _) => Asked::Error(bound),
        (None, Some(time_ms)) => Asked::Time(time_ms),
        (None, None) if ask.explain => {
            bail!("--explain: there is nothing to explain without --max-error or --max-time")
        }
        (None, None) => return Ok(None),
    };
    let start = Instant::now();
    let words = typed_words()?;
    let family = ladders::family(command, &words);
    let opened = Opened::read(command, verbosity)?;
    let mut scene = Scene {
        parts: opened.parts(command),
        opened,
        words,
    };
    let mut plan = Plan::new(asked, &mut scene, &family)?;
    let chosen = plan.choose(&mut scene, &family)?;
    let account = plan.account(&scene, (&family, &chosen), report::ms_since(start));
    if let Some(warning) = account.warning() {
        report::say(&warning);
    }
    if ask.explain {
        report::say(&account.explained());
    } else if verbosity != Verbosity::Quiet {
        report::say(&account.line());
    }
    let mut command = scene.command(&chosen.setting)?;
    if let Some(ask) = ask_of(&mut command) {
        ask.kept = Some(account.record());
    }
    Ok(Some((scene.opened, command)))
}

/// The words after the program's name, without those of the planner.
fn typed_words() -> Result<Vec<String>> {
    let words: Option<Vec<String>> = std::env::args_os()
        .skip(1)
        .map(|word| word.to_str().map(str::to_owned))
        .collect();
    let words = words.context(
        "--max-error and --max-time change the words of the command, and one of them is not UTF-8: rename the file",
    )?;
    Ok(words::without(&words, &OWN_OPTIONS.0, &OWN_OPTIONS.1))
}

fn asked_in(command: &Command) -> Option<&AskArgs> {
    match command {
        Command::Texmap(args) => Some(&args.ask),
        Command::Volsplat(args) => Some(&args.ask),
        Command::Warp3d(args) => Some(&args.ask),
        _ => None,
    }
}

fn ask_of(command: &mut Command) -> Option<&mut AskArgs> {
    match command {
        Command::Texmap(args) => Some(&mut args.ask),
        Command::Volsplat(args) => Some(&mut args.ask),
        Command::Warp3d(args) => Some(&mut args.ask),
        _ => None,
    }
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
    fn new(asked: Asked, scene: &mut Scene, family: &ladders::Family) -> Result<Self> {
        let calibration = match asked {
            Asked::Error(_) => Calibration::built_in()?,
            Asked::Time(_) => Calibration::of_this_machine(&scene.words)?,
        };
        let effort = match asked {
            Asked::Error(_) => Effort::Affordable,
            Asked::Time(_) => Effort::Any,
        };
        let pilot = Pilot::new(scene, family, (effort, &calibration.model))?;
        Ok(Self {
            asked,
            pilot,
            calibration,
            tried: Vec::new(),
        })
    }

    fn choose(&mut self, scene: &mut Scene, family: &ladders::Family) -> Result<Tried> {
        let exact = Tried {
            setting: family.exact.clone(),
            error: 0.0,
            cost_ms: 0.0,
            keeps: Keeps::Yes,
        };
        let (asked, calibration) = (self.asked, &self.calibration);
        let Some(pilot) = self.pilot.as_mut().filter(|pilot| pilot.sees_something()) else {
            return Ok(exact);
        };
        let Some(found) = pilot.exact.clone() else {
            return Ok(exact);
        };
        let (goal, extra) = match asked {
            Asked::Error(bound) => (Goal::LeastCost, proven_words(family, bound.value)),
            Asked::Time(_) => (Goal::LeastError, Vec::new()),
        };
        let pictures = pilot.pictures;
        let mut purse = full_purse(&found, pictures, &calibration.model);
        let exact = judged(asked, exact.setting, (&found, pictures), calibration);
        let mut tried = search::tried(family, (goal, &extra), &mut |candidate| {
            if goal == Goal::LeastCost && !purse.affords(candidate.cost, pilot.model_ms) {
                return Ok(None);
            }
            let found = pilot.found(scene, &candidate.setting)?;
            let tried = judged(asked, candidate.setting, (&found, pictures), calibration);
            if tried.keeps == Keeps::Yes {
                purse.won(mean_ms(&found, &calibration.model));
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

    fn account<'a>(
        &'a self,
        scene: &'a Scene,
        (family, chosen): (&'a ladders::Family, &'a Tried),
        planning_ms: f64,
    ) -> Account<'a> {
        Account {
            asked: self.asked,
            chosen,
            tried: &self.tried,
            pilot: self.pilot.as_ref(),
            calibration: &self.calibration,
            exact: &family.exact,
            words: words::with(&scene.words, &chosen.setting),
            planning_ms,
        }
    }
}

/// Words that give each proven bound its share.
fn proven_words(family: &ladders::Family, bound: f64) -> Vec<String> {
    // Less than the exact setting has is no use.
    let least: f64 = ladders::LEAST_TRANSMITTANCE.parse().unwrap_or(0.0);
    let share = (PROVEN_SHARE * bound).max(least);
    family
        .proven
        .iter()
        .flat_map(|option| [(*option).to_owned(), format!("{share:.7}")])
        .collect()
}

/// What may be spent on a run of which the exact setting is known.
fn full_purse(exact: &Found, pictures: usize, model: &Model) -> Purse {
    let exact_ms = mean_ms(exact, model);
    let windows_ms = exact.windows_model_ms;
    Purse {
        pictures: pictures as f64,
        exact_ms,
        best_ms: exact_ms,
        windows_ms,
    }
}

/// The mean cost of the pictures that were looked at.
fn mean_ms(found: &Found, model: &Model) -> f64 {
    let sum: f64 = found
        .frames
        .iter()
        .map(|counts| model.likely_cpu_ms(&found.path, counts))
        .sum();
    sum / found.frames.len().max(1) as f64
}

fn judged(
    asked: Asked,
    setting: Vec<String>,
    (found, pictures): (&Found, usize),
    calibration: &Calibration,
) -> Tried {
    let metric = match asked {
        Asked::Error(bound) => bound.metric,
        Asked::Time(_) => BoundMetric::Rms,
    };
    let error = predicted(metric, &found.errors, pictures);
    let worst = |cost: &dyn Fn(usize, &Counts) -> f64| {
        found
            .frames
            .iter()
            .enumerate()
            .map(|(k, counts)| cost(k, counts))
            .fold(0.0, f64::max)
    };
    let (cost_ms, keeps) = match asked {
        Asked::Error(bound) => {
            let cost = worst(&|_, counts| calibration.model.likely_cpu_ms(&found.path, counts));
            (cost, error <= bound.value)
        }
        Asked::Time(time_ms) => {
            let cost = worst(&|k, counts| calibration.wall_ms(found, (k, counts)));
            (cost, cost <= time_ms)
        }
    };
    Tried {
        setting,
        error,
        cost_ms,
        keeps: if keeps { Keeps::Yes } else { Keeps::No },
    }
}

impl Asked {
    /// What was asked for, as numbers.
    fn record(self) -> serde_json::Value {
        match self {
            Self::Error(bound) => json!({"metric": bound.metric.name(), "bound": bound.value}),
            Self::Time(time_ms) => json!({"metric": "time_ms", "bound": time_ms}),
        }
    }
}
