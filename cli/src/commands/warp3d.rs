//! `resample warp3d`: a picture with depth, seen from elsewhere.
//!
//! The steps are those of [`Open`]: what can be refused without reading a picture is checked first, then the references
//! are read, then the cameras are placed, and only then is anything written.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use resample_core::Camera;
use serde_json::{Value, json};
use warp3d::{Fill, WarpArgs, WarpOptions};

use clap::ValueEnum;

use crate::args::{CameraArgs, Given, LayoutWord, SequenceArgs, Warp3dArgs};
use crate::camera_file::CameraDefaults;
use crate::camera_path::{self, KeyKind};
use crate::multiview::{self, Layout, Places};
use crate::output;
use crate::picture::Drawn;
use crate::plan::{Pictures, Plan, Purpose, Request, Run, RunLog};
use crate::report::{self, RunStats};
use crate::values::Size;
use crate::viewpoint::{self, Known};
use crate::warp_references::{AnyWarper, Keeping};
use crate::warp_scene::{self, WarpScene};

mod drawer;
mod written;

use drawer::{Drawer, LastPicture};
use written::{record, write_planes};

/// The groups of options that every command has, for the shared code.
struct Shared {
    camera: CameraArgs,
    sequence: SequenceArgs,
    inputs: Vec<PathBuf>,
}

/// References that are read, ready to be warped.
pub(crate) struct Open {
    args: Warp3dArgs,
    ready: Ready,
}

/// Plan, cameras and references of a warp.
struct Ready {
    plan: Plan,
    cameras: Vec<Camera>,
    drawer: Drawer,
    scene: Value,
    load_ms: f64,
}

impl Open {
    /// Checks the arguments, reads the references, places the cameras and prepares the warp.
    pub(crate) fn read(args: Warp3dArgs, purpose: Purpose) -> Result<Self> {
        let ready = Ready::new(&args, purpose)?;
        Ok(Self { args, ready })
    }

    /// One camera per picture.
    pub(crate) fn cameras(&self) -> &[Camera] {
        &self.ready.cameras
    }

    /// Whether a part of a picture can be drawn without the rest.
    pub(crate) fn has_parts(&self) -> bool {
        // What fills a hole may come from anywhere on its rim.
        self.ready.drawer.layout == Layout::Single && self.args.render.options.fill == Fill::None
    }

    /// Draws the picture of one camera, without a warning.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        self.ready.drawer.draw_silently(camera)
    }

    /// Draws with these options from now on.
    pub(crate) fn set(&mut self, render: &Given<WarpArgs>) -> Result<()> {
        self.ready
            .drawer
            .warper
            .change(&render.options.options()?)?;
        self.args.render = render.clone();
        Ok(())
    }

    /// Draws and writes all pictures, and reports.
    pub(crate) fn finish(self, planned: Option<Value>, log: RunLog) -> Result<()> {
        let Self { args, ready } = self;
        let Ready {
            plan,
            cameras,
            mut drawer,
            scene,
            load_ms,
        } = ready;
        let shared = shared(&args);
        let request = request(&args, &shared);
        let stats = RunStats {
            version: env!("CARGO_PKG_VERSION"),
            scene,
            threads: rayon::current_num_threads(),
            settings: record(
                &args,
                &args.render.options.options()?,
                &request,
                plan.finish.format,
                drawer.convergence,
            ),
            planned,
            load_ms,
            peak_bytes: None,
            frames: Vec::new(),
        };
        drawer.last = if has_planes(&args) {
            LastPicture::Kept(None)
        } else {
            LastPicture::NotKept
        };
        plan.draw(&request, &cameras, Run { stats, log }, &mut |camera, _| {
            drawer.draw(camera)
        })?;
        match drawer.last {
            LastPicture::Kept(Some(image)) => write_planes(&args, &image),
            LastPicture::Kept(None) | LastPicture::NotKept => Ok(()),
        }
    }
}

