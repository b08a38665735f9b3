//! The transfer functions of voxels that are colours: each component tints the channel that gives the opacity.

use resample_core::image::linear_from_srgb;
use resample_volume::volume::{Described, VoxelType};

use crate::look::transfer::{ColourKnot, OpacityKnot, TransferFunction};

/// The transfer function of a colour component (0 is red): from its sRGB code to linear light.
pub fn tint(component: usize, volume: &dyn Described) -> TransferFunction {
    let most = match volume.voxel_type() {
        VoxelType::U16 => u16::MAX,
        _ => u16::from(u8::MAX),
    };
    let knot = |code: u16| {
        let share = f32::from(code) / f32::from(u8::MAX);
        let mut rgb = [0.0; 3];
        rgb[component] = linear_from_srgb(share);
        ColourKnot {
            value: f64::from(share) * f64::from(most),
            rgb,
        }
    };
    let opaque = OpacityKnot {
        value: 0.0,
        opacity: 1.0,
    };
    TransferFunction {
        colours: (0..=u16::from(u8::MAX)).map(knot).collect(),
        opacities: vec![opaque],
    }
}
