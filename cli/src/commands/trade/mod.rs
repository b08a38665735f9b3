//! `resample trade`: what every choice of an application costs, and what it loses.
//!
//! 1. plan: the settings, as words of the command line ([`ladders`]);
//! 2. reference: the picture of the most exact setting, or one that is given;
//! 3. measure: each setting beside the default, its picture against the reference ([`measure`]), and once in a process of its
//!    own ([`probe`]);
//! 4. report: JSON after every setting, then CSV, plots and one self-contained page ([`record`], [`plot`], [`page`]).
//!
//! Ctrl-C keeps what was measured, and `--resume` goes on.

mod ladders;
mod measure;
mod page;
mod plot;
mod probe;
mod record;
mod scene;
mod words;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use resample_core::metrics::{self, Mask, flip};
use resample_core::{Camera, Image};
use serde_json::{Map, Value, json};

use self::ladders::Setting;
use self::measure::Baseline;
use self::record::{Report, Row};
use crate::args::{Cli, TradeArgs, TradeOptions};
use crate::commands::{self, Prepared};
use crate::figures::{self, FLICKER, Steps};
use crate::input_picture;
use crate::interrupt::{self, Interrupted};
use crate::machine;
use crate::output::{self, Depth, Format};
use crate::report::{self, Verbosity};
use crate::sequence;

/// What all settings are compared with.
struct Reference {
    image: Image,
    /// Where it shows something; the whole picture if that is nowhere.
    mask: Option<Mask>,
    /// Its views along the flicker's steps; empty where no flicker is measured.
    moving: Vec<Image>,
}

/// Plans, measures, reports.
pub(crate) fn run(args: &TradeArgs, verbosity: Verbosity) -> Result<()> {
    interrupt::watch()?;
    let (options, mut words) = words::split(&args.words)?;
    check(&options, &words)?;
    if options.probe {
        return probe::run(&options, &words);
    }
    let is_new = !options.out.exists();
    output::make_folder(&options.out)?;
    if let Some(scene) = options.scene {
        words = scene::written(scene, &options.out, &words)?;
    }
    let (settings, left_out) = possible(
        ladders::application(&words)?.settings(&options.settings)?,
        &options,
        &words,
    );
    let command = crate::words::typed(&words);
    let done = if options.resume {
        Report::earlier(&options.out, &command)?
    } else {
        Vec::new()
    };
    let mut report = Report {
        heading: machine::heading(),
        command,
        reference: reference_name(&options),
        reps: options.reps,
        left_out,
        rows: Vec::new(),
    };
    let ending = measure_all(
        &options,
        (&words, &settings),
        done,
        (&mut report, verbosity),
    );
    if ending.is_err() && report.rows.is_empty() {
        if is_new {
            // What was written for a built-in scene stays, and the folder with it.
            let _ = std::fs::remove_dir(&options.out);
        }
        return ending;
    }
    write(&options.out, &mut report)?;
    ending?;
    if verbosity != Verbosity::Quiet {
        let page = options.out.join("index.html");
        report::say(&format!(
            "{} settings measured: open {}",
            report.rows.len(),
            page.display()
        ));
    }
    Ok(())
}

/// Words that no command understands are told before a folder is made.
fn check(options: &TradeOptions, words: &[String]) -> Result<()> {
    if options.scene.is_some() {
        return Ok(());
    }
    ladders::application(words)?.settings(&options.settings)?;
    crate::words::parsed(&complete(options, words, &[]))?;
    Ok(())
}

/// The settings that the application takes, and how many it refuses.
fn possible(
    settings: Vec<Setting>,
    options: &TradeOptions,
    words: &[String],
) -> (Vec<Setting>, usize) {
    let all = settings.len();
    let good: Vec<Setting> = settings
        .into_iter()
        .filter(|setting| crate::words::parsed(&complete(options, words, &setting.words)).is_ok())
        .collect();
    let left_out = all - good.len();
    (good, left_out)
}

fn reference_name(options: &TradeOptions) -> String {
    match &options.truth {
        Some(path) => path.display().to_string(),
        None => "the setting \"exact\"".into(),
    }
}

