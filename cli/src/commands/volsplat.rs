//! `resample volsplat`: a volume file to one picture or several.
//!
//! The steps are those of [`run`]: everything that can be refused without reading the volume is checked first, so
//! that a misspelt name does not cost a minute, and nothing is written before all input has proved to be good.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use resample_core::Camera;
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume};

use crate::args::{CameraArgs, ProjectionArg, VolsplatArgs};
use crate::camera_file::{self, CameraDefaults, CameraFile};
use crate::camera_path::{self, CameraPath, Moment};
use crate::framing::{self, Lens, View};
use crate::interrupt;
use crate::output::{self, Depth, FilmKind, FilmPlan, Format, FrameNames};
use crate::picture::{self, Finish};
use crate::report::{self, RunStats, Verbosity};
use crate::sequence::{self, Existing, Sequence};
use crate::settings;
use crate::transfer;
use crate::values::Size;

/// Picture size when neither the command line nor a camera file gives one.
const DEFAULT_SIZE: Size = Size { width: 800, height: 800 };

/// What is known before the volume is read.
struct Plan {
    names: FrameNames,
    film: Option<FilmPlan>,
    finish: Finish,
    cameras: PlannedCameras,
}

/// Where the cameras come from.
enum PlannedCameras {
    /// They are fitted to what is visible.
    Framed,
    /// A camera file.
    File(CameraFile),
    /// Keys, and the moments of the pictures between them.
    Path(CameraPath, Vec<Moment>),
}

/// The volume, ready to be drawn.
struct Scene {
    volume: Volume,
    transfer: TransferFunction,
    renderer: Renderer,
    options: RenderOptions,
    load_ms: f64,
    classify_ms: f64,
}

/// Checks, loads, classifies, renders, and reports.
pub(crate) fn run(args: &VolsplatArgs, verbosity: Verbosity) -> Result<()> {
    let start = Instant::now();
    interrupt::watch()?;
    let plan = checked_plan(args)?;
    let options = settings::render_options(&args.render, args.transfer.opacity_unit, plan.finish.format)?;
    let scene = loaded(args, options)?;
    let cameras = cameras(args, &plan, &scene)?;
    let mut stats = stats_before_drawing(args, plan.finish.format, &scene);
    let mut renderer = scene.renderer;
    // The renderer has its own copy of what can be seen.
    drop(scene.volume);
    if verbosity == Verbosity::Verbose {
        report::say(&format!("load {:.1} ms, classify {:.1} ms", stats.load_ms, stats.classify_ms));
    }
    let existing = if args.sequence.resume { Existing::Keep } else { Existing::Replace };
    let sequence = Sequence { cameras: &cameras, names: &plan.names, finish: plan.finish, existing };
    let outcome = match &plan.film {
        Some(film) => sequence::draw_film(&mut renderer, &sequence, film, verbosity)?,
        None => sequence::draw(&mut renderer, &sequence, verbosity)?,
    };
    stats.frames = outcome.frames;
    stats.peak_bytes = report::peak_bytes();
    if let Some(path) = &args.stats {
        output::write_text(path, &format!("{}\n", serde_json::to_string_pretty(&stats)?))?;
    }
    if verbosity != Verbosity::Quiet {
        if outcome.kept > 0 {
            report::say(&format!("{} of {} pictures were there already", outcome.kept, cameras.len()));
        }
        report::say(&report::summary(&stats.frames, start.elapsed().as_secs_f64()));
    }
    outcome.ending
}

fn stats_before_drawing(args: &VolsplatArgs, format: Format, scene: &Scene) -> RunStats {
    RunStats {
        version: env!("CARGO_PKG_VERSION"),
        voxels: scene.renderer.voxels(),
        non_transparent: scene.renderer.non_transparent(),
        threads: rayon::current_num_threads(),
        settings: settings::record(args, &scene.options, format, &scene.volume),
        load_ms: scene.load_ms,
        classify_ms: scene.classify_ms,
        peak_bytes: None,
        frames: Vec::new(),
    }
}

fn checked_plan(args: &VolsplatArgs) -> Result<Plan> {
    let film = film_plan(args)?;
    let format = match film.as_ref().map(|film| film.kind) {
        Some(FilmKind::Png(depth)) => Format::Png(depth),
        Some(FilmKind::Video(_)) => Format::Png(Depth::Eight),
        None => output::format_of(&args.output, args.picture.bits)?,
    };
    let cameras = planned_cameras(args)?;
    let names = match (&cameras, args.sequence.turntable) {
        _ if film.is_some() => FrameNames::Single(args.output.clone()),
        (PlannedCameras::File(CameraFile::List(_)) | PlannedCameras::Path(..), _) | (_, Some(_)) => {
            FrameNames::numbered(&args.output)?
        }
        _ => FrameNames::single(&args.output)?,
    };
    check_targets(args, &names.frame(0))?;
    // A video cannot be transparent.
    let opaque = matches!(film, Some(FilmPlan { kind: FilmKind::Video(_), .. }));
    let background = args.picture.background.or(opaque.then_some([0.0; 3]));
    Ok(Plan { names, film, finish: Finish { format, background }, cameras })
}

