//! `resample thumbnails`: a small picture of each of many files, and all of them on one sheet.
//!
//! Takes files of any kind that one file can be drawn from, gives a PNG for each in a folder, and a contact sheet. Each is drawn as
//! `resample FILE` draws it. Files that cannot be drawn are listed at the end, and the others are there.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Parser;
use resample_core::Image;
use resample_io::figure;

use crate::args::words::content;
use crate::args::{Cli, Command, Drawing, ThumbnailsArgs};
use crate::open::Opened;
use crate::output;
use crate::output::{Depth, Format};
use crate::plan::Purpose;
use crate::process::report;
use crate::process::report::{Verbosity, watch};

/// Some of several files could not be drawn.
#[derive(Debug)]
pub(crate) struct SomeFailed {
    failed: usize,
    all: usize,
}

impl std::fmt::Display for SomeFailed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(
            f,
            "{} of {} files could not be drawn, as listed above",
            self.failed, self.all
        )
    }
}

impl std::error::Error for SomeFailed {}

/// Draws the thumbnails and the sheet.
pub(crate) fn run(args: &ThumbnailsArgs, verbosity: Verbosity) -> Result<()> {
    output::make_folder(&args.output)?;
    let mut tell = watch("drawing thumbnails", verbosity.progress());
    let (names, mut taken) = (names(&args.files), HashSet::new());
    let (mut cells, mut faults) = (Vec::new(), Vec::new());
    for (done, (file, name)) in args.files.iter().zip(names).enumerate() {
        tell(done as f64 / args.files.len() as f64);
        let drawn = drawn(file, args).and_then(|image| {
            let path = args.output.join(file_name(&name, &mut taken));
            output::write_picture(&path, Format::Png(Depth::Eight), &image)?;
            Ok(image)
        });
        match drawn {
            Ok(image) => cells.push((name, image)),
            Err(error) => {
                let (name, why) = (file.display().to_string(), report::one_line(&error));
                // Readers name their file themselves.
                let is_named = why.starts_with(&name);
                faults.push(if is_named {
                    why
                } else {
                    format!("{name}: {why}")
                });
            }
        }
    }
    tell(1.0);
    if !cells.is_empty() {
        let square = || (1..).find(|side| side * side >= cells.len());
        let columns = args.columns.map(usize::from).or_else(square).unwrap_or(1);
        let sheet = figure::sheet(&cells, usize::try_from(args.size)?, columns);
        let path = args.output.join(SHEET);
        output::write_picture(&path, Format::Png(Depth::Eight), &sheet)?;
        if verbosity != Verbosity::Quiet {
            let count = cells.len();
            report::say(&format!("wrote {count} thumbnails and {}", path.display()));
        }
    }
    if faults.is_empty() {
        return Ok(());
    }
    faults.iter().for_each(|fault| report::say(fault));
    Err(SomeFailed {
        failed: faults.len(),
        all: args.files.len(),
    }
    .into())
}

/// The file name of the sheet.
const SHEET: &str = "contact-sheet.png";

/// The picture of one file, as its command draws it.
fn drawn(file: &Path, args: &ThumbnailsArgs) -> Result<Image> {
    if !file.exists() {
        bail!("no such file");
    }
    let side = args.size;
    let size = format!("--size={side}x{side}").into();
    let words = [
        "resample".into(),
        file.into(),
        "--output=thumbnail.png".into(),
        size,
    ];
    let words = words.into_iter().chain(args.options.iter().cloned());
    let words = content::with_command(words.collect(), |_| false)?;
    let words = content::of_content(words);
    let first_line = |error: clap::Error| {
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default();
        anyhow::anyhow!("{}", line.trim_start_matches("error: "))
    };
    let Command::Draw(drawing) = Cli::try_parse_from(words).map_err(first_line)?.command else {
        bail!("no file that a command draws");
    };
    if matches!(drawing, Drawing::Warp3d(_)) {
        bail!("a picture and its depth are drawn from a camera: resample warp3d");
    }
    let mut opened = Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?;
    let camera = *opened.cameras().first().context("nothing to draw")?;
    let image = opened.draw(&camera)?.image;
    Ok(opened.finished(image, &camera))
}

/// The last parts of each path, as many as tell it from the others.
fn names(files: &[PathBuf]) -> Vec<String> {
    let last = |file: &PathBuf, count: usize| {
        let parts: Vec<_> = file.components().rev().take(count).collect();
        let last: PathBuf = parts.into_iter().rev().collect();
        last.to_string_lossy().into_owned()
    };
    let most = files.iter().map(|file| file.components().count()).max();
    let mut names = vec![String::new(); files.len()];
    for count in 1..=most.unwrap_or(0) {
        let ends: Vec<String> = files.iter().map(|file| last(file, count)).collect();
        let mut times = HashMap::new();
        ends.iter()
            .for_each(|end| *times.entry(end).or_insert(0) += 1);
        for (name, end) in names.iter_mut().zip(&ends) {
            if name.is_empty() && (times[end] == 1 || Some(count) == most) {
                name.clone_from(end);
            }
        }
    }
    names
}

/// The file name of a thumbnail; a number behind it tells equal ones apart.
fn file_name(name: &str, taken: &mut HashSet<String>) -> String {
    let own = name.replace(['/', '\\'], "-").replace(['*', '?', '%'], "_");
    let numbered = (2..).map(|number| format!("{own}-{number}"));
    let mut names = std::iter::once(own.clone()).chain(numbered);
    let free = names.find(|name| taken.insert(name.clone())).unwrap_or(own);
    free + ".png"
}
