//! `resample trade`: the cost and the error of every choice of an application.
//!
//! 1. plan: the settings ([`ladders`]);
//! 2. reference: the picture of the most exact setting, or one that is given;
//! 3. measure: each setting beside the default, its picture against the reference ([`crate::measure`]), and once in a process
//!    of its own;
//! 4. report: JSON after every setting, then CSV, a verdict in words and one self-contained page ([`record`], [`verdict`], [`page`]).
//!
//! Ctrl-C keeps the measured rows, and `--resume` goes on.

mod ladders;
mod page;
mod record;
mod rows;
mod verdict;

use std::io::IsTerminal;
use std::path::Path;

use anyhow::{Result, bail};

use self::record::{Report, Row};
use self::rows::MeasuredScene;
use crate::args::words::typed::Typed;
use crate::args::{Drawing, TradeArgs, TradeOptions};
use crate::commands::built_in;
use crate::open::setting::Choices;
use crate::output;
use crate::plan::sequence;
use crate::process::interrupt::Interrupted;
use crate::process::report::Verbosity;
use crate::process::{interrupt, machine, report};

/// Plans, measures, reports.
pub(crate) fn run(args: TradeArgs, typed: &Typed, verbosity: Verbosity) -> Result<()> {
    interrupt::watch()?;
    let (options, mut drawing, built_in) = args.parts();
    for name in ["output", "stats"] {
        if typed.has(name) {
            bail!("--{name}: trade writes its own pictures; leave it out");
        }
    }
    if options.probe {
        return rows::run(drawing);
    }
    let resumes = drawing.resume();
    let settings = ladders::settings(&drawing, &options.settings)?;
    let is_new = !options.out.exists();
    output::make_folder(&options.out)?;
    let mut start = vec![drawing.name().to_owned()];
    if let (Some(scene), Drawing::Volsplat(args)) = (built_in, &mut drawing) {
        let written = built_in::volume(scene, &options.out)?;
        start.extend(built_in::words(&written));
        (args.input, args.volume, args.transfer.transfer) =
            (written.input, written.volume, written.transfer.transfer);
    }
    drawing.write_to(&options.out.join("picture.exr"));
    let scene = MeasuredScene {
        drawing,
        start,
        typed,
    };
    let command = scene.command(&Choices::default());
    let done = if resumes {
        Report::earlier(&options.out, &command)?
    } else {
        Vec::new()
    };
    let mut report = Report {
        heading: machine::heading(),
        command,
        reference: reference_name(&options),
        reps: options.reps,
        left_out: 0,
        rows: Vec::new(),
    };
    let measuring = Measuring {
        options: &options,
        scene: &scene,
        settings: &settings,
        verbosity,
    };
    let ending = measuring.run(&done, &mut report);
    if ending.is_err() && report.rows.is_empty() {
        if is_new {
            // The files of a built-in scene stay, and the folder with them.
            let _ = std::fs::remove_dir(&options.out);
        }
        return ending;
    }
    write(&options.out, &mut report)?;
    ending?;
    if verbosity != Verbosity::Quiet {
        for advice in verdict::advice(&report) {
            report::say(&advice.words);
        }
        let page = options.out.join("index.html");
        report::say(&format!(
            "{} settings measured: open {}",
            report.rows.len(),
            page.display()
        ));
    }
    Ok(())
}

fn reference_name(options: &TradeOptions) -> String {
    match &options.truth {
        Some(path) => path.display().to_string(),
        None => "the setting \"exact\"".into(),
    }
}

/// The settings of a scene that are measured.
struct Measuring<'a> {
    options: &'a TradeOptions,
    scene: &'a MeasuredScene<'a>,
    settings: &'a [ladders::Named],
    verbosity: Verbosity,
}

impl Measuring<'_> {
    /// Adds the rows of all settings to the report; those that are done are not measured again.
    fn run(&self, done: &[Row], report: &mut Report) -> Result<()> {
        let Self {
            options,
            scene,
            settings,
            verbosity,
        } = *self;
        let _patience = interrupt::patience();
        let mut beside = rows::Beside::new(scene, options)?;
        let bar = sequence::progress(settings.len(), verbosity);
        for setting in settings {
            if interrupt::asked() {
                bar.finish_and_clear();
                let (measured, all) = (report.rows.len(), settings.len());
                return Err(Interrupted {
                    state: format!(
                        "{measured} of {all} settings are measured; --resume measures the rest"
                    ),
                }
                .into());
            }
            let command = scene.command(&setting.choices);
            let kept = done
                .iter()
                .find(|row| row.command == command && row.name == setting.name);
            match kept {
                Some(row) => report.rows.push(row.clone()),
                None => match beside.measured(scene, setting, options) {
                    Ok(row) => {
                        self.tell(&row, report.rows.len() + 1);
                        report.rows.push(Row { command, ..row });
                    }
                    // Options that exclude each other in this scene are no setting; the default must work.
                    Err(_) if !["default", "exact"].contains(&setting.group) => {
                        report.left_out += 1
                    }
                    Err(error) => return Err(error),
                },
            }
            output::write_text(
                &options.out.join("trade.json"),
                &serde_json::to_string_pretty(&report)?,
            )?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// A line for each setting where no bar can be shown: a report takes minutes.
    fn tell(&self, row: &Row, number: usize) {
        if self.verbosity != Verbosity::Quiet && !std::io::stderr().is_terminal() {
            let (name, all, error) = (&row.name, self.settings.len(), row.rmse());
            let cpu_ms = row.cost.cpu_ms;
            report::say(&format!(
                "{number} of {all}: {name}: {cpu_ms:.1} ms, error {error:.1e}"
            ));
        }
    }
}

/// Writes the report: JSON, CSV and the page.
fn write(folder: &Path, report: &mut Report) -> Result<()> {
    report.mark_front();
    output::write_text(
        &folder.join("trade.json"),
        &serde_json::to_string_pretty(&report)?,
    )?;
    output::write_text(&folder.join("trade.csv"), &report.csv())?;
    output::write_text(&folder.join("index.html"), &page::html(report, folder)?)?;
    Ok(())
}
