//! From what was typed about blending to the library's choices, and to their part of the stats file's settings.

use anyhow::{Result, bail};
use serde_json::{Value, json};
use volsplat::{Blend, Isosurface, Layer};

use crate::args::{BlendArgs, RayBlendArg};
use crate::choices;
use crate::output::Format;

/// The planes that were asked for. Only an EXR file has a place for them.
pub(crate) fn layers(args: &BlendArgs, format: Format) -> Result<Vec<Layer>> {
    let Some(layers) = &args.layers else {
        return Ok(Vec::new());
    };
    if format != Format::Exr {
        bail!("--layers: only a name that ends in .exr has a place for them");
    }
    if let Some(twice) = layers
        .iter()
        .enumerate()
        .find(|(i, layer)| layers[..*i].contains(layer))
    {
        bail!(
            "--layers: {} is named twice",
            choices::VOLUME_LAYER.name(choices::VOLUME_LAYER.library(*twice.1))
        );
    }
    Ok(layers
        .iter()
        .map(|&layer| choices::VOLUME_LAYER.library(layer))
        .collect())
}

/// What a pixel shows of its ray.
pub(crate) fn blend(args: &BlendArgs) -> Result<Blend> {
    let surface = |value: f64| {
        Blend::Isosurface(Isosurface {
            value,
            colour: args.iso_colour,
            opacity: args.iso_opacity.unwrap_or(1.0),
        })
    };
    Ok(match (args.blend, args.iso) {
        (None | Some(RayBlendArg::Isosurface), Some(value)) => surface(value),
        (Some(RayBlendArg::Isosurface), None) => {
            bail!("--blend isosurface needs --iso VALUE: which surface?")
        }
        (Some(_), Some(_)) => bail!("--iso goes with --blend isosurface: leave out one of them"),
        (None | Some(RayBlendArg::Emission), None) => Blend::Emission,
        (Some(RayBlendArg::Maximum), None) => Blend::Maximum,
        (Some(RayBlendArg::Minimum), None) => Blend::Minimum,
        (Some(RayBlendArg::Average), None) => Blend::Average,
    })
}

/// Blending's part of the settings in the stats file.
pub(crate) fn record(blend: Blend) -> Value {
    match blend {
        Blend::Emission => json!("emission"),
        Blend::Maximum => json!("maximum"),
        Blend::Minimum => json!("minimum"),
        Blend::Average => json!("average"),
        Blend::Isosurface(iso) => json!({
            "iso": iso.value,
            "iso_colour_linear": iso.colour,
            "iso_opacity": iso.opacity,
        }),
    }
}
