//! Volumes of arrays: three axes in the order z, y, x, of any scalar type that NumPy has.
//!
//! Voxels are copied once, by all threads, because they are read while Python goes on. An array whose axes lie in memory the
//! other way round (Fortran order) is turned on the way.

use glam::{DAffine3, DMat3, DVec3};
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;
use volsplat::{Lattice, Voxels};

/// The order of an array's numbers in memory.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Order {
    /// The last axis is fastest.
    C,
    /// The first axis is fastest.
    Fortran,
}

/// Where an array lies in the world.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Place {
    /// World vectors from voxel to voxel along x, y and z.
    axes: [[f64; 3]; 3],
    origin: [f64; 3],
    up: Option<[f64; 3]>,
    space: Option<String>,
}

/// Lattice and voxels of an array.
pub(crate) fn parts(
    array: &Bound<'_, PyUntypedArray>,
    place: Place,
) -> PyResult<(Lattice, Voxels)> {
    let &[z, y, x] = array.shape() else {
        return Err(PyValueError::new_err(format!(
            "array: expected three axes (z, y, x), got the shape {:?}",
            array.shape()
        )));
    };
    let [right, down, deep] = place.axes.map(DVec3::from_array);
    let lattice = Lattice {
        dims: [x, y, z],
        world_from_index: DAffine3::from_mat3_translation(
            DMat3::from_cols(right, down, deep),
            DVec3::from_array(place.origin),
        ),
        up_hint: place.up.map(DVec3::from_array),
        space: place.space,
        modality: None,
        unit: None,
        window: None,
    };
    Ok((lattice, voxels(array, [x, y, z])?))
}

fn voxels(array: &Bound<'_, PyUntypedArray>, dims: [usize; 3]) -> PyResult<Voxels> {
    macro_rules! first_of {
        ($($scalar:ty => $make:expr),* $(,)?) => {
            $(if let Ok(array) = array.cast::<PyArrayDyn<$scalar>>() {
                return copied(array, dims, |value: $scalar| value).map($make);
            })*
        };
    }
    first_of! {
        u8 => Voxels::U8, i8 => Voxels::I8, u16 => Voxels::U16, i16 => Voxels::I16, u32 => Voxels::U32, i32 => Voxels::I32,
        f32 => Voxels::F32, f64 => Voxels::F64,
    }
    // Whole numbers of 64 bits are held as files' are.
    if let Ok(array) = array.cast::<PyArrayDyn<u64>>() {
        return copied(array, dims, |value: u64| value as f64).map(Voxels::F64);
    }
    if let Ok(array) = array.cast::<PyArrayDyn<i64>>() {
        return copied(array, dims, |value: i64| value as f64).map(Voxels::F64);
    }
    Err(PyTypeError::new_err(format!(
        "array: expected whole or real numbers, got {}",
        array.dtype()
    )))
}

fn copied<T: Element + Copy + Sync, U: Copy + Default + Send>(
    array: &Bound<'_, PyArrayDyn<T>>,
    dims: [usize; 3],
    convert: impl Fn(T) -> U + Sync + Send,
) -> PyResult<Vec<U>> {
    let order = match array.is_c_contiguous() {
        true => Order::C,
        false => Order::Fortran,
    };
    let guard = array
        .try_readonly()
        .map_err(|error| PyValueError::new_err(format!("array: cannot be read now: {error}")))?;
    let values = guard.as_slice().map_err(|_| {
        PyValueError::new_err("array: expected numbers without gaps: call numpy.ascontiguousarray")
    })?;
    Ok(array.py().detach(|| match order {
        Order::C => in_order(values, convert),
        Order::Fortran => turned(values, dims, convert),
    }))
}

/// Numbers per task. A guess: a task outweighs its own overhead.
const PER_TASK: usize = 1 << 18;

fn in_order<T: Copy + Sync, U: Copy + Default + Send>(
    values: &[T],
    convert: impl Fn(T) -> U + Sync + Send,
) -> Vec<U> {
    let mut copy = vec![U::default(); values.len()];
    let tasks = copy
        .par_chunks_mut(PER_TASK)
        .zip(values.par_chunks(PER_TASK));
    tasks.for_each(|(copy, values)| {
        for (copy, &value) in copy.iter_mut().zip(values) {
            *copy = convert(value);
        }
    });
    copy
}

/// Layers that are turned together: each reads neighbours of the array's fastest axis.
const LAYERS: usize = 16;

/// From the first axis fastest to the last axis fastest.
fn turned<T: Copy + Sync, U: Copy + Default + Send>(
    values: &[T],
    [x_size, y_size, z_size]: [usize; 3],
    convert: impl Fn(T) -> U + Sync + Send,
) -> Vec<U> {
    let layer = x_size * y_size;
    let mut copy = vec![U::default(); values.len()];
    if copy.is_empty() {
        return copy;
    }
    let tasks = copy.par_chunks_mut(LAYERS * layer).enumerate();
    tasks.for_each(|(task, copy)| {
        let first = task * LAYERS;
        for y in 0..y_size {
            for x in 0..x_size {
                let row = (x * y_size + y) * z_size + first;
                let own = &values[row..row + copy.len() / layer];
                for (z, &value) in own.iter().enumerate() {
                    copy[z * layer + y * x_size + x] = convert(value);
                }
            }
        }
    });
    copy
}
