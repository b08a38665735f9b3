//! What a channel's samples are read and classified with, and the ramp over the gradient.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use resample_core::OpacityMode;

use super::classify::TransferTable;
use crate::Error;
use crate::palette::Palette;
use crate::scene::{Channel, Look};
use crate::shade::Polar;
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

/// A factor of the extinction that rises from 0 to 1 with the length of the gradient.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GradientRamp {
    low: f32,
    /// 1 over the ramp's width.
    scale: f32,
}

impl ChannelSettings {
    /// The settings of scalars in this range.
    pub(crate) fn of_transfer(transfer: &TransferFunction, range: (f64, f64), opacity: OpacityMode) -> Self {
        let table = TransferTable::new(transfer, opacity, range);
        Self { table, reading: Reading::Trilinear, value_range: range }
    }

    /// The settings of a channel; an error where its labels are too many.
    pub(crate) fn new(channel: &Channel, opacity: OpacityMode) -> Result<Self, Error> {
        Ok(match channel.look {
            Look::Transfer(transfer) => Self::of_transfer(transfer, channel.volume.value_range(), opacity),
            Look::Labels(labels) => Self {
                table: TransferTable::of_entries(&Palette::new(channel.volume, labels)?.entries(opacity)),
                reading: Reading::Nearest,
                value_range: (0.0, 0.0),
            },
        })
    }
}

impl GradientRamp {
    /// A ramp from `low` to `high`, value per world unit, `low` below `high`.
    pub(crate) fn new([low, high]: [f64; 2]) -> Self {
        // A ramp narrower than f32 knows is a step.
        Self { low: low as f32, scale: (1.0 / (high - low)).min(f64::from(f32::MAX)) as f32 }
    }

    /// The factors of samples with these gradients.
    #[inline(always)]
    pub(crate) fn factor<S: Simd>(&self, simd: S, gradient: [f32x8<S>; 3]) -> f32x8<S> {
        let constant = |v: f32| f32x8::splat(simd, v);
        let ramp = (Polar::new(simd, gradient).length - constant(self.low)) * constant(self.scale);
        ramp.max(constant(0.0)).min(constant(1.0))
    }
}
