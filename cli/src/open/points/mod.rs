//! `resample points`: a scan of points to one picture or several.
//!
//! [`OpenPoints`] checks the options before it reads the scan, and writes nothing before it has checked all input. `scan` reads the
//! points, drops those outside the crop, and makes discs of the rest; `look` colours the discs; `classes` colours classes.

pub(crate) mod scan;
mod classes;
mod look;

use std::time::Instant;

use anyhow::{Result, bail};
use glam::DVec3;
use resample_cloud::input::CloudFormat;
use resample_cloud::{CloudFrame, CloudOptions, CloudOutline, CloudRenderer, LeftOut};
use resample_core::Camera;
use resample_core::simd::SimdLevel;
use resample_io::figure::Figure;
use serde_json::{Value, json};

use crate::args::{Drawing, Given, PointsArgs, PointsRenderArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::framing::{Extent, Stance, seen_points};
use crate::open::figure;
use crate::open::figure::FigureFacts;
use crate::open::open_scene::{OpenScene, Parts};
use crate::open::points::look::Found;
use crate::open::points::scan::{Positions, Scan};
use crate::open::setting::Setting;
use crate::output;
use crate::output::Format;
use crate::picture::Drawn;
use crate::plan;
use crate::plan::{Change, Plan, Purpose, Request, Run, RunLog};
use crate::process::report;
use crate::process::report::{Account, Cost, RunStats, Verbosity};
use resample_core::camera::bands::Window;
use texmap::background::Background;

/// A scan that is read, ready to be drawn.
pub(crate) struct OpenPoints {
    args: PointsArgs,
    plan: Plan,
    scan: Scan,
    positions: Positions,
    renderer: CloudRenderer,
    found: Found,
    outline: CloudOutline,
    cameras: Vec<Camera>,
    load_ms: f64,
    prepare_ms: f64,
}

impl OpenPoints {
    /// Checks the arguments, reads the scan, and prepares it.
    pub(crate) fn read(args: PointsArgs, purpose: Purpose, verbosity: Verbosity) -> Result<Self> {
        let start = Instant::now();
        let plan = Plan::new(&request(&args))?;
        plain_options(&args.render.options).validate()?;
        output::layers(plan.finish.format, args.render.options.layers.as_ref())?;
        if let Some(part) = &args.input.part {
            let path = args.input.path.display();
            bail!(
                "{path}#{part}: scans are read whole: leave #{part} out, or choose points by --crop"
            );
        }
        let mut scan = Scan::read(&args, plan.gate())?;
        let load_ms = report::ms_since(start);
        let positions = match purpose {
            Purpose::Draw | Purpose::Compare => Positions::Spent,
            Purpose::Change => Positions::Kept,
        };
        let begun = Instant::now();
        let (renderer, outline, found) = prepared(&mut scan, &args, &plan, positions)?;
        let prepare_ms = report::ms_since(begun);
        let mut open = Self {
            cameras: Vec::new(),
            args,
            plan,
            scan,
            positions,
            renderer,
            found,
            outline,
            load_ms,
            prepare_ms,
        };
        open.cameras = open.cameras_of_args()?;
        open.draw_with(&open.args.render.clone())?;
        if verbosity != Verbosity::Quiet {
            report::say_notes(&open.notes());
        }
        Ok(open)
    }

    /// Draws with these options from now on.
    fn draw_with(&mut self, render: &Given<PointsRenderArgs>) -> Result<()> {
        let options = self.options(&render.options);
        self.renderer.update(&options)?;
        self.args.render = render.clone();
        Ok(())
    }

    /// The renderer's options.
    fn options(&self, render: &PointsRenderArgs) -> CloudOptions {
        let Stance { up, right } = Stance::upright(height_axis(&self.args, &self.scan));
        // From above, from the right and from the front, as meshes have it.
        let light = up + 0.4 * right + 0.6 * right.cross(up);
        render.options(self.found.shade(), light)
    }

    /// Takes the part, the look and the render options of `args`.
    fn take(&mut self, args: PointsArgs) -> Result<()> {
        let is_same_part = self.args.part == args.part;
        self.args = args;
        if is_same_part {
            let up = height_axis(&self.args, &self.scan);
            let (look, file) = (&self.args.look, &self.scan.file);
            self.found = look::colour(&mut self.renderer, look, file, up)?;
        } else {
            let all = prepared(&mut self.scan, &self.args, &self.plan, self.positions)?;
            (self.renderer, self.outline, self.found) = all;
        }
        self.draw_with(&self.args.render.clone())
    }

    fn cameras_of_args(&self) -> Result<Vec<Camera>> {
        let of_axes = figure::corners_of_axes(&self.args.figure, self.outline.bounds);
        let points = || self.outline.points.iter().chain(&of_axes).copied();
        let extent = Extent::of_points(self.outline.bounds, points());
        let mut measure = |camera: &Camera| Ok(seen_points(camera, points()));
        let stance = stance(&self.args, &self.scan);
        self.plan
            .cameras(&request(&self.args), (&extent, stance), &mut measure)
    }

    /// Remarks for the person who looks at the picture.
    fn notes(&self) -> Vec<String> {
        let mut notes = self.scan.file.notes.clone();
        if !self.args.part.keep_all {
            notes.extend(self.scan.file.left_by_grid());
        }
        notes.extend(left_out(
            self.scan.points,
            self.renderer.prepared().left_out,
        ));
        if self.outline.far > 0 {
            notes.push(format!(
                "{} points lie far beyond the others: the camera does not move back for them; --crop leaves them out",
                self.outline.far
            ));
        }
        let camera = &self.args.camera;
        let is_framed = camera.camera.is_none() && self.args.sequence.path.is_none();
        if is_framed && camera.up.is_none() {
            let (up, other) = match scan::up_of(self.scan.format) {
                DVec3::Y => ("y", "z"),
                _ => ("z", "y"),
            };
            notes.push(format!(
                "{up} points up, as in most files of this kind; --up {other} draws it otherwise"
            ));
        }
        notes.extend(self.found.note.clone());
        notes
    }
}

impl OpenScene for OpenPoints {
    fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    fn background(&self) -> &Background {
        &self.plan.finish.background
    }

    fn figure(&self) -> Result<Option<Figure>> {
        // ASTM E2807 has metres; other files say nothing.
        let is_in_metres = self.scan.format == Some(CloudFormat::E57);
        figure::figure(&self.args.figure, self.background(), || FigureFacts {
            colours: self.found.scale(),
            ..FigureFacts::of_box(self.outline.bounds, is_in_metres.then(|| "m".to_owned()))
        })
    }

    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        Some(self.outline.bounds)
    }

    fn parts(&self) -> Parts {
        // Coverage looks at the pixels around one, and the front at those around them.
        Parts::Windows {
            side_px: 32,
            guard_px: 2,
        }
    }

    fn set(&mut self, setting: &Setting) -> Result<()> {
        match setting {
            Setting::Points(render) => self.draw_with(render),
            _ => bail!("a setting of another application"),
        }
    }

    fn restyle(&mut self, drawing: &Drawing) -> Result<()> {
        match drawing {
            Drawing::Points(args) => self.take((**args).clone()),
            _ => bail!("a command of another application"),
        }
    }

    fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        let Drawing::Points(args) = drawing else {
            return Ok(false);
        };
        let args = (**args).clone();
        self.plan = Plan::new(&request(&args))?;
        if change == Change::View {
            self.args = args;
        } else {
            self.take(args)?;
        }
        self.cameras = self.cameras_of_args()?;
        Ok(true)
    }

    fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        drawn(&mut self.renderer, camera, window)
    }

    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()> {
        let options = self.options(&self.args.render.options);
        let stats = RunStats {
            planned,
            ..RunStats::new(self.scene_record(), self.record(&options), self.load_ms)
        };
        if log.verbosity == Verbosity::Verbose {
            report::say(&format!(
                "load {:.1} ms, prepare {:.1} ms",
                self.load_ms, self.prepare_ms
            ));
        }
        let figure = self.figure()?;
        let Self {
            args,
            mut plan,
            mut renderer,
            cameras,
            ..
        } = *self;
        plan.finish.figure = figure;
        plan.draw(&request(&args), &cameras, Run { stats, log }, &mut |shot| {
            drawn(&mut renderer, shot.camera, &shot.window)
        })
    }
}

