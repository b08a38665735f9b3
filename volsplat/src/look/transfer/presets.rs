//! Named looks for what is scanned and simulated most: a transfer function, its light, and the value of a ray.
//!
//! Takes a name, gives knots. Those for CT are written in Hounsfield units, which mean the same in every scanner: air is
//! -1000, water 0, fat about -100, muscle 50, blood with contrast agent 150 to 400, bone from 200 to above 1500. Other data
//! has no such unit, so its knots are shares of the range that almost all of the volume's values lie in, from its lower end
//! or from the end of the background. `table.rs` has the numbers.
//! Limits: a contrast agent and spongy bone have the same values, and no function of the value alone parts them.

mod entry;
mod table;
#[cfg(test)]
mod tests;

use std::str::FromStr;

use entry::Entry;
use table::PRESETS;

pub use entry::PresetScale;

use crate::look::options::{Blend, Shading};
use crate::look::transfer::automatic::background_end;
use crate::look::transfer::{ColourKnot, Histogram, OpacityKnot, TransferFunction};
use resample_volume::volume::{Described, VoxelType};

/// A named look. `parse` gives one by name.
#[derive(Clone, Copy, Debug)]
pub struct Preset(&'static Entry);

/// Scalars beyond which a volume does not look like Hounsfield units: scanners store 12 bits from -1024 on, some extend
/// them for metal, and air outside the round field of view is written as -2000 or -2048 by some.
const HOUNSFIELD_RANGE: (f64, f64) = (-2048.0, 4096.0);

impl Preset {
    /// All presets, those for CT first.
    pub fn all() -> impl Iterator<Item = Self> {
        PRESETS.iter().map(Self)
    }

    /// The preset of this name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::all().find(|preset| preset.name() == name)
    }

    /// The name, lower case.
    pub fn name(&self) -> &'static str {
        self.0.name
    }

    /// A description in a few words.
    pub fn about(&self) -> &'static str {
        self.0.about
    }

    /// The light that it was made for.
    pub fn shading(&self) -> Shading {
        self.0.shading
    }

    /// The value of a ray that it was made for.
    pub fn blend(&self) -> Blend {
        self.0.blend
    }

    /// The scale of its knots.
    pub fn scale(&self) -> PresetScale {
        self.0.scale
    }

    /// The transfer function for a volume with this histogram; opacities are per voxel.
    pub fn transfer(&self, histogram: &Histogram) -> TransferFunction {
        let (low, high) = match self.0.scale {
            // One Hounsfield unit stays one.
            PresetScale::Hounsfield => (0.0, 1.0),
            PresetScale::Share => (histogram.range().0, histogram.value_below_brightest()),
            PresetScale::Signal => {
                let low = background_end(histogram);
                (low, histogram.value_below_brightest().max(low))
            }
        };
        let place = |share: f64| low * (1.0 - share) + high * share;
        let value = |knot: f64| {
            if self.0.scale == PresetScale::Hounsfield {
                knot
            } else {
                place(knot)
            }
        };
        let colours = self.0.colours.iter().map(|&(knot, rgb)| ColourKnot {
            value: value(knot),
            rgb,
        });
        let opacities = self.0.opacities.iter().map(|&(knot, opacity)| OpacityKnot {
            value: value(knot),
            opacity,
        });
        TransferFunction {
            colours: colours.collect(),
            opacities: opacities.collect(),
        }
    }

    /// Why the values of a volume do not look like what the preset is written in; `None` if they do.
    pub fn mismatch(&self, volume: &dyn Described) -> Option<String> {
        if self.0.scale != PresetScale::Hounsfield {
            return None;
        }
        let (low, high) = volume.value_range();
        if matches!(volume.voxel_type(), VoxelType::U8 | VoxelType::I8) {
            return Some("the volume has 8 bits per voxel".to_owned());
        }
        if low < HOUNSFIELD_RANGE.0 || high > HOUNSFIELD_RANGE.1 {
            return Some(format!("the volume's values go from {low} to {high}"));
        }
        // There is air in or around almost every body.
        (low >= 0.0).then(|| format!("the volume has no value below {low}, and air is -1000"))
    }
}

impl FromStr for Preset {
    type Err = String;

    /// Case does not matter. The error lists all presets, one in a line.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = text.trim().to_lowercase();
        Self::named(&wanted).ok_or_else(|| {
            let lines: Vec<_> = Self::all()
                .map(|p| format!("  {:<16} {}", p.name(), p.about()))
                .collect();
            format!("expected one of\n{}", lines.join("\n"))
        })
    }
}
