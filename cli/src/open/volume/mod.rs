//! `resample volsplat`: a volume file to one picture or several.
//!
//! The steps are those of [`Open`]: everything that can be refused without reading the volume is checked first, so
//! that a misspelt name does not cost a minute, and nothing is written before all input has proved to be good.

pub(crate) mod data;
pub(crate) mod file;
pub(crate) mod key_motion;
pub(crate) mod scene;
pub(crate) mod settings;

mod cameras;
mod said;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use resample_core::{Camera, Stop};
use serde_json::{Value, json};
use volsplat::{Described, LabelLook, Layer, RenderOptions, Renderer, Reuse, TransferFunction};

use crate::args::{Given, RenderArgs, VolsplatArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::framing::Extent;
use crate::cameras::{framing, picked_point};
use crate::look::suggested::Suggested;
use crate::look::{blend, transfer};
use crate::open::volume::data::{Content, Keeping};
use crate::open::volume::key_motion::VolumeMotion;
use crate::picture;
use crate::picture::{Drawn, Shot};
use crate::plan::{Plan, Purpose, Request, Run, RunLog};
use crate::process::progress::{Progress, watch};
use crate::process::report;
use crate::process::report::{Account, RunStats, Verbosity};

mod kept;

/// A volume that is read, ready to be drawn.
pub(crate) struct Open {
    args: VolsplatArgs,
    plan: Plan,
    content: Content,
    keeping: Keeping,
    renderer: Renderer,
    options: RenderOptions,
    /// Ends a frame that nobody waits for.
    stop: Stop,
    /// Changes from picture to picture beside the camera.
    motion: Option<VolumeMotion>,
    cameras: Vec<Camera>,
    load_ms: f64,
    classify_ms: f64,
}

/// The point under a pixel.
pub(crate) struct Probed {
    /// World position.
    pub(crate) world: DVec3,
    /// Index of the nearest voxel.
    pub(crate) voxel: [usize; 3],
    /// Its value.
    pub(crate) value: f64,
}

impl Open {
    /// Checks the arguments, reads the volume, and classifies it.
    pub(crate) fn read(args: VolsplatArgs, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        let plan = Plan::new(&request(&args))?;
        let options =
            settings::render_options(&args.render, args.transfer.opacity_unit, plan.finish.format)?;
        blend::layers(&args.render.options.blend, plan.finish.format)?;
        let mut open = loaded(args, options, (plan, purpose), verbosity.progress())?;
        open.cameras = cameras(&mut open)?;
        Ok(open)
    }

    /// One camera per picture.
    pub(crate) fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// The bounding box of the visible voxels, or of all voxels if no voxel is visible: its least and its greatest corner.
    pub(crate) fn bounds_in_world(&self) -> [DVec3; 2] {
        let visible = self.renderer.visible_bounds_in_world();
        let bounds = visible.unwrap_or_else(|| framing::volume::grid_bounds(self.content.first()));
        framing::volume::with_kernels(bounds, self.content.first())
    }

    /// The volume, or the first of several.
    pub(crate) fn described(&self) -> &dyn Described {
        self.content.first()
    }

    /// The transfer function of the first volume; `None` where it holds labels.
    pub(crate) fn function(&self) -> Option<&TransferFunction> {
        self.content.function()
    }

    /// The labels of the first volume that holds labels, with their looks, the most frequent first.
    pub(crate) fn labels(&self) -> Vec<(i64, LabelLook)> {
        self.content.labels()
    }

    /// The arguments under which it is drawn.
    pub(crate) fn args(&self) -> &VolsplatArgs {
        &self.args
    }

    /// The first visible point on the ray of a camera with one pixel, and the voxel nearest to it.
    pub(crate) fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        let world = match self.renderer.layers(pixel, &[Layer::FirstHit]) {
            Ok(planes) => {
                let depth = planes.first().and_then(|plane| plane.values.first());
                let depth = depth.filter(|depth| depth.is_finite());
                depth.map(|&depth| picked_point::world_at(pixel, f64::from(depth)))
            }
            // Labels, channels and other blends have no such plane.
            Err(_) => self.content.first_voxel(pixel),
        };
        let Some(world) = world else {
            return Ok(None);
        };
        Ok(self.content.nearest(world).map(|(voxel, value)| Probed {
            world,
            voxel,
            value,
        }))
    }

    /// Takes the transfer function and the render options of `args`; the files are not read again.
    pub(crate) fn restyle(&mut self, args: VolsplatArgs) -> Result<()> {
        self.content.relook(&args)?;
        let options = settings::render_options(
            &args.render,
            args.transfer.opacity_unit,
            self.plan.finish.format,
        )?;
        let options = self.suited(options, &args.render.options);
        self.content
            .change(&mut self.renderer, &options, self.keeping)?;
        self.options = options;
        self.args = args;
        Ok(())
    }

    /// Fills options that were not set with those the preset suggests.
    fn suited(&self, options: RenderOptions, args: &RenderArgs) -> RenderOptions {
        let (volume, suggested) = (self.content.first(), self.content.suggested());
        settings::suited_to(options, args, volume, &suggested)
    }

    /// The light and the blending that go with the look, where nobody typed others.
    pub(crate) fn suggested(&self) -> Suggested {
        self.content.suggested()
    }

    /// Has frames end early once `stop` is asked for.
    pub(crate) fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Draws the picture of one camera.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        drawn(&mut self.renderer, camera, Progress::Hidden, &self.stop)
    }

    /// Draws and writes all pictures, and reports.
    pub(crate) fn finish(self, planned: Option<Value>, log: RunLog) -> Result<()> {
        if self.args.sequence.part.tile.is_some() && !self.is_field() {
            bail!("--tile requires the field renderer; use --frames instead");
        }
        let request = request(&self.args);
        let layers = blend::layers(&self.args.render.options.blend, self.plan.finish.format)?;
        self.content.show_transfer(&self.args.transfer)?;
        let stats = RunStats {
            planned,
            ..self.stats_before_drawing(&request)
        };
        if log.verbosity == Verbosity::Verbose {
            report::say(&format!(
                "load {:.1} ms, classify {:.1} ms",
                self.load_ms, self.classify_ms
            ));
        }
        let look_line = self.suggested().line();
        // Of several pictures a bar counts the pictures.
        let progress = if self.cameras.len() == 1 {
            log.verbosity.progress()
        } else {
            Progress::Hidden
        };
        let (mut renderer, options) = (self.renderer, self.options);
        // The renderer has its own copy of what can be seen; only what moves may need the voxels again.
        let mut moving = self.motion.map(|motion| (motion, self.content));
        let mut render = |shot: &Shot| {
            if let Some((motion, content)) = &mut moving {
                motion.set(shot.number, &mut renderer, content, &options)?;
            }
            picture::in_window(shot.camera, &shot.window, &mut |camera| {
                let mut drawn = drawn(&mut renderer, camera, progress, &self.stop)?;
                drawn.image.planes.extend(renderer.layers(camera, &layers)?);
                Ok(drawn)
            })
        };
        self.plan
            .draw(&request, &self.cameras, Run { stats, log }, &mut render)?;
        if let Some(line) = look_line
            && log.verbosity != Verbosity::Quiet
        {
            report::say(&line);
        }
        Ok(())
    }

    /// Refuses what changes from picture to picture beside the camera.
    pub(crate) fn check_still(&self) -> Result<()> {
        if self.motion.is_some() {
            bail!(
                "only camera keys are supported here; remove volume changes from the --path file"
            );
        }
        Ok(())
    }

    /// Draws with these options from now on.
    pub(crate) fn set(&mut self, render: &Given<RenderArgs>) -> Result<()> {
        let options = settings::render_options(
            render,
            self.args.transfer.opacity_unit,
            self.plan.finish.format,
        )?;
        let options = self.suited(options, &render.options);
        self.args.render = render.clone();
        if options == self.options {
            return Ok(());
        }
        if self.renderer.update(&options)? == Reuse::NeedsRenderer {
            self.renderer = self
                .content
                .renderer(&options, self.keeping, Progress::Hidden)?;
        }
        self.options = options;
        Ok(())
    }

    fn stats_before_drawing(&self, request: &Request) -> RunStats {
        RunStats {
            version: env!("CARGO_PKG_VERSION"),
            scene: json!({
                "voxels": self.renderer.voxels(),
                "non_transparent": self.renderer.non_transparent(),
                "classify_ms": self.classify_ms,
                "moving": self.motion.as_ref().map(key_motion::record),
                "interpolation_residual": self.renderer.interpolation_residual(),
            }),
            threads: rayon::current_num_threads(),
            settings: settings::record(
                &self.args,
                request,
                self.plan.finish.format,
                &self.options,
                (self.content.first(), &self.suggested()),
            ),
            planned: None,
            load_ms: self.load_ms,
            peak_bytes: None,
            frames: Vec::new(),
        }
    }
}

