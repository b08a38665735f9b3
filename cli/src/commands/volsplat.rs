//! `resample volsplat`: a volume file to one picture or several.
//!
//! The steps are those of [`run`]: everything that can be refused without reading the volume is checked first, so
//! that a misspelt name does not cost a minute, and nothing is written before all input has proved to be good.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use resample_core::Camera;
use serde_json::json;
use volsplat::{FrameStats, RenderOptions, Renderer};

use crate::args::{Command, VolsplatArgs};
use crate::blend;
use crate::camera_path::KeyKind;
use crate::commands::{Opened, Parts, Prepared};
use crate::framing::{self, Extent};
use crate::interrupt;
use crate::picture::Drawn;
use crate::plan::{Plan, Request, Telling};
use crate::progress::{Progress, watch};
use crate::report::{self, Account, RunStats, Verbosity};
use crate::scene;
use crate::settings;
use crate::transfer;
use crate::volume_data::Content;
use crate::volume_motion::{self, VolumeMotion};

/// The volume, ready to be drawn.
struct Scene {
    content: Content,
    renderer: Renderer,
    options: RenderOptions,
    /// What changes from picture to picture beside the camera.
    motion: Option<VolumeMotion>,
    load_ms: f64,
    classify_ms: f64,
}

/// Checks, loads, classifies, renders, and reports.
pub(crate) fn run(args: &VolsplatArgs, verbosity: Verbosity) -> Result<()> {
    let telling = Telling { start: Instant::now(), verbosity };
    interrupt::watch()?;
    let request = request(args);
    let plan = Plan::new(&request)?;
    let options = settings::render_options(&args.render, args.transfer.opacity_unit, plan.finish.format)?;
    let layers = blend::layers(&args.render.blend, plan.finish.format)?;
    let scene = loaded(args, options, (&plan, verbosity.progress()))?;
    let cameras = cameras(args, &request, &plan, &scene)?;
    scene.content.show_transfer(&args.transfer)?;
    let stats = stats_before_drawing(args, &request, &plan, &scene);
    if verbosity == Verbosity::Verbose {
        report::say(&format!("load {:.1} ms, classify {:.1} ms", scene.load_ms, scene.classify_ms));
    }
    // Of several pictures a bar counts the pictures.
    let progress = if cameras.len() == 1 { verbosity.progress() } else { Progress::Hidden };
    let Scene { content, mut renderer, options, motion, .. } = scene;
    // The renderer has its own copy of what can be seen; only what moves may need the voxels again.
    let mut moving = motion.map(|motion| (motion, content));
    let mut render = |camera: &Camera, number: usize| {
        if let Some((motion, content)) = &mut moving {
            motion.set(number, &mut renderer, (content, &options))?;
        }
        let mut drawn = drawn(&mut renderer, camera, progress)?;
        drawn.image.planes.extend(renderer.layers(camera, &layers)?);
        Ok(drawn)
    };
    plan.draw(&request, &cameras, stats, (&mut render, telling))
}

/// Does all but the drawing.
pub(crate) fn prepared(args: &VolsplatArgs) -> Result<Prepared> {
    let request = request(args);
    let plan = Plan::new(&request)?;
    let options = settings::render_options(&args.render, args.transfer.opacity_unit, plan.finish.format)?;
    let scene = loaded(args, options, (&plan, Progress::Hidden))?;
    check_still(&scene)?;
    let cameras = cameras(args, &request, &plan, &scene)?;
    let mut renderer = scene.renderer;
    let render = move |camera: &Camera| drawn(&mut renderer, camera, Progress::Hidden);
    Ok(Prepared { cameras, render: Box::new(render) })
}

/// Reads the volume, to draw it under several settings.
pub(crate) fn opened(args: &VolsplatArgs) -> Result<Opened> {
    let request = request(args);
    let plan = Plan::new(&request)?;
    let format = plan.finish.format;
    let options = settings::render_options(&args.render, args.transfer.opacity_unit, format)?;
    let scene = loaded(args, options, (&plan, Progress::Hidden))?;
    check_still(&scene)?;
    let cameras = cameras(args, &request, &plan, &scene)?;
    let Scene { content, mut renderer, .. } = scene;
    let draw = move |command: &Command, camera: &Camera| {
        let Command::Volsplat(args) = command else { bail!("expected volsplat") };
        let options = settings::render_options(&args.render, args.transfer.opacity_unit, format)?;
        let options = settings::suited_to(options, &args.render, content.first());
        if !renderer.adopt(&options)? {
            renderer = content.renderer(&options, Progress::Hidden)?;
        }
        drawn(&mut renderer, camera, Progress::Hidden)
    };
    Ok(Opened { cameras, parts: Parts::Windows { side_px: 16, least: 8, guard_px: 0 }, draw: Box::new(draw) })
}

