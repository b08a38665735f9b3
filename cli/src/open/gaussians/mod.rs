//! `resample gaussians`: a file of 3-D Gaussians to one picture or several.
//!
//! [`OpenGaussians`] checks the options before it reads the Gaussians, and writes nothing before it has checked all input.

mod options;
mod record;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::{Camera, Stop};
use resample_io::figure::Figure;
use serde_json::Value;
use volsplat::gaussians::Outline;
use volsplat::{
    GaussianFormat, GaussianLayer, GaussianLoadOptions, GaussianOptions, GaussianRenderer,
    Gaussians,
};

use crate::args::{Drawing, GaussianRenderArgs, GaussiansArgs, Given};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::framing::{Extent, Stance, seen_points};
use crate::cameras::viewpoint;
use crate::open::figure;
use crate::open::figure::FigureFacts;
use crate::open::gaussians::options::{clip, render_options};
use crate::open::gaussians::record::{account, record, scene_record};
use crate::open::open_scene::{OpenScene, Parts, Probed};
use crate::open::setting::Setting;
use crate::picture::Drawn;
use crate::plan::{Change, Plan, Request, Run, RunLog};
use crate::process::report;
use crate::process::report::{RunStats, Verbosity};
use crate::values::input_file::Source;
use resample_core::camera::bands::Window;
use texmap::background::Background;

/// Gaussians that are read, ready to be drawn.
pub(crate) struct OpenGaussians {
    args: GaussiansArgs,
    plan: Plan,
    gaussians: Arc<Gaussians>,
    format: Option<GaussianFormat>,
    notes: Vec<String>,
    renderer: GaussianRenderer,
    outline: Outline,
    cameras: Vec<Camera>,
    load_ms: f64,
}

impl OpenGaussians {
    /// Checks the arguments and reads the Gaussians.
    pub(crate) fn read(args: GaussiansArgs, verbosity: Verbosity) -> Result<Self> {
        let start = Instant::now();
        let plan = Plan::new(&request(&args))?;
        let options = render_options(&args.render.options, plan.finish.format)?;
        let read = Read::of(&args, &plan)?;
        let load_ms = report::ms_since(start);
        if verbosity != Verbosity::Quiet {
            report::say_notes(read.notes.iter().chain(&axis_note(&args, read.format)));
        }
        let Read {
            gaussians,
            format,
            notes,
        } = read;
        let outline = outline(&args, &gaussians)?;
        let cameras = cameras(&args, &plan, &outline, format)?;
        Ok(Self {
            renderer: GaussianRenderer::new(gaussians.clone(), &options)?,
            args,
            plan,
            gaussians,
            format,
            notes,
            outline,
            cameras,
            load_ms,
        })
    }

    fn options(&self) -> Result<GaussianOptions> {
        render_options(&self.args.render.options, self.plan.finish.format)
    }

    /// Draws with these options from now on.
    fn draw_with(&mut self, render: &Given<GaussianRenderArgs>) -> Result<()> {
        let options = render_options(&render.options, self.plan.finish.format)?;
        let is_cut_otherwise = render.options.clip != self.args.render.options.clip;
        self.args.render = render.clone();
        if is_cut_otherwise {
            self.outline = outline(&self.args, &self.gaussians)?;
        }
        Ok(self.renderer.update(&options)?)
    }
}

impl OpenScene for OpenGaussians {
    fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    fn background(&self) -> &Background {
        &self.plan.finish.background
    }

    fn figure(&self) -> Result<Option<Figure>> {
        figure::figure(&self.args.figure, self.background(), || {
            FigureFacts::of_box(self.outline.bounds, None)
        })
    }

    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        Some(self.outline.bounds)
    }

    fn parts(&self) -> Parts {
        // Every part looks at all Gaussians once, which takes about as long as a part of this size. A guess.
        Parts::Windows {
            side_px: 64,
            guard_px: 0,
        }
    }

    fn set(&mut self, setting: &Setting) -> Result<()> {
        match setting {
            Setting::Gaussians(render) => self.draw_with(render),
            _ => bail!("a setting of another application"),
        }
    }

    fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        let Drawing::Gaussians(args) = drawing else {
            return Ok(false);
        };
        let args = (**args).clone();
        self.plan = Plan::new(&request(&args))?;
        if change != Change::View {
            self.draw_with(&args.render)?;
        }
        self.args = args;
        self.cameras = cameras(&self.args, &self.plan, &self.outline, self.format)?;
        Ok(true)
    }

    fn stop_with(&mut self, stop: Stop) {
        self.renderer.stop_with(stop);
    }

    fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        drawn(&mut self.renderer, camera, window)
    }

    fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        let options = self.options()?;
        self.renderer.update(&GaussianOptions {
            layers: vec![GaussianLayer::MedianDepth],
            ..options.clone()
        })?;
        let frame = self.renderer.render(pixel);
        self.renderer.update(&options)?;
        let image = frame?.image;
        let depth = image.planes.first().and_then(|plane| plane.values.first());
        let depth = depth.filter(|depth| depth.is_finite());
        let world = depth.map(|&depth| viewpoint::world_at(pixel, f64::from(depth)));
        Ok(world.map(Probed::of_surface))
    }

    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()> {
        let options = self.options()?;
        let figure = self.figure()?;
        let request = request(&self.args);
        let stats = RunStats {
            planned,
            ..RunStats::new(
                scene_record(&self.gaussians, self.format, &self.notes),
                record(
                    &self.args,
                    &request,
                    (&options, self.plan.finish.format),
                    stance(&self.args, self.format),
                ),
                self.load_ms,
            )
        };
        if log.verbosity == Verbosity::Verbose {
            report::say(&format!("load {:.1} ms", self.load_ms));
        }
        let mut plan = self.plan;
        plan.finish.figure = figure;
        let mut renderer = self.renderer;
        let run = Run { stats, log };
        plan.draw(&request, &self.cameras, run, &mut |shot| {
            drawn(&mut renderer, shot.camera, &shot.window)
        })
    }
}

