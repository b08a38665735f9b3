//! How a volume's views are fitted, and why nothing may be seen of it.

use anyhow::Result;
use glam::DVec3;
use resample_core::Camera;
use volsplat::{Described, RenderOptions, Renderer};

use crate::args::VolsplatArgs;
use crate::framing::fit::{Measure, seen_points};
use crate::framing::volume::{Small, corners, grid_bounds};

/// Calls for cameras with a measure of what they see. Small pictures measure, where they are quick; else it is the box of what
/// is visible: a volume in its file would be read once more for each look, and samples of the other orders take long.
pub(super) fn fitted(
    renderer: &mut Renderer,
    options: &RenderOptions,
    bounds: [DVec3; 2],
    cameras: &mut dyn FnMut(&mut Measure) -> Result<Vec<Camera>>,
) -> Result<Vec<Camera>> {
    if options.field().is_none() || renderer.reads_file() {
        let corners = corners(bounds);
        return cameras(&mut |camera| Ok(seen_points(camera, corners.iter().copied())));
    }
    let small = Small::new(options);
    let cameras = cameras(&mut |camera| small.seen(renderer, camera))?;
    let _same = renderer.set_options(options)?;
    Ok(cameras)
}

/// Why nothing of a volume is seen.
pub(super) fn why_nothing(args: &VolsplatArgs, volume: &dyn Described) -> String {
    let name = args.input.path.display();
    let options = &args.render.options;
    let (low, high) = volume.value_range();
    if let Some(iso) = options.blend.iso.filter(|iso| !(low..=high).contains(iso)) {
        return format!("--iso {iso} is outside the values of {name}, which are {low} to {high}");
    }
    let clip = &options.clip;
    if clip.crop.is_some() || clip.crop_voxels.is_some() || !clip.clip_plane.is_empty() {
        let [from, to] = grid_bounds(volume).map(|corner| {
            let [x, y, z] = corner.to_array();
            format!("{x},{y},{z}")
        });
        return format!(
            "--crop, --crop-voxels or --clip-plane keeps nothing of {name} that can be seen: it reaches from {from} to {to}"
        );
    }
    format!(
        "the transfer function makes every voxel of {name} transparent: its values are {low} to {high}"
    )
}
