//! Built-in scenes as files: a volume and its transfer function, written beside the report.
//!
//! A measured command has to be one that a person can type, so a formula becomes a headerless volume and a colour map.

use std::path::Path;

use anyhow::{Result, bail};
use serde_json::{Value, json};
use volsplat::volume::Voxels;
use volsplat::{Volume, procedural};

use crate::args::SceneArg;
use crate::output;

/// Writes the scene into `folder`, and gives the words of the command with it.
pub(super) fn written(scene: SceneArg, folder: &Path, words: &[String]) -> Result<Vec<String>> {
    let Some((first, rest)) = words.split_first().filter(|(first, _)| *first == "volsplat") else {
        bail!("--scene: the built-in scenes are volumes, expected volsplat");
    };
    let [dark, light] = procedural::CHECKER_VALUES.map(f64::from);
    let (name, volume, map) = match scene {
        SceneArg::CheckerBox => (
            "checker-box",
            procedural::checker_box(100, 10)?,
            map(&[(dark, [0.3, 0.4, 0.65]), (light, [0.95, 0.9, 0.85])], &[(dark, 0.9), (light, 0.9)]),
        ),
        SceneArg::MarschnerLobb => (
            "marschner-lobb",
            procedural::marschner_lobb(96)?,
            map(&[(0.0, [0.1, 0.1, 0.5]), (1.0, [0.9, 0.5, 0.2])], &[(0.0, 0.02), (0.5, 0.1), (1.0, 0.9)]),
        ),
        SceneArg::Blobs => (
            "blobs",
            procedural::blobs(96)?,
            map(&[(0.0, [0.2, 0.3, 0.8]), (2.2, [1.0, 0.9, 0.6])], &[(0.1, 0.0), (1.4, 0.05), (2.4, 0.8)]),
        ),
    };
    let (bytes, kind) = raw(&volume)?;
    let (raw, json) = (folder.join(format!("{name}.raw")), folder.join(format!("{name}.json")));
    output::write_bytes(&raw, &bytes)?;
    output::write_text(&json, &serde_json::to_string_pretty(&map)?)?;
    let dims = volume.dims.map(|n| n.to_string()).join(",");
    let (raw, json) = (raw.display().to_string(), json.display().to_string());
    let added = [first.as_str(), &raw, "--dims", &dims, "--type", kind, "--transfer", &json];
    Ok(added.iter().map(|&word| word.to_owned()).chain(rest.iter().cloned()).collect())
}

/// The voxels as a headerless file has them.
fn raw(volume: &Volume) -> Result<(Vec<u8>, &'static str)> {
    match &volume.voxels {
        Voxels::U8(voxels) => Ok((voxels.to_vec(), "u8")),
        Voxels::F32(voxels) => Ok((voxels.iter().flat_map(|value| value.to_le_bytes()).collect(), "f32")),
        _ => bail!("--scene: a formula of another type than u8 or f32"),
    }
}

/// A colour map as ParaView writes it, colours in sRGB.
fn map(colours: &[(f64, [f64; 3])], opacities: &[(f64, f64)]) -> Value {
    let rgb: Vec<f64> = colours.iter().flat_map(|&(value, [r, g, b])| [value, r, g, b]).collect();
    let points: Vec<f64> =
        opacities.iter().flat_map(|&(value, opacity)| [value, opacity, 0.5, 0.0]).collect();
    json!([{"Name": "scene", "ColorSpace": "RGB", "RGBPoints": rgb, "Points": points}])
}
