//! NumPy's `.npy` files: one array of numbers.
//!
//! Takes a path, gives the parts of a volume. An array is indexed `[z][y][x]`, whatever the order in memory: of an array
//! in C order the last axis is fastest, which is how voxels are held here; one in Fortran order is transposed, so that
//! `array[z][y][x]` is voxel (x, y, z) in either. An array of two axes is one slice. `resample_io` reads
//! the header.
//! Limits: booleans (as 0 and 1), integers, single and double precision; no half precision, complex numbers, records.

use std::io::{BufReader, Read};
use std::path::Path;

use resample_io::npy;
use resample_io::npy::{Element, Header, Kind, Order, other_type};

use crate::Error;
use crate::input::decode::{Layout, axes};
use crate::input::fault::{Fault, unsupported};
use crate::input::{Parts, decode, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, Voxels, map_voxels, voxel_count};

pub(crate) use resample_io::npy::MAGIC;

pub(crate) fn load(path: &Path) -> Result<Parts, Error> {
    let (file, total) = open_sized(path)?;
    read(&mut BufReader::new(file), total).map_err(|fault| fault.at(path))
}

fn read(file: &mut dyn Read, total: u64) -> Result<Parts, Fault> {
    let header = Header::read(file)?;
    let dims = dims(&header.shape)?;
    let layout = layout(header.element, voxel_count(dims)?)?;
    check_length(&header, &layout, total)?;
    let voxels = decode::binary(file, &layout)?;
    let voxels = if header.order == Order::C {
        voxels
    } else {
        transposed(voxels, dims)
    };
    Ok(Parts {
        lattice: Lattice::unnamed(dims, axes::upright([1.0; 3], [0.0; 3])),
        voxels,
    })
}

fn check_length(header: &Header, layout: &Layout, total: u64) -> Result<(), String> {
    let (needed, held) = (layout.bytes()?, total.saturating_sub(header.bytes));
    if needed == held {
        return Ok(());
    }
    let (shape, name) = (&header.shape, layout.voxel_type.name());
    Err(format!(
        "an array of shape {shape:?} of {name} needs {needed} bytes behind the header, there are {held}"
    ))
}

fn layout(element: Element, count: usize) -> Result<Layout, Fault> {
    let voxel_type = match (element.kind, element.bytes) {
        (Kind::Unsigned, 1) => VoxelType::U8,
        (Kind::Unsigned, 2) => VoxelType::U16,
        (Kind::Unsigned, 4) => VoxelType::U32,
        (Kind::Unsigned, 8) => VoxelType::U64,
        (Kind::Signed, 1) => VoxelType::I8,
        (Kind::Signed, 2) => VoxelType::I16,
        (Kind::Signed, 4) => VoxelType::I32,
        (Kind::Signed, 8) => VoxelType::I64,
        (Kind::Float, 4) => VoxelType::F32,
        (Kind::Float, 8) => VoxelType::F64,
        _ => return Err(unsupported(other_type(&element.to_string()))),
    };
    let endian = match element.endian {
        npy::Endian::Little => Endian::Little,
        npy::Endian::Big => Endian::Big,
    };
    Ok(Layout {
        voxel_type,
        endian,
        count,
    })
}

/// x, y and z sizes of an array `[z][y][x]`. Of more than three axes, those of size 1 go, the first ones first.
fn dims(shape: &[usize]) -> Result<[usize; 3], Fault> {
    let mut axes = shape.to_vec();
    while axes.len() > 3 {
        let Some(place) = axes.iter().position(|&size| size == 1) else {
            return Err(unsupported(format!(
                "an array of shape {shape:?}: a volume has three axes, so save one volume of it, such as array[0]"
            )));
        };
        axes.remove(place);
    }
    let mut dims = [1; 3];
    dims.iter_mut()
        .zip(axes.iter().rev())
        .for_each(|(dim, &size)| *dim = size);
    Ok(dims)
}

/// From the first axis fastest to the last axis fastest.
fn transposed(voxels: Voxels, dims: [usize; 3]) -> Voxels {
    map_voxels!(voxels, values => transposed_values(&values, dims))
}

fn transposed_values<T: Copy>(values: &[T], [x_size, y_size, z_size]: [usize; 3]) -> Vec<T> {
    let mut result = Vec::with_capacity(values.len());
    for z in 0..z_size {
        for y in 0..y_size {
            result.extend((0..x_size).map(|x| values[(x * y_size + y) * z_size + z]));
        }
    }
    result
}

#[cfg(test)]
mod tests;
