//! Camera files in the formats of others: calibrations, trajectories, reconstructions.
//!
//! Takes a path and what the user says about lens and picture size, gives named cameras in this workspace's one
//! convention: x right, y down, z forward, pixel centres at one half, world to camera. The format follows from the content;
//! each format has its own file, whose head states its axes, pixel centre and direction of the pose. The workspace's
//! own JSON is read elsewhere: a file of that kind is answered with `None`. The near plane of a camera is a
//! placeholder of 1 unless stated: it follows from the scene. Limits: no lens distortion.

use std::path::Path;

use crate::Error;
use resample_io::files::{fault, read_text};

mod calib;
mod colmap;
mod entry;
mod json;
mod mpeg;
mod nested;
mod trajectory;
mod transforms;

pub use entry::{CameraSet, Entry, Hints, Lens, NEAR_PLACEHOLDER, Pair};

/// Reads the cameras of a file; `None` if it is JSON of no format that is known here.
pub fn read(path: &Path, hints: &Hints) -> Result<Option<CameraSet>, Error> {
    let text = read_text(path)?;
    let text = text.trim_start_matches('\u{feff}');
    let set = match text.trim_start().chars().next() {
        None => Err("the file is empty, expected cameras".to_owned()),
        Some('{' | '[') => match json::value(text).map_err(|what| fault(path, what))? {
            value if transforms::is_it(&value) => transforms::read(&value, hints),
            value if mpeg::is_it(&value) => mpeg::read(&value),
            value if nested::is_it(&value) => nested::read(&value),
            _ => return Ok(None),
        },
        Some(_) => read_lines(path, text, hints),
    };
    let set = set.map_err(|what| fault(path, what))?;
    Ok(Some(set))
}

fn read_lines(path: &Path, text: &str, hints: &Hints) -> Result<CameraSet, String> {
    if calib::is_it(text) {
        return calib::read(text, hints);
    }
    if trajectory::is_log(text) {
        return trajectory::read_log(text, hints);
    }
    if trajectory::is_tum(text) {
        return trajectory::read_tum(text, hints);
    }
    if colmap::is_it(text) {
        return colmap::read(path, text);
    }
    Err("no known camera format: expected our JSON, transforms.json, MPEG JSON, calib.txt, an Open3D or TUM \
         trajectory, or COLMAP's images.txt"
        .into())
}

#[cfg(test)]
mod tests;
