//! Named transfer functions for what is scanned most.
//!
//! Takes a name, gives knots. Those for CT are written in Hounsfield units, which mean the same in every scanner: air is
//! -1000, water 0, fat about -100, muscle 50, blood with contrast agent 150 to 400, bone from 200 to above 1500. MR has
//! no such unit, so its knots are shares of the range that almost all of the volume's values lie in.
//! Source: the knots are our own, chosen from those numbers and looked at with shading; opacities are per voxel.
//! Limits: a contrast agent and spongy bone have the same values, and no function of the value alone parts them.

use std::str::FromStr;

use crate::transfer::{ColourKnot, Histogram, OpacityKnot, TransferFunction};
use crate::volume::{Described, VoxelType};

/// A named transfer function. `parse` gives one by name.
#[derive(Clone, Copy, Debug)]
pub struct Preset(&'static Entry);

/// What the knots of a preset are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresetScale {
    /// Hounsfield units, as CT has them.
    Hounsfield,
    /// Shares 0..=1 of the range of the volume's values.
    Share,
}

#[derive(Debug)]
struct Entry {
    name: &'static str,
    about: &'static str,
    scale: PresetScale,
    /// Scalar, then red, green, blue in linear light: none is above 0.9, so that a highlight still shows.
    colours: &'static [(f64, [f32; 3])],
    /// Scalar and opacity per voxel.
    opacities: &'static [(f64, f64)],
}

/// Fat, in linear light: pale yellow.
const FAT: [f32; 3] = [0.75, 0.45, 0.16];
/// Muscle: brownish red.
const MUSCLE: [f32; 3] = [0.45, 0.09, 0.06];
/// Blood with contrast agent: red.
const BLOOD: [f32; 3] = [0.65, 0.03, 0.02];
/// Spongy bone: ochre.
const SPONGY: [f32; 3] = [0.55, 0.32, 0.14];
/// Dense bone: ivory.
const BONE: [f32; 3] = [0.85, 0.75, 0.55];
/// Enamel and metal: nearly white.
const ENAMEL: [f32; 3] = [0.9, 0.9, 0.87];
/// Skin.
const SKIN: [f32; 3] = [0.72, 0.4, 0.26];

const PRESETS: [Entry; 6] = [
    Entry {
        name: "ct-bone",
        about: "bone alone, ivory",
        scale: PresetScale::Hounsfield,
        colours: &[(150.0, SPONGY), (500.0, BONE), (1800.0, ENAMEL)],
        opacities: &[(150.0, 0.0), (300.0, 0.25), (600.0, 0.8), (1200.0, 0.95)],
    },
    Entry {
        name: "ct-soft-tissue",
        about: "muscle and organs under a veil of fat, bone behind them",
        scale: PresetScale::Hounsfield,
        colours: &[
            (-120.0, FAT),
            (-30.0, FAT),
            (30.0, MUSCLE),
            (110.0, MUSCLE),
            (250.0, SPONGY),
            (600.0, BONE),
            (1800.0, ENAMEL),
        ],
        opacities: &[
            (-150.0, 0.0),
            (-90.0, 0.02),
            (-20.0, 0.02),
            (40.0, 0.2),
            (110.0, 0.25),
            (250.0, 0.5),
            (600.0, 0.9),
        ],
    },
    Entry {
        name: "ct-vessels",
        about: "vessels with contrast agent, red; bone as ivory",
        scale: PresetScale::Hounsfield,
        colours: &[
            (120.0, BLOOD),
            (350.0, BLOOD),
            (550.0, BONE),
            (1800.0, ENAMEL),
        ],
        opacities: &[(120.0, 0.0), (180.0, 0.15), (300.0, 0.6), (600.0, 0.7)],
    },
    Entry {
        name: "ct-skin",
        about: "the surface of the body",
        scale: PresetScale::Hounsfield,
        colours: &[(-400.0, SKIN), (100.0, SKIN), (400.0, BONE)],
        opacities: &[(-450.0, 0.0), (-250.0, 0.35), (-100.0, 0.9)],
    },
    Entry {
        name: "ct-lung",
        about: "lungs, blue to white; the body around them as a faint veil",
        scale: PresetScale::Hounsfield,
        colours: &[
            (-950.0, [0.1, 0.25, 0.6]),
            (-750.0, [0.35, 0.5, 0.75]),
            (-500.0, [0.8, 0.7, 0.65]),
            (0.0, MUSCLE),
            (400.0, BONE),
        ],
        opacities: &[
            (-890.0, 0.0),
            (-820.0, 0.03),
            (-600.0, 0.12),
            (-450.0, 0.03),
            (-200.0, 0.004),
            (200.0, 0.004),
            (500.0, 0.05),
        ],
    },
    Entry {
        name: "mr-head",
        about: "a head in MR: skin and brain, by shares of the volume's own range",
        scale: PresetScale::Share,
        colours: &[
            (0.1, MUSCLE),
            (0.3, SKIN),
            (0.6, [0.75, 0.62, 0.5]),
            (1.0, ENAMEL),
        ],
        opacities: &[(0.12, 0.0), (0.25, 0.06), (0.5, 0.3), (1.0, 0.8)],
    },
];

/// Share of the voxels that may lie above the upper end of [`PresetScale::Share`]: fat and vessels shine far above all
/// else in MR. A guess.
const BRIGHTEST_SHARE: f64 = 0.002;

/// Scalars beyond which a volume does not look like Hounsfield units: scanners store 12 bits from -1024 on, some extend
/// them for metal, and air outside the round field of view is written as -2000 or -2048 by some.
const HOUNSFIELD_RANGE: (f64, f64) = (-2048.0, 4096.0);

impl Preset {
    /// All presets, those for CT first.
    pub fn all() -> impl Iterator<Item = Self> {
        PRESETS.iter().map(Self)
    }

    /// The name, lower case.
    pub fn name(&self) -> &'static str {
        self.0.name
    }

    /// What it shows, in a few words.
    pub fn about(&self) -> &'static str {
        self.0.about
    }

    /// What its knots are written in.
    pub fn scale(&self) -> PresetScale {
        self.0.scale
    }

    /// The transfer function for a volume with this histogram; opacities are per voxel.
    pub fn transfer(&self, histogram: &Histogram) -> TransferFunction {
        let (low, high) = match self.0.scale {
            // One Hounsfield unit stays one.
            PresetScale::Hounsfield => (0.0, 1.0),
            PresetScale::Share => (histogram.range().0, value_below_brightest(histogram)),
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
        Self::all()
            .find(|preset| preset.name() == wanted)
            .ok_or_else(|| {
                let lines: Vec<_> = Self::all()
                    .map(|p| format!("  {:<15} {}", p.name(), p.about()))
                    .collect();
                format!("expected one of\n{}", lines.join("\n"))
            })
    }
}

/// The scalar above which there are only the brightest few voxels.
fn value_below_brightest(histogram: &Histogram) -> f64 {
    let counts = histogram.counts();
    let total: u64 = counts.iter().sum();
    let allowed = BRIGHTEST_SHARE * total as f64;
    let mut above = 0.0;
    for bin in (0..counts.len()).rev() {
        above += counts[bin] as f64;
        if above > allowed {
            return histogram.value(bin);
        }
    }
    histogram.range().1
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::volume::{Volume, Voxels};

    fn volume(voxels: Voxels) -> Volume {
        Volume::new([voxels.len(), 1, 1], voxels, DAffine3::IDENTITY).expect("valid")
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
            assert_eq!(
                function.opacity(-1000.0),
                0.0,
                "{}: what is darkest is not seen",
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
}
