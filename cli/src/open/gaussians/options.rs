//! From the typed options of Gaussians to those of the library.

use anyhow::Result;
use glam::DVec3;
use volsplat::{Clip, DepthPlane, GaussianOptions};

use crate::args::{GaussianClipArgs, GaussianRenderArgs};
use crate::output;
use crate::output::Format;

/// How Gaussians are drawn. Only an EXR file has a place for depth and further planes.
pub(super) fn render_options(args: &GaussianRenderArgs, format: Format) -> Result<GaussianOptions> {
    let options = GaussianOptions {
        model: args.model,
        slab_error: args.slab_error,
        samples: args.samples,
        clip: clip(&args.clip),
        min_transmittance: args.min_transmittance,
        depth: match format {
            Format::Exr => DepthPlane::Expected,
            Format::Png(_) | Format::Jpeg(_) => DepthPlane::None,
        },
        layers: output::layers(format, args.layers.as_ref())?,
        simd: args.vector_level,
    };
    options.validate()?;
    Ok(options)
}

/// The part that is kept.
pub(super) fn clip(args: &GaussianClipArgs) -> Clip {
    Clip {
        crop_in_world: args.crop.map(|ends| ends.map(DVec3::from)),
        crop_in_grid: None,
        planes: args.clip_plane.clone(),
    }
}