/// The picture of a volume renderer, with its counts and times.
fn drawn(
    renderer: &mut Renderer,
    camera: &Camera,
    progress: Progress,
    stop: &Stop,
) -> Result<Drawn> {
    let frame = renderer.render_until(camera, stop, &mut watch("drawing", progress))?;
    let account = Account {
        keys: serde_json::to_value(&frame.stats)?,
        line: said::stage_line(&frame.stats),
    };
    Ok(Drawn {
        image: frame.image,
        account,
    })
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
        vector_level: args.render.options.vector_level,
        gate: args.volume.reading.gate(),
        inputs: [Some(args.input.path.as_path()), transfer]
            .into_iter()
            .flatten()
            .chain(scene::inputs(&args.scene))
            .collect(),
        others: args
            .transfer
            .show_transfer
            .iter()
            .map(|path| ("--show-transfer", path.as_path()))
            .collect(),
    }
}

/// All but the cameras.
fn loaded(
    args: VolsplatArgs,
    options: RenderOptions,
    (plan, purpose): (Plan, Purpose),
    progress: Progress,
) -> Result<Open> {
    let start = Instant::now();
    let mut content = Content::load(&args, &options, plan.gate(), progress)?;
    let load_ms = report::ms_since(start);
    plan.gate()
        .remarks()
        .iter()
        .for_each(|text| report::say(&format!("note: {text}")));
    let motion = motion(&args, &plan, &mut content)?;
    let suggested = match motion.as_ref().and_then(VolumeMotion::mean) {
        Some(_) => Suggested::default(),
        None => content.suggested(),
    };
    let options = settings::suited_to(options, &args.render.options, content.first(), &suggested);
    if let Some(warning) = transfer::warning(&args.transfer, content.first()) {
        report::say(&warning);
    }
    let start = Instant::now();
    let keeping = match purpose {
        Purpose::Change => content.keeping(plan.gate()),
        Purpose::Draw | Purpose::Compare => Keeping::Shown,
    };
    let renderer = content
        .renderer(&options, keeping, progress)
        .with_context(|| format!("{}: cannot be drawn", args.input.path.display()))?;
    let classify_ms = report::ms_since(start);
    Ok(Open {
        args,
        plan,
        content,
        keeping,
        renderer,
        options,
        stop: Stop::default(),
        motion,
        cameras: Vec::new(),
        load_ms,
        classify_ms,
    })
}

