//! Built-in scenes as files and the commands that draw them: volumes, a textured mesh, a picture with depth.
//!
//! A measured command has to be one that a person can type, so a formula becomes files that any command can read: a
//! headerless volume with a colour map, an OBJ with a texture, an EXR with depth.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::Image;
use serde_json::{Value, json};
use volsplat::volume::Voxels;
use volsplat::{Volume, VoxelType, procedural};

use crate::args::{
    ModelArgs, SceneArg, TexmapArgs, TransferArgs, VolsplatArgs, VolumeArgs, Warp3dArgs,
    WarpCameraArgs,
};
use crate::cameras::viewpoint::Viewpoint;
use crate::output;
use crate::output::{Depth, Format};

/// Side of the texture of the mesh, px, and its cells along a side.
const TEXTURE_PX: usize = 512;
const TEXTURE_CELLS: usize = 16;

/// Columns and rows of the ball of the mesh: 2300 triangles.
const BALL_CELLS: [usize; 2] = [48, 24];

/// Size of the picture with depth, px, and its field of view from top to bottom, degrees.
pub(crate) const DEPTH_IMAGE_PX: [usize; 2] = [320, 240];
pub(crate) const DEPTH_IMAGE_FOV_Y_DEG: f64 = 50.0;

/// Rays of a pixel of that picture along its side: it is a photograph, whose pixels are means.
pub(crate) const DEPTH_IMAGE_SAMPLES: usize = 4;

/// Where that picture is shown from.
pub(crate) const NEW_EYE: DVec3 = DVec3::new(0.15, 0.05, 0.2);

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
    output::write_text(&obj, &ball_on_ground(BALL_CELLS))?;
    output::write_picture(
        &picture,
        Format::Png(Depth::Eight),
        &checkerboard(TEXTURE_PX),
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
    let image = ball_before_wall(DVec3::ZERO, DEPTH_IMAGE_SAMPLES);
    output::write_picture(&path, Format::Exr, &image)?;
    let colour = path.display().to_string();
    Ok(Warp3dArgs {
        depth: format!("{colour}#Z"),
        colour,
        output: never_written(folder),
        cameras: WarpCameraArgs {
            from: Some(Viewpoint::Fov(DEPTH_IMAGE_FOV_Y_DEG)),
            to: Some(Viewpoint::Shift(NEW_EYE)),
            ..WarpCameraArgs::default()
        },
        ..Warp3dArgs::default()
    })
}

/// A ground of 20 by 20 units, and a ball of radius 1 that lies on it.
fn ball_on_ground([columns, rows]: [usize; 2]) -> String {
    let mut text = String::from("v -10 -1 -10\nv 10 -1 -10\nv 10 -1 10\nv -10 -1 10\n");
    text += "vt 0 0\nvt 8 0\nvt 8 8\nvt 0 8\nf 1/1 4/4 3/3 2/2\n";
    for row in 0..=rows {
        let (sin, cos) = (std::f64::consts::PI * row as f64 / rows as f64).sin_cos();
        for column in 0..=columns {
            let angle_rad = std::f64::consts::TAU * column as f64 / columns as f64;
            let (x, z) = (sin * angle_rad.cos(), sin * angle_rad.sin());
            let (u, v) = (column as f64 / columns as f64, row as f64 / rows as f64);
            // Writing to a string cannot fail.
            let _ = writeln!(text, "v {x:.6} {cos:.6} {z:.6}\nvt {u:.6} {v:.6}");
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = 5 + row * (columns + 1) + column;
            let (right, below) = (at + 1, at + columns + 1);
            let after = below + 1;
            let _ = writeln!(
                text,
                "f {at}/{at} {right}/{right} {after}/{after} {below}/{below}"
            );
        }
    }
    text
}

fn checkerboard(side: usize) -> Image {
    let cell = side / TEXTURE_CELLS;
    let mut image = Image::transparent(side, side);
    for (index, pixel) in image.rgba.iter_mut().enumerate() {
        let (x, y) = (index % side, index / side);
        let light = if (x / cell + y / cell).is_multiple_of(2) {
            0.8
        } else {
            0.1
        };
        // A slow gradient makes the cells distinct.
        *pixel = [
            light,
            light * x as f32 / side as f32,
            light * y as f32 / side as f32,
            1.0,
        ];
    }
    image
}

/// The scene of [`depth_image`] from another place, each pixel the mean of `samples` by `samples` rays.
///
/// A ball of radius 1 at (0, 0, 4) before the wall z = 6 + 0.3 x, both with a checkerboard; x right, y down, z forward.
pub(crate) fn ball_before_wall(eye: DVec3, samples: usize) -> Image {
    let [width, height] = DEPTH_IMAGE_PX;
    let focal_px = 0.5 * height as f64 / (0.5 * DEPTH_IMAGE_FOV_Y_DEG.to_radians()).tan();
    let mut image = Image::transparent(width, height);
    let mut depth = vec![0.0; width * height];
    for (index, (pixel, depth)) in image.rgba.iter_mut().zip(&mut depth).enumerate() {
        let ray = |sub: [f64; 2]| {
            let x = ((index % width) as f64 + sub[0] - 0.5 * width as f64) / focal_px;
            let y = ((index / width) as f64 + sub[1] - 0.5 * height as f64) / focal_px;
            DVec3::new(x, y, 1.0)
        };
        // The depth of a pixel is that of its centre.
        *depth = seen(eye, ray([0.5; 2])).1 as f32;
        let weight = 1.0 / (samples * samples) as f32;
        for k in 0..samples * samples {
            let sub = [k % samples, k / samples].map(|i| (i as f64 + 0.5) / samples as f64);
            let colour = seen(eye, ray(sub)).0;
            (0..3).for_each(|c| pixel[c] += weight * colour[c]);
        }
        pixel[3] = 1.0;
    }
    image.depth = Some(depth);
    image
}

/// Colour and camera z of what a ray (with z of 1) shows.
fn seen(eye: DVec3, ray: DVec3) -> ([f32; 3], f64) {
    let wall = (6.0 + 0.3 * eye.x - eye.z) / (1.0 - 0.3 * ray.x);
    let to_ball = DVec3::new(0.0, 0.0, 4.0) - eye;
    let (a, b) = (ray.length_squared(), ray.dot(to_ball));
    let under_root = b * b - a * (to_ball.length_squared() - 1.0);
    let (z, scale) = if under_root > 0.0 {
        ((b - under_root.sqrt()) / a, 4.0)
    } else {
        (wall, 1.5)
    };
    let at = eye + z * ray;
    let odd = ((at.x * scale).floor() + (at.y * scale).floor()).rem_euclid(2.0);
    let light = (0.2 + 0.6 * odd) as f32;
    ([light, 0.6 * light, (0.2 + 0.1 * at.z) as f32 * light], z)
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
