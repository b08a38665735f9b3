//! The account of the planner's choice: one line, an explanation, and the record in the stats file.

use serde_json::{Value, json};

use super::pilot::Pilot;
use super::search::{Found, Keeps, Tried};
use crate::open::setting::Choices;
use crate::planner::light::LightError;
use crate::planner::pilot::Asked;
use crate::process::report::Verbosity;

/// All that is known about a choice.
pub(super) struct Account<'a> {
    pub(super) asked: Asked,
    /// The part that is asked of sampling.
    pub(super) sampled: Asked,
    pub(super) light: LightError,
    pub(super) choices: &'a Choices,
    /// `None` where the exact setting is taken because nothing else keeps the bound.
    pub(super) chosen: Option<&'a Tried>,
    pub(super) found: &'a Found,
    pub(super) exact: &'a Choices,
    /// The command with the setting that was chosen.
    pub(super) command: String,
    pub(super) planning_ms: f64,
    pub(super) reading_ms: f64,
}

impl Account<'_> {
    /// The lines for people.
    pub(super) fn said(&self, explain: bool, verbosity: Verbosity) -> Vec<String> {
        let mut lines: Vec<String> = self.warning().into_iter().collect();
        if explain {
            lines.push(self.explained());
        } else if verbosity != Verbosity::Quiet {
            lines.push(self.line());
        }
        lines
    }

    /// A warning where no setting keeps the bound.
    fn warning(&self) -> Option<String> {
        match (self.asked, self.chosen) {
            (Asked::Error(bound), _) if self.light.exceeds(bound) => Some(format!(
                "warning: shadows and occlusion may err by more than the {:.5} allowed; sampling keeps that",
                bound.value
            )),
            (
                Asked::Time(most_ms),
                Some(Tried {
                    keeps: Keeps::No,
                    time_ms,
                    ..
                }),
            ) => Some(format!(
                "warning: no setting is predicted to take at most {most_ms:.0} ms; the cheapest one is taken, at about \
                 {time_ms:.0} ms"
            )),
            _ => None,
        }
    }

    /// The choice in one line.
    fn line(&self) -> String {
        let name = name(self.choices);
        match (self.sampled, self.chosen) {
            (_, None) => format!("chosen: the exact setting, {name}{}", self.beyond()),
            (Asked::Error(bound), Some(tried)) => format!(
                "chosen: {name}; {} error at most {:.5} predicted, {:.5} allowed{}",
                bound.metric.name(),
                tried.error.unwrap_or_default(),
                bound.value,
                self.beyond()
            ),
            (Asked::Time(_), Some(tried)) => {
                format!("chosen: {name}; about {:.0} ms predicted", tried.time_ms)
            }
        }
    }

    /// The error of light, which samples do not show.
    fn beyond(&self) -> String {
        match self.light {
            LightError::None => String::new(),
            LightError::Within(error) => {
                format!("; shadows and occlusion err by at most {error:.5} beside that")
            }
            LightError::Unknown => {
                "; errors of shadows and occlusion are not known: a coarser grid of light gives the same picture".into()
            }
        }
    }

    /// The choice, its reason, and the savings and costs of the others.
    fn explained(&self) -> String {
        let mut lines = vec![self.line(), self.pilot_line()];
        if self.chosen.is_none() {
            lines.push(format!("why: {}", self.found.why_exact));
        }
        for other in &self.found.tried {
            if other.choices != *self.choices {
                lines.push(self.beside(other));
            }
        }
        lines.push(format!("again without planning: {}", self.command));
        lines.join("\n")
    }

    fn pilot_line(&self) -> String {
        let Some(pilot) = &self.found.pilot else {
            return "pilot: none".into();
        };
        let (views, windows, share) = pilot.size();
        format!(
            "pilot: {windows} windows in {views} of {} pictures, {:.1} % of their pixels; {:.0} ms of CPU time, {:.0} ms \
             elapsed after {:.0} ms of reading",
            pilot.pictures,
            100.0 * share,
            pilot.cpu_ms,
            self.planning_ms,
            self.reading_ms
        )
    }

    /// The saving or cost of another setting.
    fn beside(&self, other: &Tried) -> String {
        let mut parts = Vec::new();
        if let Some(error) = other.error {
            parts.push(format!("error {error:.5}"));
        }
        match (other.keeps, self.asked) {
            (Keeps::Yes, _) => {}
            (Keeps::Worse, _) => parts.push("a larger error than the default".into()),
            (Keeps::No, Asked::Error(_)) => parts.push("over the bound".into()),
            (Keeps::No, Asked::Time(_)) => parts.push("over the time".into()),
        }
        parts.push(format!("about {:.0} ms", other.time_ms));
        format!("  {}: {}", name(&other.choices), parts.join(", "))
    }

    /// The entry of the stats file.
    pub(super) fn record(&self) -> Value {
        let pilot = self.found.pilot.as_ref();
        let (views, windows, share) = pilot.map_or((0, 0, 0.0), Pilot::size);
        let (metric, bound) = match self.asked {
            Asked::Error(bound) => (bound.metric.name(), bound.value),
            Asked::Time(time_ms) => ("time_ms", time_ms),
        };
        let considered = self.found.tried.iter().map(|tried| {
            json!({
                "setting": words(&tried.choices),
                "predicted_error": tried.error,
                "predicted_work": tried.work,
                "predicted_ms": tried.time_ms,
            })
        });
        let exact = match self.asked {
            Asked::Error(_) => Some(0.0),
            Asked::Time(_) => None,
        };
        json!({
            "metric": metric,
            "bound": bound,
            "light_error": match self.light {
                LightError::Within(error) => Some(error),
                LightError::None | LightError::Unknown => None,
            },
            "setting": words(self.choices),
            "predicted_error": self.chosen.map_or(exact, |tried| tried.error),
            "predicted_work": self.chosen.map(|tried| tried.work),
            "predicted_ms": self.chosen.map(|tried| tried.time_ms),
            "kept": self.chosen.is_none_or(|tried| tried.keeps == Keeps::Yes),
            "exact_setting": words(self.exact),
            "command": self.command,
            "pilot_views": views,
            "pilot_windows": windows,
            "pilot_share_of_pixels": share,
            "pilot_cpu_ms": pilot.map_or(0.0, |pilot| pilot.cpu_ms),
            "planning_ms": self.planning_ms,
            "considered": considered.collect::<Vec<Value>>(),
        })
    }
}

/// A setting as it is typed, in one text; nothing for the default.
fn words(choices: &Choices) -> String {
    choices.words().join(" ")
}

fn name(choices: &Choices) -> String {
    let words = words(choices);
    if words.is_empty() {
        "the default".into()
    } else {
        words
    }
}