impl Ready {
    fn new(args: &Warp3dArgs, purpose: Purpose) -> Result<Self> {
        let shared = shared(args);
        let request = request(args, &shared);
        check_words(args)?;
        // How many pictures there will be is known when the cameras are read; a name that cannot be is refused now.
        Plan::without_cameras(&request, Pictures::One)?;
        let options = args.render.options.options()?;
        let start = Instant::now();
        // How large the new picture is, cameras say later.
        let guess = args
            .cameras
            .size
            .map_or([1, 1], |size| [size.width, size.height]);
        let mut keeping = keeping(args, &options, guess, purpose)?;
        let mut scene = warp_scene::read(args, keeping)?;
        let layout = layout(args, scene.nearest);
        let targets = targets(args, &scene)?;
        let convergence = convergence(args, &scene, &targets[0])?;
        let cameras = cameras(args, &layout, &targets, convergence)?;
        let several = cameras.len() > 1;
        if several && has_planes(args) {
            bail!(
                "--filled and --confidence write one file: for several pictures use .exr, which holds both for each"
            );
        }
        let plan = Plan::without_cameras(
            &request,
            if several {
                Pictures::Several
            } else {
                Pictures::One
            },
        )?;
        let cameras = plan.checked(cameras)?;
        let largest = cameras
            .iter()
            .map(|camera| [camera.width, camera.height])
            .max_by_key(|&[w, h]| w * h);
        if keeping == Keeping::Memory {
            keeping = self::keeping(args, &options, largest.unwrap_or(guess), purpose)?;
            if keeping != Keeping::Memory {
                drop(scene);
                scene = warp_scene::read(args, keeping)?;
            }
        }
        let load_ms = report::ms_since(start);
        let account =
            json!({ "references": scene.references.len(), "samples": scene.references.known() });
        let warper = AnyWarper::new(scene.references, &options)?;
        let drawer = Drawer {
            warper,
            layout,
            convergence,
            last: LastPicture::NotKept,
        };
        Ok(Self {
            plan,
            cameras,
            drawer,
            scene: account,
            load_ms,
        })
    }
}

/// Whether the filled part or the confidence of the picture is written.
fn has_planes(args: &Warp3dArgs) -> bool {
    args.filled.is_some() || args.confidence.is_some()
}

/// Where the references are kept when a picture of this size is drawn within `--max-memory`.
fn keeping(
    args: &Warp3dArgs,
    options: &WarpOptions,
    target: [u32; 2],
    purpose: Purpose,
) -> Result<Keeping> {
    match (check_memory(args, options, target), args.max_memory) {
        (Ok(()), _) | (_, None) => Ok(Keeping::Memory),
        (Err(error), _) if purpose == Purpose::Compare => {
            Err(error.context("settings are compared and chosen with the references in memory"))
        }
        (Err(_), Some(max_memory)) => Ok(Keeping::File(max_memory)),
    }
}

/// Compares the warp's memory with `--max-memory`.
fn check_memory(args: &Warp3dArgs, options: &WarpOptions, target: [u32; 2]) -> Result<()> {
    let Some(max_memory) = args.max_memory else {
        return Ok(());
    };
    Ok(warp3d::memory::check_memory(
        &warp_scene::sizes(args)?,
        target,
        options,
        max_memory,
    )?)
}

fn shared(args: &Warp3dArgs) -> Shared {
    let sequence = &args.sequence;
    Shared {
        // The cameras of this command are --from and --to; none of the shared ones is used.
        camera: CameraArgs {
            size: args.cameras.size,
            ..CameraArgs::default()
        },
        sequence: SequenceArgs {
            path: sequence.path.clone(),
            resume: sequence.resume,
            fps: sequence.fps,
            ..SequenceArgs::default()
        },
        inputs: warp_scene::files(args),
    }
}

fn request<'a>(args: &'a Warp3dArgs, shared: &'a Shared) -> Request<'a> {
    let others = [
        ("--filled", &args.filled),
        ("--confidence", &args.confidence),
    ];
    Request {
        output: &args.output,
        stats: args.stats.as_deref(),
        camera: &shared.camera,
        sequence: &shared.sequence,
        picture: &args.picture,
        keys: KeyKind::Cameras,
        inputs: shared.inputs.iter().map(PathBuf::as_path).collect(),
        others: others
            .into_iter()
            .filter_map(|(name, path)| Some((name, path.as_deref()?)))
            .collect(),
    }
}

/// Refuses what the words alone rule out.
fn check_words(args: &Warp3dArgs) -> Result<()> {
    check_layout(args)?;
    for path in [&args.filled, &args.confidence].into_iter().flatten() {
        output::format_of(path, None)?;
    }
    if args.filled.is_some() && args.filled == args.confidence {
        bail!("--filled and --confidence have the same name: choose another one");
    }
    if args.confidence.is_some() && args.views.anaglyph.is_some() {
        bail!("--confidence: an anaglyph shows two views at once: leave it out");
    }
    let views = &args.views;
    let is_single = views.stereo.is_none()
        && views.quilt.is_none()
        && views.layout.is_none()
        && args.sequence.sway.is_none();
    if is_single && args.cameras.to.is_none() && args.sequence.path.is_none() {
        bail!(
            "the new camera is missing: give --to CAM or --path, or --stereo, --layout, --quilt or --sway"
        );
    }
    Ok(())
}

