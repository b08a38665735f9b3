//! The common part of every command that draws: names and cameras before the input is read, pictures after it.
//!
//! Takes the shared groups of options, gives a `Plan`: everything that can be refused without reading the input, so
//! that a misspelt name does not cost a minute. Once the input is known, the plan gives the cameras and draws the
//! pictures with whatever renderer it is handed. Nothing is written before all input has proved to be good.

mod request;
mod targets;
pub(crate) mod sequence;
mod records;
pub(crate) mod run_log;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use glam::DVec3;
use resample_core::{Camera, Projection};
use resample_io::Gate;

use crate::args::PartArgs;
use crate::cameras::camera_path::{CameraPath, Moment};
use crate::cameras::framing::{Extent, Lens, Stance, View};
use crate::cameras::framing::{Measure, fit};
use crate::cameras::{camera_path, framing};
use crate::output::{Depth, FilmKind, FilmPlan, Format, FrameNames};
use crate::picture::{Finish, RenderShot};
use crate::plan::sequence::{Existing, Fingerprint, Part, Sequence};
use crate::process::report;
use crate::process::report::{RunStats, Verbosity};
use crate::values::{BackgroundWord, Orbit, Size};
use crate::{output, picture};
use resample_io::camera_file;
use resample_io::camera_file::{CameraDefaults, CameraFile};
use resample_io::write::Views;
pub use run_log::{Follow, RunLog};
use texmap::background::Background;

pub(crate) use records::{camera_record, picture_record};
pub(crate) use request::Request;

/// Picture size when neither the command line nor a camera file gives one.
pub(crate) const DEFAULT_SIZE: Size = Size {
    width: 800,
    height: 800,
};

/// The plan of a run before its input is read.
pub(crate) struct Plan {
    names: FrameNames,
    film: Option<FilmPlan>,
    gate: Gate,
    /// How every picture is finished.
    pub finish: Finish,
    cameras: PlannedCameras,
}

/// Where the cameras come from.
enum PlannedCameras {
    /// They are fitted to the visible part.
    Framed,
    /// A camera file.
    File(CameraFile),
    /// Keys, and the moments of the pictures between them.
    Path(CameraPath, Vec<Moment>),
}

/// The number of pictures: several names need numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pictures {
    /// One picture.
    One,
    /// A list of them, even if it should hold one only.
    Several,
}

/// The purpose of reading a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To be drawn once, as it was asked for.
    Draw,
    /// To be drawn under several settings: in memory, and the same in every picture.
    Compare,
    /// To be drawn again and again while a person edits its look: in memory, and prepared for any look.
    Change,
}

/// A change of a command whose scene is read already; each variant includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Cameras, sizes, backgrounds.
    View,
    /// How the scene is drawn.
    Render,
    /// The transfer function of a volume.
    Look,
}

/// The messages and the statistics of a run.
pub(crate) struct Run<'a> {
    /// The stats file, as far as it is known before drawing.
    pub stats: RunStats,
    /// Its start and its verbosity.
    pub log: RunLog<'a>,
}

/// Refuses a stereo photograph as the file of a picture that is no pair of whole views.
pub(crate) fn refuse_stereo(format: Format, output: &Path) -> Result<()> {
    if matches!(format, Format::Jpeg(Views::Two | Views::Crossed)) {
        bail!(
            "{}: a stereo photograph holds the two whole views of a depth image: give --stereo BASELINE, with --layout side-by-side or none",
            output.display()
        )
    }
    Ok(())
}

impl Plan {
    /// Checks all that can be checked by now.
    pub(crate) fn new(request: &Request) -> Result<Self> {
        let cameras = planned_cameras(request)?;
        let list = matches!(
            cameras,
            PlannedCameras::File(CameraFile::List(_)) | PlannedCameras::Path(..)
        );
        let several = list || request.sequence.turntable.is_some() || request.steps > 0;
        let pictures = if several {
            Pictures::Several
        } else {
            Pictures::One
        };
        let plan = Self {
            cameras,
            ..Self::without_cameras(request, pictures)?
        };
        refuse_stereo(plan.finish.format, request.output)?;
        Ok(plan)
    }

