//! `resample warp3d`: a picture with depth, seen from elsewhere.
//!
//! [`OpenDepth`] checks the options before it reads a picture, then reads the references and places the cameras. It writes files
//! last.

pub(crate) mod fed;
mod film;
pub(crate) mod photo;
pub(crate) mod frames;
pub(crate) mod scene;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, anyhow, bail};
use resample_core::Camera;
use resample_io::{Gate, Outside};
use serde_json::{Value, json};
use warp3d::input::DepthKind;
use warp3d::memory::ReferenceSize;
use warp3d::multiview::Layout;
use warp3d::{Fill, WarpOptions, Warper};

use crate::args::{CameraArgs, Drawing, LayoutWord, SequenceArgs, Warp3dArgs};
use crate::cameras::camera_path::KeyKind;
use crate::open::depth::frames::Frames;
use crate::open::open_scene::{OpenScene, Parts};
use crate::open::setting::Setting;
use crate::output;
use crate::picture::Drawn;
use crate::plan::{Change, Pictures, Plan, Purpose, Request, Run, RunLog, refuse_stereo};
use crate::process::report;
use crate::process::report::{Notes, RunStats, Verbosity};
use resample_core::camera::bands::Window;
use texmap::background::Background;

mod cameras;
mod drawer;

use crate::open::depth::scene::{record, write_planes};
use cameras::{cameras, check_layout, convergence, layout, of_frames, spatial, targets};
use drawer::{Comfort, Converges, Drawer, LastPicture, Source};

/// The groups of options that every command has, for the shared code.
struct Shared {
    camera: CameraArgs,
    sequence: SequenceArgs,
    inputs: Vec<PathBuf>,
}

/// References that are read, ready to be warped.
pub(crate) struct OpenDepth {
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

impl OpenDepth {
    /// Checks the arguments, reads the references, places the cameras and prepares the warp.
    pub(crate) fn read(
        mut args: Warp3dArgs,
        purpose: Purpose,
        verbosity: Verbosity,
    ) -> Result<Self> {
        check_words(&args)?;
        let frames = match args.source.held() {
            None => Frames::find(&mut args, verbosity.progress())?,
            Some(_) => None,
        };
        if frames.is_none() {
            photo::set_defaults(&mut args)?;
        }
        let ready = Ready::new(&args, frames, purpose, verbosity)?;
        Ok(Self { args, ready })
    }
}

impl OpenScene for OpenDepth {
    fn cameras(&self) -> &[Camera] {
        &self.ready.cameras
    }

    fn background(&self) -> &Background {
        &self.ready.plan.finish.background
    }

    fn has_bands(&self) -> bool {
        false
    }

    fn parts(&self) -> Parts {
        let is_filled = self.args.render.options.fill != Fill::None;
        // What fills a hole may come from anywhere on its rim.
        if self.ready.drawer.layout != Layout::Single || is_filled {
            return Parts::Whole;
        }
        Parts::Windows {
            side_px: 32,
            guard_px: 1,
        }
    }

    fn set(&mut self, setting: &Setting) -> Result<()> {
        let Setting::Depth(render) = setting else {
            bail!("a setting of another application");
        };
        scene::update(&mut self.ready.drawer.warper, &render.options.options()?)?;
        self.args.render = render.clone();
        Ok(())
    }

    fn change(&mut self, _drawing: &Drawing, _change: Change) -> Result<bool> {
        // New cameras may need another arrangement of the references.
        Ok(false)
    }

    fn turn_to(&mut self, number: usize) -> Result<()> {
        self.ready.drawer.turn_to(number)
    }

    fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        self.ready.drawer.draw_silently(camera)
    }

