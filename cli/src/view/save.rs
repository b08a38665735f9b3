//! Nothing found by hand is lost: the command that repeats a view, and files in the folder where this one was started.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::message::{Exactness, Saved, View};
use super::subject::Subject;
use super::words::Files;
use crate::args::Drawing;
use crate::opened::Opened;
use crate::output::{self, Format};
use crate::plan::{Purpose, RunLog};
use crate::planner;
use crate::report::Verbosity;
use crate::typed::{self, Typed};
use crate::values::Size;
use crate::viewpoint::Viewpoint;

/// Most pictures of a turntable.
const MOST_STEPS: usize = 1000;

/// The names of files in a command.
const CAMERA: &str = "camera.json";
const TRANSFER: &str = "transfer.json";
const LABELS: &str = "labels.json";
const PICTURE: &str = "view.png";

/// The commands that draw a view: they bring the camera and the transfer function along, and read the same file.
pub(super) fn command(subject: &Subject, view: &View) -> Result<String> {
    let (_, camera) = subject.camera(view)?;
    let mut text = format!("cat > {CAMERA} <<'END'\n{camera}\nEND\n");
    let mut brought = |name: &str, content: &Option<Value>| {
        let content = content.as_ref()?;
        text += &format!("cat > {name} <<'END'\n{content}\nEND\n");
        Some(PathBuf::from(name))
    };
    let files = Files {
        transfer: brought(TRANSFER, &view.transfer),
        labels: brought(LABELS, &view.labels),
    };
    let [width, height] = view.size;
    let size = format!("{width}x{height}");
    let more = [
        subject.camera_option(),
        CAMERA,
        "--size",
        &size,
        "-o",
        PICTURE,
    ];
    let mut words = subject.line(view, &files)?;
    words.extend(more.map(str::to_owned));
    text += &typed::line(&words);
    text.push('\n');
    Ok(text)
}

/// Writes a file and gives its path.
pub(super) fn save(
    subject: &mut Subject,
    what: Saved,
    name: &str,
    view: &View,
    detail: &Value,
) -> Result<PathBuf> {
    let path = free(name)?;
    match what {
        Saved::Picture => picture(subject, &path, view)?,
        Saved::Transfer => {
            let Some(transfer) = &view.transfer else {
                bail!(
                    "the transfer function is the one of the command line: change it first, then save it"
                );
            };
            output::write_text(&path, &format!("{transfer:#}\n"))?;
        }
        Saved::Labels => {
            let Some(labels) = &view.labels else {
                bail!("the labels look as on the command line: change one first, then save them");
            };
            output::write_text(&path, &format!("{labels:#}\n"))?;
        }
        Saved::Camera => {
            let (_, camera) = subject.camera(view)?;
            output::write_text(&path, &format!("{camera}\n"))?;
        }
        Saved::Path => {
            let keys = keys(subject, view, detail)?;
            output::write_text(&path, &format!("{keys:#}\n"))?;
        }
        Saved::Turntable => {
            let cameras = cameras(subject, view, detail)?;
            run(subject, &path, view, &Cameras::List(cameras))?;
        }
        Saved::Film => {
            let keys = keys(subject, view, detail)?;
            run(subject, &path, view, &Cameras::Path(keys.to_string()))?;
        }
    }
    Ok(path)
}

/// A name in the current folder that no file has.
fn free(name: &str) -> Result<PathBuf> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_. ()%".contains(c);
    if name.is_empty() || name.len() > 100 || name.starts_with('.') || !name.chars().all(is_plain) {
        bail!("'{name}': expected a file name of letters, digits, - and _");
    }
    let path = PathBuf::from(name);
    output::check_new(&path)?;
    Ok(path)
}

fn picture(subject: &mut Subject, path: &Path, view: &View) -> Result<()> {
    let format = output::format_of(path, None)?;
    if format == Format::Exr {
        // An EXR file has depth and further planes: the command itself is run.
        let (_, camera) = subject.camera(view)?;
        return run(subject, path, view, &Cameras::List(camera));
    }
    let exactness = match view.exactness {
        Exactness::Fast => Exactness::Default,
        exactness => exactness,
    };
    subject.prepare(view, exactness)?;
    let (camera, _) = subject.camera(view)?;
    let image = subject.draw(&camera)?;
    output::write_picture(path, format, &image)?;
    Ok(())
}

/// Where the cameras of a command come from: the text of a camera file, or of a file of keys.
enum Cameras {
    List(String),
    Path(String),
}

/// The text of a camera file for cameras of the page.
fn cameras(subject: &Subject, view: &View, list: &Value) -> Result<String> {
    let list = list.as_array().map(Vec::as_slice).unwrap_or_default();
    if !(1..=MOST_STEPS).contains(&list.len()) {
        bail!("expected 1 to {MOST_STEPS} pictures");
    }
    let texts: Result<Vec<String>> = list.iter().map(|at| camera(subject, view, at)).collect();
    Ok(format!("[{}]", texts?.join(",")))
}

/// A file of keys for those of the page.
fn keys(subject: &Subject, view: &View, file: &Value) -> Result<Value> {
    let list = file["keys"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    let key = |key: &Value| -> Result<Value> {
        let camera: Value = serde_json::from_str(&camera(subject, view, &key["camera"])?)?;
        Ok(json!({ "time": key["time"], "camera": camera }))
    };
    let keys: Result<Vec<Value>> = list.iter().map(key).collect();
    Ok(json!({ "keys": keys? }))
}

/// A camera of the page as a camera file has it.
fn camera(subject: &Subject, view: &View, camera: &Value) -> Result<String> {
    let view = View {
        camera: camera.clone(),
        ..view.clone()
    };
    Ok(subject.camera(&view)?.1)
}

/// Runs the command that draws a view from other cameras.
fn run(subject: &Subject, path: &Path, view: &View, cameras: &Cameras) -> Result<()> {
    let (Cameras::List(text) | Cameras::Path(text)) = cameras;
    let mut drawing = subject.whole(view)?;
    let named = Some(subject.own_file("cameras.json", text)?);
    let (list, keys) = match cameras {
        Cameras::List(_) => (named, None),
        Cameras::Path(_) => (None, named),
    };
    match &mut drawing {
        Drawing::Volsplat(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Texmap(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Warp3d(args) => {
            args.cameras.to = list.map(|path| Viewpoint::File { path, entry: None });
            args.sequence.path = keys;
        }
    }
    set_size(&mut drawing, view);
    drawing.write_to_new(path);
    let log = RunLog {
        start: Instant::now(),
        verbosity: Verbosity::Quiet,
    };
    let typed = Typed::default();
    match planner::planned(&drawing, &typed, Verbosity::Quiet)? {
        Some(planned) => planned.opened.finish(Some(planned.record), log),
        None => Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?.finish(None, log),
    }
}

fn set_size(drawing: &mut Drawing, view: &View) {
    let [width, height] = view.size;
    let size = Some(Size { width, height });
    match drawing {
        Drawing::Volsplat(args) => args.camera.size = size,
        Drawing::Texmap(args) => args.camera.size = size,
        Drawing::Warp3d(args) => args.cameras.size = size,
    }
}
