//! Volume files whose voxels stay in them, read box by box.

use std::path::Path;
use std::sync::Arc;

use super::file::at;
use super::format;
use super::format::{Detected, Format};
use super::load::zarr_choice;
use super::options::{LoadOptions, refuse_superfluous, replaced_lattice, undecided};
use crate::Error;
use crate::input::decode::stored::Stored;
use crate::input::formats::{meta_image, nifti, nrrd, raw, zarr};
use crate::source::VoxelSource;
use crate::volume::{Lattice, VoxelType};
use crate::watch::Watch;

/// A volume file whose voxels stay in it.
#[derive(Debug)]
pub struct Unread {
    /// The voxels, read box by box.
    pub source: Arc<dyn VoxelSource>,
    /// Their grid.
    pub lattice: Lattice,
}

/// The lattice and the voxel type of a file whose voxels can be read in parts, without reading them; `None` for
/// other files.
pub fn peek(path: &Path, options: &LoadOptions) -> Result<Option<(Lattice, VoxelType)>, Error> {
    if let Some(zarr) = open_zarr(path, options)? {
        let voxel_type = zarr.voxel_type();
        return Ok(Some((
            checked_lattice(path, zarr.lattice, options)?,
            voxel_type,
        )));
    }
    let unread = open_unread(path, options, 0, &mut |_| {})?;
    Ok(unread.map(|unread| (unread.lattice, unread.source.voxel_type())))
}

/// The array of a Zarr store that can be unpacked chunk by chunk.
fn open_zarr(path: &Path, options: &LoadOptions) -> Result<Option<zarr::Opened>, Error> {
    // Positioned writes are for Unix only; with a layout, the path for all formats says what is wrong.
    if !cfg!(unix) || options.raw.is_some() || options.rescale.is_some() || !zarr::begins(path) {
        return Ok(None);
    }
    refuse_superfluous(Format::Zarr, path, options)?;
    zarr::open(path, zarr_choice(options)).map(Some)
}

fn checked_lattice(path: &Path, lattice: Lattice, options: &LoadOptions) -> Result<Lattice, Error> {
    let lattice = replaced_lattice(lattice, options)?;
    lattice.check().map_err(|error| at(path, error))?;
    Ok(lattice)
}

/// Opens a volume file whose voxels can be read box by box, unpacking chunks into a temporary file within `max_memory`
/// bytes where it has any; `None` for a file that must be unpacked as a whole. `watch` hears how far unpacking is.
///
/// # Errors
/// Those of [`crate::load`], without a look at the values; and where the temporary file of a Zarr array has no room.
pub fn open_unread(
    path: &Path,
    options: &LoadOptions,
    max_memory: u64,
    watch: &mut Watch,
) -> Result<Option<Unread>, Error> {
    if let Some(zarr) = open_zarr(path, options)? {
        let lattice = checked_lattice(path, zarr.lattice.clone(), options)?;
        let stored = zarr.unpack(max_memory, watch, options.nan)?;
        return Ok(Some(Unread {
            source: Arc::new(stored),
            lattice,
        }));
    }
    if options.rescale.is_some() {
        // Box by box, values would have no type that suits all of them.
        return Ok(None);
    }
    let located = match (format::detect(path)?, &options.raw) {
        (Detected::Known(format, _), None) => {
            refuse_superfluous(format, path, options)?;
            match format {
                // A component lies between others.
                Format::Nrrd if options.component.is_none() => nrrd::locate(path, &options.gate)?,
                Format::MetaImage => meta_image::locate(path, &options.gate)?,
                _ => None,
            }
        }
        (Detected::NotRead(_) | Detected::Nothing, Some(raw)) => Some(raw::locate(path, raw)?),
        (Detected::NotRead(_) | Detected::Nothing, None)
            if nifti::header_beside(path).is_some() =>
        {
            None
        }
        (detected, _) => return Err(undecided(path, &detected)),
    };
    let Some(located) = located else {
        return Ok(None);
    };
    let Some(stored) = Stored::open(&located, options.nan)? else {
        return Ok(None);
    };
    let lattice = checked_lattice(path, located.lattice, options)?;
    Ok(Some(Unread {
        source: Arc::new(stored),
        lattice,
    }))
}
