//! Scalars are drawn as f32. Those of wide types are first counted from their own range, so that f32 holds what varies.
//!
//! Takes the range of 32-bit integers or doubles, gives a shift and a power of two: kelvin, time stamps and raw readings
//! keep their digits, and values that f32 cannot reach are brought into it. Transfer functions, surfaces and ramps are
//! carried along; what is said about the volume stays in the file's units. Most volumes need none of this and are left as they are.

use rayon::prelude::*;
use resample_volume::volume::{Volume, VoxelType, Voxels, scalar, with_voxels};

use crate::Error;
use crate::look::options::{Blend, Order, RenderOptions};
use crate::look::scene::{Channel, Look, Scene};
use crate::look::transfer::TransferFunction;

/// Scalars this many times their range away from 0 are counted from their range: nearer ones lose two bits of 24.
const FAR: f64 = 4.0;

/// Whole numbers up to this are f32 numbers.
const WHOLE: f64 = 16_777_216.0;

/// Scalars between the inverse of this and this stay as large as they are: squares of their gradients are f32 numbers.
const LARGE: f64 = 1.152_921_504_606_847e18;

/// From a scalar of the file to the one that is drawn: the difference from `origin`, times `scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Narrowing {
    origin: f64,
    /// A power of two.
    scale: f64,
}

impl Narrowing {
    /// Nothing changes.
    pub(crate) const NONE: Self = Self {
        origin: 0.0,
        scale: 1.0,
    };

    /// Returns the rescaling of scalars of a type, in this range.
    pub(crate) fn of(voxel_type: VoxelType, (low, high): (f64, f64)) -> Self {
        let is_exact = match voxel_type {
            VoxelType::U8 | VoxelType::I8 | VoxelType::U16 | VoxelType::I16 | VoxelType::F32 => {
                true
            }
            VoxelType::U32 | VoxelType::I32 => low.abs().max(high.abs()) <= WHOLE,
            VoxelType::U64 | VoxelType::I64 | VoxelType::F64 => false,
        };
        if is_exact || !(low <= high) {
            return Self::NONE;
        }
        let largest = low.abs().max(high.abs());
        // Halved, the distance of two ends of f64 is finite.
        let far = 0.5 * largest > FAR * (0.5 * high - 0.5 * low);
        let origin = if far { 0.5 * low + 0.5 * high } else { 0.0 };
        let reach = (high - origin).max(origin - low);
        let scale = if reach == 0.0 || (1.0 / LARGE..=LARGE).contains(&reach) {
            1.0
        } else {
            2f64.powi(-(reach.log2() as i32).clamp(-1000, 1000))
        };
        Self { origin, scale }
    }

    /// A scalar as it is drawn: an f32 number.
    pub(crate) fn value(&self, value: f64) -> f64 {
        if *self == Self::NONE {
            return value;
        }
        let most = 0.25 * f64::from(f32::MAX);
        f64::from(((value - self.origin) * self.scale).clamp(-most, most) as f32)
    }

    /// Converts a difference of drawn scalars to the file's.
    pub(crate) fn in_file(&self, difference: f32) -> f32 {
        (f64::from(difference) / self.scale) as f32
    }

    /// A range of scalars as they are drawn.
    pub(crate) fn range(&self, (low, high): (f64, f64)) -> (f64, f64) {
        (self.value(low), self.value(high))
    }

    /// A volume whose scalars are those that are drawn.
    pub(crate) fn volume(&self, volume: &Volume) -> Volume {
        let values = with_voxels!(&volume.voxels, slice => {
            slice.par_iter().map(|&value| self.value(scalar(value)) as f32).collect()
        });
        Volume {
            dims: volume.dims,
            voxels: Voxels::F32(values),
            world_from_index: volume.world_from_index,
            up_hint: volume.up_hint,
            space: volume.space.clone(),
            modality: volume.modality,
            unit: volume.unit.clone(),
            window: volume.window.map(|ends| ends.map(|end| self.value(end))),
        }
    }

    /// A transfer function of scalars that are drawn.
    pub(crate) fn transfer(&self, transfer: &TransferFunction) -> TransferFunction {
        transfer.of_mapped(|value| self.value(value))
    }

    /// Options of scalars that are drawn.
    pub(crate) fn options(&self, options: &RenderOptions) -> RenderOptions {
        let mut options = options.clone();
        if let Some(curve) = &mut options.gradient_opacity {
            *curve = curve.scaled(self.scale);
        }
        if let Order::Field(field) = &mut options.order
            && let Blend::Isosurface(surface) = &mut field.blend
        {
            surface.value = self.value(surface.value);
        }
        options
    }
}

/// The channels of a scene as they are drawn.
pub(crate) struct Narrowed {
    /// For each channel, what its scalars need; labels need nothing.
    pub(crate) narrowings: Vec<Narrowing>,
    /// Of those that need something.
    parts: Vec<Option<(Volume, TransferFunction)>>,
}

impl Narrowed {
    /// Narrows the channels of a scene that need it. [`Error::Option`] where opacity follows the gradient and channels lie
    /// in ranges that have no common scale.
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        let narrowings: Vec<Narrowing> = scene.channels.iter().map(narrowing).collect();
        let differ = narrowings.iter().any(|n| n.scale != narrowings[0].scale);
        if options.gradient_opacity.is_some() && differ {
            return Err(Error::Option(
                "opacity by the gradient has one curve for all channels, and their scalars are of sizes that single precision \
                 cannot hold together: rescale one of them"
                    .into(),
            ));
        }
        let part = |(channel, narrowing): (&Channel, &Narrowing)| match channel.look {
            Look::Transfer(transfer) if *narrowing != Narrowing::NONE => Some((
                narrowing.volume(channel.volume),
                narrowing.transfer(transfer),
            )),
            _ => None,
        };
        let parts = scene.channels.iter().zip(&narrowings).map(part).collect();
        Ok(Self { narrowings, parts })
    }

    /// The scene as it is drawn.
    pub(crate) fn scene<'a>(&'a self, scene: &Scene<'a>) -> Scene<'a> {
        let channel = |(channel, part): (&Channel<'a>, &'a Option<_>)| match part {
            Some((volume, transfer)) => Channel {
                volume,
                look: Look::Transfer(transfer),
            },
            None => *channel,
        };
        Scene {
            channels: scene
                .channels
                .iter()
                .zip(&self.parts)
                .map(channel)
                .collect(),
            mask: scene.mask,
        }
    }
}

/// The rescaling of a channel's scalars.
fn narrowing(channel: &Channel) -> Narrowing {
    let voxel_type = VoxelType::of(&channel.volume.voxels);
    let is_wide = matches!(voxel_type, VoxelType::U32 | VoxelType::I32 | VoxelType::F64);
    match channel.look {
        Look::Transfer(_) if is_wide => Narrowing::of(voxel_type, channel.volume.value_range()),
        _ => Narrowing::NONE,
    }
}
