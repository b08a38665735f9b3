//! The scene: one channel or several on one grid, each with its own look, and a mask over all of them; and the values of a volume that a
//! transfer function shows.
//!
//! Channels lie over one another: their extinctions add up, and their colours mix in proportion to their extinctions. Each
//! is classified by itself. Tints have no extinction: where there are any, their sum multiplies the colour of all others.
//! A mask hides every sample whose nearest voxel of the mask is 0.
//! Limits: all channels share one grid, voxel by voxel.

use std::ops::Range;

use rayon::prelude::*;
use resample_core::OpacityMode;
use resample_volume::labels::{LabelLook, LabelTable};
use resample_volume::volume::{Volume, VoxelType, Voxels, scalar, with_voxels};

use crate::Error;
use crate::look::transfer::TransferFunction;
use crate::look::transfer::{classified, strength_of};

/// The values that a transfer function shows: a table where the type has few.
pub(crate) enum VisibleValues<'a> {
    Table { lowest: i32, shown: Vec<bool> },
    Direct(&'a TransferFunction),
}

impl<'a> VisibleValues<'a> {
    pub(crate) fn new(voxel_type: VoxelType, transfer: &'a TransferFunction) -> Self {
        let (lowest, count) = match voxel_type {
            VoxelType::U8 => (0, 1 << 8),
            VoxelType::I8 => (-(1 << 7), 1 << 8),
            VoxelType::U16 => (0, 1 << 16),
            VoxelType::I16 => (-(1 << 15), 1 << 16),
            _ => return Self::Direct(transfer),
        };
        let shown = (lowest..lowest + count)
            .map(|value| transfer.opacity(f64::from(value)) > 0.0)
            .collect();
        Self::Table { lowest, shown }
    }

    /// Returns true if a value of the type is visible.
    #[inline(always)]
    pub(crate) fn shows(&self, value: f64) -> bool {
        match self {
            Self::Table { lowest, shown } => shown[(value as i32 - lowest) as usize],
            Self::Direct(transfer) => transfer.opacity(value) > 0.0,
        }
    }
}

/// Voxels whose own scalar is visible.
pub(crate) fn count_visible(volume: &Volume, transfer: &TransferFunction) -> u64 {
    let values = VisibleValues::new(VoxelType::of(&volume.voxels), transfer);
    let count = |part: Range<usize>| match (&volume.voxels, &values) {
        (Voxels::U8(bytes), VisibleValues::Table { shown, .. }) => {
            let mut ones = [0u32; 256];
            for (one, &shown) in ones.iter_mut().zip(shown) {
                *one = u32::from(shown);
            }
            let parts = bytes[part].iter().map(|&byte| ones[usize::from(byte)]);
            u64::from(parts.sum::<u32>())
        }
        _ => with_voxels!(&volume.voxels, slice => {
            slice[part].iter().filter(|&&v| values.shows(scalar(v))).count() as u64
        }),
    };
    volume.voxels.parts().into_par_iter().map(count).sum()
}

/// The scene.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The channels, at least one.
    pub channels: Vec<Channel<'a>>,
    /// Where anything is drawn: a sample whose nearest voxel here is 0 shows nothing. As many voxels along each axis as
    /// the channels; its own place in the world is not looked at.
    pub mask: Option<&'a Volume>,
}

/// One scalar field or one label map, and how it looks.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    /// The voxels.
    pub volume: &'a Volume,
    /// From a scalar or a label to colour and opacity.
    pub look: Look<'a>,
}

