//! Pictures as Python has them: arrays of (height, width, 4) numbers in linear light, premultiplied.

use std::path::{Path, PathBuf};

use anyhow::Context;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use resample_cli::output::{self, DEFAULT_FPS, Film, FilmPlan};
use resample_core::Image;
use resample_core::image::Plane;
use resample_io::film::{FrameRate, Spatial};

use crate::fault;
use crate::mesh::read;
use crate::session::Drawn;

/// A picture that was drawn: its colours, depth, further planes, and its stats as JSON.
pub(crate) type Handed<'py> = (
    Bound<'py, PyArray3<f32>>,
    Option<Bound<'py, PyArray2<f32>>>,
    Bound<'py, PyDict>,
    String,
);

/// Hands a picture over; nothing is copied.
pub(crate) fn handed(py: Python<'_>, drawn: Drawn) -> PyResult<Handed<'_>> {
    let Image {
        width,
        height,
        rgba,
        depth,
        planes,
    } = drawn.image;
    let plane = |values: Vec<f32>| values.into_pyarray(py).reshape([height, width]);
    let rgba = rgba.into_flattened().into_pyarray(py);
    let named = PyDict::new(py);
    for Plane { name, values } in planes {
        named.set_item(name, plane(values)?)?;
    }
    Ok((
        rgba.reshape([height, width, 4])?,
        depth.map(plane).transpose()?,
        named,
        drawn.stats.to_string(),
    ))
}

pub(crate) fn image(rgba: &Bound<'_, PyArray3<f32>>) -> PyResult<Image> {
    let guard = read(rgba, "picture")?;
    let (height, width, channels) = guard.as_array().dim();
    if channels != 4 {
        return Err(PyValueError::new_err(format!(
            "picture: expected the shape (height, width, 4), got ({height}, {width}, {channels})"
        )));
    }
    let values = guard
        .as_slice()
        .map_err(|error| PyValueError::new_err(format!("picture: {error}")))?;
    Ok(Image {
        rgba: values.as_chunks().0.to_vec(),
        ..Image::transparent(width, height)
    })
}

/// The codes of a PNG: (height, width, 4) bytes, sRGB with straight alpha.
#[pyfunction]
pub(crate) fn srgb8<'py>(rgba: &Bound<'py, PyArray3<f32>>) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let py = rgba.py();
    let image = image(rgba)?;
    let codes = py.detach(|| output::png_codes(&image));
    codes
        .into_pyarray(py)
        .reshape([image.height, image.width, 4])
}

/// The bytes of a PNG file.
#[pyfunction]
pub(crate) fn png<'py>(rgba: &Bound<'py, PyArray3<f32>>) -> PyResult<Bound<'py, PyBytes>> {
    let py = rgba.py();
    let image = image(rgba)?;
    let bytes = py.detach(|| output::png_file(&image));
    Ok(PyBytes::new(
        py,
        &bytes.map_err(|error| fault::raised(&error.into()))?,
    ))
}

/// Writes a PNG or an EXR; only the latter has a place for depth and further planes.
#[pyfunction]
#[pyo3(signature = (path, rgba, depth, planes, bits))]
pub(crate) fn save(
    path: PathBuf,
    rgba: &Bound<'_, PyArray3<f32>>,
    depth: Option<&Bound<'_, PyArray2<f32>>>,
    planes: &Bound<'_, PyDict>,
    bits: Option<u8>,
) -> PyResult<u64> {
    let mut image = image(rgba)?;
    image.depth = depth.map(|depth| plane(depth, &image)).transpose()?;
    for (name, values) in planes {
        let values = plane(values.cast()?, &image)?;
        image.planes.push(Plane {
            name: name.extract()?,
            values,
        });
    }
    let write = || -> anyhow::Result<u64> {
        let format = output::format_of(&path, bits)?;
        output::check_writable(&path)?;
        Ok(output::write_picture(&path, format, &image)?)
    };
    let written = rgba.py().detach(write);
    written.map_err(|error| fault::raised(&error))
}

fn plane(values: &Bound<'_, PyArray2<f32>>, image: &Image) -> PyResult<Vec<f32>> {
    let guard = read(values, "planes")?;
    if guard.as_array().dim() != (image.height, image.width) {
        return Err(PyValueError::new_err(
            "planes: expected the size of the picture",
        ));
    }
    Ok(guard.as_array().iter().copied().collect())
}

/// Writes pictures of one size as an animation: .apng, .webp, .gif, or by ffmpeg .mp4, .webm, .mkv.
#[pyfunction]
#[pyo3(signature = (path, pictures, count, fps))]
pub(crate) fn write_film(
    path: PathBuf,
    pictures: &Bound<'_, PyAny>,
    count: u32,
    fps: Option<u16>,
) -> PyResult<u64> {
    let py = pictures.py();
    let mut film: Option<Film> = None;
    for picture in pictures.try_iter()? {
        let image = image(picture?.cast()?)?;
        let added = py.detach(|| -> anyhow::Result<()> {
            let film = match &mut film {
                Some(film) => film,
                None => film.insert(begun(&path, &image, (count, fps))?),
            };
            Ok(film.add(&image)?)
        });
        added.map_err(|error| fault::raised(&error))?;
        py.check_signals()?;
    }
    let finished = film
        .context("there are no pictures")
        .and_then(|film| Ok(py.detach(|| film.finish())?));
    finished.map_err(|error| fault::raised(&error))
}

fn begun(path: &Path, first: &Image, (count, fps): (u32, Option<u16>)) -> anyhow::Result<Film> {
    let kind = output::kind_of(path, None, false)?.with_context(|| {
        format!(
            "{}: an animation's name ends in .apng, .webp, .gif, .mp4, .webm or .mkv",
            path.display()
        )
    })?;
    let plan = FilmPlan {
        path: path.to_owned(),
        kind,
        rate: FrameRate::whole(u32::from(fps.unwrap_or(DEFAULT_FPS))),
        original: None,
        spatial: Spatial::default(),
    };
    plan.check_tools()?;
    output::check_writable(path)?;
    let size = [u32::try_from(first.width)?, u32::try_from(first.height)?];
    Ok(Film::begin(&plan, size, count)?)
}
