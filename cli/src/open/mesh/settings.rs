//! From the typed options of `resample texmap` to those of the library, and to their record in the stats file.

use anyhow::{Result, bail};
use resample_io::Gate;
use serde_json::{Value, json};
use texmap::input::{LightMaps, SceneChoice, Unreadable};
use texmap::{LoadOptions, PlaneKind, Pose, RenderOptions, Shade, Textures};

use crate::args::{ModelArgs, SequenceArgs, TexmapArgs};
use crate::cameras::framing::Stance;
use crate::output::Format;
use crate::plan::Request;
use crate::process::report;
use crate::{output, plan};

/// How the file is read for picture `number`.
pub(crate) fn load_options(args: &TexmapArgs, number: usize, gate: &Gate) -> LoadOptions {
    // FILE#NAME, or FILE#scene=NAME as parts of other files are written.
    let part = args.input.part.as_deref();
    let scene = part.map(|part| part.strip_prefix("scene=").unwrap_or(part));
    LoadOptions {
        scene: scene.map(|scene| SceneChoice(scene.to_owned())),
        pose: pose(&args.model, &args.sequence, number),
        environment: args.model.environment.clone(),
        light_maps: match args.render.options.shade {
            Shade::Auto | Shade::Pbr => LightMaps::Read,
            Shade::Unlit | Shade::Headlight | Shade::Lambert => LightMaps::LeftOut,
        },
        unreadable: match args.model.textures {
            Textures::Shown | Textures::Grid => Unreadable::Refused,
            Textures::LeftOut => Unreadable::Noted,
        },
        texture: args.model.texture.clone(),
        gate: gate.clone(),
    }
}

/// The moment of the animation that picture `number` shows.
fn pose(model: &ModelArgs, sequence: &SequenceArgs, number: usize) -> Option<Pose> {
    let is_posed = model.pose_time.is_some() || model.play || model.animation.is_some();
    let played_s = if model.play {
        number as f64 / f64::from(sequence.fps.unwrap_or(output::DEFAULT_FPS))
    } else {
        0.0
    };
    is_posed.then(|| Pose {
        time_s: model.pose_time.unwrap_or(0.0) + played_s,
        animation: model.animation.clone(),
    })
}

/// How the mesh is drawn. Only an EXR file has a place for further planes.
pub(crate) fn render_options(args: &RenderOptions, format: Format) -> Result<RenderOptions> {
    let planes = match format {
        Format::Exr if args.planes.is_empty() => PlaneKind::ALL.to_vec(),
        Format::Png(_) | Format::Jpeg if !args.planes.is_empty() => {
            bail!("--layers: only a name that ends in .exr has a place for them")
        }
        _ => args.planes.clone(),
    };
    let options = RenderOptions {
        planes,
        ..args.clone()
    };
    options.validate()?;
    Ok(options)
}

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &TexmapArgs,
    request: &Request,
    options: &RenderOptions,
    format: Format,
    stance: Stance,
) -> Value {
    let camera = match &args.model.camera_name {
        Some(name) => json!({ "name": name }),
        None => plan::camera_record(request, stance),
    };
    json!({
        "model": { "file": report::name(&args.input.path), "scene": args.input.part,
            "texture": args.model.texture.as_deref().map(report::name),
            "environment": args.model.environment.as_deref().map(report::name),
            "pose_time_s": args.model.pose_time, "animation": args.model.animation, "play": args.model.play,
            "textures": args.model.textures },
        "camera": camera,
        "render": options,
        "picture": plan::picture_record(request, format),
    })
}
