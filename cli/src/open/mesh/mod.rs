//! `resample texmap`: a mesh file to one picture or several.
//!
//! [`OpenMesh`] checks the options before it reads the mesh, and writes nothing before it has checked all input.

use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use glam::{DVec3, Vec3};
use resample_core::{Camera, Reuse};
use resample_io::Gate;
use resample_io::figure::Figure;
use serde_json::{Value, json};
use texmap::input::{LightMaps, SceneChoice, Unreadable};
use texmap::scene::Mesh;
use texmap::scene_camera;
use texmap::{
    FrameStats, LoadOptions, Loaded, PlaneKind, Pose, RenderOptions, Renderer, Scene, Shade,
    Textures,
};

use crate::args::{Drawing, Given, ModelArgs, SequenceArgs, TexmapArgs};
use crate::cameras::camera_path::KeyKind;
use crate::cameras::framing::{Extent, Stance, seen_points};
use crate::cameras::viewpoint;
use crate::open::figure;
use crate::open::figure::FigureFacts;
use crate::open::open_scene::{OpenScene, Parts, Probed};
use crate::open::setting::Setting;
use crate::output::Format;
use crate::picture::{Drawn, Finish};
use crate::plan::{Change, Plan, Request, Run, RunLog};
use crate::process::report;
use crate::process::report::{Account, Cost, RunStats, Verbosity};
use crate::{output, plan};
use resample_core::camera::bands::Window;
use texmap::background::Background;

/// A mesh that is read, ready to be drawn.
pub(crate) struct OpenMesh {
    args: TexmapArgs,
    plan: Plan,
    scene: Scene,
    notes: Vec<String>,
    renderer: Renderer,
    cameras: Vec<Camera>,
    load_ms: f64,
    prepare_ms: f64,
    /// The picture whose pose the renderer has, where that is known.
    posed: Option<usize>,
}

impl OpenMesh {
    /// Checks the arguments, reads the mesh, and prepares it.
    pub(crate) fn read(args: TexmapArgs, verbosity: Verbosity) -> Result<Self> {
        let start = Instant::now();
        let plan = Plan::new(&request(&args))?;
        let options = render_options(&args.render.options, &plan.finish)?;
        let Loaded { scene, notes } = loaded(&args, 0, plan.gate())?;
        let load_ms = report::ms_since(start);
        if verbosity != Verbosity::Quiet {
            report::say_notes(&notes);
        }
        let begun = Instant::now();
        let renderer = prepared(&scene, &args, &options)
            .with_context(|| format!("{}: cannot be drawn", args.input.path.display()))?;
        let prepare_ms = report::ms_since(begun);
        let cameras = cameras(&args, &plan, &scene, &renderer)?;
        Ok(Self {
            args,
            plan,
            scene,
            notes,
            renderer,
            cameras,
            load_ms,
            prepare_ms,
            posed: Some(0),
        })
    }

    /// Draws with these options from now on.
    fn draw_with(&mut self, render: &Given<RenderOptions>) -> Result<()> {
        let options = render_options(&render.options, &self.plan.finish)?;
        self.args.render = render.clone();
        if self.renderer.update(&options)? == Reuse::NeedsRenderer {
            self.renderer = prepared(&self.scene, &self.args, &options)?;
        }
        Ok(())
    }

    /// Takes the textures and the render options of `args`; the file is read again only where its pictures were left out.
    fn take(&mut self, args: TexmapArgs) -> Result<()> {
        let render = args.render.clone();
        let before = self.args.model.textures;
        self.args = args;
        if before == self.args.model.textures {
            return self.draw_with(&render);
        }
        if before == Textures::LeftOut {
            // What could not be read was left out with the rest; now it is missed.
            self.scene = loaded(&self.args, 0, self.plan.gate())?.scene;
        }
        let options = render_options(&render.options, &self.plan.finish)?;
        self.renderer = prepared(&self.scene, &self.args, &options)?;
        Ok(())
    }
}

impl OpenScene for OpenMesh {
    fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    fn background(&self) -> &Background {
        &self.plan.finish.background
    }

