//! Camera files in the formats of others: calibrations, trajectories, reconstructions.
//!
//! Takes a path and what the user says about lens and picture size, gives named cameras in this workspace's one
//! convention: x right, y down, z forward, pixel centres at one half, world to camera. The format follows from the content;
//! each format has its own file, whose head states its axes, pixel centre and direction of the pose. The workspace's
//! own JSON is read elsewhere: a file of that kind is answered with `None`. The near plane of a camera is a
//! placeholder of 1 unless stated: it follows from the scene. A folder stands for the COLMAP model in it.

mod text;
mod colmap;
mod distortion;
mod entry;
mod json;

use std::path::Path;

use resample_core::camera::PixelCentre;
use resample_io::files::{fault, first_bytes, read_text};

use crate::Error;
pub use crate::input::cameras::distortion::Distortion;
pub use crate::input::cameras::entry::{
    CameraSet, Entry, Hints, Lens, NEAR_PLACEHOLDER, Names, Pair,
};

/// Reads the cameras of a file, at least one; `None` if it is JSON of no format that is known here.
pub fn read(path: &Path, hints: &Hints) -> Result<Option<CameraSet>, Error> {
    let set = read_any(path, hints)?;
    if set.as_ref().is_some_and(|set| set.entries.is_empty()) {
        return Err(fault(path, "it holds no camera"));
    }
    Ok(set)
}

fn read_any(path: &Path, hints: &Hints) -> Result<Option<CameraSet>, Error> {
    if path.is_dir() {
        return read_any(&model_in(path), hints);
    }
    // A binary model starts with a count, whose upper bytes are 0; no text holds such a byte.
    if first_bytes(path, 8)?.contains(&0) {
        let set = colmap::read_binary(path).map_err(|what| fault(path, what))?;
        return Ok(Some(set));
    }
    let text = read_text(path)?;
    let text = text.trim_start_matches('\u{feff}');
    let set = match text.trim_start().chars().next() {
        None => Err("the file is empty, expected cameras".to_owned()),
        Some('{' | '[') => match json::value(text).map_err(|what| fault(path, what))? {
            value if json::is_transforms(&value) => json::read_transforms(&value, hints),
            value if json::is_mpeg(&value) => json::read_mpeg(&value),
            value if json::is_open3d(&value) => json::read_open3d(&value),
            value if json::is_lens(&value) => {
                Err("it holds a lens alone, without a pose: name it as intrinsics".to_owned())
            }
            value if json::is_nested(&value) => json::read_nested(&value),
            _ => return Ok(None),
        },
        Some(_) => read_lines(path, text, hints),
    };
    let set = set.map_err(|what| fault(path, what))?;
    Ok(Some(set))
}

/// The file of a COLMAP model in a folder.
fn model_in(folder: &Path) -> std::path::PathBuf {
    let binary = folder.join("images.bin");
    if binary.exists() {
        binary
    } else {
        folder.join("images.txt")
    }
}

fn read_lines(path: &Path, text: &str, hints: &Hints) -> Result<CameraSet, String> {
    if text::is_calib(text) {
        return text::read_calib(text, hints);
    }
    if text::is_log(text) {
        return text::read_log(text, hints);
    }
    if text::is_tum(text) {
        return text::read_tum(text, hints);
    }
    if text::is_matrices(text) {
        return text::read_matrices(text, hints);
    }
    if colmap::is_it(text) {
        return colmap::read(path, text);
    }
    Err("no known camera format: expected our JSON, transforms.json, MPEG JSON, calib.txt, an Open3D or TUM \
         trajectory, a list of 4x4 or 3x4 poses, or COLMAP's images.txt or images.bin"
        .into())
}

// A lens alone, for poses whose files hold none: Open3D's JSON, or a matrix of 3 x 3 or 4 x 4 numbers.

/// Reads a lens, and the size of its picture where the file states it.
pub fn read_lens(path: &Path) -> Result<(Lens, Option<[u32; 2]>), Error> {
    let text = read_text(path)?;
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let lens = if text.starts_with('{') {
        json::value(text).and_then(|value| json::open3d_lens(&value))
    } else {
        text::lens(text).map(|[fx, fy, cx, cy]| {
            let lens = Lens {
                fx,
                fy,
                cx,
                cy,
                pixel_centre: PixelCentre::Integer,
            };
            (lens, None)
        })
    };
    lens.map_err(|what| fault(path, what))
}

#[cfg(test)]
mod tests;
