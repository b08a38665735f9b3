//! 3-D Gaussians of arrays.

use glam::{DVec3, Quat, Vec3};
use numpy::{PyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use volsplat::{BlendSpace, Gaussian, Gaussians};

use crate::mesh::rows;

/// The arrays of Gaussians, as the Python part has checked them: C order, one row a Gaussian, finite numbers.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Arrays<'py> {
    means: Bound<'py, PyArray2<f64>>,
    /// w, x, y, z; of any length above 0.
    quats: Bound<'py, PyArray2<f32>>,
    /// Standard deviations, world units.
    scales: Bound<'py, PyArray2<f32>>,
    /// One column, 0 to 1.
    opacities: Bound<'py, PyArray2<f32>>,
    /// The colours of degree 0 in the blend space.
    colours: Bound<'py, PyArray2<f32>>,
    /// The coefficients of degrees 1 and more, red, green and blue of each in turn: none, 9, 24 or 45 columns.
    harmonics: Option<Bound<'py, PyArray2<f32>>>,
    is_linear: bool,
}

/// Positions this far from the origin are kept relative to the first one, as the readers of files do it.
const FAR: f64 = 16_384.0;

/// The Gaussians of the arrays.
pub(crate) fn gaussians(arrays: &Arrays<'_>) -> PyResult<Gaussians> {
    let means = rows(&arrays.means, "means", DVec3::from_array)?;
    let rotations = rows(&arrays.quats, "quats", |[w, x, y, z]: [f32; 4]| {
        Quat::from_xyzw(x, y, z, w)
    })?;
    let scales = rows(&arrays.scales, "scales", Vec3::from_array)?;
    let opacities = rows(&arrays.opacities, "opacities", |[part]: [f32; 1]| part)?;
    let colours = rows(&arrays.colours, "colours", Vec3::from_array)?;
    let harmonics = Coefficients::of(arrays.harmonics.as_ref())?;
    let mut all = Gaussians::with_capacity(harmonics.degree, means.len());
    all.blend_space = match arrays.is_linear {
        true => BlendSpace::Linear,
        false => BlendSpace::Srgb,
    };
    all.origin_in_world = match means.first() {
        Some(first) if first.abs().max_element() >= FAR => first.round(),
        _ => DVec3::ZERO,
    };
    let origin = all.origin_in_world;
    let parts = means.iter().zip(rotations).zip(scales).zip(opacities);
    for (row, ((((mean, rotation), scales), opacity), colour)) in parts.zip(colours).enumerate() {
        let gaussian = Gaussian {
            centre: (mean - origin).as_vec3(),
            rotation,
            scales,
            opacity,
            colour,
        };
        all.push(&gaussian, harmonics.of_row(row))
            .map_err(|why| PyValueError::new_err(format!("means: of row {row}, {why}")))?;
    }
    Ok(all)
}

/// The coefficients of degrees 1 and more, row after row.
struct Coefficients {
    degree: usize,
    per_row: usize,
    values: Vec<f32>,
}

impl Coefficients {
    fn of(array: Option<&Bound<'_, PyArray2<f32>>>) -> PyResult<Self> {
        fn flat<const N: usize>(array: &Bound<'_, PyArray2<f32>>) -> PyResult<Vec<f32>> {
            let rows: Vec<[f32; N]> = rows(array, "sh", |row| row)?;
            Ok(rows.into_flattened())
        }
        let of_degree = |degree, per_row, values| Self {
            degree,
            per_row,
            values,
        };
        let Some(array) = array else {
            return Ok(of_degree(0, 0, Vec::new()));
        };
        Ok(match array.shape()[1] {
            9 => of_degree(1, 9, flat::<9>(array)?),
            24 => of_degree(2, 24, flat::<24>(array)?),
            _ => of_degree(3, 45, flat::<45>(array)?),
        })
    }

    fn of_row(&self, row: usize) -> &[f32] {
        &self.values[self.per_row * row..][..self.per_row]
    }
}