    /// As [`Plan::new`], for a command that finds its cameras itself.
    pub(crate) fn without_cameras(request: &Request, pictures: Pictures) -> Result<Self> {
        let film = film_plan(request)?;
        let format = match film.as_ref().map(|film| film.kind) {
            Some(FilmKind::Png(depth)) => Format::Png(depth),
            Some(FilmKind::WebP | FilmKind::Gif | FilmKind::Video(_)) => Format::Png(Depth::Eight),
            None => output::format_of(request.output, request.picture.bits)?,
        };
        let names = match pictures {
            _ if film.is_some() => FrameNames::Single(request.output.to_owned()),
            Pictures::Several => FrameNames::numbered(request.output)?,
            Pictures::One => FrameNames::single(request.output)?,
        };
        let names = match request.sequence.part.tile {
            Some(_) if request.output == Path::new("-") => {
                bail!("--tile: a tile has a file of its own: name the picture by --output")
            }
            Some(tile) => names.of_tile(tile.column, tile.row),
            None => names,
        };
        targets::check(request, &names.frame(0))?;
        // A video, a GIF and a JPEG cannot be transparent.
        let opaque = match &film {
            Some(film) => film.kind.is_opaque(),
            None => matches!(format, Format::Jpeg(_)),
        };
        let background = background(request.picture.background.as_ref(), opaque)?;
        Ok(Self {
            names,
            film,
            finish: Finish {
                format,
                background,
                figure: None,
            },
            gate: request.gate.clone(),
            cameras: PlannedCameras::Framed,
        })
    }

    /// The cameras of the camera file, or those that show what of `extent` is seen, as was asked for.
    pub(crate) fn cameras(
        &self,
        request: &Request,
        (extent, stance): (&Extent, Stance),
        measure: &mut Measure,
    ) -> Result<Vec<Camera>> {
        let named = |file: &Option<PathBuf>| {
            file.as_deref()
                .unwrap_or(Path::new(""))
                .display()
                .to_string()
        };
        let cameras = match &self.cameras {
            PlannedCameras::Framed => framed(request, (extent, stance), measure)?,
            PlannedCameras::File(file) => {
                file_cameras(file, extent.bounds).with_context(|| named(&request.camera.camera))?
            }
            PlannedCameras::Path(path, pictures) => path
                .cameras(pictures, |camera| camera.for_bounds(extent.bounds))
                .with_context(|| named(&request.sequence.path))?,
        };
        let cameras = match cameras[..] {
            // One camera looks at all steps.
            [camera] if request.steps > 0 => vec![camera; request.steps],
            _ => cameras,
        };
        self.checked(cameras)
    }

    /// The rules of reading, with a note of every file that was read through a name in another.
    pub(crate) fn gate(&self) -> &Gate {
        &self.gate
    }

    /// The path that the cameras follow, and the moments of its pictures.
    pub(crate) fn path(&self) -> Option<(&CameraPath, &[Moment])> {
        match &self.cameras {
            PlannedCameras::Path(path, pictures) => Some((path, pictures)),
            PlannedCameras::Framed | PlannedCameras::File(_) => None,
        }
    }

    /// Cameras that were made elsewhere, if pictures of their sizes can be written.
    pub(crate) fn checked(&self, cameras: Vec<Camera>) -> Result<Vec<Camera>> {
        cameras.iter().try_for_each(picture::check_size)?;
        if let Some(film) = &self.film {
            film.check_sizes(&cameras)?;
        }
        Ok(cameras)
    }

    /// Draws all pictures, writes the stats file, and reports.
    pub(crate) fn draw(
        &self,
        request: &Request,
        cameras: &[Camera],
        run: Run,
        render: &mut RenderShot,
    ) -> Result<()> {
        let Run { mut stats, log } = run;
        let part = Part::of(request, cameras.len())?;
        targets::check_pictures(request, &self.names, &part.numbers, &self.gate.files())?;
        let read = targets::read(request, self.gate.files());
        let existing = if request.sequence.resume {
            Existing::Keep
        } else {
            Existing::Replace
        };
        let sequence = Sequence {
            cameras,
            names: &self.names,
            finish: &self.finish,
            existing,
            part,
            fingerprint: Fingerprint::new(&stats, &read),
        };
        let outcome = match &self.film {
            Some(film) => sequence::draw_film(render, &sequence, film, &log)?,
            None => sequence::draw(render, &sequence, &log)?,
        };
        stats.frames = outcome.frames;
        stats.peak_bytes = report::peak_bytes();
        if let Some(path) = request.stats {
            output::write_text(
                path,
                &format!("{}\n", serde_json::to_string_pretty(&stats)?),
            )?;
        }
        if let Some(path) = &request.camera.save_camera {
            output::write_text(path, &camera_file::text(cameras))?;
        }
        if log.verbosity != Verbosity::Quiet {
            if outcome.kept > 0 {
                report::say(&format!(
                    "{} of {} pictures were there already",
                    outcome.kept, outcome.total
                ));
            }
            report::say(&report::summary(
                &stats.frames,
                log.start.elapsed().as_secs_f64(),
            ));
        }
        outcome.ending
    }
}

