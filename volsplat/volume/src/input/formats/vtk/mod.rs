//! VTK's legacy files, `.vtk`: STRUCTURED_POINTS as text or binary.
//!
//! Takes a path, gives the parts of a volume. Lines at the top (`head.rs`) say how the image lies; then come arrays
//! (`arrays.rs`), each with a line in front, of which one is read: the one that the caller names, or the first. Binary
//! numbers are big-endian. Values of cells stand at their centres.
//! Source: VTK File Formats, "Simple Legacy Formats". Limits: grids with one spacing along each axis; no bits.

use std::io::BufReader;
use std::path::Path;

use glam::{DAffine3, DMat3};
use resample_io::Gate;

use super::vti::{CELLS_REMARK, others_remark};
use crate::Error;
use crate::input::decode::{Layout, component};
use crate::input::fault::{Fault, excerpt};
use crate::input::file::{Parts, open_sized};
use crate::volume::{Endian, Lattice, VoxelType, voxel_count};

mod arrays;
mod head;

use arrays::{Array, Arrays};
use head::{Centring, Head};

/// The first bytes of every file.
pub(crate) const MAGIC: &[u8] = b"# vtk DataFile";

/// The caller's choice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Choice<'a> {
    /// Name of the array.
    pub(crate) array: Option<&'a str>,
    /// Component of each value, counted from 0.
    pub(crate) component: Option<usize>,
}

/// How many colours a value of the array has; `None` where it is no colour.
pub(crate) fn colours(path: &Path, array: Option<&str>) -> Result<Option<usize>, Error> {
    let (file, held) = open_sized(path)?;
    let found = || -> Result<Array, Fault> {
        let mut bytes = BufReader::new(file);
        let head = Head::read(&mut bytes)?;
        Arrays::new(&mut bytes, held, head.is_binary).find(array)
    };
    let array = found().map_err(|fault| fault.at(path))?;
    let is_colour = array.voxel_type == VoxelType::U8 && matches!(array.components, 3 | 4);
    Ok(is_colour.then_some(array.components))
}

/// The names of all arrays of a file.
pub(crate) fn array_names(path: &Path) -> Result<Vec<String>, Error> {
    let (file, held) = open_sized(path)?;
    let mut bytes = BufReader::new(file);
    let head = Head::read(&mut bytes).map_err(|fault| fault.at(path))?;
    Ok(Arrays::new(&mut bytes, held, head.is_binary).names())
}

pub(crate) fn load(path: &Path, choice: Choice, gate: &Gate) -> Result<Parts, Error> {
    let (file, held) = open_sized(path)?;
    let mut bytes = BufReader::new(file);
    let read = || -> Result<(Parts, Vec<String>), Fault> {
        let head = Head::read(&mut bytes)?;
        let arrays = Arrays::new(&mut bytes, held, head.is_binary);
        read(&head, arrays, choice, gate)
    };
    let (parts, remarks) = { read }().map_err(|fault| fault.at(path))?;
    let name = path.display();
    for remark in remarks {
        gate.remark(format!("{name}: {remark}"));
    }
    Ok(parts)
}

/// The chosen array on its grid, and remarks on what was decided.
fn read(
    head: &Head,
    mut arrays: Arrays,
    choice: Choice,
    gate: &Gate,
) -> Result<(Parts, Vec<String>), Fault> {
    let array = arrays.find(choice.array)?;
    let chosen = component::chosen(choice.component, array.components)?;
    let (dims, first) = head.grid(array.centring);
    let layout = Layout {
        voxel_type: array.voxel_type,
        endian: Endian::Big,
        count: voxel_count(dims)?,
    };
    if array.tuples != layout.count {
        let [x, y, z] = dims;
        return Err(Fault::Invalid(format!(
            "the array '{}' has {} values, but DIMENSIONS make {x}x{y}x{z}: expected {}",
            excerpt(&array.name),
            array.tuples,
            layout.count
        )));
    }
    gate.ask(layout.bytes()?, "the voxels")?;
    let voxels = arrays.values(&array, &layout, chosen)?;
    let mut remarks = Vec::new();
    if array.centring == Centring::Cells {
        remarks.push(CELLS_REMARK.to_owned());
    }
    if choice.array.is_none() {
        remarks.extend(others_remark(&array.name, &arrays.names()));
    }
    let axes = DMat3::from_diagonal(head.spacing);
    let map = DAffine3::from_mat3_translation(axes, head.origin + axes * first);
    let lattice = Lattice::unnamed(dims, map);
    Ok((Parts { lattice, voxels }, remarks))
}

#[cfg(test)]
mod tests;