/// Gaussians of a file or of memory.
struct Read {
    gaussians: Arc<Gaussians>,
    format: Option<GaussianFormat>,
    notes: Vec<String>,
}

impl Read {
    fn of(args: &GaussiansArgs, plan: &Plan) -> Result<Self> {
        if let Source::Memory(held) = &args.source {
            return Ok(Self {
                gaussians: held.clone(),
                format: None,
                notes: Vec::new(),
            });
        }
        let path = &args.input.path;
        if let Some(part) = &args.input.part {
            bail!(
                "{}#{part}: a file of Gaussians has no parts",
                path.display()
            );
        }
        let options = GaussianLoadOptions {
            gate: plan.gate().clone(),
        };
        let (gaussians, notes) = volsplat::load_gaussians(path, &options)?;
        Ok(Self {
            gaussians: gaussians.into(),
            format: volsplat::gaussian_format_of(path)?,
            notes,
        })
    }
}

/// The note on an axis that nobody typed and no format states.
fn axis_note(args: &GaussiansArgs, format: Option<GaussianFormat>) -> Option<String> {
    let is_framed = args.camera.camera.is_none() && args.sequence.path.is_none();
    let is_taken = is_framed && args.camera.up.is_none() && format?.up_in_world() == DVec3::NEG_Y;
    is_taken.then(|| {
        "y is taken to point down, as it does in most files of this kind; --up y if the picture stands on its head".to_owned()
    })
}

fn stance(args: &GaussiansArgs, format: Option<GaussianFormat>) -> Stance {
    // Gaussians of memory have the axes of their training, as files of PLY.
    let format = format.unwrap_or(GaussianFormat::Ply);
    let stated = format.up_in_world();
    Stance::upright(args.camera.up.map_or(stated, |axis| axis.direction))
}

fn outline(args: &GaussiansArgs, gaussians: &Gaussians) -> Result<Outline> {
    let name = args.input.path.display();
    let Some(outline) = Outline::of(gaussians, &clip(&args.render.options.clip)) else {
        let Some([low, high]) = gaussians.bounds_in_world(|_| true) else {
            bail!("{name}: there are no Gaussians");
        };
        bail!(
            "{name}: --crop or --clip-plane keeps the centre of no Gaussian: they reach from {low} to {high}"
        );
    };
    Ok(outline)
}

fn cameras(
    args: &GaussiansArgs,
    plan: &Plan,
    outline: &Outline,
    format: Option<GaussianFormat>,
) -> Result<Vec<Camera>> {
    let of_axes = figure::corners_of_axes(&args.figure, outline.bounds);
    let points = || outline.points.iter().chain(&of_axes).copied();
    let extent = Extent::of_points(outline.bounds, points());
    let mut measure = |camera: &Camera| Ok(seen_points(camera, points()));
    plan.cameras(
        &request(args),
        (&extent, stance(args, format)),
        &mut measure,
    )
}

fn request(args: &GaussiansArgs) -> Request<'_> {
    Request {
        output: &args.output,
        stats: args.stats.as_deref(),
        camera: &args.camera,
        sequence: &args.sequence,
        steps: 0,
        picture: &args.picture,
        keys: KeyKind::Cameras,
        vector_level: args.render.options.vector_level,
        gate: args.reading.gate(),
        inputs: vec![args.input.path.as_path()],
        others: Vec::new(),
    }
}

fn drawn(renderer: &mut GaussianRenderer, camera: &Camera, window: &Window) -> Result<Drawn> {
    let frame = renderer.render_window(camera, window.first(), window.size())?;
    Ok(Drawn {
        account: account(&frame.stats)?,
        image: frame.image,
    })
}
