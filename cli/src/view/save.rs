//! Nothing found by hand is lost: the command that repeats a view, and files in the folder where this one was started.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, bail};
use serde_json::Value;

use super::message::{Exactness, Saved, View};
use super::subject::Subject;
use crate::args::Drawing;
use crate::opened::Opened;
use crate::output::{self, Depth, Format};
use crate::plan::{Purpose, RunLog};
use crate::report::Verbosity;
use crate::typed;
use crate::values::Size;
use crate::viewpoint::Viewpoint;

/// Most pictures of a turntable.
const MOST_STEPS: usize = 1000;

/// The names of files in a command.
const CAMERA: &str = "camera.json";
const TRANSFER: &str = "transfer.json";
const PICTURE: &str = "view.png";

/// The commands that draw a view: they bring the camera and the transfer function along, and read the same file.
pub(super) fn command(subject: &Subject, view: &View) -> Result<String> {
    let (_, camera) = subject.camera(view)?;
    let mut text = format!("cat > {CAMERA} <<'END'\n{camera}\nEND\n");
    let mut file = None;
    if let Some(transfer) = &view.transfer {
        text += &format!("cat > {TRANSFER} <<'END'\n{transfer}\nEND\n");
        file = Some(Path::new(TRANSFER));
    }
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
    let mut words = subject.line(view, file)?;
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
        Saved::Camera => {
            let (_, camera) = subject.camera(view)?;
            output::write_text(&path, &format!("{camera}\n"))?;
        }
        Saved::Path => {
            output::write_text(&path, &format!("{detail:#}\n"))?;
        }
        Saved::Turntable => turntable(subject, &path, view, detail)?,
    }
    Ok(path)
}

/// A name in the current folder that is not taken.
fn free(name: &str) -> Result<PathBuf> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_. ()%".contains(c);
    if name.is_empty() || name.len() > 100 || name.starts_with('.') || !name.chars().all(is_plain) {
        bail!("'{name}': expected a file name of letters, digits, - and _");
    }
    let path = PathBuf::from(name);
    if path.exists() {
        bail!("{name} is there already: choose another name");
    }
    Ok(path)
}

fn picture(subject: &mut Subject, path: &Path, view: &View) -> Result<()> {
    if output::format_of(path, None)? == Format::Exr {
        // An EXR file has depth and further planes: the command itself is run.
        let (_, camera) = subject.camera(view)?;
        return run(subject, path, view, &camera);
    }
    subject.prepare(view, Exactness::Default)?;
    let (camera, _) = subject.camera(view)?;
    let image = subject.draw(&camera)?;
    output::write_picture(path, Format::Png(Depth::Eight), &image)?;
    Ok(())
}

/// Pictures from a list of cameras, numbered or as an animation.
fn turntable(subject: &Subject, path: &Path, view: &View, cameras: &Value) -> Result<()> {
    let list = cameras.as_array().map(Vec::as_slice).unwrap_or_default();
    if !(1..=MOST_STEPS).contains(&list.len()) {
        bail!("expected 1 to {MOST_STEPS} pictures");
    }
    let text = |camera: &Value| -> Result<String> {
        let view = View {
            camera: camera.clone(),
            ..view.clone()
        };
        Ok(subject.camera(&view)?.1)
    };
    let texts: Result<Vec<String>> = list.iter().map(text).collect();
    run(subject, path, view, &format!("[{}]", texts?.join(",")))
}

/// Runs the command that draws a view from the cameras of a file.
fn run(subject: &Subject, path: &Path, view: &View, cameras: &str) -> Result<()> {
    let file = tempfile::Builder::new().suffix(".json").tempfile()?;
    std::fs::write(file.path(), cameras)?;
    let mut drawing = subject.whole(view)?;
    let camera = file.path().to_owned();
    match &mut drawing {
        Drawing::Volsplat(args) => args.camera.camera = Some(camera),
        Drawing::Texmap(args) => args.camera.camera = Some(camera),
        Drawing::Warp3d(args) => {
            args.cameras.to = Some(Viewpoint::File {
                path: camera,
                entry: None,
            });
        }
    }
    set_size(&mut drawing, view);
    drawing.write_to(path);
    let log = RunLog {
        start: Instant::now(),
        verbosity: Verbosity::Quiet,
    };
    Opened::read(drawing, Purpose::Draw, Verbosity::Quiet)?.finish(None, log)
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
