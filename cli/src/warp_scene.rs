//! The references of a warp: pictures, depths and cameras read and put together.
//!
//! Takes what was typed, gives the views that the warp starts from, the camera of the first and the box around all
//! their samples.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use glam::{DVec2, DVec3};
use warp3d::Reference;
use warp3d::input::cameras::{Lens, Pair};
use warp3d::input::{self, DepthMeaning, Part, colour, depth};

use crate::args::{DepthArgs, Warp3dArgs};
use crate::camera_file::FileCamera;
use crate::choices::warp;
use crate::viewpoint::{self, Known, Viewpoint};

/// What is warped.
pub(crate) struct WarpScene {
    /// The references, the picture of the command line first.
    pub references: Vec<Reference>,
    /// The camera of the first.
    pub from: FileCamera,
    /// Two corners of the box around all samples, world units.
    pub bounds: [DVec3; 2],
}

/// One picture as it was typed.
struct Typed<'a> {
    colour: &'a str,
    depth: &'a str,
    camera: Option<Viewpoint>,
}

/// Reads all that is named.
pub(crate) fn read(args: &Warp3dArgs) -> Result<WarpScene> {
    let first = Typed { colour: &args.colour, depth: &args.depth, camera: args.cameras.from.clone() };
    let (from, first) = one(&first, args)?;
    let mut references = vec![first];
    for typed in further(args) {
        references.push(one(&typed?, args)?.1);
    }
    let bounds = bounds(&references);
    for reference in &mut references {
        // The near plane of a reference cuts nothing: its samples are where they are.
        reference.camera.near = reference.camera.near.min(1e-4 * (bounds[1] - bounds[0]).length().max(1e-30));
    }
    Ok(WarpScene { references, from, bounds })
}

/// The sizes of all pictures, px, from their headers alone.
pub(crate) fn sizes(args: &Warp3dArgs) -> Result<Vec<[u32; 2]>> {
    let mut sizes = vec![colour::size(&Part::from_text(&args.colour))?];
    for typed in further(args) {
        sizes.push(colour::size(&Part::from_text(typed?.colour))?);
    }
    Ok(sizes)
}

/// The files that are read, for the check that none is written over.
pub(crate) fn files(args: &Warp3dArgs) -> Vec<std::path::PathBuf> {
    let pictures = [&args.colour, &args.depth]
        .into_iter()
        .chain(args.cameras.reference.chunks(3).flat_map(|words| words.iter().take(2)));
    let of_camera = |word: &Option<Viewpoint>| word.as_ref().and_then(Viewpoint::path).map(Path::to_owned);
    let cameras = [of_camera(&args.cameras.from), of_camera(&args.cameras.to)].into_iter().flatten();
    pictures.map(|text| Part::from_text(text).path).chain(cameras).collect()
}

/// The lens that was typed.
pub(crate) fn lens(args: &Warp3dArgs) -> Option<Lens> {
    let [fx, fy, cx, cy] = args.cameras.intrinsics?;
    Some(Lens { fx, fy, cx, cy, pixel_centre: args.cameras.pixel_centre.library() })
}

fn further(args: &Warp3dArgs) -> impl Iterator<Item = Result<Typed<'_>>> {
    args.cameras.reference.chunks(3).map(|words| {
        let [colour, depth, camera] = words else { anyhow::bail!("--reference needs COLOUR DEPTH CAM") };
        let camera = viewpoint::parse(camera).map_err(|what| anyhow!("--reference: '{camera}': {what}"))?;
        Ok(Typed { colour, depth, camera: Some(camera) })
    })
}

fn one(typed: &Typed, args: &Warp3dArgs) -> Result<(FileCamera, Reference)> {
    let picture = colour::read(&Part::from_text(typed.colour))?;
    let size = [u32::try_from(picture.width)?, u32::try_from(picture.height)?];
    let lens = lens(args);
    let known = Known { picture: size, size: None, lens };
    let (from, pair) = match (&typed.camera, &lens) {
        (Some(camera), _) => viewpoint::only_one(camera, &known)?,
        (None, Some(lens)) => (viewpoint::at_origin(lens, size)?, None),
        (None, None) => anyhow::bail!(
            "{}: its camera is missing: give --from CAM (a file, or fov:DEGREES), or --intrinsics",
            typed.colour
        ),
    };
    let part = Part::from_text(typed.depth);
    let stored = depth::read(&part)?;
    let meaning = meaning(&args.meaning, pair.as_ref());
    let reference = input::reference(picture, &stored, from.with_any_near(), &meaning, &part.path);
    Ok((from, reference.with_context(|| typed.colour.to_owned())?))
}

/// What the numbers of a depth file mean.
fn meaning(args: &DepthArgs, pair: Option<&Pair>) -> DepthMeaning {
    DepthMeaning {
        kind: warp::DEPTH_KIND.library(args.depth_kind),
        scale: args.depth_scale,
        invalid: args.invalid,
        baseline: args.baseline.or(pair.map(|pair| pair.baseline)),
        doffs: args.doffs.or(pair.map(|pair| pair.doffs)).unwrap_or(0.0),
        near_far: args.near.zip(args.far).map(|(near, far)| [near, far]),
    }
}

/// Two corners of the box around all samples that have a depth.
fn bounds(references: &[Reference]) -> [DVec3; 2] {
    let mut corners = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for reference in references {
        let width = reference.camera.width as usize;
        let world_from_camera = reference.camera.camera_from_world.inverse();
        for (index, &z) in reference.depth.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let pos_in_screen = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
            let (origin, direction) = reference.camera.ray_in_camera(pos_in_screen);
            let pos_in_world = world_from_camera.transform_point3(origin + f64::from(z) * direction);
            corners = [corners[0].min(pos_in_world), corners[1].max(pos_in_world)];
        }
    }
    corners
}
