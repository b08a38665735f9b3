//! Measuring a list of settings beside one another: error against one picture, CPU time, counts.
//!
//! Every setting is read and prepared as its command would be. Its frames alternate with those of the first setting
//! ([`crate::measure`]).

use anyhow::{Context, Result};
use resample_core::metrics::Comparison;
use resample_core::{Camera, Image};

use crate::args::Drawing;
use crate::measure;
use crate::measure::Reference;
use crate::open::Opened;
use crate::open::setting::Choices;
use crate::plan::{Purpose, sequence};
use crate::process::interrupt;
use crate::process::report::Verbosity;

/// A scene and the settings that it is measured under.
pub(super) struct Bench {
    pub(super) drawing: Drawing,
    pub(super) settings: Vec<Choices>,
    /// Frames of each setting.
    pub(super) reps: u16,
}

/// One setting.
pub(super) struct Measured {
    /// As it is typed.
    pub(super) setting: String,
    pub(super) comparison: Comparison,
    /// Error of the change from picture to picture, and largest change over median change.
    pub(super) flicker: Option<f64>,
    pub(super) jump: Option<f64>,
    /// CPU time of a frame, ms.
    pub(super) cpu_ms: f64,
    /// Points, splats and pixels touched.
    pub(super) counts: [f64; 3],
}

/// The settings are compared with this.
pub(super) enum Against {
    /// The picture of a setting.
    Setting(Choices),
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

/// Pictures that are compared, and their movement.
pub(super) struct Compared {
    pub(super) against: Against,
    pub(super) motion: Motion,
}

impl Bench {
    /// Measures every setting.
    pub(super) fn measured(
        &self,
        compared: Compared,
        verbosity: Verbosity,
    ) -> Result<Vec<Measured>> {
        let Compared { against, motion } = compared;
        let first = self.settings.first().context("no setting to measure")?;
        let mut base = self.opened(first)?;
        let cameras = base.cameras().first().copied();
        let camera = cameras.context("there is no camera to draw from")?;
        let views = match &motion {
            Motion::Still => Vec::new(),
            Motion::Even(steps) | Motion::Shimmer(steps) => steps(&camera),
        };
        let reference = match against {
            Against::Picture(picture) => Reference::new(picture, Vec::new()),
            Against::Setting(setting) => {
                let mut exact = self.opened(&setting)?;
                let moving = match motion {
                    Motion::Shimmer(_) => measure::pictures(&mut exact, &views)?,
                    Motion::Still | Motion::Even(_) => Vec::new(),
                };
                Reference::new(exact.draw(&camera)?.image, moving)
            }
        };
        let base_time = measure::time_alone(&mut base, &camera, self.reps)?;
        let bar = sequence::progress(self.settings.len(), verbosity);
        let mut rows = Vec::with_capacity(self.settings.len());
        for setting in &self.settings {
            if interrupt::asked() {
                break;
            }
            let mut own = self.opened(setting)?;
            let drawn = measure::rendered(&mut own, &camera)?;
            let beside = measure::time_beside(&mut own, &mut base, base_time, &camera, self.reps)?;
            let moving = measure::pictures(&mut own, &views)?;
            rows.push(Measured {
                setting: setting.words().join(" "),
                comparison: reference.comparison(&drawn.image)?,
                flicker: reference.flicker(&moving),
                jump: match motion {
                    Motion::Even(_) => measure::jump(&moving),
                    Motion::Still | Motion::Shimmer(_) => None,
                },
                cpu_ms: beside.time.cpu_ms,
                counts: ["points", "splats", "pixels_touched"]
                    .map(|name| measure::number(&drawn.keys, name)),
            });
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(rows)
    }

    fn opened(&self, choices: &Choices) -> Result<Opened> {
        let mut drawing = self.drawing.clone();
        drawing.set(drawing.setting().with(choices)?)?;
        Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)
    }
}
