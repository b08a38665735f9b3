//! Pictures one after another, numbered or as one animation.
//!
//! Takes any renderer as a closure, and cameras; writes one file for each or one for all, and gives an account of them.
//! Between two pictures it looks whether Ctrl-C was pressed and then stops; pictures that exist can be kept, so that a
//! run can be taken up again.
//! A picture is kept if it can be read, has the format and the size that this run would give it, and carries the
//! fingerprint of its settings, its camera and the files that it reads.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use indicatif::{ProgressBar, ProgressStyle};
use resample_core::Camera;
use resample_core::simd::SimdLevel;
use resample_io::files;
use resample_io::rendered::{self, Content, Description};
use serde_json::Value;

use crate::output::{Film, FilmPlan, Format, FrameNames, Left};
use crate::picture::tiles;
use crate::picture::tiles::PartMark;
use crate::picture::{Drawn, Finish, RenderShot, Shot};
use crate::plan::Request;
use crate::plan::run_log::RunLog;
use crate::process::interrupt::Interrupted;
use crate::process::report::{RunStats, Verbosity, WrittenFrame};
use crate::process::{interrupt, report};
use crate::values::TileWord;
use crate::{output, picture};
use resample_core::camera::bands::{Next, Window};

/// Returns true if the next picture is drawn: nobody has pressed Ctrl-C, and whoever follows the run wants it.
fn goes_on(log: &RunLog, done: usize, total: usize) -> bool {
    let wanted = log
        .follow
        .is_none_or(|follow| follow(done, total) == Next::Draw);
    wanted && !interrupt::asked()
}

/// The pictures of a run and their files.
pub(crate) struct Sequence<'a> {
    /// One camera per picture.
    pub cameras: &'a [Camera],
    /// One name per picture.
    pub names: &'a FrameNames,
    /// How every picture is finished.
    pub finish: &'a Finish,
    /// The treatment of pictures that exist.
    pub existing: Existing,
    /// The part that is drawn.
    pub part: Part,
    /// Distinguishes them from pictures of other settings.
    pub fingerprint: Fingerprint,
}

/// The treatment of pictures that exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Existing {
    /// They are drawn again.
    Replace,
    /// They stay as they are.
    Keep,
}

/// The result of a sequence.
pub(crate) struct Outcome {
    /// The pictures that were drawn, in order.
    pub frames: Vec<WrittenFrame>,
    /// How many pictures were there already.
    pub kept: usize,
    /// How many there are to be.
    pub total: usize,
    /// An error of the kind [`Interrupted`] if Ctrl-C ended it.
    pub ending: Result<()>,
}

impl Sequence<'_> {
    /// The mark in the file of a picture; a single picture and a JPEG carry none.
    fn mark(&self, camera: &Camera) -> Option<String> {
        let numbered = matches!(self.names, FrameNames::Numbered { .. });
        let has_room = !matches!(self.finish.format, Format::Jpeg(_));
        (numbered && has_room).then(|| self.fingerprint.of_picture(camera))
    }

    /// The mark in the file that is written: of a picture, or of a tile of it.
    fn mark_in_file(&self, camera: &Camera, number: usize) -> Result<Option<String>> {
        let number = matches!(self.names, FrameNames::Numbered { .. }).then_some(number);
        let fingerprint = self.fingerprint.of_picture(camera);
        match self
            .part
            .mark((number, fingerprint), camera, self.finish.format)
        {
            Some(mark) => Ok(Some(serde_json::to_string(&mark)?)),
            None => Ok(self.mark(camera)),
        }
    }

    /// The format and the size of the file that is written.
    fn shape(&self, camera: &Camera) -> Result<(Content, [usize; 2])> {
        let content = match self.part.has_tile() {
            true => Content::Exr,
            false => Content::of(self.finish.format),
        };
        Ok((content, self.part.window(camera)?.size()))
    }
}

