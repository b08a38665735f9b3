//! From a scene and options to what its bricks are made from.
//!
//! What the options ask for decides which cells are kept: those that a transfer function shows, all of them where a
//! statistic of the whole ray is wanted, those that hold the scalar of a surface.

use super::cells::WithGradients;
use super::fill::{FieldPlan, PlannedChannel, Shown};
use super::support::Support;
use crate::Error;
use crate::look::options::{Blend, RenderOptions};
use crate::look::palette::Palette;
use crate::look::scene::{Channel, Look, Scene};
use crate::look::transfer::TransferFunction;
use crate::slabs::channel::ChannelSettings;

/// Returns the plan from which the bricks of a scene are made.
pub(crate) fn plan<'a>(scene: &Scene<'a>, options: &RenderOptions) -> Result<FieldPlan<'a>, Error> {
    Ok(FieldPlan {
        channels: scene
            .channels
            .iter()
            .map(|channel| {
                Ok(PlannedChannel {
                    volume: channel.volume,
                    shown: shown(channel, options)?,
                })
            })
            .collect::<Result<_, Error>>()?,
        mask: scene.mask,
        gradients: gradients(options),
    })
}

impl FieldPlan<'_> {
    /// The plan for samples that are classified by the tables of these channels.
    pub(crate) fn tabulated(mut self, channels: &[ChannelSettings]) -> Self {
        for (planned, channel) in self.channels.iter_mut().zip(channels) {
            if let Shown::Scalars(support) = &mut planned.shown {
                *support = support.clone().tabulated(channel.table.step_of_entries());
            }
        }
        self
    }
}

/// Returns true if the bricks need gradients.
pub(crate) fn gradients(options: &RenderOptions) -> WithGradients {
    if options.follows_gradient() {
        WithGradients::Yes
    } else {
        WithGradients::No
    }
}

/// The scalars that are seen.
pub(crate) fn support(transfer: &TransferFunction, options: &RenderOptions) -> Support {
    match options.blend() {
        Blend::Emission => Support::new(transfer),
        Blend::Isosurface(iso) => Support::of(iso.value as f32),
        Blend::Maximum | Blend::Minimum | Blend::Average => Support::everything(),
    }
}

fn shown(channel: &Channel, options: &RenderOptions) -> Result<Shown, Error> {
    Ok(match channel.look {
        Look::Labels(labels) => {
            let palette = Palette::new(channel.volume, labels)?;
            let strengths = palette
                .entries(options.opacity)
                .iter()
                .map(|entry| entry[3])
                .collect();
            Shown::Labels(palette, strengths)
        }
        Look::Transfer(transfer) => Shown::Scalars(support(transfer, options)),
        Look::Tint(_) => Shown::Scalars(Support::nothing()),
    })
}

/// A sample needs a cell around it.
pub(crate) fn check_dims(dims: [usize; 3]) -> Result<(), Error> {
    let Some(axis) = dims.iter().position(|&n| n < 2) else {
        return Ok(());
    };
    Err(Error::Option(format!(
        "the field renderer needs at least 2 voxels along each axis ({} has 1); use order every-sample",
        ["x", "y", "z"][axis]
    )))
}
