//! The content of a file beside one scalar a voxel: colours, several arrays, channels and points in time.
//!
//! Voxels that are colours have three or four bytes each, red first. Takes a path and the options of reading; the header alone tells whether there are colours. They are read in one pass, and drawn as tints over one more channel, which gives the opacity.

use std::path::Path;

use rayon::prelude::*;

use super::format;
use super::format::{Detected, Format};
use super::load::load_components;
use super::options::LoadOptions;
use crate::Error;
use crate::input::axes::ImageAxes;
use crate::input::formats::numpy::npz;
use crate::input::formats::plain::amira;
use crate::input::formats::{
    hdf5, meta_image, mgh, nifti, nrrd, picture_slices, tiff_stack, vti, vtk, zarr,
};
use crate::input::invalid;
use crate::volume::{Volume, Voxels};

/// The components of voxels that are colours.
pub struct ColourVoxels {
    /// Red, green and blue, in display colours (sRGB), each the tint of one more channel.
    pub components: [Volume; 3],
    /// The scalar that the opacity follows: alpha where it varies, else the greatest of red, green and blue.
    pub opacity: Volume,
}

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
    let Detected::Known(format, files) = format::detect(path)? else {
        return Ok(None);
    };
    let array = options.array.as_deref();
    let colours = match format {
        Format::Nifti => nifti::colours(path)?,
        Format::Nrrd => nrrd::colours(path)?,
        Format::MetaImage => meta_image::colours(path)?,
        Format::Vti => vti::colours(path, array)?,
        Format::Vtk => vtk::colours(path, array)?,
        Format::Tiff => tiff_stack::colours(&files)?,
        Format::Pictures => picture_slices::colours(&files, &options.gate),
        _ => None,
    };
    Ok(colours.filter(|count| matches!(count, 3 | 4)))
}

/// The names of the arrays of a file of VTK, HDF5, NetCDF, NumPy or Amira, which may hold several, and of the one that is read by default; empty for other formats.
///
/// # Errors
/// As [`crate::load`] has them for headers.
pub fn arrays_of(path: &Path) -> Result<(Vec<String>, Option<String>), Error> {
    match format::detect(path)? {
        Detected::Known(Format::Vti, _) => vti::array_names(path),
        Detected::Known(Format::Vtk, _) => vtk::array_names(path),
        Detected::Known(Format::Hdf5 | Format::NetCdf, _) => hdf5::array_names(path),
        Detected::Known(Format::Npz, _) => npz::array_names(path),
        Detected::Known(Format::Amira, _) => amira::array_names(path),
        _ => Ok((Vec::new(), None)),
    }
}

/// The channels and points in time of a file; one of each where it has no such axes, and of raw files.
///
/// # Errors
/// As [`crate::load`] has them for headers.
pub fn axes_of(path: &Path, options: &LoadOptions) -> Result<ImageAxes, Error> {
    if options.raw.is_some() {
        return Ok(ImageAxes::default());
    }
    let header = nifti::header_beside(path);
    let path = header.as_deref().unwrap_or(path);
    let Detected::Known(format, files) = format::detect(path)? else {
        return Ok(ImageAxes::default());
    };
    let times = match format {
        Format::Tiff => return tiff_stack::axes(&files, &options.gate),
        Format::Zarr => return zarr::axes(path, options),
        Format::Hdf5 | Format::NetCdf => return hdf5::axes(path, options),
        Format::Nifti => nifti::times(path)?,
        Format::Mgh => mgh::times(path)?,
        _ => 1,
    };
    Ok(ImageAxes {
        times,
        ..ImageAxes::default()
    })
}

/// Reads voxels that are colours; `None` where [`colours_of`] has none.
///
/// # Errors
/// As [`crate::load`] has them.
pub fn load_colours(path: &Path, options: &LoadOptions) -> Result<Option<ColourVoxels>, Error> {
    let Some(count) = colours_of(path, options)? else {
        return Ok(None);
    };
    let numbers: Vec<usize> = (0..count).collect();
    let mut read = load_components(path, options, &numbers)?.into_iter();
    let (Some(red), Some(green), Some(blue)) = (read.next(), read.next(), read.next()) else {
        return Ok(None);
    };
    let all = (red.bytes() as u64).saturating_mul(count as u64 + 1);
    options
        .gate
        .ask(all, "red, green, blue and the opacity")
        .map_err(|what| invalid(path, what))?;
    let components = [red, green, blue];
    let alpha = read.next();
    let opacity = match alpha.filter(|alpha| alpha.value_range().0 < alpha.value_range().1) {
        Some(alpha) => alpha,
        None => greatest(&components),
    };
    Ok(Some(ColourVoxels {
        components,
        opacity,
    }))
}

/// The greatest of three components at each voxel.
fn greatest(components: &[Volume; 3]) -> Volume {
    let [red, green, blue] = components;
    let voxels = match [&red.voxels, &green.voxels, &blue.voxels] {
        [Voxels::U8(r), Voxels::U8(g), Voxels::U8(b)] => Voxels::U8(greatest_of(r, g, b)),
        [Voxels::U16(r), Voxels::U16(g), Voxels::U16(b)] => Voxels::U16(greatest_of(r, g, b)),
        // Colours have 8 or 16 bits.
        _ => red.voxels.clone(),
    };
    Volume {
        voxels,
        ..red.clone()
    }
}

fn greatest_of<T: Copy + Ord + Send + Sync>(red: &[T], green: &[T], blue: &[T]) -> Vec<T> {
    let both = green.par_iter().zip(blue);
    red.par_iter()
        .zip(both)
        .map(|(&r, (&g, &b))| r.max(g).max(b))
        .collect()
}
