//! A scene and the options under which it was last drawn.
//!
//! Files are read and volumes classified when the first picture is asked for. After that a change of the camera costs nothing, one
//! of the way of drawing little, one of the transfer function asks the voxels again, and any other reads the scene anew.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use resample_cli::args::words::content::Application;
use resample_cli::args::words::typed::Typed;
use resample_cli::args::{
    CameraArgs, Drawing, GaussianRenderArgs, PictureArgs, PointsLookArgs, PointsRenderArgs,
    RenderArgs, SequenceArgs, TransferArgs, names_of,
};
use resample_cli::cameras::camera_file;
use resample_cli::open::Opened;
use resample_cli::plan::{Change, Purpose, RunLog};
use resample_cli::planner::{self, Planned};
use resample_cli::process::report::Verbosity;
use resample_cli::values::input_file::Held;
use resample_core::camera::bands::{Pace, Window, in_bands};
use resample_core::image::srgb_from_linear;
use resample_core::{Camera, Image};
use serde_json::{Value, json};

use crate::words::{self, Named};
use crate::work::Reins;

/// A scene that is drawn.
pub(crate) struct Session {
    pub(crate) application: Application,
    /// The names of its files, or what stands for them in messages.
    pub(crate) inputs: Vec<OsString>,
    /// The scene, where it is no file.
    pub(crate) held: Option<Held>,
    ready: Option<Ready>,
}

/// A scene that is read.
struct Ready {
    opened: Opened,
    words: Words,
    planned: Option<Value>,
    pace: Pace,
}

type Words = BTreeMap<String, Vec<OsString>>;

/// A picture, and its counts and times.
pub(crate) struct Drawn {
    pub(crate) image: Image,
    pub(crate) stats: Value,
}

/// Pixels of the first band under the default way of drawing: a picture of 1024x1024 is drawn at once.
const FIRST_BAND_PX: u32 = 1 << 20;

/// Pixels of the first band under any other, which may take a thousand times as long.
const TRIAL_BAND_PX: u32 = 1 << 15;

/// Target time per band in seconds: the latency of a cancel. Shorter bands would draw a
/// larger part twice.
const BAND_S: f64 = 2.0;

impl Session {
    pub(crate) fn new(application: Application, inputs: Vec<OsString>, held: Option<Held>) -> Self {
        Self {
            application,
            inputs,
            held,
            ready: None,
        }
    }

    /// Parses options; the scene is not touched.
    pub(crate) fn drawing(&self, named: &[Named]) -> Result<(Drawing, Typed)> {
        let mut words = self.inputs.clone();
        words.extend(named.iter().flat_map(|(_, words)| words.iter().cloned()));
        // Only an EXR file has a place for further planes; nothing is written under this name.
        if named.iter().any(|(name, _)| name == "layers") {
            words.push("--output=picture.exr".into());
        }
        let command = words::command(self.application);
        let matches = command
            .clone()
            .try_get_matches_from(words)
            .map_err(|error| plain(&error))?;
        let mut drawing = self
            .application
            .drawing(&matches)
            .map_err(|error| plain(&error))?;
        drawing.keep_in_memory();
        if let Some(held) = &self.held {
            drawing.hold(held);
        }
        Ok((drawing, Typed::of(command, &matches)))
    }

    /// Has the scene stand as the options say; the number of pictures that they ask for.
    pub(crate) fn prepare(&mut self, named: &[Named]) -> Result<usize> {
        let words: Words = named.iter().cloned().collect();
        let (drawing, typed) = self.drawing(named)?;
        // Whatever fails from here on leaves a scene that has to be read again.
        if let Some(mut ready) = self.ready.take() {
            let is_same = ready.words == words;
            if is_same || self.changed(&mut ready, &words, &drawing)? {
                if !is_same {
                    ready.pace = pace(self.application, named);
                }
                ready.words = words;
                return Ok(self.ready.insert(ready).opened.cameras().len());
            }
        }
        let planned = planner::planned(&drawing, &typed, Verbosity::Normal)?;
        let (opened, record) = match planned {
            Some(Planned { opened, record }) => (opened, Some(record)),
            None => (
                Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?,
                None,
            ),
        };
        let ready = Ready {
            opened,
            words,
            planned: record,
            pace: pace(self.application, named),
        };
        Ok(self.ready.insert(ready).opened.cameras().len())
    }

