//! The stack in the description of the first page, as ImageJ and OME write it.
//!
//! ImageJ writes lines such as `slices=27` and `spacing=2.5`; with a `unit`, the resolution of the page is in pixels per
//! that unit. OME writes XML, whose element Pixels has the physical size of a voxel. Both say how many channels and
//! times there are, and more than one of either is refused.

use crate::input::fault::{Fault, excerpt, unsupported};

/// World distance between voxels along x, y and z: 1 where nothing is known.
///
/// `resolution` is in pixels per unit; `pages` is the number of pages in the file.
pub(crate) fn spacing(
    text: &str,
    resolution: [Option<f64>; 2],
    pages: usize,
) -> Result<[f64; 3], Fault> {
    if text.starts_with("ImageJ=") {
        return image_j(text, resolution, pages);
    }
    if text.trim_start().starts_with('<') && text.contains("<OME") {
        return ome(text);
    }
    Ok([1.0; 3])
}

fn image_j(text: &str, resolution: [Option<f64>; 2], pages: usize) -> Result<[f64; 3], Fault> {
    let value = |key: &str| {
        let found = text
            .lines()
            .filter_map(|line| line.split_once('='))
            .find(|(name, _)| name.trim() == key);
        found.map(|(_, value)| value.trim())
    };
    let count = |key: &str| {
        value(key)
            .and_then(|text| text.parse::<usize>().ok())
            .unwrap_or(1)
    };
    refuse_many(count("channels"), count("frames"))?;
    let images = count("images");
    if images > pages {
        return Err(unsupported(format!(
            "ImageJ says {images} images, but the file lists {pages}, as it does for stacks beyond 4 GB: \
             save it as BigTIFF, NRRD or as single slices"
        )));
    }
    let mut spacing = [1.0; 3];
    if value("unit").is_some_and(|unit| !unit.is_empty() && unit != "pixel") {
        for (length, per_unit) in spacing.iter_mut().zip(resolution) {
            *length = per_unit
                .map(|per_unit| 1.0 / per_unit)
                .filter(is_length)
                .unwrap_or(1.0);
        }
    }
    if let Some(text) = value("spacing") {
        let parsed = text.parse().map(f64::abs).ok().filter(is_length);
        spacing[2] = parsed
            .ok_or_else(|| format!("spacing={}: expected a length above 0", excerpt(text)))?;
    }
    Ok(spacing)
}

fn ome(text: &str) -> Result<[f64; 3], Fault> {
    let document = roxmltree::Document::parse(text)
        .map_err(|error| format!("the OME description is broken XML: {error}"))?;
    let Some(pixels) = document
        .descendants()
        .find(|node| node.has_tag_name("Pixels"))
    else {
        return Ok([1.0; 3]);
    };
    let count = |name: &str| {
        pixels
            .attribute(name)
            .and_then(|text| text.parse::<usize>().ok())
            .unwrap_or(1)
    };
    refuse_many(count("SizeC"), count("SizeT"))?;
    let length = |name: &str| {
        let parsed = pixels.attribute(name).and_then(|text| text.parse().ok());
        parsed.filter(is_length).unwrap_or(1.0)
    };
    Ok(["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"].map(length))
}

fn refuse_many(channels: usize, times: usize) -> Result<(), Fault> {
    if channels <= 1 && times <= 1 {
        return Ok(());
    }
    Err(unsupported(format!(
        "{channels} channel(s) and {times} time(s): save one channel at one time as a stack of its own"
    )))
}

fn is_length(length: &f64) -> bool {
    *length > 0.0 && length.is_finite()
}