/// The animation that the name of the output asks for.
fn film_plan(args: &VolsplatArgs) -> Result<Option<FilmPlan>> {
    let name = args.output.display();
    let Some(kind) = output::kind_of(&args.output, args.picture.bits)? else {
        if args.sequence.fps.is_some() && args.sequence.path.is_none() {
            bail!(
                "{name}: --fps is for --path and for animations, whose name ends in .apng, .mp4, .webm or .mkv"
            );
        }
        return Ok(None);
    };
    if args.sequence.resume {
        bail!("{name}: --resume is for numbered pictures; an animation is written whole or not at all");
    }
    let fps = args.sequence.fps.unwrap_or(output::DEFAULT_FPS);
    let film = FilmPlan { path: args.output.clone(), kind, fps };
    film.check_tools()?;
    Ok(Some(film))
}

fn planned_cameras(args: &VolsplatArgs) -> Result<PlannedCameras> {
    let (camera, sequence) = (&args.camera, &args.sequence);
    let defaults = CameraDefaults { size: camera.size, look_at_size: DEFAULT_SIZE, fov_y_deg: camera.fov };
    if let Some(file) = &sequence.path {
        let path = camera_path::read(file, &defaults)?;
        let pictures = path.pictures(f64::from(sequence.fps.unwrap_or(output::DEFAULT_FPS)))?;
        return Ok(PlannedCameras::Path(path, pictures));
    }
    match &camera.camera {
        Some(file) => Ok(PlannedCameras::File(camera_file::read(file, &defaults)?)),
        None => Ok(PlannedCameras::Framed),
    }
}

/// Checks every place that will be written to. All frames go to one folder, so the first stands for the others.
fn check_targets(args: &VolsplatArgs, first_frame: &Path) -> Result<()> {
    let optional =
        [args.transfer.transfer.as_deref(), args.camera.camera.as_deref(), args.sequence.path.as_deref()];
    let inputs: Vec<&Path> = optional.into_iter().flatten().chain([args.input.as_path()]).collect();
    let plot = args.transfer.show_transfer.as_deref();
    if let Some(plot) = plot.filter(|&plot| plot == first_frame) {
        bail!("{}: is the name of the picture and of --show-transfer: choose another name", plot.display());
    }
    for target in [Some(first_frame), args.stats.as_deref(), plot].into_iter().flatten() {
        output::check_writable(target)?;
        output::check_not_input(target, &inputs)?;
    }
    Ok(())
}

fn loaded(args: &VolsplatArgs, options: RenderOptions) -> Result<Scene> {
    let start = Instant::now();
    let volume = volsplat::load(&args.input, &settings::load_options(&args.volume))?;
    let load_ms = report::ms_since(start);
    let options = settings::suited_to(options, &args.render, &volume);
    let transfer: TransferFunction = transfer::function(&args.transfer, &volume)?;
    if let Some(warning) = transfer::warning(&args.transfer, &volume) {
        report::say(&warning);
    }
    let start = Instant::now();
    let renderer = Renderer::new(&volume, &transfer, &options)
        .with_context(|| format!("{}: cannot be drawn", args.input.display()))?;
    let classify_ms = report::ms_since(start);
    Ok(Scene { volume, transfer, renderer, options, load_ms, classify_ms })
}

fn cameras(args: &VolsplatArgs, plan: &Plan, scene: &Scene) -> Result<Vec<Camera>> {
    let bounds = scene.renderer.visible_bounds_in_world().unwrap_or_else(|| {
        report::say(&format!(
            "warning: nothing is visible: the transfer function makes every voxel of {} transparent",
            args.input.display()
        ));
        framing::grid_bounds(&scene.volume)
    });
    let bounds = framing::with_kernels(bounds, &scene.volume);
    let named = |file: &Option<PathBuf>| file.as_deref().unwrap_or(Path::new("")).display().to_string();
    let cameras = match &plan.cameras {
        PlannedCameras::Framed => framed(args, bounds, &scene.volume)?,
        PlannedCameras::File(file) => {
            file_cameras(file, bounds).with_context(|| named(&args.camera.camera))?
        }
        PlannedCameras::Path(path, pictures) => {
            path.cameras(pictures, bounds).with_context(|| named(&args.sequence.path))?
        }
    };
    cameras.iter().try_for_each(picture::check_size)?;
    if let Some(film) = &plan.film {
        film.check_sizes(&cameras)?;
    }
    transfer::show(&args.transfer, &scene.transfer, &scene.volume)?;
    Ok(cameras)
}

/// The cameras that nobody wrote down: one, or those of a turntable.
fn framed(args: &VolsplatArgs, bounds: [DVec3; 2], volume: &Volume) -> Result<Vec<Camera>> {
    let view = view(&args.camera, volume);
    match args.sequence.turntable {
        Some(steps) => framing::turntable(bounds, &view, steps),
        None => Ok(vec![framing::frame(bounds, &view)?]),
    }
}

fn file_cameras(file: &CameraFile, bounds: [DVec3; 2]) -> Result<Vec<Camera>> {
    match file {
        CameraFile::One(camera) => Ok(vec![camera.for_bounds(bounds)?]),
        CameraFile::List(list) => list.iter().map(|camera| camera.for_bounds(bounds)).collect(),
    }
}

fn view(args: &CameraArgs, volume: &Volume) -> View {
    View {
        size: args.size.unwrap_or(DEFAULT_SIZE),
        orbit: args.orbit.unwrap_or(framing::DEFAULT_ORBIT),
        stance: framing::stance(volume, args.up.map(|axis| axis.direction)),
        lens: match args.projection {
            ProjectionArg::Perspective => Lens::Perspective { fov_y_deg: args.fov },
            ProjectionArg::Orthographic => Lens::Orthographic,
        },
    }
}
