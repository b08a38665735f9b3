//! Nothing found by hand is lost: the command that repeats a view, and files in the folder where this one was started.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::message::Job;
use super::message::{Goal, Saved, View};
use crate::args::Drawing;
use crate::args::words::session::FORMAT;
use crate::args::words::typed;
use crate::cameras::viewpoint::Viewpoint;
use crate::output;
use crate::output::Format;
use crate::values::Size;
use crate::view::opened_scene::OpenedScene;
use crate::view::options_text::Files;

/// Most pictures of a turntable.
const MOST_STEPS: usize = 1000;

/// Most files of one name, whose numbers count up.
const MOST_OF_A_NAME: usize = 10_000;

/// The names of files in a command.
const CAMERA: &str = "camera.json";
const TRANSFER: &str = "transfer.json";
const LABELS: &str = "labels.json";
const PICTURE: &str = "view.png";

/// The commands that draw a view: they bring the camera and the transfer function along, and read the same file.
pub(crate) fn command(subject: &OpenedScene, view: &View) -> Result<String> {
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
    let picture = subject.picture_name(PICTURE);
    let more = [
        subject.camera_option(),
        CAMERA,
        "--size",
        &size,
        "-o",
        &picture,
    ];
    let mut words = subject.line(view, &files)?;
    words.extend(more.map(str::to_owned));
    text += &typed::line(&words);
    text.push('\n');
    Ok(text)
}

/// The result of a request to save.
pub(crate) enum Saving {
    /// The file is there.
    Written(PathBuf),
    /// Pictures are drawn for it on a thread of their own.
    Begun(Job),
}

/// Writes a file, or begins to where pictures have to be drawn for it. `shown` is the PNG of a view that is shown at rest.
pub(crate) fn save(
    subject: &OpenedScene,
    (what, name, to): (Saved, &str, Goal),
    (view, detail): (&View, &Value),
    shown: Option<&(View, Vec<u8>)>,
) -> Result<Saving> {
    let path = match to {
        Goal::Folder => free(&checked(name)?)?,
        Goal::Page => subject.sent_file(&checked(name)?)?,
    };
    match what {
        Saved::Picture => return picture(subject, (path, to), view, shown),
        Saved::Session => {
            let session = session(subject, view, detail)?;
            output::write_text(&path, &format!("{session:#}\n"))?;
        }
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
            return begin(subject, (path, to), view, &Cameras::List(cameras));
        }
        Saved::Film => {
            let keys = keys(subject, view, detail)?;
            return begin(subject, (path, to), view, &Cameras::Path(keys.to_string()));
        }
    }
    Ok(Saving::Written(path))
}

/// A name that is no path.
fn checked(name: &str) -> Result<PathBuf> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_. ()%".contains(c);
    if name.is_empty() || name.len() > 100 || name.starts_with('.') || !name.chars().all(is_plain) {
        bail!("'{name}': expected a file name of letters, digits, - and _");
    }
    Ok(PathBuf::from(name))
}

/// The name, or the first of `name-2`, `name-3` and so on that no file in the current folder has.
fn free(name: &Path) -> Result<PathBuf> {
    let stem = name.file_stem().unwrap_or_default().to_string_lossy();
    let extension = name
        .extension()
        .map(|e| format!(".{}", e.to_string_lossy()));
    let numbered = |number: usize| {
        format!(
            "{stem}-{number}{}",
            extension.as_deref().unwrap_or_default()
        )
    };
    let others = (2..MOST_OF_A_NAME).map(|number| PathBuf::from(numbered(number)));
    let mut names = [name.to_owned()].into_iter().chain(others);
    match names.find(|path| output::check_new(path).is_ok()) {
        Some(path) => Ok(path),
        None => bail!(
            "{}: there are {MOST_OF_A_NAME} files of this name: choose another",
            name.display()
        ),
    }
}

/// A file that a command takes with `--session`: the words that draw the view, and the state of the page.
fn session(subject: &OpenedScene, view: &View, page: &Value) -> Result<Value> {
    let (_, camera) = subject.camera(view)?;
    let inline =
        |content: &Option<Value>| content.as_ref().map(|text| PathBuf::from(text.to_string()));
    let files = Files {
        transfer: inline(&view.transfer),
        labels: inline(&view.labels),
    };
    let mut words = subject.line(view, &files)?;
    let [width, height] = view.size;
    words.extend([
        format!("{}={camera}", subject.camera_option()),
        format!("--size={width}x{height}"),
    ]);
    Ok(json!({ "format": FORMAT, "words": words, "page": page }))
}

fn picture(
    subject: &OpenedScene,
    (path, to): (PathBuf, Goal),
    view: &View,
    shown: Option<&(View, Vec<u8>)>,
) -> Result<Saving> {
    let format = output::format_of(&path, None)?;
    if let (Format::Png(_), Some((_, png))) = (format, shown.filter(|(of, _)| of == view)) {
        output::write_bytes(&path, png)?;
        return Ok(Saving::Written(path));
    }
    let (_, camera) = subject.camera(view)?;
    begin(subject, (path, to), view, &Cameras::List(camera))
}

/// Where the cameras of a command come from: the text of a camera file, or of a file of keys.
enum Cameras {
    List(String),
    Path(String),
}

/// The text of a camera file for cameras of the page.
fn cameras(subject: &OpenedScene, view: &View, list: &Value) -> Result<String> {
    let list = list.as_array().map(Vec::as_slice).unwrap_or_default();
    if !(1..=MOST_STEPS).contains(&list.len()) {
        bail!("expected 1 to {MOST_STEPS} pictures");
    }
    let texts: Result<Vec<String>> = list.iter().map(|at| camera(subject, view, at)).collect();
    Ok(format!("[{}]", texts?.join(",")))
}

/// A file of keys for those of the page.
fn keys(subject: &OpenedScene, view: &View, file: &Value) -> Result<Value> {
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
fn camera(subject: &OpenedScene, view: &View, camera: &Value) -> Result<String> {
    let view = View {
        camera: camera.clone(),
        ..view.clone()
    };
    Ok(subject.camera(&view)?.1)
}

/// Begins the command that draws a view from other cameras.
fn begin(
    subject: &OpenedScene,
    (path, to): (PathBuf, Goal),
    view: &View,
    cameras: &Cameras,
) -> Result<Saving> {
    let (Cameras::List(text) | Cameras::Path(text)) = cameras;
    let mut drawing = subject.whole(view)?;
    let named = Some(subject.own_file("cameras.json", text)?);
    let (list, keys) = match cameras {
        Cameras::List(_) => (named, None),
        Cameras::Path(_) => (None, named),
    };
    match &mut drawing {
        Drawing::Volsplat(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Gaussians(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Texmap(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Points(args) => (args.camera.camera, args.sequence.path) = (list, keys),
        Drawing::Warp3d(args) => {
            args.cameras.to = list.map(|path| Viewpoint::File { path, entry: None });
            args.sequence.path = keys;
        }
    }
    set_size(&mut drawing, view);
    drawing.write_to_new(&path);
    Ok(Saving::Begun(Job::begin(path, to, drawing)?))
}

fn set_size(drawing: &mut Drawing, view: &View) {
    let [width, height] = view.size;
    let size = Some(Size { width, height });
    match drawing {
        Drawing::Volsplat(args) => args.camera.size = size,
        Drawing::Gaussians(args) => args.camera.size = size,
        Drawing::Texmap(args) => args.camera.size = size,
        Drawing::Points(args) => args.camera.size = size,
        Drawing::Warp3d(args) => args.cameras.size = size,
    }
}