    fn draw_window(&mut self, camera: &Camera, _window: &Window) -> Result<Drawn> {
        self.draw(camera)
    }

    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()> {
        let Self { args, ready } = *self;
        let Ready {
            plan,
            cameras,
            mut drawer,
            scene,
            load_ms,
        } = ready;
        let frames = drawer.source.as_ref().map(|source| &source.frames);
        let shared = shared(&args, frames);
        let request = request(&args, &shared);
        let stats = RunStats {
            planned,
            ..RunStats::new(
                scene,
                record(
                    &args,
                    &args.render.options.options()?,
                    &request,
                    plan.finish.format,
                    drawer.convergence,
                ),
                load_ms,
            )
        };
        drawer.last = if has_planes(&args) {
            LastPicture::Kept(None)
        } else {
            LastPicture::NotKept
        };
        plan.draw(&request, &cameras, Run { stats, log }, &mut |shot| {
            drawer.draw(shot.camera, shot.number)
        })?;
        match drawer.last {
            LastPicture::Kept(Some(image)) => write_planes(&args, &image),
            LastPicture::Kept(None) | LastPicture::NotKept => Ok(()),
        }
    }
}

impl Ready {
    fn new(
        args: &Warp3dArgs,
        mut frames: Option<Frames>,
        purpose: Purpose,
        verbosity: Verbosity,
    ) -> Result<Self> {
        let shared = shared(args, frames.as_ref());
        let request = request(args, &shared);
        // How many pictures there will be is known when the cameras are read; a name that cannot be is refused now.
        Plan::without_cameras(&request, Pictures::One)?;
        let options = args.render.options.options()?;
        let (start, mut notes) = (Instant::now(), Notes::default());
        let first = first_words(args, frames.as_mut(), purpose, verbosity)?;
        // The cameras tell how large the new picture is, and some of them need the references.
        let guess = args
            .cameras
            .size
            .map_or([1, 1], |size| [size.width, size.height]);
        check_memory(&first, &options, guess)?;
        let mut source = frames.map(|frames| Source::new(frames, args)).transpose()?;
        let (scene, hidden) = match &mut source {
            Some(source) => {
                let read = source.read(0, &mut notes)?;
                (read.scene, read.hidden)
            }
            None => (scene::read(&first, &mut notes)?, None),
        };
        let mut targets = targets(&first, &scene)?;
        let layout = layout(args, &targets[0], scene.nearest);
        let convergence = convergence(args, &scene, &targets[0])?;
        if let Some(source) = &mut source {
            targets = of_frames(args, &source.frames, targets[0], scene.nearest)?;
            source.seen_from(&targets);
        }
        let cameras = cameras(args, &layout, &targets, convergence)?;
        let plan = plan(args, &request, cameras.len() > 1 || source.is_some())?;
        let cameras = plan.checked(cameras)?;
        let largest = cameras
            .iter()
            .map(|camera| [camera.width, camera.height])
            .max_by_key(|&[w, h]| w * h);
        check_memory(&first, &options, largest.unwrap_or(guess))?;
        let load_ms = report::ms_since(start);
        let account = json!({ "references": scene.references.len(), "samples": scene::known(&scene.references) });
        let seen = scene::seen_depths(&scene.references, &targets[0]);
        let warper = Warper::with_hidden(scene.references, hidden, &options)?;
        let mut drawer = Drawer {
            warper,
            source,
            layout,
            comfort: Comfort::new(&first, layout),
            convergence,
            converges: Converges::of(args, &layout),
            notes,
            last: LastPicture::NotKept,
        };
        if let Some(seen) = seen {
            drawer.begin_shot(&seen, &targets[0], 0);
        }
        Ok(Self {
            plan,
            cameras,
            drawer,
            scene: account,
            load_ms,
        })
    }
}

/// The words of the first picture, or of the only one.
fn first_words(
    args: &Warp3dArgs,
    frames: Option<&mut Frames>,
    purpose: Purpose,
    verbosity: Verbosity,
) -> Result<Warp3dArgs> {
    let Some(frames) = frames else {
        if args.sequence.neighbours > 0 {
            bail!(
                "--neighbours: {} is one picture: give a pattern such as %04d, or a list",
                args.colour
            );
        }
        return Ok(args.clone());
    };
    check_frames(args, purpose)?;
    frames.check_neighbours(args)?;
    frames.find_range(args, verbosity.progress())?;
    frames.words(args, 0)
}

/// The plan of one picture or several.
fn plan(args: &Warp3dArgs, request: &Request, is_several: bool) -> Result<Plan> {
    if is_several && has_planes(args) {
        bail!(
            "--filled and --confidence write one file: for several pictures use .exr, which holds both for each"
        );
    }
    let pictures = if is_several {
        Pictures::Several
    } else {
        Pictures::One
    };
    Plan::without_cameras(request, pictures)
}