/// Changes from picture to picture beside the camera; the content takes the mean of its looks.
fn motion(args: &VolsplatArgs, plan: &Plan, content: &mut Content) -> Result<Option<VolumeMotion>> {
    let Some((path, pictures)) = plan.path() else {
        return Ok(None);
    };
    let motion = VolumeMotion::new(path, pictures, args, content.first())
        .with_context(|| path_name(args))?;
    if let Some(mean) = motion.as_ref().and_then(VolumeMotion::mean) {
        content.set_function(mean);
    }
    Ok(motion)
}

fn path_name(args: &VolsplatArgs) -> String {
    args.sequence
        .path
        .as_deref()
        .unwrap_or(Path::new(""))
        .display()
        .to_string()
}

fn cameras(open: &mut Open) -> Result<Vec<Camera>> {
    let bounds = open.bounds_in_world();
    let Open {
        args,
        plan,
        content,
        renderer,
        options,
        ..
    } = open;
    if renderer.visible_bounds_in_world().is_none() {
        let why = said::why_nothing(args, content.first());
        report::say(&format!("warning: nothing is visible: {why}"));
    }
    let stance =
        framing::volume::stance(content.first(), args.camera.up.map(|axis| axis.direction));
    let extent = Extent::of_box(bounds);
    cameras::fitted(renderer, options, bounds, &mut |measure| {
        plan.cameras(&request(args), (&extent, stance), measure)
    })
}
