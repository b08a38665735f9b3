//! The account of the planner's choice: one line, an explanation, and the record in the stats file.

use anyhow::Result;
use serde_json::{Value, json};

use super::asked::Asked;
use super::calibration::Calibration;
use super::pilot::Pilot;
use super::search::{Keeps, Tried};
use crate::report::Verbosity;
use crate::setting::Setting;

/// All that is known about a choice.
pub(super) struct Account<'a> {
    pub(super) asked: Asked,
    pub(super) chosen: &'a Tried,
    pub(super) tried: &'a [Tried],
    pub(super) pilot: Option<&'a Pilot>,
    pub(super) calibration: &'a Calibration,
    pub(super) exact: &'a Setting,
    /// The command with the setting that was chosen.
    pub(super) command: String,
    pub(super) planning_ms: f64,
}

impl Account<'_> {
    /// The lines for people.
    pub(super) fn said(&self, explain: bool, verbosity: Verbosity) -> Result<Vec<String>> {
        let mut lines: Vec<String> = self.warning().into_iter().collect();
        if explain {
            lines.push(self.explained()?);
        } else if verbosity != Verbosity::Quiet {
            lines.push(self.line()?);
        }
        Ok(lines)
    }

    /// A warning where no setting keeps the bound.
    fn warning(&self) -> Option<String> {
        let Asked::Time(time_ms) = self.asked else {
            return None;
        };
        (self.chosen.keeps == Keeps::No).then(|| {
            format!(
                "warning: no setting is predicted to take at most {time_ms:.0} ms; the cheapest one is taken, at about {:.0} ms",
                self.chosen.cost_ms
            )
        })
    }

    /// The choice in one line.
    fn line(&self) -> Result<String> {
        let setting = typed(&self.chosen.setting)?;
        Ok(match self.asked {
            Asked::Error(_) if self.is_exact() => format!("chosen: the exact setting, {setting}"),
            Asked::Error(bound) => format!(
                "chosen: {setting}; {} error at most {:.5} predicted, {:.5} allowed",
                bound.metric.name(),
                self.chosen.error,
                bound.value
            ),
            Asked::Time(_) => format!(
                "chosen: {setting}; about {:.0} ms predicted, rms error about {:.5}",
                self.chosen.cost_ms, self.chosen.error
            ),
        })
    }

    /// The choice, its reason, and the savings and costs of the others.
    fn explained(&self) -> Result<String> {
        let mut lines = vec![self.line()?, self.pilot_line()];
        if let Asked::Time(_) = self.asked {
            lines.push(format!("times: {}", self.calibration.described));
        }
        if self.is_exact() {
            lines.push(self.why_exact().into());
        }
        let mut others: Vec<&Tried> = self
            .tried
            .iter()
            .filter(|t| t.setting != self.chosen.setting)
            .collect();
        others.sort_by(|a, b| a.cost_ms.total_cmp(&b.cost_ms));
        for other in others {
            lines.push(self.beside(other)?);
        }
        lines.push(format!("again without planning: {}", self.command));
        Ok(lines.join("\n"))
    }

    /// The entry of the stats file.
    pub(super) fn record(&self) -> Result<Value> {
        let (views, windows, share) = self.pilot.map_or((0, 0, 0.0), Pilot::size);
        let mut record = self.asked.record();
        let mut considered = Vec::with_capacity(self.tried.len());
        for tried in self.tried {
            considered.push(json!({
                "setting": typed(&tried.setting)?,
                "predicted_error": tried.error,
                "predicted_ms": tried.cost_ms,
            }));
        }
        let more = json!({
            "setting": typed(&self.chosen.setting)?,
            "predicted_error": self.chosen.error,
            "predicted_ms": self.chosen.cost_ms,
            "kept": self.chosen.keeps == Keeps::Yes,
            "exact_setting": typed(self.exact)?,
            "command": self.command,
            "pilot_views": views,
            "pilot_windows": windows,
            "pilot_share_of_pixels": share,
            "pilot_cpu_ms": self.pilot.map_or(0.0, |pilot| pilot.cpu_ms),
            "planning_ms": self.planning_ms,
            "model": self.calibration.described,
            "considered": considered,
        });
        if let (Some(record), Value::Object(more)) = (record.as_object_mut(), more) {
            record.extend(more);
        }
        Ok(record)
    }

    fn is_exact(&self) -> bool {
        self.chosen.setting == *self.exact
    }

    fn why_exact(&self) -> &'static str {
        match self.pilot {
            None => {
                "why: to try settings on parts of so few or such small pictures costs more than it can save"
            }
            Some(pilot) if !pilot.sees_something() => {
                "why: a coarse look shows nothing to measure on"
            }
            Some(_) => "why: no cheaper setting is predicted to keep the bound",
        }
    }

    fn pilot_line(&self) -> String {
        let Some(pilot) = self.pilot else {
            return "pilot: none".into();
        };
        let (views, windows, share) = pilot.size();
        let exact_ms: f64 = pilot
            .exact
            .as_ref()
            .map_or(0.0, |exact| exact.frames_cpu_ms.iter().sum());
        let all_ms = exact_ms / views.max(1) as f64 * pilot.pictures as f64;
        format!(
            "pilot: {windows} windows in {views} of {} pictures, {:.1} % of their pixels; {:.0} ms of CPU time, {:.1} % of \
             the exact setting would take for all; {:.0} ms in all, with reading",
            pilot.pictures,
            100.0 * share,
            pilot.cpu_ms,
            100.0 * pilot.cpu_ms / all_ms.max(f64::MIN_POSITIVE),
            self.planning_ms
        )
    }

    /// The saving or cost of another setting.
    fn beside(&self, other: &Tried) -> Result<String> {
        let ratio = other.cost_ms / self.chosen.cost_ms.max(f64::MIN_POSITIVE);
        let cost = if ratio < 1.0 {
            format!("saves {:.0} %", 100.0 * (1.0 - ratio))
        } else {
            format!("takes {ratio:.2} times as long")
        };
        let verdict = match (other.keeps, self.asked) {
            (Keeps::Yes, _) => "",
            (Keeps::No, Asked::Error(_)) => ", over the bound",
            (Keeps::No, Asked::Time(_)) => ", over the time",
        };
        let setting = typed(&other.setting)?;
        Ok(format!(
            "  {setting}: error {:.5}{verdict}; {cost}",
            other.error
        ))
    }
}

/// A setting as it is typed, in one text.
fn typed(setting: &Setting) -> Result<String> {
    Ok(setting.words()?.join(" "))
}
