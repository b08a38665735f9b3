//! Pictures with depth of arrays, as the readers of files leave them.

use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use resample_cli::values::input_file::HeldPicture;
use resample_core::image::linear_from_srgb;
use resample_io::colour::BRIGHTEST;
use resample_io::{Picture, Plane, Stored};

use crate::mesh::read;

/// A picture and its depth, as the Python part has checked them: C order, rows from the top.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Arrays<'py> {
    /// Codes of four channels up to `largest`, sRGB; or, where that is 0, linear light.
    colour: Bound<'py, PyArray3<f32>>,
    largest: u16,
    has_alpha: bool,
    depth: Bound<'py, PyArray2<f32>>,
    /// Largest code of whole numbers; `None` for floating point.
    largest_depth: Option<u32>,
}

/// The picture of the arrays.
pub(crate) fn picture(arrays: &Arrays<'_>) -> PyResult<HeldPicture> {
    let guard = read(&arrays.colour, "colour")?;
    let (height, width, _) = guard.as_array().dim();
    let values = guard
        .as_slice()
        .map_err(|error| PyValueError::new_err(format!("colour: {error}")))?;
    let largest = f32::from(arrays.largest);
    let table: Vec<f32> = (0..=arrays.largest)
        .map(|code| linear_from_srgb(f32::from(code) / largest))
        .collect();
    let mut rgb = Vec::with_capacity(width * height);
    let mut coverage = Vec::with_capacity(width * height);
    for &[r, g, b, alpha] in values.as_chunks::<4>().0 {
        if [r, g, b].iter().any(|channel| channel.is_nan()) {
            rgb.push([0.0; 3]);
            coverage.push(0.0);
        } else if arrays.largest > 0 {
            // Codes are whole and at most `largest`.
            rgb.push([r, g, b].map(|code| table[(code as usize).min(table.len() - 1)]));
            coverage.push(alpha / largest);
        } else {
            rgb.push([r, g, b].map(|light| light.clamp(-BRIGHTEST, BRIGHTEST)));
            coverage.push(alpha);
        }
    }
    let is_told = arrays.has_alpha || coverage.iter().any(|&part| part != 1.0);
    let depth = read(&arrays.depth, "depth")?;
    let (depth_height, depth_width) = depth.as_array().dim();
    let numbers = depth
        .as_slice()
        .map_err(|error| PyValueError::new_err(format!("depth: {error}")))?;
    Ok(HeldPicture {
        colour: Picture {
            width,
            height,
            rgb,
            coverage: is_told.then_some(coverage),
        },
        depth: Plane {
            width: depth_width,
            height: depth_height,
            values: numbers.to_vec(),
            stored: arrays.largest_depth.map_or(Stored::Float, Stored::Code),
        },
    })
}