/// Draws the sequence.
pub(crate) fn draw(render: &mut RenderShot, sequence: &Sequence, log: &RunLog) -> Result<Outcome> {
    let verbosity = log.verbosity;
    let (todo, kept) = todo(sequence)?;
    let total = sequence.part.numbers.len();
    // A single picture has no end that is worth waiting for.
    let _patience = (total > 1).then(interrupt::patience);
    let bar = progress(todo.len(), verbosity);
    let mut frames = Vec::with_capacity(todo.len());
    for (file, (camera, number)) in todo {
        if !goes_on(log, kept + frames.len(), total) {
            break;
        }
        let shot = Shot {
            camera,
            number,
            window: sequence.part.window(camera)?,
        };
        let drawn = picture::render(render, &shot, sequence.finish)?;
        let mark = sequence.mark_in_file(camera, number)?;
        let frame = match sequence.part.has_tile() {
            true => write(drawn, file, &shot, mark.as_deref())?,
            false => picture::write(drawn, file, sequence.finish.format, mark.as_deref())?,
        };
        if verbosity == Verbosity::Verbose {
            bar.suspend(|| report::say(&report::stage_line(&frame)));
        }
        frames.push(frame);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let ending = ending(kept + frames.len(), total);
    Ok(Outcome {
        frames,
        kept,
        total,
        ending,
    })
}

/// Draws the sequence into one animation.
pub(crate) fn draw_film(
    render: &mut RenderShot,
    sequence: &Sequence,
    plan: &FilmPlan,
    log: &RunLog,
) -> Result<Outcome> {
    let (cameras, file) = (sequence.cameras, &plan.path);
    let size = cameras
        .first()
        .map_or([1; 2], |camera| [camera.width, camera.height]);
    let _patience = (cameras.len() > 1).then(interrupt::patience);
    let mark = sequence.fingerprint.of_film(cameras, plan);
    let left = match sequence.existing {
        Existing::Keep => Left::Kept(&mark),
        Existing::Replace => Left::Refused(&mark),
    };
    let total = cameras.len();
    let mut film = Film::resume(plan, size, u32::try_from(total)?, left)?;
    let kept = film.left().map_or(0, |(pictures, _)| pictures.min(total));
    let bar = progress(total - kept, log.verbosity);
    let mut frames = Vec::with_capacity(total - kept);
    for (number, camera) in cameras.iter().enumerate().skip(kept) {
        if !goes_on(log, number, total) {
            bar.finish_and_clear();
            let state = match film.left().filter(|(pictures, _)| *pictures > 0) {
                None => format!("{} is not written", file.display()),
                Some((pictures, folder)) => format!(
                    "{pictures} of {total} pictures are in {}; --resume draws the rest",
                    folder.display()
                ),
            };
            return Ok(Outcome {
                frames: Vec::new(),
                kept: 0,
                total,
                ending: Err(Interrupted { state }.into()),
            });
        }
        let Drawn { image, account } = picture::render(
            render,
            &Shot {
                camera,
                number,
                window: Window::whole(camera),
            },
            sequence.finish,
        )?;
        film.add(&image)?;
        let (width, height) = (image.width, image.height);
        frames.push(WrittenFrame {
            file: file.clone(),
            file_bytes: 0,
            width,
            height,
            account,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let file_bytes = film.finish()?;
    frames
        .iter_mut()
        .for_each(|frame| frame.file_bytes = file_bytes);
    Ok(Outcome {
        frames,
        kept,
        total,
        ending: Ok(()),
    })
}

/// A bar with the time left; it hides itself where stderr is no terminal.
pub(crate) fn progress(count: usize, verbosity: Verbosity) -> ProgressBar {
    if count < 2 || verbosity == Verbosity::Quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{wide_bar} {pos} of {len}, {eta} left");
    ProgressBar::new(count as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// A picture's file, and its camera with its number.
type Todo<'a> = (PathBuf, (&'a Camera, usize));

/// The pictures to draw, each with its camera and its number, and how many are kept.
fn todo<'a>(sequence: &Sequence<'a>) -> Result<(Vec<Todo<'a>>, usize)> {
    let mut todo = Vec::new();
    let numbers = sequence.part.numbers.clone();
    let total = numbers.len();
    for (index, camera) in numbers.clone().zip(&sequence.cameras[numbers]) {
        let file = sequence.names.frame(index);
        let may_stay = sequence.existing == Existing::Keep && file.is_file();
        if !(may_stay && keeps(&file, (camera, index), sequence)?) {
            todo.push((file, (camera, index)));
        }
    }
    let kept = total - todo.len();
    Ok((todo, kept))
}

/// Returns true if a picture that exists is as this run would write it; says why where it is not.
fn keeps(file: &Path, (camera, number): (&Camera, usize), sequence: &Sequence) -> Result<bool> {
    let wrong = match rendered::description(file) {
        Err(error) => report::one_line(&error.into()),
        Ok(found) => {
            let (content, size) = sequence.shape(camera)?;
            let expected = Description {
                content,
                size,
                mark: sequence.mark_in_file(camera, number)?,
            };
            if found == expected {
                return Ok(true);
            }
            let file = file.display();
            if (found.content, found.size) == (expected.content, expected.size) {
                format!(
                    "{file}: made with other options, by another version or from files that have changed"
                )
            } else {
                format!("{file}: {found}, expected {expected}")
            }
        }
    };
    report::say(&format!("drawn again: {wrong}"));
    Ok(false)
}

fn ending(done: usize, total: usize) -> Result<()> {
    if done == total {
        return Ok(());
    }
    let state = format!("{done} of {total} pictures are finished; --resume draws the rest");
    Err(Interrupted { state }.into())
}

/// Bytes of a sample, a page of most systems.
const SAMPLE_BYTES: u64 = 4096;

/// Samples of a file, evenly spread: half a megabyte, under a millisecond where the file has just been read. A guess.
const SAMPLES: u64 = 128;

/// The common part of all pictures of a run.
#[derive(Clone, Debug)]
pub(crate) struct Fingerprint(DefaultHasher);

impl Fingerprint {
    /// The fingerprint of a run that draws with `stats.settings` and reads `files`.
    pub(crate) fn new(stats: &RunStats, files: &[PathBuf]) -> Self {
        let mut settings = stats.settings.clone();
        if let Some(Value::Object(picture)) = settings.get_mut("picture") {
            picture.remove("output");
        }
        let mut hasher = DefaultHasher::new();
        stats.version.hash(&mut hasher);
        settings.to_string().hash(&mut hasher);
        for file in files {
            // Standard input cannot be read twice; a file that is gone was read all the same.
            let _ = sample(file, &mut hasher);
        }
        Self(hasher)
    }

    /// The digits of the picture that `camera` sees.
    pub(crate) fn of_picture(&self, camera: &Camera) -> String {
        self.of(&format!("{camera:?}"))
    }

    /// The digits of a film that `cameras` see.
    fn of_film(&self, cameras: &[Camera], plan: &FilmPlan) -> String {
        let FilmPlan { kind, rate, .. } = plan;
        self.of(&format!("{kind:?} {rate} {cameras:?}"))
    }

    fn of(&self, text: &str) -> String {
        let mut hasher = self.0.clone();
        text.hash(&mut hasher);
        format!("{:016x}", hasher.finish())
    }
}

/// Adds the size of a file and samples of its bytes, all of them where it is small.
fn sample(path: &Path, hasher: &mut DefaultHasher) -> io::Result<()> {
    let (mut file, length) = files::open_regular(path)?;
    let step = (length / SAMPLES).max(SAMPLE_BYTES);
    length.hash(hasher);
    let mut bytes = Vec::new();
    for start in (0..length).step_by(usize::try_from(step).unwrap_or(usize::MAX)) {
        bytes.clear();
        file.seek(SeekFrom::Start(start))?;
        file.by_ref().take(SAMPLE_BYTES).read_to_end(&mut bytes)?;
        bytes.hash(hasher);
    }
    Ok(())
}

/// The part of the work of one process.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// The numbers of the pictures.
    pub(crate) numbers: Range<usize>,
    tile: Option<TileWord>,
    vector_level: SimdLevel,
}

impl Part {
    /// The part that was asked for, of so many pictures.
    pub(crate) fn of(request: &Request, count: usize) -> Result<Self> {
        let asked = request.sequence.part;
        let numbers = match asked.frames {
            None => 0..count,
            Some(range) => match range.of(count) {
                Some(numbers) => numbers,
                None => bail!(
                    "--frames: starts at {}, and there are {count} pictures, counted from 0",
                    range.first
                ),
            },
        };
        Ok(Self {
            numbers,
            tile: asked.tile,
            vector_level: request.vector_level,
        })
    }

    /// Returns true if a tile of each picture is drawn.
    pub(crate) fn has_tile(&self) -> bool {
        self.tile.is_some()
    }

    /// The pixels that are drawn of a picture.
    pub(crate) fn window(&self, camera: &Camera) -> Result<Window> {
        let size = [camera.width, camera.height];
        match self.tile {
            Some(tile) => tiles::window(&tile, size),
            None => Ok(Window::whole(camera)),
        }
    }

    /// The mark in the file of a tile; `None` where pictures are drawn whole.
    pub(crate) fn mark(
        &self,
        (number, fingerprint): (Option<usize>, String),
        camera: &Camera,
        format: Format,
    ) -> Option<PartMark> {
        let TileWord { column, row, grid } = self.tile?;
        Some(PartMark {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            vector_level: self.vector_level.resolve().name().to_owned(),
            fingerprint,
            number,
            whole: [camera.width, camera.height],
            place: [column, row],
            grid: [grid.columns, grid.rows],
            format,
        })
    }
}

/// Writes the file of a tile.
pub(crate) fn write(
    drawn: Drawn,
    file: PathBuf,
    shot: &Shot,
    mark: Option<&str>,
) -> Result<WrittenFrame> {
    let Drawn { image, account } = drawn;
    let whole = [shot.camera.width as usize, shot.camera.height as usize];
    let place = (shot.window.first(), whole);
    let file_bytes = output::write_tile(&file, &image, place, mark.unwrap_or_default())?;
    Ok(WrittenFrame::of(file, file_bytes, &image, account))
}