/// Refuses what does not go with several pictures with depth.
fn check_frames(args: &Warp3dArgs, purpose: Purpose) -> Result<()> {
    let sequence = &args.sequence;
    let given = [
        ("--sway", sequence.sway.is_some()),
        ("--path", sequence.path.is_some()),
        ("--reference", !args.cameras.reference.is_empty()),
        (
            "--max-error and --max-time",
            args.ask.max_error.is_some() || args.ask.max_time_ms.is_some(),
        ),
        ("comparing settings", purpose != Purpose::Draw),
    ];
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((what, _)) => bail!("{}: {what} is for a single picture: name one", args.colour),
        None => Ok(()),
    }
}

/// Returns true if the filled part or the confidence of the picture is written.
fn has_planes(args: &Warp3dArgs) -> bool {
    args.filled.is_some() || args.confidence.is_some()
}

/// Refuses a picture of this size that takes more memory than `--max-memory` allows.
fn check_memory(args: &Warp3dArgs, options: &WarpOptions, target: [u32; 2]) -> Result<()> {
    let gate = Gate::new(Outside::Refused, args.max_memory);
    let sizes = scene::sizes(args)?;
    if gate.given_memory().is_none() {
        check_unpacked(args, &sizes, &gate)?;
    }
    Ok(warp3d::memory::check_memory(
        &sizes,
        target,
        options,
        gate.max_memory(),
    )?)
}

/// Refuses small files that unpack to large references.
fn check_unpacked(args: &Warp3dArgs, sizes: &[ReferenceSize], gate: &Gate) -> Result<()> {
    if args.source.held().is_some() {
        return Ok(());
    }
    // At least a byte for each of three colours, and one of depth.
    const PIXEL_BYTES: u64 = 4;
    let pixels: u64 = sizes
        .iter()
        .map(|&ReferenceSize { size: [w, h], .. }| u64::from(w) * u64::from(h))
        .sum();
    let held = |path: PathBuf| std::fs::metadata(path).map_or(0, |file| file.len());
    let packed = scene::files(args).into_iter().map(held).sum();
    gate.ask_unpacked(pixels.saturating_mul(PIXEL_BYTES), packed, "the references")
        .map_err(|what| anyhow!("{}: {what}", args.colour))
}

fn shared(args: &Warp3dArgs, frames: Option<&Frames>) -> Shared {
    let sequence = &args.sequence;
    Shared {
        // The cameras of this command are --from and --to; none of the shared ones is used.
        camera: CameraArgs {
            size: args.cameras.size,
            save_camera: args.cameras.save_camera.clone(),
            ..CameraArgs::default()
        },
        sequence: SequenceArgs {
            path: sequence.path.clone(),
            resume: sequence.resume,
            fps: sequence.fps,
            part: sequence.part,
            original: frames.and_then(|frames| frames.film()?.original()),
            spatial: spatial(args),
            ..SequenceArgs::default()
        },
        inputs: scene::files(args)
            .into_iter()
            .chain(frames.into_iter().flat_map(Frames::files))
            .collect(),
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
        steps: 0,
        picture: &args.picture,
        keys: KeyKind::Cameras,
        vector_level: args.render.options.vector_level,
        gate: Gate::new(Outside::Refused, args.max_memory),
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
        refuse_stereo(output::format_of(path, None)?, path)?;
    }
    if args.filled.is_some() && args.filled == args.confidence {
        bail!("--filled and --confidence have the same name: choose another one");
    }
    if args.confidence.is_some() && args.views.anaglyph.is_some() {
        bail!("--confidence: an anaglyph shows two views at once: leave it out");
    }
    if args.meaning.relative_range.is_some() && args.meaning.kind() != DepthKind::Relative {
        bail!("--relative-range is the range of relative depth: give --depth-kind relative too");
    }
    let views = &args.views;
    let is_whole = views
        .layout
        .is_none_or(|layout| layout == LayoutWord::SideBySide);
    let is_pair = views.stereo.is_some() && views.anaglyph.is_none() && is_whole;
    if let (false, Ok(format)) = (is_pair, output::format_of(&args.output, None)) {
        refuse_stereo(format, &args.output)?;
    }
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
