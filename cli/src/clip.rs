//! From what was typed about clipping to the library's clip, and to its part of the stats file's settings.

use glam::DVec3;
use serde_json::{Value, json};
use volsplat::Clip;

use crate::args::ClipArgs;

/// What is kept of the volume.
pub(crate) fn clip(args: &ClipArgs) -> Clip {
    let corners = |typed: Option<[[f64; 3]; 2]>| typed.map(|ends| ends.map(DVec3::from));
    Clip {
        crop_in_world: corners(args.crop),
        crop_in_grid: corners(args.crop_voxels),
        planes: args.clip_plane.clone(),
    }
}

/// The clip's part of the settings in the stats file.
pub(crate) fn record(clip: &Clip) -> Value {
    let corners = |ends: Option<[DVec3; 2]>| ends.map(|ends| ends.map(|corner| corner.to_array()));
    let plane = |plane: &volsplat::ClipPlane| {
        [plane.normal.x, plane.normal.y, plane.normal.z, plane.offset]
    };
    json!({
        "crop": corners(clip.crop_in_world),
        "crop_voxels": corners(clip.crop_in_grid),
        "clip_planes": clip.planes.iter().map(plane).collect::<Vec<_>>(),
    })
}