impl OpenPoints {
    fn scene_record(&self) -> Value {
        let prepared = self.renderer.prepared();
        json!({
            "format": self.scan.format.map(|format| format.name()),
            "points": self.scan.points,
            "discs": prepared.discs.len(),
            "isolated": prepared.left_out.isolated,
            "without_spacing": prepared.left_out.without_spacing,
            "notes": self.notes(),
            "prepare_ms": self.prepare_ms,
        })
    }

    /// Everything that decided the pictures, for the stats file.
    fn record(&self, options: &CloudOptions) -> Value {
        let args = &self.args;
        let request = request(args);
        let part = &args.part;
        let planes = part.clip_plane.iter();
        json!({
            "scan": { "file": report::name(&args.input.path), "points": part.points, "keep_all": part.keep_all, "crop": part.crop,
                "clip_planes": planes.map(|p| [p.normal.x, p.normal.y, p.normal.z, p.offset]).collect::<Vec<_>>() },
            "colours": { "by": crate::values::word(self.found.by), "range": self.found.range,
                "map": args.look.colormap.map(|map| map.name()) },
            "camera": plan::camera_record(&request, stance(args, &self.scan)),
            "render": options,
            "picture": plan::picture_record(&request, self.format()),
        })
    }

    fn format(&self) -> Format {
        self.plan.finish.format
    }
}

