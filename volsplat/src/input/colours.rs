//! Whether the voxels of a file are colours: three or four bytes each, red first.
//!
//! Takes a path and what the caller says, looks at the header alone. A reader reads one component; whoever draws colours reads
//! three of them as channels.

use std::path::Path;

use super::format::{self, Detected, Format};
use super::options::LoadOptions;
use super::{meta_image, nifti, nrrd, vti, vtk};
use crate::Error;

/// How many colours a voxel has, 3 or 4; `None` where it is a number or a vector of others, and where the caller has chosen
/// a component or the layout of a raw file.
///
/// # Errors
/// As [`crate::load`] has them for headers.
pub fn colours_of(path: &Path, options: &LoadOptions) -> Result<Option<usize>, Error> {
    if options.component.is_some() || options.raw.is_some() {
        return Ok(None);
    }
    let header = nifti::header_beside(path);
    let path = header.as_deref().unwrap_or(path);
    let Detected::Known(format, _) = format::detect(path)? else {
        return Ok(None);
    };
    let array = options.array.as_deref();
    let colours = match format {
        Format::Nifti => nifti::colours(path)?,
        Format::Nrrd => nrrd::colours(path)?,
        Format::MetaImage => meta_image::colours(path)?,
        Format::Vti => vti::colours(path, array)?,
        Format::Vtk => vtk::colours(path, array)?,
        _ => None,
    };
    Ok(colours.filter(|count| matches!(count, 3 | 4)))
}