    /// Changes the scene as the options say; false where it has to be read again.
    fn changed(&self, ready: &mut Ready, words: &Words, drawing: &Drawing) -> Result<bool> {
        let ask = drawing.ask();
        let is_planned = ask.max_error.is_some() || ask.max_time_ms.is_some() || ask.explain;
        if is_planned || ready.planned.is_some() {
            return Ok(false);
        }
        let names = ready.words.keys().chain(words.keys());
        let mut new = names.filter(|name| ready.words.get(*name) != words.get(*name));
        let most = new.try_fold(Change::View, |most, name| {
            Some(most.max(change_of(self.application, name)?))
        });
        match most {
            Some(change) => ready.opened.change(drawing, change),
            None => Ok(false),
        }
    }

    /// Draws a picture; `None` where nobody waits for it any more.
    pub(crate) fn draw(&mut self, number: usize, reins: &Reins) -> Result<Option<Drawn>> {
        let ready = self.ready.as_mut().context("nothing is prepared")?;
        let opened = &mut ready.opened;
        let camera = camera(opened, number)?;
        opened.turn_to(number)?;
        let mut accounts = Vec::new();
        let has_bands = opened.has_bands();
        let mut draw = |band: &Window| {
            let drawn = opened.draw_window(&camera, band)?;
            accounts.push(drawn.account.keys);
            Ok(drawn.image)
        };
        let image = match has_bands {
            true => in_bands::<anyhow::Error>(&camera, &mut ready.pace, &mut draw, &mut |share| {
                reins.done(share)
            })?,
            false => Some(draw(&Window::whole(&camera))?),
        };
        let Some(image) = image else {
            return Ok(None);
        };
        let stats = match accounts.as_mut_slice() {
            [one] => std::mem::take(one),
            several => json!({ "bands": several }),
        };
        let image = ready.opened.finished(image, &camera);
        Ok(Some(Drawn {
            image,
            stats: with_plan(stats, ready.planned.as_ref()),
        }))
    }

    /// Draws a window of a picture, without what lies behind it: where pictures cannot be drawn in parts, only all of it.
    pub(crate) fn draw_window(&mut self, number: usize, window: &Window) -> Result<Drawn> {
        let ready = self.ready.as_mut().context("nothing is prepared")?;
        let opened = &mut ready.opened;
        let camera = camera(opened, number)?;
        opened.turn_to(number)?;
        let Window { columns, rows } = window;
        let is_inside = columns.end <= camera.width && rows.end <= camera.height;
        if columns.is_empty() || rows.is_empty() || !is_inside {
            bail!(
                "columns {columns:?} and rows {rows:?} of a picture of {}x{}",
                camera.width,
                camera.height
            );
        }
        let drawn = opened.draw_window(&camera, window)?;
        let stats = with_plan(drawn.account.keys, ready.planned.as_ref());
        Ok(Drawn {
            image: drawn.image,
            stats,
        })
    }

    /// The size of each picture that was prepared, px, and whether it can be drawn in parts.
    pub(crate) fn sizes(&self) -> (Vec<[u32; 2]>, bool) {
        let Some(ready) = &self.ready else {
            return (Vec::new(), false);
        };
        let cameras = ready.opened.cameras().iter();
        let sizes = cameras.map(|camera| [camera.width, camera.height]);
        (sizes.collect(), ready.opened.has_bands())
    }

    /// The cameras of the pictures that were prepared, as camera files have them.
    pub(crate) fn cameras(&self) -> String {
        let cameras = self.ready.iter().flat_map(|ready| ready.opened.cameras());
        cameras
            .map(camera_file::object)
            .collect::<Value>()
            .to_string()
    }

    /// The values and display colours of a colour bar of the pictures that were prepared.
    pub(crate) fn colours(&self) -> Option<([f64; 2], Vec<[f32; 3]>)> {
        let (values, colours) = self.ready.as_ref()?.opened.colour_scale()?;
        let shown = colours.into_iter().map(|rgb| rgb.map(srgb_from_linear));
        Some((values, shown.collect()))
    }

