//! From what was typed for `resample texmap` to the options of the library, and to the record of what was used.

use anyhow::{Result, bail};
use clap::ValueEnum;
use serde_json::{Value, json};
use texmap::input::SceneChoice;
use texmap::{LoadOptions, RenderOptions};

use crate::args::{LayerArg, ModelArgs, TexmapArgs, TexmapRenderArgs};
use crate::choices;
use crate::framing::Stance;
use crate::output::Format;
use crate::plan::{self, Request};

/// How the file is read.
pub(crate) fn load_options(args: &ModelArgs) -> LoadOptions {
    LoadOptions {
        scene: args.scene.clone().map(SceneChoice),
        texture: args.texture.clone(),
    }
}

/// How the mesh is drawn. Only an EXR file has a place for further planes.
pub(crate) fn render_options(args: &TexmapRenderArgs, format: Format) -> Result<RenderOptions> {
    let default = RenderOptions::default();
    let layers: &[LayerArg] = match (&args.layers, format) {
        (None, Format::Exr) => LayerArg::value_variants(),
        (None, Format::Png(_)) => &[],
        (Some(layers), Format::Exr) => layers,
        (Some(_), Format::Png(_)) => {
            bail!("--layers: only a name that ends in .exr has a place for them")
        }
    };
    let options = RenderOptions {
        method: args.method.map_or(default.method, |method| {
            choices::TEXMAP_METHOD.library(method)
        }),
        footprint: args.footprint.map_or(default.footprint, |mode| {
            choices::FLAT_FOOTPRINT.library(mode)
        }),
        shade: args
            .shade
            .map_or(default.shade, |shade| choices::MESH_SHADE.library(shade)),
        light: args.light.unwrap_or(default.light),
        subpixels: args.subpixel.unwrap_or(default.subpixels),
        level: args
            .level
            .map_or(default.level, |level| choices::LEVEL.library(level)),
        max_texels: args.max_texels.unwrap_or(default.max_texels),
        planes: layers
            .iter()
            .map(|&layer| choices::LAYER.library(layer))
            .collect(),
        simd: default.simd,
    };
    options.validate()?;
    Ok(options)
}

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &TexmapArgs,
    request: &Request,
    options: &RenderOptions,
    (format, stance): (Format, Stance),
) -> Value {
    let camera = match &args.model.camera_name {
        Some(name) => json!({ "name": name }),
        None => plan::camera_record(request, stance),
    };
    json!({
        "model": { "file": args.input, "scene": args.model.scene, "texture": args.model.texture },
        "camera": camera,
        "render": {
            "method": choices::TEXMAP_METHOD.name(options.method),
            "footprint": choices::FLAT_FOOTPRINT.name(options.footprint),
            "shade": choices::MESH_SHADE.name(options.shade),
            "light": options.light.to_array(),
            "subpixel": options.subpixels,
            "level": choices::LEVEL.name(options.level),
            "max_texels": options.max_texels,
            "layers": options.planes.iter().map(|&plane| choices::LAYER.name(plane)).collect::<Vec<_>>(),
            "simd": format!("{:?}", options.simd).to_lowercase(),
        },
        "picture": plan::picture_record(request, format),
    })
}