/// The background that was asked for; where a picture has to be opaque, black if none was.
fn background(word: Option<&BackgroundWord>, opaque: bool) -> Result<Background> {
    match word {
        Some(BackgroundWord::File(path)) => Ok(Background::read(path)?),
        Some(&BackgroundWord::Colour(colour)) => Ok(Background::Colour(colour)),
        Some(BackgroundWord::Transparent) | None if opaque => Ok(Background::Colour([0.0; 3])),
        Some(BackgroundWord::Transparent) | None => Ok(Background::Transparent),
    }
}

/// The animation that the name of the output asks for.
fn film_plan(request: &Request) -> Result<Option<FilmPlan>> {
    let name = request.output.display();
    let original = request.sequence.original.as_ref();
    let kind = output::kind_of(request.output, request.picture.bits, original.is_some())?;
    let Some(kind) = kind else {
        if original.is_none() && request.sequence.fps.is_some() && request.sequence.path.is_none() {
            bail!(
                "{name}: --fps is for --path and for animations, whose name ends in .apng, .webp, .gif, .mp4, .webm or .mkv"
            );
        }
        return Ok(None);
    };
    if request.sequence.resume && !matches!(kind, FilmKind::Video(_)) {
        bail!(
            "{name}: --resume is for numbered pictures and videos; such an animation is written whole or not at all"
        );
    }
    if request.sequence.part != PartArgs::default() {
        bail!(
            "{name}: --frames and --tile are for pictures of their own; an animation is written whole: draw numbered pictures, \
             such as out_%04d.png, and put them together with ffmpeg"
        );
    }
    let film = FilmPlan {
        path: request.output.to_owned(),
        kind,
        rate: request.sequence.rate(),
        original: original.cloned(),
        spatial: request.sequence.spatial,
    };
    film.check_tools()?;
    report::say_notes(&film.note());
    Ok(Some(film))
}

fn planned_cameras(request: &Request) -> Result<PlannedCameras> {
    let (camera, sequence) = (request.camera, request.sequence);
    let defaults = CameraDefaults {
        size: camera.size,
        look_at_size: DEFAULT_SIZE,
        fov_y_deg: camera.fov,
    };
    if let Some(file) = &sequence.path {
        let path = camera_path::read(file, &defaults, request.keys, &request.gate)?;
        let pictures = path.pictures(f64::from(sequence.fps.unwrap_or(output::DEFAULT_FPS)))?;
        return Ok(PlannedCameras::Path(path, pictures));
    }
    match &camera.camera {
        Some(file) => Ok(PlannedCameras::File(camera_file::read(file, &defaults)?)),
        None => Ok(PlannedCameras::Framed),
    }
}

/// The cameras that nobody wrote down: one, or those of a turntable.
fn framed(
    request: &Request,
    (extent, stance): (&Extent, Stance),
    measure: &mut Measure,
) -> Result<Vec<Camera>> {
    let args = request.camera;
    let orbit = args.orbit.unwrap_or(framing::DEFAULT_ORBIT);
    let view = View {
        size: args.size.unwrap_or(DEFAULT_SIZE),
        orbit,
        stance,
        lens: match args.projection {
            Projection::Perspective => Lens::Perspective {
                fov_y_deg: args.fov,
            },
            Projection::Orthographic => Lens::Orthographic,
        },
    };
    let steps = request.sequence.turntable.unwrap_or(1);
    // Fitted at the distance that fits, whatever multiple of it was asked for.
    let fitting = View {
        orbit: Orbit {
            distance: 1.0,
            ..orbit
        },
        ..view
    };
    let views: Vec<View> = framing::turned(&fitting, steps.min(FITTED_STEPS)).collect();
    let extent = fit(extent, &views, measure)?;
    framing::turned(&view, steps)
        .map(|view| Ok(framing::frame(&extent, &view)?))
        .collect()
}

/// Most views of a turntable to which it is fitted.
const FITTED_STEPS: u32 = 8;

fn file_cameras(file: &CameraFile, bounds: [DVec3; 2]) -> Result<Vec<Camera>> {
    match file {
        CameraFile::One(camera) => Ok(vec![camera.for_bounds(bounds)?]),
        CameraFile::List(list) => list
            .iter()
            .map(|camera| Ok(camera.for_bounds(bounds)?))
            .collect(),
    }
}
