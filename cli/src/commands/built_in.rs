//! Built-in scenes as files and the commands that draw them: volumes, a textured mesh, a picture with depth.
//!
//! A measured command has to be one that a person can type, so a formula becomes files that any command can read: a
//! headerless volume with a colour map, an OBJ with a texture, an EXR with depth.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use glam::DVec3;
use serde_json::{Value, json};
use volsplat::volume::Voxels;
use volsplat::{Volume, VoxelType, procedural};
use warp3d::input::procedural::{FOV_Y_DEG, NEW_EYE, PHOTOGRAPH_SAMPLES, ball_before_wall};

use crate::args::{
    ModelArgs, SceneArg, TexmapArgs, TransferArgs, VolsplatArgs, VolumeArgs, Warp3dArgs,
    WarpCameraArgs,
};
use crate::cameras::viewpoint::Viewpoint;
use crate::output;
use crate::output::{Depth, Format};

/// Writes a volume and its colour map into `folder`, and gives the command that draws them.
pub(crate) fn volume(scene: SceneArg, folder: &Path) -> Result<VolsplatArgs> {
    let [dark, light] = procedural::CHECKER_VALUES.map(f64::from);
    let (name, volume, map) = match scene {
        SceneArg::CheckerBox => (
            "checker-box",
            procedural::checker_box(100, 10)?,
            map(
                &[(dark, [0.3, 0.4, 0.65]), (light, [0.95, 0.9, 0.85])],
                &[(dark, 0.9), (light, 0.9)],
            ),
        ),
        SceneArg::MarschnerLobb => (
            "marschner-lobb",
            procedural::marschner_lobb(96)?,
            map(
                &[(0.0, [0.1, 0.1, 0.5]), (1.0, [0.9, 0.5, 0.2])],
                &[(0.0, 0.02), (0.5, 0.1), (1.0, 0.9)],
            ),
        ),
        SceneArg::Blobs => (
            "blobs",
            procedural::blobs(96)?,
            map(
                &[(0.0, [0.2, 0.3, 0.8]), (2.2, [1.0, 0.9, 0.6])],
                &[(0.1, 0.0), (1.4, 0.05), (2.4, 0.8)],
            ),
        ),
    };
    let (bytes, kind) = raw(&volume)?;
    let (raw, json) = (
        folder.join(format!("{name}.raw")),
        folder.join(format!("{name}.json")),
    );
    output::write_bytes(&raw, &bytes)?;
    output::write_text(&json, &serde_json::to_string_pretty(&map)?)?;
    Ok(VolsplatArgs {
        input: raw.into(),
        output: never_written(folder),
        volume: VolumeArgs {
            dims: Some(volume.dims),
            voxel_type: Some(kind),
            ..VolumeArgs::default()
        },
        transfer: TransferArgs {
            transfer: Some(json),
            ..TransferArgs::default()
        },
        ..VolsplatArgs::default()
    })
}

/// The words that name a volume of [`volume`].
pub(crate) fn words(args: &VolsplatArgs) -> Vec<String> {
    let dims = args
        .volume
        .dims
        .map(|dims| dims.map(|n| n.to_string()).join(","));
    let kind = args.volume.voxel_type.map(|kind| kind.name().to_owned());
    let map = args
        .transfer
        .transfer
        .as_ref()
        .map(|path| path.display().to_string());
    let mut words = vec![args.input.path.display().to_string()];
    for (name, value) in [("--dims", dims), ("--type", kind), ("--transfer", map)] {
        words.extend(value.into_iter().flat_map(|value| [name.to_owned(), value]));
    }
    words
}

/// A picture that is never written; its name only has to be good.
fn never_written(folder: &Path) -> PathBuf {
    folder.join("picture.exr")
}

/// Writes a ball over a ground, both with a checkerboard, into `folder`, and gives the command that draws them.
pub(crate) fn mesh(folder: &Path) -> Result<TexmapArgs> {
    let obj = folder.join("ball-on-ground.obj");
    let picture = folder.join("fine.png");
    output::write_text(&obj, &texmap::procedural::ball_on_ground())?;
    output::write_picture(
        &picture,
        Format::Png(Depth::Eight),
        &texmap::procedural::checkerboard(),
    )?;
    Ok(TexmapArgs {
        input: obj.into(),
        output: never_written(folder),
        model: ModelArgs {
            texture: Some(picture),
            ..ModelArgs::default()
        },
        ..TexmapArgs::default()
    })
}

/// Writes a picture with depth of a ball before a wall into `folder`, and gives the command that shows it from beside.
pub(crate) fn depth_image(folder: &Path) -> Result<Warp3dArgs> {
    let path = folder.join("ball-before-wall.exr");
    let image = ball_before_wall(DVec3::ZERO, PHOTOGRAPH_SAMPLES);
    output::write_picture(&path, Format::Exr, &image)?;
    let colour = path.display().to_string();
    Ok(Warp3dArgs {
        depth: format!("{colour}#Z"),
        colour,
        output: never_written(folder),
        cameras: WarpCameraArgs {
            from: Some(Viewpoint::Fov(FOV_Y_DEG)),
            to: Some(Viewpoint::Shift(NEW_EYE)),
            ..WarpCameraArgs::default()
        },
        ..Warp3dArgs::default()
    })
}

/// The voxels as a headerless file has them.
fn raw(volume: &Volume) -> Result<(Vec<u8>, VoxelType)> {
    match &volume.voxels {
        Voxels::U8(voxels) => Ok((voxels.to_vec(), VoxelType::U8)),
        Voxels::F32(voxels) => Ok((
            voxels
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
            VoxelType::F32,
        )),
        _ => bail!("--scene: a formula of another type than u8 or f32"),
    }
}

/// A colour map as ParaView writes it, colours in sRGB.
pub(crate) fn map(colours: &[(f64, [f64; 3])], opacities: &[(f64, f64)]) -> Value {
    let rgb: Vec<f64> = colours
        .iter()
        .flat_map(|&(value, [r, g, b])| [value, r, g, b])
        .collect();
    let points: Vec<f64> = opacities
        .iter()
        .flat_map(|&(value, opacity)| [value, opacity, 0.5, 0.0])
        .collect();
    json!([{"Name": "scene", "ColorSpace": "RGB", "RGBPoints": rgb, "Points": points}])
}