/// Refuses what changes from picture to picture beside the camera.
fn check_still(scene: &Scene) -> Result<()> {
    if scene.motion.is_some() {
        bail!(
            "the keys of --path change the volume, and only cameras are measured: leave that out of the keys"
        );
    }
    Ok(())
}

/// What a volume renderer draws, and says.
pub(crate) fn drawn(renderer: &mut Renderer, camera: &Camera, progress: Progress) -> Result<Drawn> {
    let frame = renderer.render_watched(camera, &mut watch("drawing", progress))?;
    let account = Account { keys: serde_json::to_value(&frame.stats)?, line: stage_line(&frame.stats) };
    Ok(Drawn { image: frame.image, account })
}

fn request(args: &VolsplatArgs) -> Request<'_> {
    let transfer = args.transfer.transfer.as_deref();
    Request {
        output: &args.output,
        stats: args.stats.as_deref(),
        camera: &args.camera,
        sequence: &args.sequence,
        picture: &args.picture,
        keys: KeyKind::Volume,
        inputs: [Some(args.input.as_path()), transfer]
            .into_iter()
            .flatten()
            .chain(scene::inputs(&args.scene))
            .collect(),
        others: args.transfer.show_transfer.iter().map(|path| ("--show-transfer", path.as_path())).collect(),
    }
}

fn stats_before_drawing(args: &VolsplatArgs, request: &Request, plan: &Plan, scene: &Scene) -> RunStats {
    RunStats {
        version: env!("CARGO_PKG_VERSION"),
        scene: json!({
            "voxels": scene.renderer.voxels(),
            "non_transparent": scene.renderer.non_transparent(),
            "classify_ms": scene.classify_ms,
            "moving": scene.motion.as_ref().map(volume_motion::record),
            "interpolation_residual": scene.renderer.interpolation_residual(),
        }),
        threads: rayon::current_num_threads(),
        settings: settings::record(
            args,
            request,
            plan.finish.format,
            (&scene.options, scene.content.first()),
        ),
        planned: args.ask.kept.clone(),
        load_ms: scene.load_ms,
        peak_bytes: None,
        frames: Vec::new(),
    }
}

fn loaded(args: &VolsplatArgs, options: RenderOptions, (plan, progress): (&Plan, Progress)) -> Result<Scene> {
    let start = Instant::now();
    let mut content = Content::load(args, &options, progress)?;
    let load_ms = report::ms_since(start);
    let motion = match plan.path() {
        Some(path) => VolumeMotion::new(path, args, content.first()).with_context(|| path_name(args))?,
        None => None,
    };
    if let Some(mean) = motion.as_ref().and_then(VolumeMotion::mean) {
        content.set_function(mean);
    }
    let options = settings::suited_to(options, &args.render, content.first());
    if let Some(warning) = transfer::warning(&args.transfer, content.first()) {
        report::say(&warning);
    }
    let start = Instant::now();
    let renderer = content
        .renderer(&options, progress)
        .with_context(|| format!("{}: cannot be drawn", args.input.display()))?;
    let classify_ms = report::ms_since(start);
    Ok(Scene { content, renderer, options, motion, load_ms, classify_ms })
}

fn path_name(args: &VolsplatArgs) -> String {
    args.sequence.path.as_deref().unwrap_or(Path::new("")).display().to_string()
}

fn cameras(args: &VolsplatArgs, request: &Request, plan: &Plan, scene: &Scene) -> Result<Vec<Camera>> {
    let bounds = scene.renderer.visible_bounds_in_world().unwrap_or_else(|| {
        report::say(&format!(
            "warning: nothing is visible: the transfer function makes every voxel of {} transparent",
            args.input.display()
        ));
        framing::volume::grid_bounds(scene.content.first())
    });
    let bounds = framing::volume::with_kernels(bounds, scene.content.first());
    let stance = framing::volume::stance(scene.content.first(), args.camera.up.map(|axis| axis.direction));
    plan.cameras(request, &Extent::of_box(bounds), stance)
}

/// The times of a frame's stages and its counts, one line.
fn stage_line(stats: &FrameStats) -> String {
    let stages = &stats.stages;
    let named = [
        ("cull", stages.cull),
        ("project", stages.project),
        ("bin", stages.bin),
        ("sort", stages.sort),
        ("composite", stages.composite),
        ("image", stages.image),
    ];
    let times: Vec<_> = named.iter().map(|(name, time)| format!("{name} {:.1}", time.wall_ms)).collect();
    format!(
        "{:.1} ms wall, {:.1} ms CPU ({} ms); {} points, {} splats, {} culled; \
         bricks: {} empty, {} outside, {} hidden",
        stats.wall_ms,
        stats.cpu_ms,
        times.join(", "),
        stats.points,
        stats.splats,
        stats.culled,
        stats.bricks_empty,
        stats.bricks_outside,
        stats.bricks_hidden
    )
}