/// How views lie in the picture; `nearest` is the distance of the nearest sample, world units.
fn layout(args: &Warp3dArgs, nearest: f64) -> Layout {
    let views = &args.views;
    let places = views.layout.and_then(LayoutWord::places);
    match (views.stereo, views.anaglyph, views.quilt, views.layout) {
        (Some(baseline), Some(kind), ..) => Layout::Anaglyph(baseline, kind),
        (Some(baseline), ..) => Layout::Stereo(baseline, places.unwrap_or(Places::SideBySide)),
        (None, _, Some(grid), _) => Layout::Quilt(grid, views.view_cone),
        (None, _, None, Some(LayoutWord::ColourAndDepth)) => Layout::ColourAndDepth(nearest),
        (None, _, None, Some(LayoutWord::Equirectangular)) => {
            Layout::Equirectangular(args.cameras.size)
        }
        (None, _, None, _) => Layout::Single,
    }
}

/// Refuses layouts of a pair without one, and pairs in a layout of one view.
fn check_layout(args: &Warp3dArgs) -> Result<()> {
    let Some(layout) = args.views.layout else {
        return Ok(());
    };
    let name = layout.to_possible_value();
    let name = name.as_ref().map_or("", |name| name.get_name());
    match (layout.places(), args.views.stereo) {
        (Some(_), None) => bail!("--layout {name}: it shows two views: give --stereo BASELINE"),
        (None, Some(_)) => bail!("--layout {name}: it shows one view: leave --stereo out"),
        _ => Ok(()),
    }
}

/// The cameras to draw from, before they become sheets or sway.
fn targets(args: &Warp3dArgs, scene: &WarpScene) -> Result<Vec<Camera>> {
    let from = scene.from.for_distance(scene.nearest)?;
    if let Some(path) = &args.sequence.path {
        return keyed(path, args, &from, scene);
    }
    let Some(to) = &args.cameras.to else {
        return Ok(vec![viewpoint::sized(from, args.cameras.size)?]);
    };
    let known = Known {
        picture: [from.width, from.height],
        size: args.cameras.size,
        lens: warp_scene::lens(args, [from.width, from.height])?,
    };
    let cameras = viewpoint::several(to, &from, &known)?;
    let named = || to.path().unwrap_or(Path::new("--to")).display().to_string();
    cameras
        .iter()
        .map(|camera| camera.for_distance(scene.nearest).with_context(named))
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
    let keys = camera_path::read(path, &defaults, KeyKind::Cameras)?;
    let pictures = keys.pictures(f64::from(args.sequence.fps.unwrap_or(output::DEFAULT_FPS)))?;
    keys.cameras(&pictures, |camera| camera.for_distance(scene.nearest))
        .with_context(|| path.display().to_string())
}

/// Distance at which views agree and about which cameras sway.
fn convergence(args: &Warp3dArgs, scene: &WarpScene, target: &Camera) -> Result<f64> {
    let is_needed = layout(args, scene.nearest).needs_convergence() || args.sequence.sway.is_some();
    let Some(typed) = args.views.convergence else {
        if !is_needed {
            return Ok(f64::INFINITY);
        }
        let median = scene.references.median_depth(target)?;
        return median.context("nothing lies before the new camera: give --convergence");
    };
    let needs_finite = args.views.quilt.is_some() || args.sequence.sway.is_some();
    if needs_finite && typed.is_infinite() {
        bail!("--convergence inf: --quilt and --sway need a distance");
    }
    Ok(typed)
}

fn cameras(
    args: &Warp3dArgs,
    layout: &Layout,
    targets: &[Camera],
    convergence: f64,
) -> Result<Vec<Camera>> {
    let swaying = match args.sequence.sway {
        None => targets.to_vec(),
        Some(_) if targets.len() > 1 => bail!("--sway goes around one camera: name it behind a #"),
        Some(angle_deg) => {
            multiview::sway(&targets[0], convergence, angle_deg, args.sequence.frames)?
        }
    };
    swaying
        .iter()
        .map(|camera| Ok(layout.sheet(camera).validated()?))
        .collect()
}
