//! Settings of a channel: how its samples are read and classified.

use std::sync::Arc;

use resample_core::OpacityMode;

use crate::Error;
use crate::look::options::{Blend, RenderOptions};
use crate::look::palette::Palette;
use crate::look::scene::{Channel, Look, Scene};
use crate::look::transfer::TransferFunction;
use crate::slabs::table::TransferTable;

/// How one channel becomes colour and extinction.
#[derive(Clone, Debug)]
pub(crate) struct ChannelSettings {
    pub(crate) table: TransferTable,
    pub(crate) reading: Reading,
    pub(crate) role: Role,
    /// Least and greatest scalar of the volume; of labels, 0.
    pub(crate) value_range: (f64, f64),
}

/// The part of a channel in a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// Extinction, and the colour that it shines in.
    Extinction,
    /// A factor of the colour.
    Tint,
}

/// How a sample is read from the voxels around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// Interpolated.
    Trilinear,
    /// That of the nearest voxel.
    Nearest,
}

impl ChannelSettings {
    /// The settings of scalars in this range.
    pub(crate) fn of_transfer(
        transfer: &TransferFunction,
        range: (f64, f64),
        opacity: OpacityMode,
    ) -> Self {
        let table = TransferTable::new(transfer, opacity, range);
        Self {
            table,
            reading: Reading::Trilinear,
            role: Role::Extinction,
            value_range: range,
        }
    }

    /// The settings of a channel; an error where its labels are too many.
    pub(crate) fn new(channel: &Channel, opacity: OpacityMode) -> Result<Self, Error> {
        Ok(match channel.look {
            Look::Transfer(transfer) => {
                Self::of_transfer(transfer, channel.volume.voxels.finite_range(), opacity)
            }
            Look::Labels(labels) => Self {
                table: TransferTable::of_entries(
                    &Palette::new(channel.volume, labels)?.entries(opacity),
                ),
                reading: Reading::Nearest,
                role: Role::Extinction,
                value_range: (0.0, 0.0),
            },
            Look::Tint(transfer) => Self {
                role: Role::Tint,
                ..Self::of_transfer(
                    &transfer.opaque(),
                    channel.volume.voxels.finite_range(),
                    opacity,
                )
            },
        })
    }
}

/// The channel by which tints are weighted between voxels, and its least scalar; `None` where all others are labels.
#[inline(always)]
pub(crate) fn weights_of_tints(channels: &[ChannelSettings]) -> Option<(usize, f32)> {
    let holds = |channel: &ChannelSettings| {
        channel.role == Role::Extinction && channel.reading == Reading::Trilinear
    };
    let number = channels.iter().position(holds)?;
    Some((number, channels[number].value_range.0 as f32))
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
    check(&channels, options)?;
    Ok(channels)
}

/// An error where the channels do not suit the options.
pub(crate) fn check(channels: &[ChannelSettings], options: &RenderOptions) -> Result<(), Error> {
    let has_labels = channels
        .iter()
        .any(|channel| channel.reading == Reading::Nearest);
    let refuse = |what: &str| Err(Error::Option(what.into()));
    match options.blend() {
        Blend::Isosurface(_) if channels.len() > 1 => refuse(
            "an isosurface is drawn of one channel, and there are more: leave out the others",
        ),
        Blend::Emission => Ok(()),
        _ if has_labels => {
            refuse("labels have no greatest, no mean and no surface: draw them by emission")
        }
        _ => Ok(()),
    }
}
