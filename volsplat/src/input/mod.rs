//! Volume files: tells the format by the content and gives a checked [`Volume`].
//!
//! Takes a path and what the user says about it. The first bytes tell the format (`format.rs`); a file without a known
//! mark is headerless, and then its size and type must be given. All formats end in one decoder of scalars
//! (`decode.rs`) and one check of the result ([`Volume::new`]), so the promises of a volume do not depend on the format.
//! Limits: one scalar per voxel; one volume per file. World coordinates stay as the format defines them.

use std::fs::File;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use crate::Error;
use crate::large::Watch;
use crate::volume::{Lattice, NanPolicy, Volume, Voxels};

pub mod format;
pub mod raw;
pub mod voxel_type;

mod axes;
mod component;
mod data_files;
mod decode;
mod dicom;
mod fault;
mod lines;
mod meta_image;
mod nifti;
mod npy;
mod nrrd;
mod rescale;
mod slices;
mod stored;
mod tiff_stack;
mod vti;
mod zarr;

use format::Told;
use stored::Located;

pub use format::{Format, format_of};
pub use raw::RawOptions;
pub(crate) use stored::{Region, Stored};
pub use voxel_type::{Endian, VoxelType};

/// What a caller says about a volume file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// How a file without a header is laid out; must be absent for a file with one.
    pub raw: Option<RawOptions>,
    /// World distance between voxels along x, y and z, each above 0, instead of what the file says. Directions stay.
    pub spacing: Option<[f64; 3]>,
    /// World position of the first voxel, instead of what the file says.
    pub origin: Option<[f64; 3]>,
    /// What happens to voxels that are NaN or infinite.
    pub nan: NanPolicy,
    /// SeriesInstanceUID of the series that is read; needed where a folder of DICOM files holds several.
    pub series: Option<String>,
    /// Name of the array that is read; needed where the file holds several and calls none of them its scalars.
    pub array: Option<String>,
    /// Which component of each voxel, or channel of an image, is read, counted from 0; needed where there are several.
    pub component: Option<usize>,
    /// Which level of an image with several resolutions is read; `None` is 0, the finest.
    pub level: Option<usize>,
    /// Which point in time is read, counted from 0; needed where there are several.
    pub time: Option<usize>,
    /// What every value is multiplied with, and what is added then; for raw files that hold no Hounsfield units yet.
    pub rescale: Option<[f64; 2]>,
}

/// Reads a volume file.
///
/// Errors name the file: [`Error::Read`] if the system cannot read it, [`Error::Invalid`] if it contradicts its own
/// header or the options, [`Error::Unsupported`] if it is no scalar volume, [`Error::Option`] if options are missing
/// or superfluous.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Volume, Error> {
    // The image of a NIfTI pair has no mark of its own.
    let header = if options.raw.is_none() {
        nifti::header_beside(path)
    } else {
        None
    };
    let path = header.as_deref().unwrap_or(path);
    let mut parts = match (format::tell(path)?, &options.raw) {
        (Told::Known(format, files), None) => read(format, path, &files, options)?,
        (Told::NotRead(_) | Told::Nothing, Some(raw)) => raw::load(path, raw)?,
        (told, _) => return Err(undecided(path, &told)),
    };
    if let Some([slope, intercept]) = options.rescale {
        parts.voxels = rescaled(parts.voxels, slope, intercept)?;
    }
    if let NanPolicy::Replace(value) = options.nan {
        parts
            .voxels
            .replace_non_finite(value)
            .map_err(Error::Option)?;
    }
    let lattice = replaced_lattice(parts.world_from_index, options)?;
    let mut volume =
        Volume::new(parts.dims, parts.voxels, lattice).map_err(|error| at(path, error))?;
    volume.up_hint = parts.up_hint;
    volume.space = parts.space;
    Ok(volume)
}

/// What is known of a volume file whose voxels stay in it.
pub(crate) struct Unread {
    pub(crate) stored: Stored,
    pub(crate) lattice: Lattice,
}