    /// Lays what the options say behind a whole picture.
    pub(crate) fn finished(&self, image: Image) -> Image {
        match &self.ready {
            Some(ready) => match ready.opened.cameras().first().copied() {
                Some(camera) => ready.opened.finished(image, &camera),
                None => image,
            },
            None => image,
        }
    }

    /// Draws and writes all pictures as the command line does.
    pub(crate) fn write(&mut self, path: &Path, named: &[Named]) -> Result<()> {
        let (mut drawing, typed) = self.drawing(named)?;
        drawing.write_to(path);
        let log = RunLog {
            start: Instant::now(),
            verbosity: Verbosity::Quiet,
            follow: None,
        };
        match planner::planned(&drawing, &typed, Verbosity::Normal)? {
            Some(Planned { opened, record }) => opened.finish(Some(record), log),
            None => Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?.finish(None, log),
        }
    }

    /// The same scene, not yet read, for whoever cannot wait for this one.
    pub(crate) fn again(&self) -> Self {
        Self::new(self.application, self.inputs.clone(), self.held.clone())
    }

    /// Forgets what is read, after a fault.
    pub(crate) fn forget(&mut self) {
        self.ready = None;
    }
}

fn camera(opened: &Opened, number: usize) -> Result<Camera> {
    let camera = opened.cameras().get(number);
    camera
        .copied()
        .with_context(|| format!("there is no picture {number}"))
}

fn with_plan(mut stats: Value, planned: Option<&Value>) -> Value {
    if let (Some(map), Some(planned)) = (stats.as_object_mut(), planned) {
        map.insert("planned".to_owned(), planned.clone());
    }
    stats
}

/// The work that a new value of an option causes; `None` if the scene must be read again.
fn change_of(application: Application, name: &str) -> Option<Change> {
    let is_of = |names: Vec<String>| names.iter().any(|known| known == name);
    if is_of(names_of::<CameraArgs>())
        || is_of(names_of::<SequenceArgs>())
        || is_of(names_of::<PictureArgs>())
    {
        return Some(Change::View);
    }
    match application {
        Application::Volume if is_of(names_of::<RenderArgs>()) => Some(Change::Render),
        Application::Volume if is_of(names_of::<TransferArgs>()) => Some(Change::Look),
        Application::Gaussians if is_of(names_of::<GaussianRenderArgs>()) => Some(Change::Render),
        // Some lights need maps that others leave in their files.
        Application::Mesh if name == "shade" => None,
        Application::Mesh if is_of(names_of::<texmap::RenderOptions>()) => Some(Change::Render),
        Application::Points if is_of(names_of::<PointsRenderArgs>()) => Some(Change::Render),
        Application::Points if is_of(names_of::<PointsLookArgs>()) => Some(Change::Look),
        _ => None,
    }
}

fn pace(application: Application, named: &[Named]) -> Pace {
    let is_default = named.iter().all(|(name, _)| {
        let change = change_of(application, name);
        change.is_some() && change != Some(Change::Render)
    });
    Pace {
        band_px: match is_default {
            true => FIRST_BAND_PX,
            false => TRIAL_BAND_PX,
        },
        seconds: Some(BAND_S),
    }
}

/// The message of a parser without its usage lines, with options as Python spells them.
fn plain(error: &clap::Error) -> anyhow::Error {
    let text = error.to_string();
    let lines: Vec<&str> = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    let line = lines.join(" ");
    let spelled: Vec<String> = line
        .trim_start_matches("error: ")
        .split(' ')
        .map(in_python)
        .collect();
    anyhow!("{}", spelled.join(" "))
}

/// `'--max-error` as `'max_error`.
fn in_python(word: &str) -> String {
    match word.split_once("--") {
        Some((before, name)) if before.chars().all(|c| "'`([".contains(c)) => {
            let end = name
                .find(|c: char| !c.is_ascii_alphanumeric() && c != '-')
                .unwrap_or(name.len());
            format!("{before}{}{}", name[..end].replace('-', "_"), &name[end..])
        }
        _ => word.to_owned(),
    }
}
