//! How a volume file is read, as it is typed.

use clap::Args;
use volsplat::{Endian, VoxelType};

use crate::args::ReadingArgs;
use crate::values;

/// How the volume file is read.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Volume")]
pub struct VolumeArgs {
    /// Number of voxels along x, y and z (raw files)
    #[arg(long, value_name = "X,Y,Z", value_parser = values::dims, requires = "voxel_type")]
    pub dims: Option<[usize; 3]>,
    /// Type of a voxel: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64 (raw files)
    #[arg(long = "type", value_name = "TYPE", requires = "dims")]
    pub voxel_type: Option<VoxelType>,
    /// Byte order: little (default) or big (raw files)
    #[arg(long, value_name = "ORDER", requires = "dims")]
    pub endian: Option<Endian>,
    /// Bytes before the first voxel, 0 if not given (raw files)
    #[arg(long, value_name = "BYTES", requires = "dims")]
    pub skip: Option<u64>,
    /// Distance between voxels along x, y and z in world units, instead of the file's own [default: 1,1,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector)]
    pub spacing: Option<[f64; 3]>,
    /// World position of the centre of the first voxel, instead of the file's own [default: 0,0,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// Value that stands for NaN; without it, a volume that holds NaN is an error
    #[arg(long, value_name = "V", value_parser = values::number, allow_hyphen_values = true)]
    pub nan_as: Option<f64>,
    /// Multiply every value by SCALE and add OFFSET, such as 1,-1024 for a raw CT
    #[arg(long, value_name = "SCALE,OFFSET", value_parser = values::pair, allow_hyphen_values = true)]
    pub rescale_values: Option<[f64; 2]>,
    /// Rules of reading.
    #[command(flatten)]
    pub reading: ReadingArgs,
}
