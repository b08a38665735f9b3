//! The cameras of a warp: where pictures are drawn from, and how their views lie.

use std::path::Path;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use resample_core::Camera;
use resample_io::Gate;
use resample_io::film::{Directions, Pair, Spatial};
use warp3d::input::unrolled_camera;
use warp3d::multiview;
use warp3d::multiview::{Hemisphere, Layout, Places};

use crate::args::{LayoutWord, Warp3dArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::viewpoint::Known;
use crate::cameras::{camera_path, viewpoint};
use crate::open::depth::drawer::Converges;
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

/// How views lie in the picture of `target`; `nearest` is the distance of the nearest sample, world units.
pub(crate) fn layout(args: &Warp3dArgs, target: &Camera, nearest: f64) -> Layout {
    let views = &args.views;
    let places = views.layout.and_then(LayoutWord::places);
    match (views.stereo, views.anaglyph, views.quilt, views.layout) {
        (Some(baseline), Some(kind), ..) => Layout::Anaglyph(baseline, kind),
        (Some(baseline), _, _, Some(word)) if word.is_around() => {
            match (args.baseline_around(), word) {
                (Some(_), LayoutWord::Vr180) => Layout::Stereo(baseline, Places::SideBySide),
                (Some(_), _) => Layout::Stereo(baseline, Places::TopBottom),
                (None, _) => {
                    let side_px = args.cameras.size.map(|size| size.width);
                    let half = Hemisphere::new(target, baseline, nearest, side_px);
                    Layout::Hemispheres(baseline, half)
                }
            }
        }
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
    if layout.is_around() && args.views.stereo.is_some() {
        return check_around(args, layout, name);
    }
    match (layout.places(), args.views.stereo) {
        (Some(_), None) => bail!("--layout {name}: it shows two views: give --stereo BASELINE"),
        (None, None) if layout == LayoutWord::Vr180 => {
            bail!("--layout {name}: it shows two views: give --stereo BASELINE")
        }
        (None, Some(_)) => bail!("--layout {name}: it shows one view: leave --stereo out"),
        _ => Ok(()),
    }
}

/// Refuses pairs of half or whole panoramas that cannot be.
fn check_around(args: &Warp3dArgs, layout: LayoutWord, name: &str) -> Result<()> {
    let is_whole = layout == LayoutWord::Equirectangular;
    let (cameras, sequence) = (&args.cameras, &args.sequence);
    if is_whole && args.baseline_around().is_none() {
        bail!(
            "--layout {name}: both eyes see all around in a panorama alone: give --from equirectangular without --to, or --layout vr180"
        );
    }
    if args.views.convergence.is_some() {
        bail!("--convergence: the eyes of --layout {name} look straight ahead: leave it out");
    }
    let has_others =
        !cameras.reference.is_empty() || sequence.path.is_some() || sequence.sway.is_some();
    if args.baseline_around().is_some() && has_others {
        bail!(
            "--layout {name}: both eyes are drawn from one panorama: leave --reference, --path and --sway out"
        );
    }
    if let Some(size) = cameras.size
        && (size.width != size.height * (1 + u32::from(is_whole)))
    {
        let shape = if is_whole {
            "is twice as wide as high"
        } else {
            "is a square"
        };
        bail!(
            "--size {}x{}: a view of --layout {name} {shape}",
            size.width,
            size.height
        );
    }
    Ok(())
}

/// The marks by which players know the views of a film.
pub(crate) fn spatial(args: &Warp3dArgs) -> Spatial {
    let layout = args.views.layout;
    let has_pair = args.views.stereo.is_some() && args.views.anaglyph.is_none();
    let pair = match layout {
        None | Some(LayoutWord::SideBySide | LayoutWord::HalfSideBySide | LayoutWord::Vr180) => {
            Some(Pair::SideBySide)
        }
        Some(LayoutWord::TopBottom | LayoutWord::HalfTopBottom | LayoutWord::Equirectangular) => {
            Some(Pair::TopBottom)
        }
        Some(LayoutWord::CrossEye | LayoutWord::ColourAndDepth) => None,
    };
    Spatial {
        pair: pair.filter(|_| has_pair),
        panorama: match layout {
            Some(LayoutWord::Equirectangular) => Some(Directions::All),
            Some(LayoutWord::Vr180) => Some(Directions::Ahead),
            _ => None,
        },
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
    // The size of a hemisphere is that of its layout.
    let is_half = args.views.layout == Some(LayoutWord::Vr180);
    let size = args.cameras.size.filter(|_| !is_half);
    let Some(to) = &args.cameras.to else {
        return Ok(vec![match args.baseline_around() {
            Some(_) => around(args, from),
            None => viewpoint::sized(*from, size)?,
        }]);
    };
    let known = Known {
        picture: [from.width, from.height],
        size,
        lens: scene::lens(args, [from.width, from.height])?,
    };
    let cameras = viewpoint::several(to, from, &known)?;
    let named = || to.path().unwrap_or(Path::new("--to")).display().to_string();
    cameras
        .iter()
        .map(|camera| camera.for_distance(nearest).with_context(named))
        .collect()
}

/// The camera of both eyes in an unrolled panorama, whose own camera is `from`: all of it, or its half ahead.
fn around(args: &Warp3dArgs, from: &Camera) -> Camera {
    let is_half = args.views.layout == Some(LayoutWord::Vr180);
    let whole = match args.cameras.size {
        None => [from.width, from.height],
        Some(size) if is_half => [2 * size.width, size.height],
        Some(size) => [size.width, size.height],
    };
    let camera = Camera {
        near: from.near,
        ..unrolled_camera(whole)
    };
    match is_half {
        false => camera,
        // Video has even sides.
        true => Camera {
            width: (camera.width / 4 * 2).max(1),
            cx: f64::from((camera.width / 4).max(1)),
            ..camera
        },
    }
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
    let layout = layout(args, target, scene.nearest);
    let is_needed =
        Converges::of(args, &layout) == Converges::AtMedian || args.sequence.sway.is_some();
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
