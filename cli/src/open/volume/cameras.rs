//! How a volume's views are fitted.

use anyhow::Result;
use glam::DVec3;
use resample_core::Camera;
use volsplat::{RenderOptions, Renderer};

use crate::cameras::framing::fit::{Measure, seen_points};
use crate::cameras::framing::volume::{Small, corners};

/// Makes the cameras, and fits them to the visible part. Small pictures find that part where they are quick. Elsewhere the box of the
/// visible voxels stands for it: a volume in its file would be read once more for each look, and samples of the other orders take long.
pub(crate) fn fitted(
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
    let _same = renderer.update(options)?;
    Ok(cameras)
}
