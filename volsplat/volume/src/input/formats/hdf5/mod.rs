//! HDF5 and NetCDF, files of arrays: `.h5`, `.hdf5`, `.nc`, MATLAB's `.mat` (7.3), and two formats of images inside, Imaris and MINC.
//!
//! Takes a path, gives the parts of a volume. `netcdf-reader` decodes the groups and unpacks the chunks; `imaris`, `minc` and `grid` plan which
//! part of which array makes the volume (`plan`), `placed` reads the places that VTK and ITK give; `slab` reads the part. `tree` lists the arrays.
//! Limits: integers, real numbers of 32 and 64 bits and booleans; arrays lie in the file itself; the wanted part is unpacked as a whole.

mod grid;
mod imaris;
mod minc;
mod placed;
mod plan;
mod slab;
mod tree;

use std::path::Path;

use netcdf_reader::{NcFile, NcMetadataMode, NcOpenOptions};
use resample_core::narrow;
use resample_io::Gate;

use crate::Error;
use crate::input::axes::{ImageAxes, first_of};
use crate::input::file::{Fault, Parts};
use crate::input::options::LoadOptions;
use plan::Plan;

/// The mark of HDF5. A block of the user may lie before it, of 512 bytes or twice, four or eight times as many.
const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Returns true if a file that begins with `head` is an HDF5 file.
pub(crate) fn begins(head: &[u8]) -> bool {
    [0, 512, 1024, 2048]
        .iter()
        .any(|&at| head.get(at..).is_some_and(|rest| rest.starts_with(MAGIC)))
}

/// Returns true if a file that begins with `head` is a classic NetCDF file.
pub(crate) fn begins_classic(head: &[u8]) -> bool {
    [b"CDF\x01", b"CDF\x02", b"CDF\x05"]
        .iter()
        .any(|mark| head.starts_with(*mark))
}

fn open(path: &Path, gate: &Gate) -> Result<NcFile, Fault> {
    let most = narrow::count(gate.max_memory());
    let options = NcOpenOptions {
        metadata_mode: NcMetadataMode::Lossy,
        filter_registry: Some(slab::filters(most)),
        max_read_bytes: most,
        ..NcOpenOptions::default()
    };
    NcFile::open_with_options(path, options).map_err(|error| unreadable(&error))
}

fn unreadable(error: &netcdf_reader::Error) -> Fault {
    Fault::Invalid(format!("it cannot be read as HDF5 or NetCDF: {error}"))
}

/// Reads the wanted components of the chosen array, or its only one.
pub(crate) fn load(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Parts, Error> {
    read(path, options, components).map_err(|fault| fault.at(path))
}

fn read(path: &Path, options: &LoadOptions, components: &[usize]) -> Result<Parts, Fault> {
    let file = open(path, &options.gate)?;
    let held = std::fs::metadata(path).map_or(0, |file| file.len());
    let times = axes_in(&file, options)?.times;
    if times > 1 && options.time.is_none() {
        options.gate.remark(first_of(times, path));
    }
    let plan = planned(&file, options, components)?;
    let mut voxels = Vec::new();
    for slab in &plan.slabs {
        let variable = file.variable(&slab.path).map_err(|e| unreadable(&e))?;
        let array = (slab.path.as_str(), &variable.dtype, plan.values.is_unsigned);
        let stored = slab::read(&file, array, &slab.taken, (&options.gate, held))?;
        let real = plan.values.real(stored, plan.lattice.dims);
        let (real, missing) = real.map_err(|what| format!("the array {}: {what}", slab.path))?;
        if missing > 0 {
            options.gate.remark(format!(
                "{}: {missing} of {} elements have no value: they get the least of the others",
                slab.path,
                real.len()
            ));
        }
        voxels.push(real);
    }
    Ok(Parts {
        lattice: plan.lattice,
        voxels,
    })
}

fn planned(file: &NcFile, options: &LoadOptions, components: &[usize]) -> Result<Plan, Fault> {
    let root = file.root_group().map_err(|error| unreadable(&error))?;
    if options.array.is_none() {
        if imaris::is_layout(root) {
            return imaris::plan(root, options, components);
        }
        if let Some(image) = minc::image(root) {
            return image.plan(file, options, components);
        }
    }
    if options.level.is_some() {
        return Err(Fault::Option(
            "level is for images with several resolutions: leave it out".to_owned(),
        ));
    }
    grid::plan((file, root), options, components)
}

/// The channels and points in time of the image or of the chosen array.
pub(crate) fn axes(path: &Path, options: &LoadOptions) -> Result<ImageAxes, Error> {
    let file = open(path, &options.gate);
    file.and_then(|file| axes_in(&file, options))
        .map_err(|fault| fault.at(path))
}

fn axes_in(file: &NcFile, options: &LoadOptions) -> Result<ImageAxes, Fault> {
    let root = file.root_group().map_err(|error| unreadable(&error))?;
    if options.array.is_none() {
        if imaris::is_layout(root) {
            return Ok(imaris::axes(root));
        }
        if let Some(image) = minc::image(root) {
            return Ok(ImageAxes {
                times: image.times(),
                ..ImageAxes::default()
            });
        }
    }
    grid::axes(root, options.array.as_deref())
}

/// The names of the arrays that may be drawn, and of the one that is read by default.
pub(crate) fn array_names(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    let names = || {
        let file = open(path, &Gate::default())?;
        let root = file.root_group().map_err(|error| unreadable(&error))?;
        if imaris::is_layout(root) || minc::image(root).is_some() {
            return Ok((Vec::new(), None));
        }
        let all = grid::drawable(root);
        let default = grid::largest(&all).map(|found| found.path.clone());
        Ok((all.into_iter().map(|found| found.path).collect(), default))
    };
    names().map_err(|fault: Fault| fault.at(path))
}

#[cfg(test)]
mod tests;
