//! COLMAP's text model: `images.txt`, with `cameras.txt` beside it.
//!
//! An image has two lines: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, and its points, which may be empty. Poses
//! are world-to-camera; axes x right, y down, z forward; pixel centres at one half. The picture's name is the camera's.
//! Source: COLMAP's description of its output formats. The binary model and the lens models stand in the folder of
//! this name.

mod binary;
mod lens;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use super::entry::{CameraSet, Entry, LensModel, Names};
use super::trajectory::{content, numbers, rotation};
use resample_io::files::read_text;

pub(super) use binary::read as read_binary;

type Lenses<'a> = HashMap<&'a str, LensModel>;

pub(super) fn is_it(text: &str) -> bool {
    let first = content(text).next();
    first.is_some_and(|(_, words)| words.len() >= 10 && numbers(&words[..9]).is_some())
}

pub(super) fn read(path: &Path, text: &str) -> Result<CameraSet, String> {
    let beside = path.with_file_name("cameras.txt");
    let cameras = read_text(&beside)
        .map_err(|error| format!("its lenses must stand in a cameras.txt beside it: {error}"))?;
    let lenses = lenses(&cameras).map_err(|what| format!("{}: {what}", beside.display()))?;
    let mut entries = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        entries.push(image(line, &lenses).map_err(|what| format!("line {}: {what}", index + 1))?);
        // The line of points, empty without points.
        lines.next();
    }
    Ok(CameraSet {
        format: "COLMAP model",
        entries,
        pair: None,
        names: Names::Words,
    })
}

fn image(line: &str, lenses: &Lenses) -> Result<Entry, String> {
    let expected = "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME";
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, pose @ .., _, _] = words.get(..10).ok_or(expected)? else {
        return Err(expected.into());
    };
    let pose = numbers(pose).ok_or(expected)?;
    let (id, name) = (words[8], words[9..].join(" "));
    let lens = lenses
        .get(id)
        .ok_or_else(|| format!("no camera {id} in cameras.txt"))?;
    lens.entry(name, camera_from_world(&pose)?)
}

/// The pose of `QW QX QY QZ TX TY TZ`.
fn camera_from_world(pose: &[f64]) -> Result<DAffine3, String> {
    let &[w, x, y, z, tx, ty, tz] = pose else {
        return Err("expected a quaternion and a translation".into());
    };
    let turn = rotation(DQuat::from_xyzw(x, y, z, w))?;
    Ok(DAffine3::from_rotation_translation(
        turn,
        DVec3::new(tx, ty, tz),
    ))
}

fn lenses(text: &str) -> Result<Lenses<'_>, String> {
    let mut lenses = HashMap::new();
    for (number, words) in content(text) {
        let lens = lens(&words).map_err(|what| format!("line {number}: {what}"))?;
        lenses.insert(words[0], lens);
    }
    Ok(lenses)
}

fn lens(words: &[&str]) -> Result<LensModel, String> {
    let expected = "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS";
    let [_, model, width, height, parameters @ ..] = words else {
        return Err(expected.into());
    };
    let side = |word: &str| word.parse::<u32>().map_err(|_| expected.to_owned());
    let size = [side(width)?, side(height)?];
    lens::model(model, size, &numbers(parameters).ok_or(expected)?)
}