/// A renderer of the coloured discs, the box that a picture has to show, and the colours that were chosen.
fn prepared(
    scan: &mut Scan,
    args: &PointsArgs,
    plan: &Plan,
    positions: Positions,
) -> Result<(CloudRenderer, CloudOutline, Found)> {
    let discs = scan.prepared(args, plan.gate(), positions)?;
    let outline = CloudOutline::of(&discs);
    let mut renderer = CloudRenderer::new(discs, &plain_options(&args.render.options))?;
    let up = height_axis(args, scan);
    let found = look::colour(&mut renderer, &args.look, &scan.file, up)?;
    Ok((renderer, outline, found))
}

/// The options before the colours are known.
fn plain_options(render: &PointsRenderArgs) -> CloudOptions {
    let CloudOptions { shade, light, .. } = CloudOptions::default();
    render.options(shade, light)
}

fn stance(args: &PointsArgs, scan: &Scan) -> Stance {
    let usual = scan::up_of(scan.format);
    Stance::upright(args.camera.up.map_or(usual, |axis| axis.direction))
}

/// The direction in which heights grow. It may differ from that of the picture, which a camera file gives.
fn height_axis(args: &PointsArgs, scan: &Scan) -> DVec3 {
    let typed = args.look.height_axis;
    typed.map_or(stance(args, scan).up, |axis| axis.direction)
}

/// Says how many points got no disc.
fn left_out(points: usize, left: LeftOut) -> Vec<String> {
    let mut notes = Vec::new();
    if left.isolated > 0 {
        notes.push(format!(
            "{} of {points} points float far from the others and are left out; --keep-all draws them",
            left.isolated
        ));
    }
    if left.without_spacing > 0 {
        notes.push(format!(
            "{} of {points} points lie in the place of 12 others and are left out",
            left.without_spacing
        ));
    }
    notes
}

fn request(args: &PointsArgs) -> Request<'_> {
    Request {
        output: &args.output,
        stats: args.stats.as_deref(),
        camera: &args.camera,
        sequence: &args.sequence,
        steps: 0,
        picture: &args.picture,
        keys: KeyKind::Cameras,
        vector_level: SimdLevel::Auto,
        gate: args.part.reading.gate(),
        inputs: vec![args.input.path.as_path()],
        others: Vec::new(),
    }
}

fn drawn(renderer: &mut CloudRenderer, camera: &Camera, window: &Window) -> Result<Drawn> {
    let CloudFrame { image, stats } =
        renderer.render_window(camera, window.first(), window.size())?;
    let (wall_ms, cpu_ms) = (
        stats.project.wall_ms + stats.draw.wall_ms,
        stats.project.cpu_ms + stats.draw.cpu_ms,
    );
    /// The work of a disc, from the times of the stages, in pixels.
    const DISC: f64 = 0.3;
    let account = Account {
        keys: json!({
            "wall_ms": wall_ms,
            "cpu_ms": cpu_ms,
            "project": stats.project,
            "draw": stats.draw,
            "discs": stats.discs,
            "in_view": stats.in_view,
            "seen_px": stats.seen,
        }),
        line: format!(
            "{wall_ms:.1} ms wall, {cpu_ms:.1} ms CPU (project {:.1}, draw {:.1} ms); {} of {} points in view",
            stats.project.wall_ms, stats.draw.wall_ms, stats.in_view, stats.discs
        ),
        cost: Cost {
            wall_ms,
            cpu_ms,
            growing: stats.seen as f64,
            fixed: DISC * stats.discs as f64,
            subpixels: 0,
        },
    };
    Ok(Drawn { image, account })
}
