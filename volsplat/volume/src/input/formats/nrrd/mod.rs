//! NRRD files, versions 1 to 5, with attached or detached data.
//!
//! Takes a path, gives the parts of a volume. The header (`header.rs`) says what the numbers are, the geometry
//! (`geometry.rs`) which of its axes are the volume's and where they lie, and the data (`data.rs`) is found, unpacked
//! and decoded. The source is the definition of the NRRD file format of the Teem library, version 1.9 and later.
//! Limits: scalar volumes, or one of several components; "block" types, and the fields that do not place or size the data ("axis mins", "centers",
//! "thicknesses", units, "measurement frame", "old min", key/value pairs), are left aside. World coordinates are
//! kept as the file has them: nothing is flipped between anatomical conventions.

use std::io::BufReader;
use std::path::Path;

use resample_io::Gate;

use crate::Error;
use crate::input::decode::component;
use crate::input::decode::stored::Located;
use crate::input::{Parts, open};
use crate::volume::VoxelType;

mod data;
mod geometry;
mod header;

/// The first bytes of every NRRD file; one digit of version follows.
pub(crate) const MAGIC: &[u8] = b"NRRD000";

pub(crate) fn load(path: &Path, component: Option<usize>, gate: &Gate) -> Result<Parts, Error> {
    let mut reader = BufReader::new(open(path)?);
    let header = header::read(&mut reader).map_err(|fault| fault.at(path))?;
    let geometry = geometry::derive(&header).map_err(|fault| fault.at(path))?;
    let components = geometry.components.map_or(1, |axis| header.sizes[axis]);
    let chosen = component::chosen(component, components).map_err(|fault| fault.at(path))?;
    let voxels = data::read(
        path,
        &header,
        geometry.components.map(|axis| data::OneOf { axis, chosen }),
        gate,
    )?;
    Ok(Parts {
        lattice: geometry.lattice,
        voxels,
    })
}

/// How many bytes of colour a voxel has; `None` where it is a number.
pub(crate) fn colours(path: &Path) -> Result<Option<usize>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let geometry = geometry::derive(&header).map_err(|fault| fault.at(path))?;
    let count = geometry.components.map(|axis| header.sizes[axis]);
    Ok(count.filter(|_| header.voxel_type == VoxelType::U8))
}

/// Where the voxels lie; `None` where they are packed.
pub(crate) fn locate(path: &Path, gate: &Gate) -> Result<Option<Located>, Error> {
    let header = header::read(&mut BufReader::new(open(path)?)).map_err(|fault| fault.at(path))?;
    let geometry = geometry::derive(&header).map_err(|fault| fault.at(path))?;
    if geometry.components.is_some() {
        return Ok(None);
    }
    let Some(files) = data::locate(path, &header, gate)? else {
        return Ok(None);
    };
    Ok(Some(Located {
        lattice: geometry.lattice,
        voxel_type: header.voxel_type,
        endian: header.endian,
        files,
    }))
}

#[cfg(test)]
mod tests;
