//! Meshes of arrays: vertices, faces and what lies on them.

use glam::DVec3;
use numpy::{Element, PyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use resample_core::image::linear_from_srgb;
use texmap::Scene;
use texmap::input::set_origin;
use texmap::scene::{Material, Mesh, Sides, Texels, Texture, TextureUse};

/// The arrays of a mesh, as the Python part has checked them: C order, one row a vertex or a face.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Arrays<'py> {
    vertices: Bound<'py, PyArray2<f64>>,
    faces: Bound<'py, PyArray2<u32>>,
    /// The origin at the bottom left of the picture, as OBJ has it.
    uv: Option<Bound<'py, PyArray2<f64>>>,
    normals: Option<Bound<'py, PyArray2<f64>>>,
    /// 8 bits, sRGB.
    colours: Option<Bound<'py, PyArray2<u8>>>,
    /// 8 bits, sRGB.
    texture: Option<Bound<'py, PyArray3<u8>>>,
    /// Linear light.
    texture_linear: Option<Bound<'py, PyArray3<f32>>>,
}

/// The scene of a mesh.
pub(crate) fn scene(arrays: &Arrays<'_>) -> PyResult<Scene> {
    let positions: Vec<DVec3> = rows(&arrays.vertices, "vertices", DVec3::from_array)?;
    let mesh = Mesh {
        normals: optional(arrays.normals.as_ref(), "normals", unit)?,
        uvs: match &arrays.uv {
            // As the reader of PLY turns them.
            Some(uv) => vec![rows(uv, "uv", |[u, v]: [f64; 2]| {
                [u as f32, (1.0 - v) as f32]
            })?],
            None => Vec::new(),
        },
        colours: optional(arrays.colours.as_ref(), "colours", linear)?,
        triangles: rows(&arrays.faces, "faces", |face| face)?,
        ..Mesh::default()
    };
    let texture = texture(arrays)?;
    let mut scene = Scene {
        meshes: vec![mesh],
        materials: vec![Material {
            base_texture: texture.is_some().then_some(TextureUse::whole(0)),
            // Scans are not closed, and programs disagree on which side of a face is its front.
            sides: Sides::Both,
            ..Material::default()
        }],
        textures: texture.into_iter().collect(),
        ..Scene::default()
    };
    set_origin(&mut scene, &[positions]);
    Ok(scene)
}

fn unit(normal: [f64; 3]) -> [f32; 3] {
    let unit = DVec3::from_array(normal).normalize_or_zero();
    unit.as_vec3().to_array()
}

fn linear([r, g, b, alpha]: [u8; 4]) -> [f32; 4] {
    let part = |code: u8| f64::from(code) / 255.0;
    let colour = |code: u8| linear_from_srgb(part(code) as f32);
    [colour(r), colour(g), colour(b), part(alpha) as f32]
}

fn texture(arrays: &Arrays<'_>) -> PyResult<Option<Texture>> {
    let (size, texels) = match (&arrays.texture, &arrays.texture_linear) {
        (Some(codes), _) => {
            let guard = read(codes, "texture")?;
            let texels = guard.as_slice().map_err(gaps)?.as_chunks().0.to_vec();
            (size(&guard), Texels::Srgb8(texels.into()))
        }
        (None, Some(light)) => {
            let guard = read(light, "texture")?;
            let texels = guard.as_slice().map_err(gaps)?.as_chunks().0.to_vec();
            (size(&guard), Texels::LinearF32(texels))
        }
        (None, None) => return Ok(None),
    };
    Ok(Some(Texture {
        name: "texture".to_owned(),
        width: size[0],
        height: size[1],
        texels,
    }))
}

/// Width and height of an array of rows.
fn size<T: Element>(array: &PyReadonlyArray<'_, T, numpy::Ix3>) -> [usize; 2] {
    let shape = array.as_array().dim();
    [shape.1, shape.0]
}

fn optional<T: Element + Copy, const N: usize, U>(
    array: Option<&Bound<'_, PyArray2<T>>>,
    name: &str,
    of_row: impl Fn([T; N]) -> U,
) -> PyResult<Vec<U>> {
    array.map_or(Ok(Vec::new()), |array| rows(array, name, of_row))
}

/// The rows of an array, each of N numbers.
pub(crate) fn rows<T: Element + Copy, const N: usize, U>(
    array: &Bound<'_, PyArray2<T>>,
    name: &str,
    of_row: impl Fn([T; N]) -> U,
) -> PyResult<Vec<U>> {
    let guard = read(array, name)?;
    let columns = guard.as_array().ncols();
    if columns != N {
        return Err(PyValueError::new_err(format!(
            "{name}: expected {N} numbers in each row, got {columns}"
        )));
    }
    let values = guard.as_slice().map_err(gaps)?;
    Ok(values.as_chunks().0.iter().copied().map(of_row).collect())
}

pub(crate) fn read<'py, T: Element, D: numpy::ndarray::Dimension>(
    array: &Bound<'py, PyArray<T, D>>,
    name: &str,
) -> PyResult<PyReadonlyArray<'py, T, D>> {
    let guard = array.try_readonly();
    guard.map_err(|error| PyValueError::new_err(format!("{name}: cannot be read now: {error}")))
}

fn gaps(_: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err("expected an array without gaps: call numpy.ascontiguousarray")
}
