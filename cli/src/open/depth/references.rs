//! The references of a warp, and their warper.

use anyhow::Result;
use resample_core::{Camera, Reuse};
use warp3d::{Reference, WarpOptions, Warper};

use crate::cameras::multiview;

/// Samples with a depth.
pub(crate) fn known(references: &[Reference]) -> u64 {
    let known = |r: &Reference| r.depth.iter().filter(|z| !z.is_nan()).count() as u64;
    references.iter().map(known).sum()
}

/// Camera z of the sample that is nearest to the camera that saw it, world units.
pub(crate) fn nearest(references: &[Reference]) -> f64 {
    let nearest = references.iter().map(Reference::nearest);
    f64::from(nearest.fold(f32::INFINITY, f32::min))
}

/// The median depth, camera z, at which `camera` sees the samples of the first reference.
pub(crate) fn median_depth(references: &[Reference], camera: &Camera) -> Option<f64> {
    let first = references.first()?;
    let step = multiview::median_step(&first.camera);
    let samples = first.depth.iter().copied().enumerate().step_by(step);
    multiview::median_depth(&first.camera, samples, camera)
}

/// Warps with these options from now on.
pub(crate) fn update(warper: &mut Warper, options: &WarpOptions) -> Result<()> {
    if warper.update(options)? == Reuse::NeedsRenderer {
        *warper = Warper::new(warper.references(), options)?;
    }
    Ok(())
}
