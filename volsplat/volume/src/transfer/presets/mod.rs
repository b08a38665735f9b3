//! Named looks for the usual scans and simulations: a transfer function, its light, and the value of a ray; and the look of data for which
//! the caller chose none.
//!
//! Takes a name, returns knots. Those for CT are written in Hounsfield units, which mean the same in every scanner: air is
//! -1000, water 0, fat about -100, muscle 50, blood with contrast agent 150 to 400, bone from 200 to above 1500. Other data
//! has no such unit, so its knots are shares of the range that almost all of the volume's values lie in, from its lower end
//! or from the end of the background. `table.rs` has the numbers.
//!
//! By default, Hounsfield units look as the preset
//! `ct`, another scan as `scan`, a field as the automatic function does. A field of
//! more than one value is lit: its opacity begins at a surface. Labels need no function: they have a table of colours.
//! Limits: a contrast agent and spongy bone have the same values, and no function of the value alone separates them.

mod table;

use std::str::FromStr;

use crate::transfer::presets::table::{Entry, PRESETS};
use crate::transfer::{
    Blend, ColourKnot, ColourMap, DataKind, Histogram, OpacityKnot, Shading, TransferFunction,
    background_end,
};
use crate::volume::{Described, VoxelType};

pub use table::PresetScale;

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
    fn named(name: &str) -> Option<Self> {
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
        TransferFunction::of_checked(colours.collect(), opacities.collect())
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
    automatic.coloured(ColourMap::default(), low, high)
}

#[cfg(test)]
mod tests {
    use crate::volume::{Volume, Voxels};
    use glam::DAffine3;

    use super::*;
    use crate::transfer::presets::table::PRESETS;

    fn volume(voxels: Voxels) -> Volume {
        Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid")
    }

    #[test]
    fn air_is_clear_and_one_value_is_not_lit() {
        let ct = Histogram::of_volume(&volume(Voxels::I16((-1000..2000).collect())));
        let look = DefaultLook::of(DataKind::Hounsfield, &ct);
        assert_eq!(look.shading, Shading::Phong);
        assert_eq!(look.function.opacity(-1000.0), 0.0, "air is clear");
        let one = Histogram::of_volume(&volume(Voxels::U8(vec![7; 64])));
        let look = DefaultLook::of(DataKind::Field, &one);
        assert_eq!(look.shading, Shading::None, "one value has no surface");
    }

    #[test]
    fn every_preset_is_a_valid_function_and_found_by_its_name() {
        let histogram = Histogram::of_volume(&volume(Voxels::I16((-1000..2000).collect())));
        for preset in Preset::all() {
            let found: Preset = preset.name().to_uppercase().parse().expect("a listed name");
            assert_eq!(found.name(), preset.name());
            let function = preset.transfer(&histogram);
            let knots = (
                function.colour_knots().to_vec(),
                function.opacity_knots().to_vec(),
            );
            TransferFunction::new(knots.0.clone(), knots.1)
                .unwrap_or_else(|error| panic!("{found:?}: {error}"));
            let brightest = knots.0.iter().flat_map(|knot| knot.rgb).fold(0.0, f32::max);
            assert!(
                brightest <= 0.9,
                "{}: a channel of {brightest} leaves no room for a highlight",
                preset.name()
            );
            if preset.name() != "extremes" {
                assert_eq!(
                    function.opacity(-1000.0),
                    0.0,
                    "{}: what is darkest is not seen",
                    preset.name()
                );
            }
            let is_projection = preset.blend() != Blend::Emission;
            assert!(
                !is_projection || preset.shading() == Shading::None,
                "{}: a projection has no light",
                preset.name()
            );
        }
    }

    #[test]
    fn an_unknown_name_lists_all_with_a_line_each() {
        let text = "list".parse::<Preset>().expect_err("no such preset");
        assert_eq!(text.lines().count(), 1 + PRESETS.len(), "{text}");
        for preset in Preset::all() {
            assert!(
                text.contains(preset.name()) && text.contains(preset.about()),
                "{} in {text}",
                preset.name()
            );
        }
    }

