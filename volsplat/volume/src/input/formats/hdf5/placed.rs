//! Places of voxels that the groups around an array give: images of VTK (`VTKHDF`) and of ITK (`ITKImage`).
//!
//! VTK has attributes at its group, as a `.vti` file has them at its element; ITK has arrays beside that of the voxels, in a world whose x
//! points left, y to the back and z to the head.

use glam::{DMat3, DVec3};
use netcdf_reader::NcFile;

use crate::input::file::Fault;
use crate::input::formats::hdf5::plan::placed;
use crate::input::formats::hdf5::tree::{Found, numbers};
use crate::volume::Lattice;

/// Names of VTK's group, of that of its arrays in cells, and of ITK's array.
const VTK: &str = "VTKHDF";
const CELLS: &str = "CellData";
const ITK: &str = "VoxelData";

/// The lattice of an array of so many voxels; `None` where the groups say nothing of it.
pub(crate) fn lattice(
    file: &NcFile,
    found: &Found,
    dims: [usize; 3],
) -> Result<Option<Lattice>, Fault> {
    let name = found.variable.name.as_str();
    if let Some(map) = found.group(VTK).and_then(|group| {
        let three = |name: &str| vector(numbers(&group.attributes, name));
        let axes = numbers(&group.attributes, "Direction");
        // Row by row; the columns are the directions of the axes.
        let axes = matrix(axes).map_or(DMat3::IDENTITY, |rows| rows.transpose());
        let (spacing, origin) = (three("Spacing")?, three("Origin")?);
        let begin = numbers(&group.attributes, "WholeExtent").unwrap_or_default();
        let begin = [0, 2, 4].map(|at| begin.get(at).copied().unwrap_or(0.0));
        let beside = if found.path.contains(CELLS) { 0.5 } else { 0.0 };
        let first = DVec3::from_array(begin) + beside;
        let steps = [0, 1, 2].map(|axis| axes.col(axis) * spacing[axis]);
        let offset = (0..3).map(|axis| steps[axis] * first[axis]).sum::<DVec3>();
        Some(placed(steps, origin + offset))
    }) {
        return Ok(Some(Lattice::unnamed(dims, map)));
    }
    if name != ITK {
        return Ok(None);
    }
    let beside = |name: &str| {
        let path = format!("{}{name}", found.path.trim_end_matches(ITK));
        let read = file.read_variable_as_f64(&path).ok()?;
        Some(read.iter().copied().collect::<Vec<f64>>())
    };
    let facts = vector(beside("Spacing")).zip(vector(beside("Origin")));
    Ok(facts.map(|(spacing, origin)| {
        // Row by row, a direction each.
        let axes = matrix(beside("Directions")).unwrap_or(DMat3::IDENTITY);
        let steps = [0, 1, 2].map(|axis| axes.col(axis) * spacing[axis]);
        Lattice {
            space: Some("left-posterior-superior".to_owned()),
            up_hint: Some(DVec3::Z),
            ..Lattice::unnamed(dims, placed(steps, origin))
        }
    }))
}

fn vector(numbers: Option<Vec<f64>>) -> Option<DVec3> {
    let three = <[f64; 3]>::try_from(numbers?).ok()?;
    Some(DVec3::from_array(three)).filter(|three| three.is_finite())
}

/// Three numbers for each column.
fn matrix(numbers: Option<Vec<f64>>) -> Option<DMat3> {
    let nine = <[f64; 9]>::try_from(numbers?).ok()?;
    Some(DMat3::from_cols_array(&nine)).filter(DMat3::is_finite)
}
