//! The cameras of a warp: where pictures are drawn from, and how their views lie.

use std::path::Path;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use resample_core::Camera;
use resample_io::Gate;
use warp3d::multiview;
use warp3d::multiview::{Layout, Places};

use crate::args::{LayoutWord, Warp3dArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::viewpoint::Known;
use crate::cameras::{camera_path, viewpoint};
use crate::open::depth::frames::Frames;
use crate::open::depth::scene;
use crate::open::depth::scene::WarpScene;
use crate::output;
use crate::values::{Size, Sway};
use resample_io::camera_file::CameraDefaults;

/// One camera for each frame of a sequence, the first frame's as [`targets`] has it.
pub(crate) fn of_frames(
    args: &Warp3dArgs,
    frames: &Frames,
    first: Camera,
    nearest: f64,
) -> Result<Vec<Camera>> {
    let mut cameras = vec![first];
    for index in 1..frames.len() {
        let words = frames.words(args, index)?;
        let from = scene::camera(&words)?.for_distance(nearest)?;
        let mut of_frame = to_cameras(&words, &from, nearest)?;
        cameras.push(of_frame.remove(0));
    }
    Ok(cameras)
}

/// How views lie in the picture; `nearest` is the distance of the nearest sample, world units.
pub(crate) fn layout(args: &Warp3dArgs, nearest: f64) -> Layout {
    let views = &args.views;
    let places = views.layout.and_then(LayoutWord::places);
    match (views.stereo, views.anaglyph, views.quilt, views.layout) {
        (Some(baseline), Some(kind), ..) => Layout::Anaglyph(baseline, kind),
        (Some(baseline), ..) => Layout::Stereo(baseline, places.unwrap_or(Places::SideBySide)),
        (None, _, Some(grid), _) => Layout::Quilt(grid, views.view_cone),
        (None, _, None, Some(LayoutWord::ColourAndDepth)) => Layout::ColourAndDepth(nearest),
        (None, _, None, Some(LayoutWord::Equirectangular)) => {
            Layout::Equirectangular(args.cameras.size.map(|size| [size.width, size.height]))
        }
        (None, _, None, _) => Layout::Single,
    }
}

/// Refuses layouts of a pair without one, and pairs in a layout of one view.
pub(crate) fn check_layout(args: &Warp3dArgs) -> Result<()> {
    let Some(layout) = args.views.layout else {
        return Ok(());
    };
    let name = layout.to_possible_value();
    let name = name.as_ref().map_or("", |name| name.get_name());
    match (layout.places(), args.views.stereo) {
        (Some(_), None) => bail!("--layout {name}: it shows two views: give --stereo BASELINE"),
        (None, Some(_)) if layout == LayoutWord::Equirectangular => bail!(
            "--layout {name}: it shows one eye's view: leave --stereo out (eyes side by side see depth ahead alone; a \
             picture for each of them is drawn with --to shift:X,0,0)"
        ),
        (None, Some(_)) => bail!("--layout {name}: it shows one view: leave --stereo out"),
        _ => Ok(()),
    }
}

/// The cameras to draw from, before they become sheets or sway.
pub(crate) fn targets(args: &Warp3dArgs, scene: &WarpScene) -> Result<Vec<Camera>> {
    let from = scene.from.for_distance(scene.nearest)?;
    if let Some(path) = &args.sequence.path {
        return keyed(path, args, &from, scene);
    }
    to_cameras(args, &from, scene.nearest)
}

/// The cameras of the words' new camera; `nearest` is the distance of the nearest sample, world units.
fn to_cameras(args: &Warp3dArgs, from: &Camera, nearest: f64) -> Result<Vec<Camera>> {
    let Some(to) = &args.cameras.to else {
        return Ok(vec![viewpoint::sized(*from, args.cameras.size)?]);
    };
    let known = Known {
        picture: [from.width, from.height],
        size: args.cameras.size,
        lens: scene::lens(args, [from.width, from.height])?,
    };
    let cameras = viewpoint::several(to, from, &known)?;
    let named = || to.path().unwrap_or(Path::new("--to")).display().to_string();
    cameras
        .iter()
        .map(|camera| camera.for_distance(nearest).with_context(named))
        .collect()
}

/// The cameras of a path of keys.
fn keyed(path: &Path, args: &Warp3dArgs, from: &Camera, scene: &WarpScene) -> Result<Vec<Camera>> {
    let look_at_size = Size {
        width: from.width,
        height: from.height,
    };
    let defaults = CameraDefaults {
        size: args.cameras.size,
        look_at_size,
        fov_y_deg: viewpoint::DEFAULT_FOV_Y_DEG,
    };
    let keys = camera_path::read(path, &defaults, KeyKind::Cameras, &Gate::default())?;
    let pictures = keys.pictures(f64::from(args.sequence.fps.unwrap_or(output::DEFAULT_FPS)))?;
    keys.cameras(&pictures, |camera| camera.for_distance(scene.nearest))
        .with_context(|| path.display().to_string())
}

/// Distance at which views agree and about which cameras sway.
pub(crate) fn convergence(args: &Warp3dArgs, scene: &WarpScene, target: &Camera) -> Result<f64> {
    let is_needed = layout(args, scene.nearest).needs_convergence() || args.sequence.sway.is_some();
    let Some(typed) = args.views.convergence else {
        if !is_needed {
            return Ok(f64::INFINITY);
        }
        let seen = scene::seen_depths(&scene.references, target);
        return seen
            .map(|seen| seen.median)
            .context("nothing lies before the new camera: give --convergence");
    };
    let needs_finite = args.views.quilt.is_some() || args.sequence.sway.is_some();
    if needs_finite && typed.is_infinite() {
        bail!("--convergence inf: --quilt and --sway need a distance");
    }
    Ok(typed)
}

pub(crate) fn cameras(
    args: &Warp3dArgs,
    layout: &Layout,
    targets: &[Camera],
    convergence: f64,
) -> Result<Vec<Camera>> {
    let swaying = match args.sequence.sway {
        None => targets.to_vec(),
        Some(_) if targets.len() > 1 => bail!("--sway goes around one camera: name it behind a #"),
        Some(Sway {
            angle_deg,
            pictures,
        }) => multiview::sway(&targets[0], convergence, angle_deg, pictures)?,
    };
    swaying
        .iter()
        .map(|camera| Ok(layout.sheet(camera).validated()?))
        .collect()
}
