//! A volume whose pictures stay in memory: drawn one at a time, in any order, under one command after another.

use anyhow::Result;
use resample_core::Camera;
use volsplat::Order;

use super::{Open, cameras, motion, request};
use crate::args::VolsplatArgs;
use crate::look::blend;
use crate::picture;
use crate::picture::Drawn;
use crate::picture::background::Background;
use crate::picture::bands::Window;
use crate::plan::{Change, Plan};

impl Open {
    /// Takes new options; the files are not read again.
    pub(crate) fn change(&mut self, args: VolsplatArgs, change: Change) -> Result<()> {
        let had_motion = self.motion.is_some();
        self.plan = Plan::new(&request(&args))?;
        match change {
            // A moving look is not that of the options any more.
            Change::Look => self.restyle(args)?,
            Change::View | Change::Render if had_motion => self.restyle(args)?,
            Change::Render => {
                self.set(&args.render)?;
                self.args = args;
            }
            Change::View => self.args = args,
        }
        self.motion = motion(&self.args, &self.plan, &mut self.content)?;
        self.cameras = cameras(self)?;
        Ok(())
    }

    /// Takes the transfer function and the clip of picture `number`.
    pub(crate) fn turn_to(&mut self, number: usize) -> Result<()> {
        match &mut self.motion {
            Some(motion) => {
                motion.set(number, &mut self.renderer, &mut self.content, &self.options)
            }
            None => Ok(()),
        }
    }

    /// Draws a window of a picture with its further planes, `--layers`.
    pub(crate) fn draw_window(&mut self, camera: &Camera, window: &Window) -> Result<Drawn> {
        let layers = blend::layers(&self.args.render.options.blend, self.plan.finish.format)?;
        picture::in_window(camera, window, &mut |camera| {
            let mut drawn = self.draw(camera)?;
            drawn
                .image
                .planes
                .extend(self.renderer.layers(camera, &layers)?);
            Ok(drawn)
        })
    }

    /// Returns true if the trilinear field is drawn, and not samples.
    pub(crate) fn is_field(&self) -> bool {
        matches!(self.options.order, Order::Field(_))
    }

    /// The background of every picture.
    pub(crate) fn background(&self) -> &Background {
        &self.plan.finish.background
    }
}
