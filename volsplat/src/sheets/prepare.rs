//! From a scene and options to what image sheets keep: the field, the channels' tables, the surface.
//!
//! What the options ask for decides which cells are kept: those that a transfer function shows, all of them where a
//! statistic of the whole ray is wanted, those that hold the scalar of a surface.

use std::sync::Arc;

use super::channel::{ChannelSettings, Reading};
use super::isosurface::IsoSettings;
use super::statistic::Statistic;
use super::{ImageSheets, Reuse, Source};
use crate::Error;
use crate::cells::{CellField, FieldPlan, Gradients, PlannedChannel, Shown};
use crate::options::{Blend, RenderOptions};
use crate::palette::Palette;
use crate::scene::{Channel, Look, Scene};
use crate::support::Support;
use crate::transfer::TransferFunction;

impl ImageSheets {
    /// Takes options that differ in what is read anew for each frame; a new renderer is needed where sums of kernels
    /// hold some of them.
    pub(crate) fn set_options(&mut self, options: &RenderOptions) -> Reuse {
        if matches!(self.source, Source::Kernels(_)) {
            return Reuse::NeedsRenderer;
        }
        self.options = options.clone();
        Reuse::Done
    }
}

/// The tables of a scene's channels; an error where the channels do not suit the options.
pub(crate) fn channels(
    scene: &Scene,
    options: &RenderOptions,
) -> Result<Arc<[ChannelSettings]>, Error> {
    let channels: Arc<[ChannelSettings]> = scene
        .channels
        .iter()
        .map(|channel| ChannelSettings::new(channel, options.opacity))
        .collect::<Result<_, _>>()?;
    let has_labels = channels
        .iter()
        .any(|channel| channel.reading == Reading::Nearest);
    let refuse = |what: &str| Err(Error::Option(what.into()));
    match options.blend() {
        Blend::Isosurface(_) if channels.len() > 1 => refuse(
            "an isosurface is drawn of one channel, and there are more: leave out the others",
        ),
        Blend::Emission => Ok(channels),
        _ if has_labels => {
            refuse("labels have no greatest, no mean and no surface: draw them by emission")
        }
        _ => Ok(channels),
    }
}

/// The bricks of a scene.
pub(super) fn cells(scene: &Scene, options: &RenderOptions) -> Result<CellField, Error> {
    Ok(CellField::new(
        &plan(scene, options)?,
        scene.count_visible(),
    ))
}

/// What the bricks of a scene are made from.
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

/// Whether the bricks need gradients.
pub(crate) fn gradients(options: &RenderOptions) -> Gradients {
    if options.follows_gradient() {
        Gradients::With
    } else {
        Gradients::Without
    }
}

/// The scalars that are seen.
pub(super) fn support(transfer: &TransferFunction, options: &RenderOptions) -> Support {
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
    })
}

/// The statistic that the options ask for.
pub(super) fn statistic(options: &RenderOptions) -> Option<Statistic> {
    match options.blend() {
        Blend::Maximum => Some(Statistic::Greatest),
        Blend::Minimum => Some(Statistic::Least),
        Blend::Average => Some(Statistic::Mean),
        Blend::Emission | Blend::Isosurface(_) => None,
    }
}

/// The surface that the options ask for, without what depends on the camera.
pub(super) fn iso(look: Look, options: &RenderOptions) -> Option<IsoSettings> {
    let Blend::Isosurface(iso) = options.blend() else {
        return None;
    };
    let own_colour = match look {
        Look::Transfer(transfer) => transfer.sample(iso.value).0,
        Look::Labels(_) => [1.0; 3],
    };
    let rgb = iso.colour.unwrap_or(own_colour);
    Some(IsoSettings {
        value: iso.value as f32,
        rgb,
        opacity: iso.opacity,
        near: 0.0,
        step: 0.0,
    })
}
