//! The rows of a report: each setting measured beside the default, its picture against the reference.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use resample_core::Camera;
use resample_core::metrics::flip;
use resample_io::rendered;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::args::words::typed;
use crate::args::words::typed::Typed;
use crate::args::{Drawing, TradeOptions};
use crate::commands::trade::ladders;
use crate::commands::trade::ladders::Named;
use crate::commands::trade::record::{Cost, Row};
use crate::measure::figures::FLICKER;
use crate::measure::{Reference, Rendered, Time, figures};
use crate::open::Opened;
use crate::open::setting::Choices;
use crate::output::{Depth, Format};
use crate::plan::Purpose;
use crate::process::report;
use crate::process::report::Verbosity;
use crate::{measure, output};

/// The measured command.
pub(super) struct MeasuredScene<'a> {
    pub(super) drawing: Drawing,
    /// The name of the command, and the words of a built-in scene.
    pub(super) start: Vec<String>,
    pub(super) typed: &'a Typed,
}

/// The options of the measurement, which are no part of the measured command.
const OWN_OPTIONS: [&str; 8] = [
    "out", "settings", "scene", "reps", "truth", "flicker", "resume", "probe",
];

/// The default setting and the reference, which settings are measured beside.
pub(super) struct Beside {
    camera: Camera,
    default: Opened,
    time: Time,
    reference: Reference,
    /// The most exact setting and its picture, drawn for the reference already: it is also a row.
    exact: Option<(Choices, Rendered)>,
    /// Cameras of the flicker; empty where it is not measured.
    steps: Vec<Camera>,
}

impl MeasuredScene<'_> {
    /// The command under a setting, as a person would type it.
    pub(super) fn command(&self, choices: &Choices) -> String {
        typed::line(&self.words_with(choices))
    }

    fn words_with(&self, choices: &Choices) -> Vec<String> {
        let mut words = self.start.clone();
        let typed = self
            .typed
            .words(|name| OWN_OPTIONS.contains(&name) || choices.has(name));
        words.extend(typed);
        words.extend(choices.words());
        words
    }

    fn opened(&self, choices: &Choices) -> Result<Opened> {
        let mut drawing = self.drawing.clone();
        drawing.set(drawing.setting().with(choices)?)?;
        Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)
    }
}

impl Beside {
    pub(super) fn new(scene: &MeasuredScene, options: &TradeOptions) -> Result<Self> {
        let drawing = scene.drawing.clone();
        let mut default = Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)?;
        let cameras = default.cameras().first().copied();
        let camera = cameras.context("there is no camera to draw from")?;
        let exact_choices = ladders::exact(&scene.drawing);
        let mut exact = scene.opened(&exact_choices)?;
        let (image, rendered) = match &options.truth {
            Some(path) => (rendered::read(path)?, None),
            None => {
                let rendered = measure::rendered(&mut exact, &camera)?;
                (rendered.image.clone(), Some(rendered))
            }
        };
        let steps = if options.flicker {
            measure::sub_pixel_steps(&camera)
        } else {
            Vec::new()
        };
        Ok(Self {
            reference: Reference::new(image, measure::pictures(&mut exact, &steps)?),
            time: measure::time_alone(&mut default, &camera, options.reps)?,
            exact: rendered.map(|rendered| (exact_choices, rendered)),
            default,
            camera,
            steps,
        })
    }

    /// The picture of a setting: of the most exact one that of the reference.
    fn first(&mut self, choices: &Choices, own: &mut Opened) -> Result<Rendered> {
        match self.exact.take_if(|(exact, _)| exact == choices) {
            Some((_, rendered)) => Ok(rendered),
            None => measure::rendered(own, &self.camera),
        }
    }

    /// One row of the report, and its pictures; its command is filled in by the caller.
    pub(super) fn measured(
        &mut self,
        scene: &MeasuredScene,
        setting: &Named,
        options: &TradeOptions,
    ) -> Result<Row> {
        let alone = measured(&scene.words_with(&setting.choices), &options.out)?;
        let mut own = scene.opened(&setting.choices)?;
        let first = self.first(&setting.choices, &mut own)?;
        let reps = measure::worthwhile_reps(options.reps, first.time.cpu_ms);
        let beside =
            measure::time_beside(&mut own, &mut self.default, self.time, &self.camera, reps)?;
        let mut error = figures::record(&self.reference.comparison(&first.image)?);
        let moving = measure::pictures(&mut own, &self.steps)?;
        if let Some(flicker) = self.reference.flicker(&moving) {
            error.insert(FLICKER.into(), json!(flicker));
        }
        let map = flip::map(
            &first.image,
            self.reference.image(),
            flip::DEFAULT_PIXELS_PER_DEGREE,
        )?;
        let (picture, heatmap) = (
            file_name(&setting.name, "picture"),
            file_name(&setting.name, "error"),
        );
        for (name, image) in [
            (&picture, &first.image),
            (&heatmap, &figures::heatmap(&map)),
        ] {
            output::write_picture(&options.out.join(name), Format::Png(Depth::Eight), image)?;
        }
        Ok(Row {
            name: setting.name.clone(),
            group: setting.group.to_owned(),
            cost: Cost {
                wall_ms: beside.time.wall_ms,
                cpu_ms: beside.time.cpu_ms,
                spread: beside.spread,
                cold_ms: alone.cold_ms,
                peak_bytes: alone.peak_bytes,
            },
            counts: measure::counts(first.keys),
            error,
            picture,
            heatmap,
            ..Row::default()
        })
    }
}

/// The name of a setting as part of a file name.
fn file_name(setting: &str, kind: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || c == '.' {
            c
        } else {
            '-'
        }
    };
    format!(
        "{}_{kind}.png",
        setting.chars().map(plain).collect::<String>()
    )
}

/// Time and memory of one picture.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct Alone {
    /// Elapsed time: reading, preparing, drawing once, ms.
    pub(super) cold_ms: f64,
    /// Most memory that the process held, bytes.
    pub(super) peak_bytes: Option<u64>,
}

/// Draws one picture, and prints its time and memory.
pub(super) fn run(drawing: Drawing) -> Result<()> {
    let start = std::time::Instant::now();
    let mut opened = Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)?;
    let camera = opened.cameras().first().copied();
    opened.draw(&camera.context("there is no camera to draw from")?)?;
    let alone = Alone {
        cold_ms: report::ms_since(start),
        peak_bytes: report::peak_bytes(),
    };
    println!("{}", serde_json::to_string(&alone)?);
    Ok(())
}

/// Time and memory of a command line in a process of its own. Nothing is written to the folder of the report.
pub(super) fn measured(words: &[String], folder: &Path) -> Result<Alone> {
    let program = std::env::current_exe().context("the program does not know where it lies")?;
    let mut command = Command::new(program);
    command
        .arg("trade")
        .args(words)
        .args(["--probe", "--out"])
        .arg(folder)
        .stdin(Stdio::null());
    // Ctrl-C asks this process to stop after the setting, and leaves the other alone.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let output = command
        .output()
        .context("the program cannot start itself")?;
    if !output.status.success() {
        bail!(
            "{}",
            String::from_utf8_lossy(&output.stderr)
                .trim()
                .trim_start_matches("error: ")
        );
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
