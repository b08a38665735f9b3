//! `resample volsplat`: a volume file to one picture or several.
//!
//! The steps are those of [`OpenVolume`]: everything that can be refused without reading the volume is checked first, so
//! that a misspelt name does not cost a minute, and nothing is written before all input has proved to be good.

pub(crate) mod channels;
pub(crate) mod data;
pub(crate) mod file;
pub(crate) mod meshes;
mod slices;
pub(crate) mod key_motion;
pub(crate) mod scene;
pub(crate) mod step_values;
pub(crate) mod time_steps;
mod record;
mod open_scene;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use resample_core::clock::StageClock;
use resample_core::{Camera, Image, Stop};
use serde_json::json;
use volsplat::{
    Described, FrameStats, LabelLook, Order, RenderOptions, Renderer, Reuse, TransferFunction,
};

use crate::args::{Given, RenderArgs, VolsplatArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::framing;
use crate::cameras::framing::volume::{Small, corners};
use crate::cameras::framing::{Extent, Measure, Seen, seen_points};
use crate::look;
use crate::look::file_channel::ShownChannel;
use crate::look::transfer;
use crate::look::transfer::Suggested;
use crate::open::figure;
use crate::open::figure::FigureFacts;
use crate::open::volume::data::{Content, Keeping};
use crate::open::volume::key_motion::VolumeMotion;
use crate::open::volume::meshes::Meshes;
use crate::open::volume::slices::Cut;
use crate::open::volume::time_steps::TimeSteps;
use crate::output;
use crate::picture::Drawn;
use crate::plan::{Plan, Purpose, Request};
use crate::process::report;
use crate::process::report::{Account, Cost, Progress, RunStats, Verbosity, watch};
use crate::values::LookOf;
use crate::values::input_file::InputFile;

/// A volume that is read, ready to be drawn.
pub(crate) struct OpenVolume {
    args: VolsplatArgs,
    plan: Plan,
    content: Content,
    /// The steps of a volume over time.
    steps: Option<TimeSteps>,
    keeping: Keeping,
    renderer: Renderer,
    /// Meshes that stand in the volume.
    meshes: Meshes,
    /// Ends a frame that nobody waits for.
    stop: Stop,
    /// Changes from picture to picture beside the camera.
    motion: Option<VolumeMotion>,
    cameras: Vec<Camera>,
    load_ms: f64,
    classify_ms: f64,
}

impl OpenVolume {
    /// Checks the arguments, reads the volume, and classifies it.
    pub(crate) fn read(args: VolsplatArgs, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        let steps = TimeSteps::of(&args, purpose)?;
        let plan = Plan::new(&request(&args, steps.as_ref()))?;
        let mut args = args;
        if let Some(several) = &steps {
            args = several.args_of(0, &args);
        }
        let typed = look::typed_options(&args, plan.finish.format)?;
        output::layers(
            plan.finish.format,
            args.render.options.blend.layers.as_ref(),
        )?;
        let mut open = loaded(args, &typed, (plan, purpose, steps), verbosity.progress())?;
        open.cameras = cameras(&mut open)?;
        if purpose != Purpose::Draw {
            open.check_still(purpose)?;
        }
        Ok(open)
    }

    /// The volume, or the first of several.
    pub(crate) fn described(&self) -> &dyn Described {
        self.content.first()
    }

    /// The transfer function of the first volume; `None` where it holds labels.
    pub(crate) fn function(&self) -> Option<&TransferFunction> {
        self.content.look.function()
    }

    /// The channels of the file as they are drawn, with their volumes.
    pub(crate) fn shown_channels(&self) -> Vec<(&ShownChannel, &dyn Described)> {
        self.content.shown_channels()
    }

    /// The labels of the first volume that holds labels, with their looks, the most frequent first.
    pub(crate) fn labels(&self) -> Vec<(i64, LabelLook)> {
        self.content.labels()
    }

    /// The arguments under which it is drawn.
    pub(crate) fn args(&self) -> &VolsplatArgs {
        &self.args
    }

    /// The slice of a voxel along an axis of the grid, black and white at the ends of the window.
    pub(crate) fn slice(&self, axis: usize, index: usize, window: [f64; 2]) -> Result<Image> {
        slices::picture(&self.content, Cut::Voxels(axis, index), window)
    }

    /// Takes the transfer function and the render options of `args`; the files are not read again.
    fn take(&mut self, args: VolsplatArgs) -> Result<()> {
        self.content.decide(&args, self.plan.finish.format)?;
        self.content.change(&mut self.renderer, self.keeping)?;
        self.args = args;
        self.meshes.follow(&self.content, &self.args.scene)?;
        self.meshes
            .check(&self.renderer, &self.content.look.options)
    }

    /// The light and blending that go with the look, where none were typed.
    pub(crate) fn suggested(&self) -> Suggested {
        self.content.look.suggested.clone()
    }

    /// The bounding box of the visible voxels, or of all voxels if no voxel is visible: its least and its greatest corner.
    fn visible_bounds_in_world(&self) -> [DVec3; 2] {
        let visible = self.renderer.visible_bounds_in_world();
        let visible = self.content.box_of_steps().or(visible);
        let bounds = visible.unwrap_or_else(|| self.content.first().lattice().bounds_in_world());
        let [low, high] = framing::volume::with_kernels(bounds, self.content.first());
        let meshes = self.meshes.bounds_in_world();
        meshes.map_or([low, high], |[a, b]| [low.min(a), high.max(b)])
    }

    /// The facts that a figure shows.
    fn figure_facts(&self) -> FigureFacts {
        let described = self.described();
        // The first letters of a patient's sides, as scans have them in their corners.
        let letters = described.lattice().patient_sides().map(|sides| {
            let letter = |side: &String| side.chars().next().map(|c| c.to_uppercase().to_string());
            sides.iter().filter_map(letter).collect::<Vec<_>>()
        });
        let names = letters.and_then(|letters| <[String; 3]>::try_from(letters).ok());
        FigureFacts {
            bounds: self.visible_bounds_in_world(),
            unit: described.lattice().length_unit(),
            names: names.unwrap_or(["x", "y", "z"].map(str::to_owned)),
            colours: self.colour_scale(),
        }
    }

    /// The scale of colours of a single transfer function.
    pub(crate) fn colour_scale(&self) -> Option<([f64; 2], Vec<[f32; 3]>)> {
        let function = self.function();
        let single = function.filter(|_| self.content.look.channels.len() == 1);
        single.map(TransferFunction::scale)
    }

    /// The number of steps of a volume over time, or 1.
    pub(crate) fn steps(&self) -> usize {
        self.steps.as_ref().map_or(1, |steps| steps.inputs.len())
    }

    /// The option `--look-of` of the copied command, if the viewer chose the step by itself.
    pub(crate) fn look_word(&self) -> Option<String> {
        match self.steps.as_ref()?.look_of {
            LookOf::Step(step) if self.args.look_of == LookOf::All => {
                Some(format!("--look-of={step}"))
            }
            LookOf::All | LookOf::Step(_) => None,
        }
    }

    /// The names of the steps of a volume over time.
    pub(crate) fn step_names(&self) -> Vec<String> {
        let inputs = self.steps.iter().flat_map(|steps| &steps.inputs);
        inputs.map(InputFile::name).collect()
    }

    /// The main volume or its channels, then the volumes of `--also`.
    pub(crate) fn volumes(&self) -> Result<Vec<&volsplat::Volume>> {
        self.content.volumes()
    }

    /// Returns true if the trilinear field is drawn, and not samples.
    fn is_field(&self) -> bool {
        matches!(self.content.look.options.order, Order::Field(_))
    }

    /// Refuses what changes from picture to picture beside the camera.
    fn check_still(&self, purpose: Purpose) -> Result<()> {
        if self.steps.is_some() && purpose != Purpose::Change {
            bail!(
                "the steps of a volume over time change from picture to picture: choose settings for one of them"
            );
        }
        if self.motion.is_some() {
            bail!(
                "only camera keys are supported here; remove volume changes from the --path file"
            );
        }
        Ok(())
    }

    /// Draws with these options from now on.
    fn draw_with(&mut self, render: &Given<RenderArgs>) -> Result<()> {
        let look = &self.content.look;
        let typed = (&self.args, self.plan.finish.format);
        let options = look.options_with(render, typed, self.content.first())?;
        self.args.render = render.clone();
        if options == self.content.look.options {
            return Ok(());
        }
        let reuse = self.renderer.update(&options)?;
        self.content.look.options = options;
        if reuse == Reuse::NeedsRenderer {
            self.renderer = self.content.renderer(self.keeping, Progress::Hidden)?;
        }
        self.meshes.follow(&self.content, &self.args.scene)
    }

    /// Draws a part of a picture. The first camera sees the part, the second the whole picture.
    fn draw_part(&mut self, cameras: (&Camera, &Camera)) -> Result<Drawn> {
        let both = (&mut self.renderer, &mut self.meshes);
        drawn(both, cameras, Progress::Hidden, &self.stop)
    }

    fn stats_before_drawing(&self, request: &Request) -> RunStats {
        RunStats::new(
            json!({
                "voxels": self.renderer.voxels(),
                "non_transparent": self.renderer.non_transparent(),
                "classify_ms": self.classify_ms,
                "moving": self.motion.as_ref().map(key_motion::record),
                "interpolation_residual": self.renderer.interpolation_residual(),
            }),
            record::record(
                &self.args,
                request,
                self.plan.finish.format,
                &self.content.look,
                self.content.first(),
            ),
            self.load_ms,
        )
    }
}

/// Draws a part of a picture, the volume and its meshes, with counts and times. The first camera sees the part, the second the whole picture.
fn drawn(
    (renderer, meshes): (&mut Renderer, &mut Meshes),
    (camera, whole): (&Camera, &Camera),
    progress: Progress,
    stop: &Stop,
) -> Result<Drawn> {
    let clock = StageClock::start();
    let surfaces = meshes.surfaces(renderer, camera, whole)?;
    let of_meshes = clock.stop();
    let mut watch = watch("drawing", progress);
    let frame = renderer.render_among(camera, &surfaces, stop, &mut watch)?;
    let mut account = Account {
        keys: serde_json::to_value(&frame.stats)?,
        line: record::stage_line(&frame.stats),
        cost: cost(&frame.stats),
    };
    if !meshes.is_empty() {
        account.cost.wall_ms += of_meshes.wall_ms;
        account.cost.cpu_ms += of_meshes.cpu_ms;
        account.line += &format!("; meshes {:.1} ms", of_meshes.wall_ms);
        if let Some(keys) = account.keys.as_object_mut() {
            keys.insert("meshes".to_owned(), serde_json::to_value(of_meshes)?);
        }
    }
    Ok(Drawn {
        image: frame.image,
        account,
    })
}

/// The time and work of a frame, in sub-pixels that a sample is added to.
fn cost(stats: &FrameStats) -> Cost {
    /// The work of looking at a brick, from the times of the stages.
    const BRICK: f64 = 2.0;
    Cost {
        wall_ms: stats.wall_ms,
        cpu_ms: stats.cpu_ms,
        growing: stats.pixels_touched as f64,
        fixed: BRICK * stats.bricks as f64,
        subpixels: stats.subpixels as u32,
    }
}

fn request<'a>(args: &'a VolsplatArgs, steps: Option<&'a TimeSteps>) -> Request<'a> {
    let steps = steps.map_or(&[][..], |steps| &steps.inputs);
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
        steps: match args.only_step {
            Some(_) => 0,
            None => steps.len(),
        },
        inputs: [
            Some(args.input.path.as_path()).filter(|_| steps.is_empty()),
            transfer,
        ]
        .into_iter()
        .flatten()
        .chain(paths(steps))
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

/// The files of steps; of several points in time of one file that file once.
fn paths(steps: &[InputFile]) -> impl Iterator<Item = &Path> {
    let mut paths: Vec<&Path> = steps.iter().map(|step| step.path.as_path()).collect();
    paths.dedup();
    paths.into_iter()
}

/// All but the cameras.
fn loaded(
    args: VolsplatArgs,
    typed: &RenderOptions,
    (plan, purpose, steps): (Plan, Purpose, Option<TimeSteps>),
    progress: Progress,
) -> Result<OpenVolume> {
    let start = Instant::now();
    let mut content = Content::load(
        &args,
        (typed, plan.finish.format),
        steps.as_ref(),
        plan.gate(),
        progress,
    )?;
    let load_ms = report::ms_since(start);
    plan.gate()
        .remarks()
        .iter()
        .for_each(|text| report::say(&format!("note: {text}")));
    let motion = motion(&args, &plan, &mut content)?;
    if let Some(warning) = transfer::warning(&args.transfer, content.first()) {
        report::say(&warning);
    }
    let start = Instant::now();
    let keeping = match purpose {
        Purpose::Change => content.keeping(plan.gate()),
        Purpose::Draw | Purpose::Compare => Keeping::Shown,
    };
    let renderer = content
        .renderer(keeping, progress)
        .with_context(|| format!("{}: cannot be drawn", args.input.path.display()))?;
    let meshes = Meshes::read(&args.scene, &content, plan.gate())?;
    meshes.check(&renderer, &content.look.options)?;
    let classify_ms = report::ms_since(start);
    Ok(OpenVolume {
        args,
        plan,
        content,
        steps,
        keeping,
        renderer,
        meshes,
        stop: Stop::default(),
        motion,
        cameras: Vec::new(),
        load_ms,
        classify_ms,
    })
}

/// Has the content and the renderer show the step of a picture. Returns true if the renderer is another one now.
fn turn(
    (steps, args): (&mut TimeSteps, &VolsplatArgs),
    picture: (usize, usize),
    content: &mut Content,
    renderer: &mut Renderer,
) -> Result<bool> {
    let Some(step) = steps.turn_to(picture) else {
        return Ok(false);
    };
    let args = steps.args_of(step, args);
    content.read_step(&args)?;
    *renderer = content
        .renderer(Keeping::Shown, Progress::Hidden)
        .with_context(|| format!("{}: cannot be drawn", args.input))?;
    Ok(true)
}

/// Changes from picture to picture beside the camera; the content takes the mean of its looks.
fn motion(args: &VolsplatArgs, plan: &Plan, content: &mut Content) -> Result<Option<VolumeMotion>> {
    let Some((path, pictures)) = plan.path() else {
        return Ok(None);
    };
    let motion = VolumeMotion::new(path, pictures, args, content.first())
        .with_context(|| path_name(args))?;
    if let Some(mean) = motion.as_ref().and_then(VolumeMotion::mean) {
        content.follow_keys(mean, args, plan.finish.format)?;
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

fn cameras(open: &mut OpenVolume) -> Result<Vec<Camera>> {
    let bounds = open.visible_bounds_in_world();
    let OpenVolume {
        args,
        plan,
        content,
        steps,
        renderer,
        meshes,
        ..
    } = open;
    if steps.is_none() && renderer.visible_bounds_in_world().is_none() {
        let why = record::why_nothing(args, content.first());
        report::say(&format!("warning: nothing is visible: {why}"));
    }
    let stance =
        framing::volume::stance(content.first(), args.camera.up.map(|axis| axis.direction));
    let extent = Extent::of_box(bounds);
    let request = request(args, steps.as_ref());
    let mut of_box = figure::corners_of_axes(&args.figure, bounds);
    if steps.is_some() || !of_box.is_empty() {
        // A small picture shows one step and no axes, the box of the visible voxels holds all.
        of_box.extend(corners(bounds));
        let mut measure = |camera: &Camera| Ok(seen_points(camera, of_box.iter().copied()));
        return plan.cameras(&request, (&extent, stance), &mut measure);
    }
    fitted(renderer, &content.look.options, bounds, &mut |measure| {
        let mut measure = |camera: &Camera| {
            let volume = measure(camera)?;
            Ok(Seen::both(volume, seen_points(camera, meshes.corners())))
        };
        plan.cameras(&request, (&extent, stance), &mut measure)
    })
}

/// Makes the cameras, and fits them to the visible part. Small pictures find that part where they are quick. Elsewhere the box of the
/// visible voxels stands for it: a volume in its file would be read once more for each look, and samples of the other orders take long.
pub(crate) fn fitted(
    renderer: &mut Renderer,
    options: &RenderOptions,
    bounds: [DVec3; 2],
    cameras: &mut dyn FnMut(&mut Measure) -> Result<Vec<Camera>>,
) -> Result<Vec<Camera>> {
    if options.field().is_none() || renderer.reads_file() {
        let corners = corners(bounds);
        return cameras(&mut |camera| Ok(seen_points(camera, corners.iter().copied())));
    }
    let small = Small::new(options);
    let cameras = cameras(&mut |camera| small.seen(renderer, camera))?;
    let _same = renderer.update(options)?;
    Ok(cameras)
}
