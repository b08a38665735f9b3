//! The look of data for which nobody asked for one.
//!
//! Takes the kind of the data and its histogram, gives a transfer function and its light: Hounsfield units look as the preset
//! `ct`, another scan as `scan`, a field as the automatic function does. A field of
//! more than one value is lit: its opacity begins at a surface.
//! Labels need no function: they have a table of colours.
//! Limits: what is bright is the object, as for the automatic function.

use crate::look::options::Shading;
use crate::look::transfer::automatic::background_end;
use crate::look::transfer::presets::Preset;
use crate::look::transfer::{ColourMap, DataKind, Histogram, TransferFunction};

/// A transfer function and the light that goes with it.
#[derive(Clone, Debug, PartialEq)]
pub struct DefaultLook {
    /// From a scalar to colour and opacity.
    pub function: TransferFunction,
    /// The light of emission and absorption.
    pub shading: Shading,
}

impl DefaultLook {
    /// The look of data of a kind. Labels are treated as a field.
    pub fn of(kind: DataKind, histogram: &Histogram) -> Self {
        match Self::preset(kind) {
            Some(preset) => Self {
                function: preset.transfer(histogram),
                shading: preset.shading(),
            },
            None => Self {
                function: field(histogram),
                // Where the background ends, the opacity begins: a surface.
                shading: if background_end(histogram) < histogram.range().1 {
                    Shading::Phong
                } else {
                    Shading::None
                },
            },
        }
    }

    /// The preset that data of a kind looks like, where there is one.
    pub fn preset(kind: DataKind) -> Option<Preset> {
        match kind {
            DataKind::Hounsfield => Preset::named("ct"),
            DataKind::Scan => Preset::named("scan"),
            DataKind::Labels | DataKind::Field => None,
        }
    }
}

/// Share of the object's voxels that may lie beyond the colour map: the few brightest ones do not make all others dark. A guess.
const BEYOND_MAP: f64 = 0.05;

/// The automatic opacity, under colours that span what most of the object holds.
fn field(histogram: &Histogram) -> TransferFunction {
    let automatic = TransferFunction::automatic(histogram, ColourMap::default());
    let low = background_end(histogram);
    let high = histogram.value_with_above(BEYOND_MAP, low).max(low);
    TransferFunction {
        colours: ColourMap::default().knots(low, high),
        ..automatic
    }
}
