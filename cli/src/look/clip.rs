//! From the typed options of clipping to the library's clip.

use glam::DVec3;
use volsplat::Clip;

use crate::args::ClipArgs;

/// The clip of the volume.
pub(crate) fn clip(args: &ClipArgs) -> Clip {
    let corners = |typed: Option<[[f64; 3]; 2]>| typed.map(|ends| ends.map(DVec3::from));
    Clip {
        crop_in_world: corners(args.crop),
        crop_in_grid: corners(args.crop_voxels),
        planes: args.clip_plane.clone(),
    }
}
