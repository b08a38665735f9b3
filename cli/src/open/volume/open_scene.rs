//! A volume as the commands draw it: one picture at a time, in any order, under one setting after another.

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::{Camera, Stop};
use resample_io::figure::Figure;
use serde_json::Value;
use volsplat::Layer;

use crate::args::Drawing;
use crate::cameras::viewpoint;
use crate::open::figure;
use crate::open::open_scene::{OpenScene, Parts, Probed};
use crate::open::setting::Setting;
use crate::open::volume::{OpenVolume, drawn, motion, request, turn};
use crate::output;
use crate::picture;
use crate::picture::{Drawn, Shot};
use crate::plan::{Change, Plan, Run, RunLog};
use crate::process::report;
use crate::process::report::{Progress, RunStats, Verbosity};
use resample_core::camera::bands::Window;
use texmap::background::Background;

impl OpenScene for OpenVolume {
    fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    fn background(&self) -> &Background {
        &self.plan.finish.background
    }

    fn figure(&self) -> Result<Option<Figure>> {
        figure::figure(&self.args.figure, self.background(), || self.figure_facts())
    }

    fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        Some(self.visible_bounds_in_world())
    }

    fn parts(&self) -> Parts {
        // Means of pixels are corrected by their neighbours.
        Parts::Windows {
            side_px: 8,
            guard_px: 1,
        }
    }

    fn has_bands(&self) -> bool {
        self.is_field()
    }

    fn set(&mut self, setting: &Setting) -> Result<()> {
        match setting {
            Setting::Volume(render) => self.draw_with(render),
            _ => bail!("a setting of another application"),
        }
    }

    fn restyle(&mut self, drawing: &Drawing) -> Result<()> {
        match drawing {
            Drawing::Volsplat(args) => self.take((**args).clone()),
            _ => bail!("a command of another application"),
        }
    }

    fn change(&mut self, drawing: &Drawing, change: Change) -> Result<bool> {
        let Drawing::Volsplat(args) = drawing else {
            return Ok(false);
        };
        let args = (**args).clone();
        let had_motion = self.motion.is_some();
        self.plan = Plan::new(&request(&args, self.steps.as_ref()))?;
        match change {
            // A moving look is not that of the options any more.
            Change::Look => self.take(args)?,
            Change::View | Change::Render if had_motion => self.take(args)?,
            Change::Render => {
                self.draw_with(&args.render)?;
                self.args = args;
            }
            Change::View => self.args = args,
        }
        self.motion = motion(&self.args, &self.plan, &mut self.content)?;
        self.cameras = super::cameras(self)?;
        Ok(true)
    }

    fn turn_to(&mut self, number: usize) -> Result<()> {
        if let Some(steps) = &mut self.steps {
            let (content, renderer) = (&mut self.content, &mut self.renderer);
            let is_other = turn(
                (steps, &self.args),
                (number, self.cameras.len()),
                content,
                renderer,
            )?;
            if is_other {
                self.meshes.forget_slices();
                if let Some(motion) = &mut self.motion {
                    motion.forget();
                }
            }
        }
        if let Some(motion) = &mut self.motion {
            motion.set(number, &mut self.renderer, &mut self.content)?;
        }
        match self.steps.is_some() || self.motion.is_some() {
            true => self.meshes.follow(&self.content, &self.args.scene),
            false => Ok(()),
        }
    }

    fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    fn draw(&mut self, camera: &Camera) -> Result<Drawn> {
        self.draw_part((camera, camera))
    }

    fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        let layers = output::layers(
            self.plan.finish.format,
            self.args.render.options.blend.layers.as_ref(),
        )?;
        picture::in_window(camera, window, &mut |part| {
            let mut drawn = self.draw_part((part, camera))?;
            drawn
                .image
                .planes
                .extend(self.renderer.layers(part, &layers)?);
            Ok(drawn)
        })
    }

    fn probe(&mut self, pixel: &Camera) -> Result<Option<Probed>> {
        let world = match self.renderer.layers(pixel, &[Layer::MedianDepth]) {
            Ok(planes) => {
                let depth = planes.first().and_then(|plane| plane.values.first());
                let depth = depth.filter(|depth| depth.is_finite());
                depth.map(|&depth| viewpoint::world_at(pixel, f64::from(depth)))
            }
            // Labels, channels and other blends have no such plane.
            Err(_) => self.content.first_voxel(pixel),
        };
        let z = |world: DVec3| pixel.camera_from_world.transform_point3(world).z;
        let nearer = |depth: &f64| world.is_none_or(|world| *depth < z(world));
        if let Some(depth) = self.meshes.depth(pixel)?.filter(nearer) {
            return Ok(Some(Probed::of_surface(viewpoint::world_at(pixel, depth))));
        }
        let Some(world) = world else {
            return Ok(None);
        };
        Ok(self.content.nearest(world).map(|voxel| Probed {
            world,
            voxel: Some(voxel),
        }))
    }

    fn finish(self: Box<Self>, planned: Option<Value>, log: RunLog) -> Result<()> {
        let mut open = *self;
        open.plan.finish.figure = open.figure()?;
        if open.args.sequence.part.tile.is_some() && !open.is_field() {
            bail!("--tile requires the field renderer; use --frames instead");
        }
        let request = request(&open.args, open.steps.as_ref());
        let layers = output::layers(
            open.plan.finish.format,
            open.args.render.options.blend.layers.as_ref(),
        )?;
        open.content.show_transfer(&open.args.transfer)?;
        let stats = RunStats {
            planned,
            ..open.stats_before_drawing(&request)
        };
        if log.verbosity == Verbosity::Verbose {
            report::say(&format!(
                "load {:.1} ms, classify {:.1} ms",
                open.load_ms, open.classify_ms
            ));
        }
        let look = &open.content.look;
        let look_line = open
            .suggested()
            .line()
            .or_else(|| look.channel_line(&open.args));
        // Of several pictures a bar counts the pictures.
        let progress = if open.cameras.len() == 1 {
            log.verbosity.progress()
        } else {
            Progress::Hidden
        };
        let (mut renderer, mut meshes) = (open.renderer, open.meshes);
        // The renderer holds a copy of the visible voxels. Only a look or steps that change between pictures need the volume again.
        let is_moving = open.motion.is_some() || open.steps.is_some();
        let mut content = is_moving.then_some(open.content);
        let (mut motion, mut turning) = (open.motion, open.steps.clone());
        let count = open.cameras.len();
        let mut render = |shot: &Shot| {
            if let Some(content) = &mut content {
                let is_other = match &mut turning {
                    Some(steps) => turn(
                        (steps, &open.args),
                        (shot.number, count),
                        content,
                        &mut renderer,
                    )?,
                    None => false,
                };
                if is_other {
                    meshes.forget_slices();
                }
                if let Some(motion) = &mut motion {
                    if is_other {
                        motion.forget();
                    }
                    motion.set(shot.number, &mut renderer, content)?;
                }
                meshes.follow(content, &open.args.scene)?;
            }
            picture::in_window(shot.camera, &shot.window, &mut |camera| {
                let both = (&mut renderer, &mut meshes);
                let mut drawn = drawn(both, (camera, shot.camera), progress, &open.stop)?;
                drawn.image.planes.extend(renderer.layers(camera, &layers)?);
                Ok(drawn)
            })
        };
        open.plan
            .draw(&request, &open.cameras, Run { stats, log }, &mut render)?;
        if let Some(line) = look_line
            && log.verbosity != Verbosity::Quiet
        {
            report::say(&line);
        }
        Ok(())
    }
}