    fn figure(&self) -> Result<Option<Figure>> {
        let input = self.args.input.path.extension();
        let is_gltf = input.is_some_and(|ending| {
            ending.eq_ignore_ascii_case("glb") || ending.eq_ignore_ascii_case("gltf")
        });
        figure::figure(&self.args.figure, self.background(), || {
            let bounds = self.renderer.bounds_in_world().unwrap_or_default();
            FigureFacts::of_box(bounds, is_gltf.then(|| "m".to_owned()))
        })
    }

    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.renderer.bounds_in_world()
    }

    fn parts(&self) -> Parts {
        Parts::Windows {
            side_px: 16,
            guard_px: 0,
        }
    }

    fn set(&mut self, setting: &Setting) -> Result<()> {
        match setting {
            Setting::Mesh(render) => self.draw_with(render),
            _ => bail!("a setting of another application"),
        }
    }

    fn restyle(&mut self, drawing: &Drawing) -> Result<()> {
        match drawing {
            Drawing::Texmap(args) => self.take((**args).clone()),
            _ => bail!("a command of another application"),
        }
    }

    fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        let Drawing::Texmap(args) = drawing else {
            return Ok(false);
        };
        let args = (**args).clone();
        let plan = Plan::new(&request(&args))?;
        self.plan = plan;
        if change == Change::View {
            self.args = args;
        } else {
            self.take(args)?;
            // The renderer may be a new one, in the pose of the file.
            self.posed = None;
        }
        self.cameras = cameras(&self.args, &self.plan, &self.scene, &self.renderer)?;
        Ok(true)
    }

    fn turn_to(&mut self, number: usize) -> Result<()> {
        if self.args.model.play && self.posed != Some(number) {
            let options = render_options(&self.args.render.options, &self.plan.finish)?;
            self.renderer = posed(&self.args, &options, number, self.plan.gate())?;
            self.posed = Some(number);
        }
        Ok(())
    }

    fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        drawn(&mut self.renderer, camera, window)
    }

    fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        let options = render_options(&self.args.render.options, &self.plan.finish)?;
        let _kept = self.renderer.update(&RenderOptions {
            planes: vec![PlaneKind::Depth],
            ..options.clone()
        })?;
        let frame = self.renderer.render(pixel);
        let _kept = self.renderer.update(&options)?;
        let world = viewpoint::in_world(pixel, &frame?.image);
        Ok(world.map(Probed::of_surface))
    }

    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()> {
        let figure = self.figure()?;
        let Self {
            args,
            mut plan,
            scene,
            notes,
            mut renderer,
            cameras,
            load_ms,
            prepare_ms,
            ..
        } = *self;
        plan.finish.figure = figure;
        let request = request(&args);
        let options = render_options(&args.render.options, &plan.finish)?;
        let stats = RunStats {
            planned,
            ..RunStats::new(
                scene_record(&scene, &notes, prepare_ms),
                record(&args, &request, &options, plan.finish.format, stance(&args)),
                load_ms,
            )
        };
        // The renderer has its own copy of what it draws.
        drop(scene);
        if log.verbosity == Verbosity::Verbose {
            report::say(&format!("load {load_ms:.1} ms, prepare {prepare_ms:.1} ms"));
        }
        plan.draw(&request, &cameras, Run { stats, log }, &mut |shot| {
            // The first picture is prepared already.
            if args.model.play && shot.number > 0 {
                renderer = posed(&args, &options, shot.number, plan.gate())?;
            }
            drawn(&mut renderer, shot.camera, &shot.window)
        })
    }
}

/// A renderer of the scene with the textures that were asked for.
fn prepared(scene: &Scene, args: &TexmapArgs, options: &RenderOptions) -> Result<Renderer> {
    let textures = args.model.textures;
    Ok(match textures {
        Textures::Shown => Renderer::new(scene, options)?,
        Textures::LeftOut | Textures::Grid => {
            Renderer::new(&textures.applied_to(scene.clone()), options)?
        }
    })
}

/// The scene as picture `number` of a played animation shows it.
fn posed(
    args: &TexmapArgs,
    options: &RenderOptions,
    number: usize,
    gate: &Gate,
) -> Result<Renderer> {
    let Loaded { scene, .. } = loaded(args, number, gate)?;
    prepared(&scene, args, options)
}