/// From what a voxel holds to colour and opacity.
#[derive(Clone, Copy, Debug)]
pub enum Look<'a> {
    /// Scalars: interpolated, then classified.
    Transfer(&'a TransferFunction),
    /// Labels: that of the nearest voxel.
    Labels(&'a LabelTable),
    /// Scalars: interpolated, then the colour of the function, whose opacity is not used. The tints of a scene add up, and
    /// their sum multiplies the colour of its other channels: red, green and blue of voxels that are colours. Between voxels
    /// each counts by the scalar of the first transfer function's channel above the least one, as colours with alpha are
    /// interpolated: black or transparent neighbours do not darken an edge.
    Tint(&'a TransferFunction),
}

/// Grids whose corners are this close, in voxels, are the same: headers are written with six digits or more.
const SAME_PLACE_VOXELS: f64 = 0.01;

impl<'a> Scene<'a> {
    /// One scalar field, nothing hidden.
    pub fn new(volume: &'a Volume, transfer: &'a TransferFunction) -> Self {
        Self {
            channels: vec![Channel {
                volume,
                look: Look::Transfer(transfer),
            }],
            mask: None,
        }
    }

    /// The grid that all channels share: the first of them.
    pub fn grid(&self) -> &'a Volume {
        self.channels[0].volume
    }

    /// The one scalar field and its transfer function, where that is all there is.
    pub(crate) fn single(&self) -> Option<(&'a Volume, &'a TransferFunction)> {
        match (self.channels.as_slice(), self.mask) {
            (
                &[
                    Channel {
                        volume,
                        look: Look::Transfer(transfer),
                    },
                ],
                None,
            ) => Some((volume, transfer)),
            _ => None,
        }
    }

    /// The transfer functions of the channels, where all of them are scalars.
    pub(crate) fn transfers(&self) -> Option<Vec<&'a TransferFunction>> {
        let transfer = |channel: &Channel<'a>| match channel.look {
            Look::Transfer(transfer) => Some(transfer),
            Look::Labels(_) | Look::Tint(_) => None,
        };
        self.channels.iter().map(transfer).collect()
    }

    /// Checks that there is a channel with extinction, and that channels and mask share one grid. [`Error::Option`] says which does not.
    pub fn validate(&self) -> Result<(), Error> {
        let Some(first) = self.channels.first() else {
            return Err(Error::Option("there is no channel to draw".into()));
        };
        if self
            .channels
            .iter()
            .all(|channel| channel.tint(0).is_some())
        {
            return Err(Error::Option(
                "every channel is a tint; at least one channel must carry opacity".into(),
            ));
        }
        let dims = first.volume.dims;
        for (number, channel) in self.channels.iter().enumerate().skip(1) {
            same_dims(&format!("channel {number}"), channel.volume.dims, dims)?;
            let apart = apart_voxels(first.volume, channel.volume);
            if !(apart < SAME_PLACE_VOXELS) {
                return Err(Error::Option(format!(
                    "channel {number} lies up to {apart:.3} voxels away from the first: resample it to the grid of the \
                     first, or give all of them the same spacing and origin"
                )));
            }
        }
        self.mask
            .map_or(Ok(()), |mask| same_dims("the mask", mask.dims, dims))
    }

    /// Colour and strength of the voxel at a linear index: extinctions add up, colours mix by extinction.
    pub(crate) fn voxel(&self, index: usize, opacity: OpacityMode) -> [f32; 4] {
        if !self.shows(index) {
            return [0.0; 4];
        }
        let mut sum = [0.0f64; 4];
        for channel in &self.channels {
            let [r, g, b, strength] = channel.voxel(index, opacity);
            for (sum, value) in sum.iter_mut().zip([r, g, b, 1.0]) {
                *sum += f64::from(strength) * f64::from(value);
            }
        }
        let tint = self.tint(index);
        let colour = |k: usize| {
            if sum[3] > 0.0 {
                (f64::from(tint[k]) * sum[k] / sum[3]) as f32
            } else {
                0.0
            }
        };
        [colour(0), colour(1), colour(2), sum[3] as f32]
    }

    /// The sum of the tints of the voxel at a linear index; 1 where the scene has none.
    fn tint(&self, index: usize) -> [f32; 3] {
        let tints = self
            .channels
            .iter()
            .filter_map(|channel| channel.tint(index));
        tints
            .reduce(|a, b| std::array::from_fn(|k| a[k] + b[k]))
            .unwrap_or([1.0; 3])
    }

    /// Voxels that are seen by themselves.
    pub(crate) fn count_visible(&self) -> u64 {
        if let Some((volume, transfer)) = self.single() {
            return count_visible(volume, transfer);
        }
        let seen = |&index: &usize| {
            self.shows(index)
                && self
                    .channels
                    .iter()
                    .any(|channel| channel.shows(channel.volume.value(index)))
        };
        (0..self.grid().len()).into_par_iter().filter(seen).count() as u64
    }

    /// Returns true if the mask shows the voxel at a linear index.
    fn shows(&self, index: usize) -> bool {
        self.mask.is_none_or(|mask| mask.value(index) != 0.0)
    }
}

impl Channel<'_> {
    /// Returns true if a value is seen by itself.
    fn shows(&self, value: f64) -> bool {
        match self.look {
            Look::Transfer(transfer) => transfer.opacity(value) > 0.0,
            Look::Labels(labels) => labels.shows(value as i64),
            Look::Tint(_) => false,
        }
    }

    fn voxel(&self, index: usize, opacity: OpacityMode) -> [f32; 4] {
        let value = self.volume.value(index);
        match self.look {
            Look::Transfer(transfer) => classified(transfer, opacity, value),
            Look::Labels(labels) => {
                let LabelLook {
                    rgb: [r, g, b],
                    opacity: shown,
                } = labels.look(value as i64);
                [r, g, b, strength_of(shown, opacity)]
            }
            Look::Tint(_) => [0.0; 4],
        }
    }

    /// The colour of the voxel at a linear index, where this is a tint.
    fn tint(&self, index: usize) -> Option<[f32; 3]> {
        match self.look {
            Look::Tint(transfer) => Some(transfer.sample(self.volume.value(index)).0),
            Look::Transfer(_) | Look::Labels(_) => None,
        }
    }
}

fn same_dims(what: &str, dims: [usize; 3], expected: [usize; 3]) -> Result<(), Error> {
    if dims == expected {
        return Ok(());
    }
    let text = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
    Err(Error::Option(format!(
        "{what} has {} voxels, the volume has {}; expected the same dimensions",
        text(dims),
        text(expected)
    )))
}

/// The largest distance of two grids' corners, in the smallest spacing of the first.
fn apart_voxels(a: &Volume, b: &Volume) -> f64 {
    let corner = |i: usize| {
        let end = |axis: usize| (a.dims[axis] - 1) as f64 * (i >> axis & 1) as f64;
        glam::DVec3::new(end(0), end(1), end(2))
    };
    let apart = |i: usize| {
        let [at, other] = [a, b].map(|volume| volume.world_from_index.transform_point3(corner(i)));
        at.distance(other)
    };
    (0..8).map(apart).fold(0.0, f64::max) / a.smallest_spacing()
}
