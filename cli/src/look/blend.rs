//! From the typed options of blending to the library's choices.

use anyhow::{Result, bail};
use volsplat::{Blend, Isosurface, Layer};

use crate::args::{BlendArgs, RayBlend};
use crate::output::Format;
use crate::values::word;

/// The planes that were asked for. Only an EXR file has a place for them.
pub(crate) fn layers(args: &BlendArgs, format: Format) -> Result<Vec<Layer>> {
    let Some(layers) = &args.layers else {
        return Ok(Vec::new());
    };
    if format != Format::Exr {
        bail!("--layers: only a name that ends in .exr has a place for them");
    }
    let repeated = |&(index, layer): &(usize, &Layer)| layers[..index].contains(layer);
    if let Some((_, layer)) = layers.iter().enumerate().find(repeated) {
        bail!("--layers: {} is named twice", word(*layer));
    }
    Ok(layers.clone())
}

/// The value of its ray that a pixel shows.
pub(crate) fn blend(args: &BlendArgs) -> Result<Blend> {
    let surface = |value: f64| {
        Blend::Isosurface(Isosurface {
            value,
            colour: args.iso_colour,
            opacity: args.iso_opacity.unwrap_or(1.0),
        })
    };
    Ok(match (args.blend, args.iso) {
        (None | Some(RayBlend::Isosurface), Some(value)) => surface(value),
        (Some(RayBlend::Isosurface), None) => {
            bail!("--blend isosurface needs --iso VALUE: which surface?")
        }
        (Some(other), Some(_)) => {
            bail!("--iso cannot be combined with --blend {}", word(other))
        }
        (None | Some(RayBlend::Emission), None) => Blend::Emission,
        (Some(RayBlend::Maximum), None) => Blend::Maximum,
        (Some(RayBlend::Minimum), None) => Blend::Minimum,
        (Some(RayBlend::Average), None) => Blend::Average,
    })
}
