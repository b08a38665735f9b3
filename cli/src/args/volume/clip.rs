//! Options that clip the volume; see `args.rs`.
//!
//! Takes words, gives plain values. That boxes are boxes and planes not too many is checked by the library.

use clap::Args;
use volsplat::ClipPlane;

use crate::values;

/// The part of the volume that is drawn.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Clipping")]
pub struct ClipArgs {
    /// Draw only the inside of a box along the world's axes, from the first corner to the second
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop: Option<[[f64; 3]; 2]>,
    /// Draw only a box of voxels, from the first to the last, both included
    #[arg(long, value_name = "I0,J0,K0,I1,J1,K1", value_parser = values::corners, allow_hyphen_values = true)]
    pub crop_voxels: Option<[[f64; 3]; 2]>,
    /// Draw only the side of a plane where NX x + NY y + NZ z >= D, in the world; up to six times
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = values::plane, allow_hyphen_values = true)]
    pub clip_plane: Vec<ClipPlane>,
}
