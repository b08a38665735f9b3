//! Whatever a run will write, held against whatever it reads: checked before anything is written.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use super::request::Request;
use crate::args::Goes;
use crate::output;
use crate::output::FrameNames;
use crate::values::BackgroundWord;

/// Checks the places of all files but further pictures, which go to the folder of the first.
pub(super) fn check(request: &Request, first_picture: &Path) -> Result<()> {
    if request.picture.goes == Goes::Memory {
        return Ok(());
    }
    let targets = targets(request, first_picture);
    for (number, (option, path)) in targets.iter().enumerate() {
        if let Some((other, _)) = targets[..number].iter().find(|(_, other)| other == path) {
            bail!(
                "{}: is the name of {other} and of {option}: choose another name",
                path.display()
            );
        }
        output::check_writable(path)?;
        output::check_not_input(path, &inputs(request))?;
    }
    Ok(())
}

/// Checks the pictures of these numbers, and all files again, now that the names inside files are known.
pub(super) fn check_pictures(
    request: &Request,
    names: &FrameNames,
    numbers: &Range<usize>,
    named_inside: &[PathBuf],
) -> Result<()> {
    let mut read = inputs(request);
    read.extend(named_inside.iter().map(PathBuf::as_path));
    let pictures: Vec<PathBuf> = match names {
        FrameNames::Single(path) => vec![path.clone()],
        FrameNames::Numbered { .. } => {
            let numbers = numbers.clone();
            numbers.map(|index| names.frame(index)).collect()
        }
    };
    if request.picture.goes == Goes::NewFile {
        pictures
            .iter()
            .try_for_each(|path| output::check_new(path))?;
    }
    pictures
        .iter()
        .try_for_each(|path| output::check_name(path))?;
    for picture in pictures.iter().filter(|picture| picture.exists()) {
        output::check_writable(picture)?;
    }
    let others = targets(request, Path::new(""));
    for (option, path) in &others {
        if let Some(picture) = pictures.iter().find(|picture| picture.as_path() == *path) {
            bail!(
                "{}: is the name of a picture and of {option}: choose another name",
                picture.display()
            );
        }
    }
    let others = others.iter().map(|(_, path)| *path);
    let written = pictures.iter().map(PathBuf::as_path).chain(others);
    Ok(output::check_not_inputs(written, &read)?)
}

/// All files that the run reads, with those that it found through names inside others.
pub(super) fn read(request: &Request, named_inside: Vec<PathBuf>) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = inputs(request).into_iter().map(Path::to_path_buf).collect();
    files.extend(named_inside);
    files
}

/// The first picture, and every other file that is written, each with its option.
fn targets<'a>(request: &'a Request, picture: &'a Path) -> Vec<(&'static str, &'a Path)> {
    let stats = request.stats.map(|path| ("--stats", path));
    let camera = request.camera.save_camera.as_deref();
    [("the picture", picture)]
        .into_iter()
        .filter(|(_, path)| !path.as_os_str().is_empty())
        .chain(stats)
        .chain(camera.map(|path| ("--save-camera", path)))
        .chain(request.others.iter().copied())
        .collect()
}

/// The files that were typed to be read.
fn inputs<'a>(request: &'a Request) -> Vec<&'a Path> {
    let background = match &request.picture.background {
        Some(BackgroundWord::File(path)) => Some(path.as_path()),
        _ => None,
    };
    let optional = [
        request.camera.camera.as_deref(),
        request.sequence.path.as_deref(),
        background,
    ];
    let optional = optional.into_iter().flatten();
    optional.chain(request.inputs.iter().copied()).collect()
}
