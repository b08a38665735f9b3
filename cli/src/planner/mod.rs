//! The planner: from an error or a time that was asked for to settings, for this scene and these cameras.
//!
//! 1. ladder: the settings that may be chosen, from cheap to exact, and the default among them (`ladder`);
//! 2. light: the part of the error that a volume's shadows and occlusion take is counted first, and taken off the bound (`light`);
//! 3. pilot: a small preview of some pictures shows where they have contrast; small windows stand there (`metrics::windows` of the core), in
//!    which the exact setting and the candidates are drawn (`pilot`);
//! 4. search: the default first, then up the ladder until a setting keeps the bound, or down it while one does
//!    (`search`); errors of whole pictures are predicted from those of windows with a margin (`metrics::estimate`);
//!    for a time, the least measured error among all that fit;
//! 5. the scene that was read is drawn with the setting that was chosen, and the choice is explained (`explain`).
//!
//! The choice for an error reads no clock: it is the same on every machine, and so is the picture. The choice for a time
//! measures the windows by the clock, and needs no calibration. Limits: the error of a picture by its windows is an
//! estimate with a margin, not a proof.

mod ladder;
mod pilot;
mod compared;
mod light;
mod search;
mod explain;

use std::time::Instant;

use anyhow::{Result, bail};
use resample_core::Camera;
use serde_json::Value;

use crate::args::words::typed;
use crate::args::words::typed::Typed;
use crate::args::{AskArgs, Drawing};
use crate::open::Opened;
use crate::open::setting::{Choices, Setting};
use crate::plan::Purpose;
use crate::planner::explain::Account;
use crate::planner::ladder::Ladder;
use crate::planner::light::LightError;
use crate::planner::pilot::{Asked, PlannedScene};
use crate::process::report;
use crate::process::report::Verbosity;
use crate::values::Bound;

pub(crate) use crate::planner::ladder::ends;

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
    let mut opened = Opened::read(drawing.clone(), Purpose::Compare, verbosity)?;
    let mut scene = PlannedScene {
        cameras: opened.cameras().to_vec(),
        opened: &mut opened,
        typed: setting,
    };
    let read = Instant::now();
    let light = match asked {
        Asked::Error(bound) => light::error(&mut scene, bound.metric)?,
        Asked::Time(_) => LightError::None,
    };
    let sampled = match asked {
        Asked::Error(bound) => Asked::Error(light.leaves(bound)),
        asked => asked,
    };
    let found = search::found(&mut scene, &ladder, sampled)?;
    let chosen = found.best.map(|place| &found.tried[place]);
    let choices = found.choices(&ladder);
    let whole = scene.typed.with(choices)?;
    let account = Account {
        asked,
        sampled,
        light,
        choices,
        chosen,
        found: &found,
        exact: &ladder.exact().choices,
        command: command(drawing, typed, choices),
        planning_ms: report::ms_since(read),
        reading_ms: (read - start).as_secs_f64() * 1e3,
    };
    for line in account.said(drawing.ask().explain, verbosity) {
        report::say(&line);
    }
    let record = account.record();
    opened.set(&whole)?;
    Ok(Some(Planned { opened, record }))
}

/// The setting under which an opened scene keeps an error in one picture, with all that was typed: the one that
/// [`planned`] chooses for this camera. The scene is left under any setting.
pub(crate) fn keeping(
    opened: &mut Opened,
    typed: Setting,
    camera: Camera,
    bound: Bound,
) -> Result<Setting> {
    let ladder = Ladder::of(&typed, Some(bound.value))?;
    let mut scene = PlannedScene {
        opened,
        cameras: vec![camera],
        typed,
    };
    let bound = light::error(&mut scene, bound.metric)?.leaves(bound);
    let found = search::found(&mut scene, &ladder, Asked::Error(bound))?;
    scene.typed.with(found.choices(&ladder))
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

/// The command that repeats the pictures without planning.
fn command(drawing: &Drawing, typed: &Typed, choices: &Choices) -> String {
    let mut words = vec![drawing.name().to_owned()];
    words.extend(typed.words(|name| OWN_OPTIONS.contains(&name)));
    words.extend(choices.words());
    typed::line(&words)
}
