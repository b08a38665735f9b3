//! Scans of arrays.

use glam::DVec3;
use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use resample_cloud::input::{PointCloudFile, PointLists};

use crate::mesh::rows;

/// The arrays of a scan, as the Python part has checked them: C order, one row a point, finite places.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Arrays<'py> {
    positions: Bound<'py, PyArray2<f64>>,
    /// sRGB.
    colours: Option<Bound<'py, PyArray2<u8>>>,
    /// One column.
    intensities: Option<Bound<'py, PyArray2<f32>>>,
    /// One column.
    classes: Option<Bound<'py, PyArray2<u8>>>,
}

/// The scan of the arrays.
pub(crate) fn scan(arrays: &Arrays<'_>) -> PyResult<PointCloudFile> {
    let (colours, intensities) = (arrays.colours.as_ref(), arrays.intensities.as_ref());
    let colours = colours.map(|all| rows(all, "colours", |colour| colour));
    let intensities = intensities.map(|all| rows(all, "intensities", |[one]: [f32; 1]| one));
    let classes = arrays.classes.as_ref();
    let classes = classes.map(|all| rows(all, "classes", |[one]: [u8; 1]| one));
    let lists = PointLists {
        places: rows(&arrays.positions, "positions", DVec3::from_array)?,
        colours: colours.transpose()?,
        intensities: intensities.transpose()?,
        classes: classes.transpose()?,
    };
    PointCloudFile::of_lists(&lists)
        .map_err(|why| PyValueError::new_err(format!("positions: {why}")))
}