/// The scene as picture `number` shows it.
fn loaded(args: &TexmapArgs, number: usize, gate: &Gate) -> Result<Loaded> {
    if let Some(held) = args.source.held() {
        return Ok(held.clone());
    }
    let load = load_options(args, number, gate);
    let path = &args.input.path;
    texmap::load(path, &load).map_err(|error| match volsplat::is_gaussians(path) {
        true => anyhow!(
            "{}: holds 3-D Gaussians and no mesh: resample gaussians draws it",
            path.display()
        ),
        false => error.into(),
    })
}

fn stance(args: &TexmapArgs) -> Stance {
    Stance::upright(args.camera.up.map_or(DVec3::Y, |axis| axis.direction))
}

fn cameras(
    args: &TexmapArgs,
    plan: &Plan,
    scene: &Scene,
    renderer: &Renderer,
) -> Result<Vec<Camera>> {
    // A scene that was loaded has triangles.
    let bounds = renderer.bounds_in_world().unwrap_or_default();
    match &args.model.camera_name {
        None => {
            let of_axes = figure::corners_of_axes(&args.figure, bounds);
            let points = || corners(scene).chain(of_axes.iter().copied());
            let extent = Extent::of_points(bounds, points());
            let mut measure = |camera: &Camera| Ok(seen_points(camera, points()));
            plan.cameras(&request(args), (&extent, stance(args)), &mut measure)
        }
        Some(name) => {
            let size = args.camera.size.map(|size| [size.width, size.height]);
            let camera = scene_camera::named(&scene.cameras, name, size, bounds);
            plan.checked(vec![
                camera.with_context(|| args.input.path.display().to_string())?,
            ])
        }
    }
}

/// The corners of all triangles; one that several share comes several times.
pub(crate) fn corners(scene: &Scene) -> impl Iterator<Item = DVec3> {
    let of_mesh = |mesh: &Mesh, corner: u32| {
        scene.origin_in_world + Vec3::from_array(mesh.positions[corner as usize]).as_dvec3()
    };
    let meshes = scene.meshes.iter();
    meshes.flat_map(move |mesh| {
        mesh.triangles
            .iter()
            .flatten()
            .map(move |&corner| of_mesh(mesh, corner))
    })
}

fn request(args: &TexmapArgs) -> Request<'_> {
    let texture = args.model.texture.as_deref();
    let environment = args.model.environment.as_deref();
    Request {
        output: &args.output,
        stats: args.stats.as_deref(),
        camera: &args.camera,
        sequence: &args.sequence,
        steps: 0,
        picture: &args.picture,
        keys: KeyKind::Cameras,
        vector_level: args.render.options.simd,
        gate: args.model.reading.gate(),
        inputs: [Some(args.input.path.as_path()), texture, environment]
            .into_iter()
            .flatten()
            .collect(),
        others: Vec::new(),
    }
}

fn drawn(renderer: &mut Renderer, camera: &Camera, window: &Window) -> Result<Drawn> {
    let frame = renderer.render_window(camera, window.first(), window.size())?;
    let account = Account {
        keys: serde_json::to_value(&frame.stats)?,
        line: stage_line(&frame.stats),
        cost: cost(&frame.stats),
    };
    Ok(Drawn {
        image: frame.image,
        account,
    })
}

/// The time and work of a frame, in covered pixels.
fn cost(stats: &FrameStats) -> Cost {
    /// The work of looking at a triangle, from the times of the stages.
    const TRIANGLE: f64 = 0.04;
    Cost {
        wall_ms: stats.wall_ms,
        cpu_ms: stats.cpu_ms,
        growing: stats.pixels_touched as f64,
        fixed: TRIANGLE * stats.triangles as f64,
        subpixels: 0,
    }
}

fn scene_record(scene: &Scene, notes: &[String], prepare_ms: f64) -> Value {
    let texels: usize = scene
        .textures
        .iter()
        .map(|texture| texture.width * texture.height)
        .sum();
    json!({
        "meshes": scene.meshes.len(),
        "triangles": scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>(),
        "vertices": scene.meshes.iter().map(|mesh| mesh.positions.len()).sum::<usize>(),
        "textures": scene.textures.len(),
        "texels": texels,
        "notes": notes,
        "prepare_ms": prepare_ms,
    })
}

