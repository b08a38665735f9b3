//! Reads a volume file: finds the format by the content and returns a checked [`Volume`], or its voxels box by box.
//!
//! Takes a path and the user's options. The first bytes tell the format (`format.rs`); a file without a known
//! mark is headerless, and then its size and type must be given. All formats end in one decoder of scalars
//! (`decode`) and one check of the result ([`Volume::new`]), so the promises of a volume do not depend on the format.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use resample_io::Gate;

use crate::Error;
use crate::input::decode::rescale;
use crate::input::decode::stored::Stored;
use crate::input::file::{Parts, at, invalid};
use crate::input::format;
use crate::input::format::{Detected, Format};
use crate::input::formats::density::{cube, mrc};
use crate::input::formats::numpy::{npy, npz};
use crate::input::formats::plain::{amira, gipl, raw};
use crate::input::formats::{
    dicom, hdf5, meta_image, mgh, nifti, nrrd, picture_slices, tiff_stack, vti, vtk, zarr,
};
use crate::input::options::{LoadOptions, RawOptions, replaced_lattice};
use crate::source::{VoxelSource, Watch};
use crate::volume::{Lattice, NanPolicy, Volume, VoxelType, Voxels};

/// Reads a volume file.
///
/// Errors name the file: [`Error::Read`] if the system cannot read it, [`Error::Invalid`] if it contradicts its own
/// header or the options, [`Error::Unsupported`] if it is no scalar volume, [`Error::Option`] if options are missing
/// or superfluous.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Volume, Error> {
    let components: Vec<usize> = options.component.into_iter().collect();
    let volume = load_all(path, options, &components)?.pop();
    volume.ok_or_else(|| invalid(path, "it holds no volume"))
}

