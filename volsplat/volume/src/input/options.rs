//! Options of reading a volume file, and those that are refused.

use std::path::Path;

use glam::{DMat3, DVec3};
use resample_io::Gate;

use super::format::{Detected, Format};
use crate::Error;
use crate::input::formats::raw::RawOptions;
use crate::volume::{Lattice, NanPolicy};

/// Options of reading a volume file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// How a file without a header is laid out; must be absent for a file with one.
    pub raw: Option<RawOptions>,
    /// World distance between voxels along x, y and z, each above 0, instead of what the file says. Directions stay.
    pub spacing: Option<[f64; 3]>,
    /// World position of the first voxel, instead of what the file says.
    pub origin: Option<[f64; 3]>,
    /// The treatment of voxels that are NaN or infinite.
    pub nan: NanPolicy,
    /// SeriesInstanceUID of the series that is read; needed where a folder of DICOM files holds several.
    pub series: Option<String>,
    /// Name of the array that is read; needed where the file holds several and calls none of them its scalars.
    pub array: Option<String>,
    /// The component of each voxel, or channel of an image, to read, counted from 0; needed where there are several.
    pub component: Option<usize>,
    /// The level to read of an image with several resolutions; `None` is 0, the finest.
    pub level: Option<usize>,
    /// The point in time to read, counted from 0; needed where there are several.
    pub time: Option<usize>,
    /// The factor of every value, and the offset added to it; for raw files that hold no Hounsfield units yet.
    pub rescale: Option<[f64; 2]>,
    /// Rules for names inside files, and the memory the voxels may take.
    pub gate: Gate,
}

/// Options that mean nothing for the format are an error, because whoever typed them expects an effect.
pub(crate) fn refuse_superfluous(
    format: Format,
    path: &Path,
    options: &LoadOptions,
) -> Result<(), Error> {
    let has_components = matches!(
        format,
        Format::MetaImage
            | Format::Nifti
            | Format::Nrrd
            | Format::Pictures
            | Format::Tiff
            | Format::Vti
            | Format::Vtk
            | Format::Zarr
    );
    let has_times = matches!(format, Format::Mgh | Format::Nifti | Format::Zarr);
    let has_arrays = matches!(format, Format::Vti | Format::Vtk);
    let given = [
        ("component", options.component.is_some() && !has_components),
        (
            "series",
            options.series.is_some() && format != Format::Dicom,
        ),
        ("array", options.array.is_some() && !has_arrays),
        ("level", options.level.is_some() && format != Format::Zarr),
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
pub(crate) fn undecided(path: &Path, detected: &Detected) -> Error {
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
            "{name}: no known header (the format is detected by the content): for a headerless file say its dimensions \
             and its type, and where needed the byte order, the bytes to skip and the spacing"
        )),
    }
}

/// A lattice with the spacing and the origin of the options.
pub(crate) fn replaced_lattice(
    mut lattice: Lattice,
    options: &LoadOptions,
) -> Result<Lattice, Error> {
    let map = &mut lattice.world_from_index;
    if let Some(spacing) = options.spacing {
        if !spacing
            .iter()
            .all(|&length| length > 0.0 && length.is_finite())
        {
            return Err(Error::Option(format!(
                "the spacing is {spacing:?}: each must be finite and above 0"
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
    Ok(lattice)
}
