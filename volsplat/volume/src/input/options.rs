//! Options of reading a volume file.

use glam::{DMat3, DVec3};
use resample_io::Gate;

use crate::Error;
use crate::volume::{Endian, Lattice, NanPolicy, VoxelType};

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

/// How a headerless file is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct RawOptions {
    /// Number of voxels along x, y and z; x is fastest in the file.
    pub dims: [usize; 3],
    /// Type of one scalar.
    pub voxel_type: VoxelType,
    /// Byte order.
    pub endian: Endian,
    /// World distance between voxels along x, y and z, each above 0.
    pub spacing: [f64; 3],
    /// World position of the first voxel.
    pub origin: [f64; 3],
    /// Bytes before the first scalar.
    pub skip_bytes: u64,
}

impl RawOptions {
    /// Little endian, spacing 1, origin 0, nothing skipped.
    ///
    /// ```
    /// use resample_volume::{RawOptions, VoxelType};
    ///
    /// let raw = RawOptions {
    ///     spacing: [1.0, 1.0, 2.5],
    ///     ..RawOptions::new([256, 256, 109], VoxelType::U16)
    /// };
    /// assert_eq!(raw.skip_bytes, 0);
    /// ```
    pub fn new(dims: [usize; 3], voxel_type: VoxelType) -> Self {
        Self {
            dims,
            voxel_type,
            endian: Endian::Little,
            spacing: [1.0; 3],
            origin: [0.0; 3],
            skip_bytes: 0,
        }
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
