//! A lens alone, for poses whose files hold none: Open3D's JSON, or a matrix of 3 x 3 or 4 x 4 numbers.

use std::path::Path;

use resample_core::camera::PixelCentre;

use super::entry::Lens;
use super::{json, matrices, open3d};
use crate::Error;
use resample_io::files::{fault, read_text};

/// Reads a lens, and the size of its picture where the file states it.
pub fn read_lens(path: &Path) -> Result<(Lens, Option<[u32; 2]>), Error> {
    let text = read_text(path)?;
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let lens = if text.starts_with('{') {
        json::value(text).and_then(|value| open3d::lens(&value))
    } else {
        matrices::lens(text).map(|[fx, fy, cx, cy]| {
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
