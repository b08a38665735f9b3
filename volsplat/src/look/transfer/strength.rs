//! From opacity to strength: what a transfer function's opacity is in the sums of a picture.

use resample_core::OpacityMode;

use super::TransferFunction;

/// Extinction of a fully opaque voxel, per opacity unit: exp(-87) is the edge of what f32 holds as a normal number,
/// so more would change no pixel.
const MAX_EXTINCTION: f64 = 87.0;

/// Colour and strength of a scalar.
pub(crate) fn classified(transfer: &TransferFunction, mode: OpacityMode, value: f64) -> [f32; 4] {
    let (rgb, opacity) = transfer.sample(value);
    [rgb[0], rgb[1], rgb[2], strength_of(opacity, mode)]
}

/// Strength of an opacity: extinction per opacity unit, or with linear opacity the opacity.
pub(crate) fn strength_of(opacity: f64, mode: OpacityMode) -> f32 {
    let strength = match mode {
        OpacityMode::Extinction => (-(-opacity).ln_1p()).min(MAX_EXTINCTION),
        OpacityMode::Linear => opacity,
    };
    strength as f32
}