    #[test]
    fn tissues_are_where_hounsfield_units_put_them() {
        let histogram = Histogram::of_volume(&volume(Voxels::I16(vec![0, 1])));
        let opacity = |name: &str, value: f64| {
            name.parse::<Preset>()
                .expect("a listed name")
                .transfer(&histogram)
                .opacity(value)
        };
        assert_eq!(opacity("ct-bone", 60.0), 0.0, "muscle is no bone");
        assert!(opacity("ct-bone", 1500.0) > 0.9, "dense bone is dense");
        assert_eq!(opacity("ct-vessels", 60.0), 0.0, "muscle is no vessel");
        assert!(opacity("ct-vessels", 300.0) > 0.5, "contrast agent is seen");
        assert!(
            opacity("ct-soft-tissue", 50.0) > 5.0 * opacity("ct-soft-tissue", -100.0),
            "fat is a veil"
        );
        assert_eq!(opacity("ct-skin", -1000.0), 0.0, "air is clear");
        assert!(
            opacity("ct-lung", -700.0) > opacity("ct-lung", 0.0),
            "the lung is denser than the body's veil"
        );
    }

    #[test]
    fn shares_span_the_values_without_the_brightest_few() {
        let mut values: Vec<u16> = (0..10_000).map(|v| 100 + v / 10).collect();
        values[5] = 60_000;
        let preset: Preset = "mr-head".parse().expect("a listed name");
        let function = preset.transfer(&Histogram::of_volume(&volume(Voxels::U16(values))));
        let (low, high) = function.value_range();
        // Of 10000 values, 20 may lie above: the outlier and the ten at 1099 do, and the ten at 1098 are too many.
        assert_eq!(high, 1098.0, "the outlier does not stretch the range");
        assert!(
            (low - (100.0 + 0.1 * 998.0)).abs() < 1e-9,
            "the first knot lies at a tenth of it: {low}"
        );
    }

    #[test]
    fn values_that_are_not_hounsfield_units_are_told() {
        let bone: Preset = "ct-bone".parse().expect("a listed name");
        let told = |voxels: Voxels| bone.mismatch(&volume(voxels));
        assert_eq!(told(Voxels::I16(vec![-1024, 3071])), None, "CT");
        assert_eq!(told(Voxels::F32(vec![-2048.0, 4096.0])), None, "the ends");
        assert!(told(Voxels::U8(vec![0, 255])).is_some_and(|text| text.contains("8 bits")));
        assert!(told(Voxels::I16(vec![-1024, 9000])).is_some_and(|text| text.contains("9000")));
        assert!(told(Voxels::I16(vec![-3000, 10])).is_some_and(|text| text.contains("-3000")));
        assert!(told(Voxels::U16(vec![0, 4000])).is_some_and(|text| text.contains("-1000")));
        let mr: Preset = "mr-head".parse().expect("a listed name");
        assert_eq!(
            mr.mismatch(&volume(Voxels::U8(vec![0, 255]))),
            None,
            "MR has no unit"
        );
    }

    #[test]
    fn a_signal_begins_where_the_background_ends() {
        // Nine tenths are background around 100, and one tenth an object from 1000 to 2000.
        let background = (0..9000).map(|i| 95 + i % 11);
        let object = (0..1000).map(|i| 1000 + i);
        let values: Vec<u16> = background.chain(object).collect();
        let histogram = Histogram::of_volume(&volume(Voxels::U16(values)));
        let solid: Preset = "solid".parse().expect("a listed name");
        let function = solid.transfer(&histogram);
        assert_eq!(function.opacity(105.0), 0.0, "background");
        assert!(
            function.opacity(1000.0) > 0.5,
            "{:?}",
            function.opacity_knots()
        );
    }
}