/// The lattice and the voxel type of a file that [`open_unread`] opens, told without unpacking it; `None` for others.
pub(crate) fn peek(
    path: &Path,
    options: &LoadOptions,
) -> Result<Option<(Lattice, VoxelType)>, Error> {
    if let Some(zarr) = open_zarr(path, options)? {
        return Ok(Some((
            zarr_lattice(path, &zarr, options)?,
            zarr.voxel_type(),
        )));
    }
    let unread = open_unread(path, options, (0, &mut |_| {}))?;
    Ok(unread.map(|unread| (unread.lattice, unread.stored.voxel_type())))
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

fn zarr_lattice(path: &Path, zarr: &zarr::Opened, options: &LoadOptions) -> Result<Lattice, Error> {
    let world_from_index = replaced_lattice(zarr.world_from_index, options)?;
    let lattice = Lattice {
        dims: zarr.dims,
        world_from_index,
        up_hint: None,
        space: None,
    };
    lattice.check().map_err(|error| at(path, error))?;
    Ok(lattice)
}

fn zarr_choice(options: &LoadOptions) -> zarr::Choice {
    zarr::Choice {
        level: options.level,
        channel: options.component,
        time: options.time,
    }
}

/// Opens a volume file whose voxels can be read box by box, unpacking chunks into a temporary file within `max_memory`
/// bytes where it has any; `None` for a file that must be unpacked as a whole. `watch` is told how far unpacking is.
///
/// Errors as in [`load`]; the values are not looked at.
pub(crate) fn open_unread(
    path: &Path,
    options: &LoadOptions,
    (max_memory, watch): (u64, &mut Watch),
) -> Result<Option<Unread>, Error> {
    if let Some(zarr) = open_zarr(path, options)? {
        let lattice = zarr_lattice(path, &zarr, options)?;
        return Ok(Some(Unread {
            stored: zarr.unpack((max_memory, watch), options.nan)?,
            lattice,
        }));
    }
    if options.rescale.is_some() {
        // Box by box, values would have no type that suits all of them.
        return Ok(None);
    }
    let located = match (format::tell(path)?, &options.raw) {
        (Told::Known(format, _), None) => {
            refuse_superfluous(format, path, options)?;
            match format {
                // A component lies between others.
                Format::Nrrd if options.component.is_none() => nrrd::locate(path)?,
                Format::MetaImage => meta_image::locate(path)?,
                _ => None,
            }
        }
        (Told::NotRead(_) | Told::Nothing, Some(raw)) => Some(raw::locate(path, raw)?),
        (Told::NotRead(_) | Told::Nothing, None) if nifti::header_beside(path).is_some() => None,
        (told, _) => return Err(undecided(path, &told)),
    };
    let Some(located) = located else {
        return Ok(None);
    };
    let Some(stored) = Stored::open(&located, options.nan)? else {
        return Ok(None);
    };
    let Located {
        dims,
        up_hint,
        space,
        ..
    } = located;
    let world_from_index = replaced_lattice(located.world_from_index, options)?;
    let lattice = Lattice {
        dims,
        world_from_index,
        up_hint,
        space,
    };
    lattice.check().map_err(|error| at(path, error))?;
    Ok(Some(Unread { stored, lattice }))
}

/// Integers stay integers where all of their values do.
fn rescaled(voxels: Voxels, slope: f64, intercept: f64) -> Result<Voxels, Error> {
    if !(slope.is_finite() && intercept.is_finite() && slope != 0.0) {
        return Err(Error::Option(format!(
            "values are to be multiplied with {slope} and {intercept} added: expected finite numbers, the first not 0"
        )));
    }
    Ok(rescale::Rescale { slope, intercept }.apply(voxels))
}

fn read(
    format: Format,
    path: &Path,
    files: &[PathBuf],
    options: &LoadOptions,
) -> Result<Parts, Error> {
    refuse_superfluous(format, path, options)?;
    match format {
        Format::Nrrd => nrrd::load(path, options.component),
        Format::MetaImage => meta_image::load(path, options.component),
        Format::Nifti => nifti::load(path),
        Format::Npy => npy::load(path),
        Format::Dicom => dicom::load(files, path, options.series.as_deref()),
        Format::Tiff => tiff_stack::load(files),
        Format::Vti => {
            let choice = vti::Choice {
                array: options.array.as_deref(),
                component: options.component,
            };
            vti::load(path, choice)
        }
        Format::Zarr => zarr::load(path, zarr_choice(options)),
    }
}

/// Options that mean nothing for the format are an error, because whoever typed them expects an effect.
fn refuse_superfluous(format: Format, path: &Path, options: &LoadOptions) -> Result<(), Error> {
    let has_components = matches!(
        format,
        Format::MetaImage | Format::Nrrd | Format::Vti | Format::Zarr
    );
    let given = [
        (
            "component",
            options.component.is_some() && !has_components,
        ),
        (
            "series",
            options.series.is_some() && format != Format::Dicom,
        ),
        ("array", options.array.is_some() && format != Format::Vti),
        ("level", options.level.is_some() && format != Format::Zarr),
        ("time", options.time.is_some() && format != Format::Zarr),
    ];
    match given.iter().find(|(_, superfluous)| *superfluous) {
        None => Ok(()),
        Some((name, _)) => {
            let (path, format) = (path.display(), format.name());
            Err(Error::Option(format!(
                "{path}: {name} does not apply to {format} files: leave it out"
            )))
        }
    }
}

/// The error where the content and the options do not say how to read the file.
fn undecided(path: &Path, told: &Told) -> Error {
    let name = path.display();
    match told {
        Told::Known(format, _) => Error::Option(format!(
            "{name}: this is a file of format {} and states its own size and type: leave out --dims and --type",
            format.name()
        )),
        Told::NotRead(advice) => Error::Unsupported {
            path: path.to_owned(),
            what: format!("this is {advice}"),
        },
        Told::Nothing => Error::Option(format!(
            "{name}: no known header (formats are told by the content): for a headerless file give --dims X,Y,Z \
             and --type TYPE, and where needed --endian, --skip and --spacing"
        )),
    }
}

/// What a format reader gives: the parts of a volume, not yet checked against each other.
struct Parts {
    dims: [usize; 3],
    voxels: Voxels,
    world_from_index: glam::DAffine3,
    up_hint: Option<DVec3>,
    space: Option<String>,
}

fn replaced_lattice(
    mut map: glam::DAffine3,
    options: &LoadOptions,
) -> Result<glam::DAffine3, Error> {
    if let Some(spacing) = options.spacing {
        if !spacing
            .iter()
            .all(|&length| length > 0.0 && length.is_finite())
        {
            return Err(Error::Option(format!(
                "--spacing {spacing:?}: each must be finite and above 0"
            )));
        }
        let axes = map.matrix3;
        let unit = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::normalize_or_zero);
        map.matrix3 = DMat3::from_cols(
            unit[0] * spacing[0],
            unit[1] * spacing[1],
            unit[2] * spacing[2],
        );
    }
    if let Some(origin) = options.origin {
        map.translation = DVec3::from_array(origin);
    }
    Ok(map)
}

fn open(path: &Path) -> Result<File, Error> {
    let file = File::open(path).map_err(|source| cannot_read(path, source))?;
    // Opening a folder succeeds on some systems, and the fault would surface later with a worse message.
    let metadata = file
        .metadata()
        .map_err(|source| cannot_read(path, source))?;
    if metadata.is_dir() {
        return Err(cannot_read(path, std::io::ErrorKind::IsADirectory.into()));
    }
    Ok(file)
}

fn cannot_read(path: &Path, source: std::io::Error) -> Error {
    Error::Read {
        path: path.to_owned(),
        source,
    }
}

fn unsupported_file(path: &Path, what: impl Into<String>) -> Error {
    Error::Unsupported {
        path: path.to_owned(),
        what: what.into(),
    }
}

fn invalid(path: &Path, what: impl Into<String>) -> Error {
    Error::Invalid {
        path: path.to_owned(),
        what: what.into(),
    }
}

/// Puts the file's name before an error of the volume's own checks.
fn at(path: &Path, error: Error) -> Error {
    match error {
        Error::Option(what) => invalid(path, what),
        other => other,
    }
}

#[cfg(test)]
mod test_files;
#[cfg(test)]
mod tests;