/// Reads several components of each voxel, or channels of an image, in the order in which they are listed; the file is decoded once.
///
/// # Errors
/// As [`load`] has them for each component; [`LoadOptions::component`] is ignored.
pub fn load_components(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Vec<Volume>, Error> {
    let Some(&first) = components.first() else {
        return Ok(Vec::new());
    };
    let options = LoadOptions {
        component: Some(first),
        ..options.clone()
    };
    load_all(path, &options, components)
}

/// Reads the listed components; with an empty list, the only one.
fn load_all(
    path: &Path,
    options: &LoadOptions,
    components: &[usize],
) -> Result<Vec<Volume>, Error> {
    // The image of a NIfTI pair has no mark of its own.
    let header = if options.raw.is_none() {
        nifti::header_beside(path)
    } else {
        None
    };
    let path = header.as_deref().unwrap_or(path);
    ask_for_plain(path, &options.gate)?;
    let detected = format::detect(path)?;
    let layout = raw_layout(path, &detected, options);
    let parts = match (detected, layout) {
        (Detected::Known(format, files), None) => {
            read(format, path, &files, (options, components))?
        }
        (Detected::NotRead(_) | Detected::Nothing, Some(raw)) => raw::load(path, &raw)?,
        (detected, _) => return Err(undecided(path, &detected)),
    };
    finished(path, parts, options)
}

/// The layout of a headerless file: the caller gives it, or the name of the file.
fn raw_layout(path: &Path, detected: &Detected, options: &LoadOptions) -> Option<RawOptions> {
    if options.raw.is_some() || !matches!(detected, Detected::Nothing) {
        return options.raw.clone();
    }
    let raw = raw::of_name(path)?;
    let ([x, y, z], name) = (raw.dims, raw.voxel_type.name());
    options.gate.remark(format!(
        "{}: no header; by its name it holds {x}x{y}x{z} voxels of {name}",
        path.display()
    ));
    Some(raw)
}

/// A volume of memory, as if a file held it: spacing, origin, and what happens to values come from the options.
///
/// Errors name `name`. The layout of raw files and the parts of files mean nothing here and are refused.
pub fn of_memory(
    name: &Path,
    lattice: Lattice,
    voxels: Voxels,
    options: &LoadOptions,
) -> Result<Volume, Error> {
    let parts = [
        ("the layout of raw files", options.raw.is_some()),
        ("series", options.series.is_some()),
        ("array", options.array.is_some()),
        ("component", options.component.is_some()),
        ("level", options.level.is_some()),
        ("time", options.time.is_some()),
    ];
    if let Some((what, _)) = parts.iter().find(|(_, is_given)| *is_given) {
        return Err(Error::Option(format!(
            "{}: {what} is for files: leave it out",
            name.display()
        )));
    }
    let parts = Parts {
        lattice,
        voxels: vec![voxels],
    };
    let volume = finished(name, parts, options)?.pop();
    volume.ok_or_else(|| invalid(name, "it holds no volume"))
}

/// The window of the file, in the values that the options ask for.
fn window_of(lattice: &Lattice, options: &LoadOptions) -> Option<[f64; 2]> {
    let [slope, intercept] = options.rescale.unwrap_or([1.0, 0.0]);
    let mut ends = lattice.window?.map(|end| slope * end + intercept);
    ends.sort_by(f64::total_cmp);
    Some(ends)
}

/// The volumes of the parts, with the values and the lattice that the options require.
fn finished(path: &Path, parts: Parts, options: &LoadOptions) -> Result<Vec<Volume>, Error> {
    let lattice = replaced_lattice(parts.lattice, options)?;
    let volume = |mut voxels: Voxels| {
        if let Some([slope, intercept]) = options.rescale {
            voxels = rescaled(voxels, slope, intercept)?;
        }
        if let NanPolicy::Replace(value) = options.nan {
            voxels.replace_non_finite(value).map_err(Error::Option)?;
        }
        let volume = Volume::new(lattice.dims, voxels, lattice.world_from_index)
            .map_err(|error| at(path, error))?;
        Ok(Volume {
            up_hint: lattice.up_hint,
            space: lattice.space.clone(),
            modality: lattice.modality,
            unit: lattice.unit.clone(),
            window: window_of(&lattice, options),
            ..volume
        })
    };
    parts.voxels.into_iter().map(volume).collect()
}

/// Decoded voxels are almost never smaller than their file.
fn ask_for_plain(path: &Path, gate: &Gate) -> Result<(), Error> {
    // A folder, or a file that is not there: the readers say more about it.
    let bytes =
        std::fs::metadata(path).map_or(0, |file| if file.is_file() { file.len() } else { 0 });
    gate.ask(bytes, "the voxels")
        .map_err(|what| invalid(path, what))
}

/// Integers stay integers where all of their values do.
fn rescaled(voxels: Voxels, slope: f64, intercept: f64) -> Result<Voxels, Error> {
    if !(slope.is_finite() && intercept.is_finite() && slope != 0.0) {
        return Err(Error::Option(format!(
            "invalid rescale: slope {slope}, intercept {intercept} (both must be finite, slope non-zero)"
        )));
    }
    Ok(rescale::Rescale { slope, intercept }.apply(voxels))
}

fn read(
    format: Format,
    path: &Path,
    files: &[PathBuf],
    (options, components): (&LoadOptions, &[usize]),
) -> Result<Parts, Error> {
    refuse_superfluous(format, path, options)?;
    let gate = &options.gate;
    match format {
        Format::Nrrd => nrrd::load(path, components, gate),
        Format::MetaImage => meta_image::load(path, components, gate),
        Format::Nifti => nifti::load(path, options, components),
        Format::Npy => npy::load(path),
        Format::Dicom => dicom::load(files, path, options.series.as_deref(), gate),
        Format::Tiff => tiff_stack::load(files, options, components),
        Format::Vti => vti::load(path, options, components),
        Format::Vtk => vtk::load(path, options, components),
        Format::Mgh => mgh::load(path, options.time, gate),
        Format::Mrc => mrc::load(path, gate),
        Format::Pictures => picture_slices::load(files, path, options, components),
        Format::Zarr => zarr::load(path, options, components),
        Format::Hdf5 | Format::NetCdf => hdf5::load(path, options, components),
        Format::Npz => npz::load(path, options),
        Format::Cube => cube::load(path, options, components),
        Format::Amira => amira::load(path, options, components),
        Format::Gipl => gipl::load(path, gate),
    }
}

/// Options that mean nothing for the format are an error, because whoever typed them expects an effect.
fn refuse_superfluous(format: Format, path: &Path, options: &LoadOptions) -> Result<(), Error> {
    let has_components = matches!(
        format,
        Format::Amira
            | Format::Cube
            | Format::Hdf5
            | Format::NetCdf
            | Format::MetaImage
            | Format::Nifti
            | Format::Nrrd
            | Format::Pictures
            | Format::Tiff
            | Format::Vti
            | Format::Vtk
            | Format::Zarr
    );
    let has_times = matches!(
        format,
        Format::Hdf5 | Format::Mgh | Format::NetCdf | Format::Nifti | Format::Tiff | Format::Zarr
    );
    let has_arrays = matches!(
        format,
        Format::Amira | Format::Hdf5 | Format::NetCdf | Format::Npz | Format::Vti | Format::Vtk
    );
    let has_levels = matches!(format, Format::Hdf5 | Format::Zarr);
    let given = [
        ("component", options.component.is_some() && !has_components),
        (
            "series",
            options.series.is_some() && format != Format::Dicom,
        ),
        ("array", options.array.is_some() && !has_arrays),
        ("level", options.level.is_some() && !has_levels),
        ("time", options.time.is_some() && !has_times),
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
fn undecided(path: &Path, detected: &Detected) -> Error {
    let name = path.display();
    match detected {
        Detected::Known(format, _) => Error::Option(format!(
            "{name}: this is a file of format {} and states its own size and type: leave out the layout of raw files",
            format.name()
        )),
        Detected::NotRead(advice) => Error::Unsupported {
            path: path.to_owned(),
            what: format!("this is {advice}"),
        },
        Detected::Nothing => Error::Option(format!(
            "{name}: no known header (the format is detected by the content): for a raw file give --dims X,Y,Z \
             and --type, such as u8 or i16, and where needed --endian, --skip and --spacing"
        )),
    }
}

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
    zarr::open(path, options).map(Some)
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
    let detected = format::detect(path)?;
    let layout = raw_layout(path, &detected, options);
    let located = match (detected, layout) {
        (Detected::Known(format, _), None) => {
            refuse_superfluous(format, path, options)?;
            match format {
                // A component lies between others.
                Format::Nrrd if options.component.is_none() => nrrd::locate(path, &options.gate)?,
                Format::MetaImage => meta_image::locate(path, &options.gate)?,
                _ => None,
            }
        }
        (Detected::NotRead(_) | Detected::Nothing, Some(raw)) => Some(raw::locate(path, &raw)?),
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