fn measure_all(
    options: &TradeOptions,
    (words, settings): (&[String], &[Setting]),
    done: Vec<Row>,
    (report, verbosity): (&mut Report, Verbosity),
) -> Result<()> {
    let _patience = interrupt::patience();
    let mut default = prepared(options, words, &[])?;
    let Some(&camera) = default.cameras.first() else {
        bail!("there is no camera to draw from")
    };
    let reference = reference(options, words, settings, &camera)?;
    // The first frame is cold.
    (default.render)(&camera)?;
    let time = measure::alone(&mut *default.render, &camera, options.reps)?;
    let mut baseline = Baseline {
        render: &mut *default.render,
        time,
    };
    let bar = sequence::progress(settings.len(), verbosity);
    for setting in settings {
        if interrupt::asked() {
            bar.finish_and_clear();
            let state = format!(
                "{} of {} settings are measured",
                report.rows.len(),
                settings.len()
            );
            return Err(Interrupted {
                state: format!("{state}; --resume measures the rest"),
            }
            .into());
        }
        let typed = crate::words::typed(&crate::words::with(words, &setting.words));
        let kept = done
            .iter()
            .find(|row| row.command == typed && row.name == setting.name);
        match kept {
            Some(row) => report.rows.push(row.clone()),
            None => match measured(
                options,
                (words, setting),
                &reference,
                (&camera, &mut baseline),
            ) {
                Ok(row) => report.rows.push(Row {
                    command: typed,
                    ..row
                }),
                // Options that exclude each other in this scene are no setting; the default must work.
                Err(_) if !["default", "exact"].contains(&setting.group.as_str()) => {
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

/// Reads and prepares the scene under a setting.
fn prepared(options: &TradeOptions, words: &[String], changes: &[String]) -> Result<Prepared> {
    let Cli { command, .. } = crate::words::parsed(&complete(options, words, changes))?;
    commands::prepared(&command)
}

/// The words of a command that can be parsed.
fn complete(options: &TradeOptions, words: &[String], changes: &[String]) -> Vec<String> {
    let mut words = crate::words::with(words, changes);
    // The picture is never written; the name only has to be good.
    words.extend([
        "-o".to_owned(),
        options.out.join("picture.exr").display().to_string(),
    ]);
    words
}

fn reference(
    options: &TradeOptions,
    words: &[String],
    settings: &[Setting],
    camera: &Camera,
) -> Result<Reference> {
    let exact = settings.iter().find(|setting| setting.group == "exact");
    let exact =
        exact.context("the most exact setting is refused together with the options given")?;
    let mut exact = prepared(options, words, &exact.words)?;
    let image = match &options.truth {
        Some(path) => input_picture::read(path)?,
        None => (exact.render)(camera)?.image,
    };
    let mask = Mask::from_alpha(&image);
    let views = if options.flicker {
        measure::flicker_cameras(camera)
    } else {
        Vec::new()
    };
    let moving = views
        .iter()
        .map(|view| Ok((exact.render)(view)?.image))
        .collect::<Result<_>>()?;
    Ok(Reference {
        mask: (mask.count() > 0).then_some(mask),
        image,
        moving,
    })
}

/// One row of the report, and its pictures.
fn measured(
    options: &TradeOptions,
    (words, setting): (&[String], &Setting),
    reference: &Reference,
    (camera, baseline): (&Camera, &mut Baseline),
) -> Result<Row> {
    let prepare = || prepared(options, words, &setting.words);
    let alone = probe::measured(&crate::words::with(words, &setting.words), &options.out)?;
    let (found, mut prepared) = measure::setting(prepare, camera, (options.reps, alone), baseline)?;
    let mut error = figures(&found.image, reference)?;
    if let Some(flicker) = flicker(&mut prepared, camera, &reference.moving)? {
        error.insert(FLICKER.into(), json!(flicker));
    }
    let map = flip::map(
        &found.image,
        &reference.image,
        flip::DEFAULT_PIXELS_PER_DEGREE,
    )?;
    let (picture, heatmap) = (
        file_name(&setting.name, "picture"),
        file_name(&setting.name, "error"),
    );
    for (name, image) in [
        (&picture, &found.image),
        (&heatmap, &figures::heatmap(&map)),
    ] {
        output::write_picture(&options.out.join(name), Format::Png(Depth::Eight), image)?;
    }
    Ok(Row {
        name: setting.name.clone(),
        group: setting.group.clone(),
        cost: found.cost,
        counts: found.counts,
        error,
        picture,
        heatmap,
        ..Row::default()
    })
}

fn figures(image: &Image, reference: &Reference) -> Result<Map<String, Value>> {
    Ok(figures::record(&metrics::compare(
        image,
        &reference.image,
        reference.mask.as_ref(),
    )?))
}

fn flicker(prepared: &mut Prepared, camera: &Camera, moving: &[Image]) -> Result<Option<f64>> {
    let mut steps = Steps::default();
    for (view, expected) in measure::flicker_cameras(camera).iter().zip(moving) {
        steps.add((prepared.render)(view)?.image, expected.clone(), None);
    }
    Ok(steps.flicker())
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

/// Writes what was measured: JSON, CSV, plots and the page.
fn write(folder: &Path, report: &mut Report) -> Result<()> {
    report.mark_front();
    output::write_text(
        &folder.join("trade.json"),
        &serde_json::to_string_pretty(&report)?,
    )?;
    output::write_text(&folder.join("trade.csv"), &report.csv())?;
    for (name, figure) in [("error-time.png", "rmse"), ("flip-time.png", "flip")] {
        if let Some(plot) = plot::scatter(report, figure)? {
            output::write_bytes(&folder.join(name), &plot)?;
        }
    }
    let page: PathBuf = folder.join("index.html");
    output::write_text(&page, &page::html(report, folder)?)?;
    Ok(())
}