/// The times of a frame's stages and its counts, one line.
fn stage_line(stats: &FrameStats) -> String {
    let stages = &stats.stages;
    let named = [
        ("cull", stages.cull),
        ("bin", stages.bin),
        ("visibility", stages.visibility),
        ("accumulate", stages.accumulate),
        ("resolve", stages.resolve),
        ("image", stages.image),
    ];
    let times: Vec<_> = named
        .iter()
        .map(|(name, time)| format!("{name} {:.1}", time.wall_ms))
        .collect();
    format!(
        "{:.1} ms wall, {:.1} ms CPU ({} ms); {} of {} triangles, {} points, {} splats",
        stats.wall_ms,
        stats.cpu_ms,
        times.join(", "),
        stats.drawn,
        stats.triangles,
        stats.points,
        stats.splats
    )
}

/// How the file is read for picture `number`.
pub(crate) fn load_options(args: &TexmapArgs, number: usize, gate: &Gate) -> LoadOptions {
    // FILE#NAME, or FILE#scene=NAME as parts of other files are written.
    let part = args.input.part.as_deref();
    let scene = part.map(|part| part.strip_prefix("scene=").unwrap_or(part));
    LoadOptions {
        scene: scene.map(|scene| SceneChoice(scene.to_owned())),
        pose: pose(&args.model, &args.sequence, number),
        environment: args.model.environment.clone(),
        light_maps: match args.render.options.shade {
            Shade::Auto | Shade::Pbr => LightMaps::Read,
            Shade::Unlit | Shade::Headlight | Shade::Lambert => LightMaps::LeftOut,
        },
        unreadable: match args.model.textures {
            Textures::Shown | Textures::Grid => Unreadable::Refused,
            Textures::LeftOut => Unreadable::Noted,
        },
        texture: args.model.texture.clone(),
        gate: gate.clone(),
    }
}

/// The moment of the animation that picture `number` shows.
fn pose(model: &ModelArgs, sequence: &SequenceArgs, number: usize) -> Option<Pose> {
    let is_posed = model.pose_time.is_some() || model.play || model.animation.is_some();
    let played_s = if model.play {
        number as f64 / f64::from(sequence.fps.unwrap_or(output::DEFAULT_FPS))
    } else {
        0.0
    };
    is_posed.then(|| Pose {
        time_s: model.pose_time.unwrap_or(0.0) + played_s,
        animation: model.animation.clone(),
    })
}

/// How the mesh is drawn. Only an EXR file has a place for further planes.
pub(crate) fn render_options(args: &RenderOptions, finish: &Finish) -> Result<RenderOptions> {
    let planes = match finish.format {
        Format::Exr if args.planes.is_empty() => PlaneKind::USUAL.to_vec(),
        Format::Png(_) | Format::Jpeg(_) if !args.planes.is_empty() => {
            bail!("--layers: only a name that ends in .exr has a place for them")
        }
        _ => args.planes.clone(),
    };
    let options = RenderOptions {
        planes,
        background: finish.background.colour(),
        ..args.clone()
    };
    options.validate()?;
    Ok(options)
}

/// Everything that decided the pictures, for the stats file.
pub(crate) fn record(
    args: &TexmapArgs,
    request: &Request,
    options: &RenderOptions,
    format: Format,
    stance: Stance,
) -> Value {
    let camera = match &args.model.camera_name {
        Some(name) => json!({ "name": name }),
        None => plan::camera_record(request, stance),
    };
    json!({
        "model": { "file": report::name(&args.input.path), "scene": args.input.part,
            "texture": args.model.texture.as_deref().map(report::name),
            "environment": args.model.environment.as_deref().map(report::name),
            "pose_time_s": args.model.pose_time, "animation": args.model.animation, "play": args.model.play,
            "textures": args.model.textures },
        "camera": camera,
        "render": options,
        "picture": plan::picture_record(request, format),
    })
}
