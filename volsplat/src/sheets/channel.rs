//! What a channel's samples are read and classified with.

use resample_core::OpacityMode;

use super::classify::TransferTable;
use crate::Error;
use crate::palette::Palette;
use crate::scene::{Channel, Look};
use crate::transfer::TransferFunction;

/// How one channel becomes colour and extinction.
#[derive(Clone, Debug)]
pub(crate) struct ChannelSettings {
    pub(crate) table: TransferTable,
    pub(crate) reading: Reading,
    /// Least and greatest scalar of the volume; of labels, 0.
    pub(crate) value_range: (f64, f64),
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
            value_range: range,
        }
    }

    /// The settings of a channel; an error where its labels are too many.
    pub(crate) fn new(channel: &Channel, opacity: OpacityMode) -> Result<Self, Error> {
        Ok(match channel.look {
            Look::Transfer(transfer) => {
                Self::of_transfer(transfer, channel.volume.value_range(), opacity)
            }
            Look::Labels(labels) => Self {
                table: TransferTable::of_entries(
                    &Palette::new(channel.volume, labels)?.entries(opacity),
                ),
                reading: Reading::Nearest,
                value_range: (0.0, 0.0),
            },
        })
    }
}
