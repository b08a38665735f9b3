//! The knots, the light and the blending of every preset.
//!
//! Colours are red, green, blue in linear light, none above 0.9, so that a highlight still shows; opacities are per voxel.
//! Source: our own, from the Hounsfield units of tissues and from pictures of data that they were not made on.

use crate::transfer::presets::table::PresetScale::{Hounsfield, Share, Signal};
use crate::transfer::{Blend, Shading};

/// The scale of a preset's knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresetScale {
    /// Hounsfield units, as CT has them.
    Hounsfield,
    /// Shares 0..=1 of the range of the volume's values.
    Share,
    /// Shares 0..=1 from the end of the background to the top of the range.
    Signal,
}

/// A preset.
#[derive(Debug)]
pub(crate) struct Entry {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) scale: PresetScale,
    /// The light that it was made for.
    pub(crate) shading: Shading,
    /// The value of a ray that it was made for.
    pub(crate) blend: Blend,
    /// Scalar, then red, green, blue in linear light.
    pub(crate) colours: &'static [(f64, [f32; 3])],
    /// Scalar and opacity per voxel.
    pub(crate) opacities: &'static [(f64, f64)],
}

/// Fat: pale yellow.
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
/// Grey matter.
const BRAIN: [f32; 3] = [0.75, 0.62, 0.5];
/// Unfired clay.
const CLAY: [f32; 3] = [0.62, 0.5, 0.4];

const BLACK: [f32; 3] = [0.0; 3];
const WHITE: [f32; 3] = [0.9; 3];

/// A lit preset for CT.
const CT: Entry = Entry {
    name: "",
    about: "",
    scale: Hounsfield,
    shading: Shading::Phong,
    blend: Blend::Emission,
    colours: &[],
    opacities: &[],
};
/// A lit preset in shares of the range.
const SHARES: Entry = Entry { scale: Share, ..CT };
/// A lit preset in shares of the range above the background.
const SIGNALS: Entry = Entry {
    scale: Signal,
    ..CT
};

/// All presets: those for CT, for MR, for microscopes, for simulations.
pub(crate) const PRESETS: [Entry; 24] = [
    Entry {
        name: "ct",
        about: "a body: its skin as a veil, muscle and bone under it",
        colours: &[
            (-400.0, SKIN),
            (-20.0, SKIN),
            (40.0, MUSCLE),
            (110.0, MUSCLE),
            (220.0, SPONGY),
            (600.0, BONE),
            (1800.0, ENAMEL),
        ],
        opacities: &[
            (-420.0, 0.0),
            (-260.0, 0.02),
            (-80.0, 0.015),
            (20.0, 0.03),
            (110.0, 0.04),
            (200.0, 0.2),
            (350.0, 0.7),
            (1000.0, 0.95),
        ],
        ..CT
    },
    Entry {
        name: "ct-bone",
        about: "bone alone, ivory",
        colours: &[(150.0, SPONGY), (500.0, BONE), (1800.0, ENAMEL)],
        opacities: &[(150.0, 0.0), (300.0, 0.25), (600.0, 0.8), (1200.0, 0.95)],
        ..CT
    },
    Entry {
        name: "ct-soft-tissue",
        about: "muscle and organs under a veil of fat, bone behind them",
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
        ..CT
    },
    Entry {
        name: "ct-muscle",
        about: "muscle and organs laid bare: no skin, no fat",
        colours: &[
            (0.0, MUSCLE),
            (130.0, MUSCLE),
            (300.0, SPONGY),
            (600.0, BONE),
            (1800.0, ENAMEL),
        ],
        opacities: &[(-10.0, 0.0), (40.0, 0.5), (100.0, 0.9)],
        ..CT
    },
    Entry {
        name: "ct-vessels",
        about: "vessels with contrast agent, red; bone as ivory",
        colours: &[
            (120.0, BLOOD),
            (350.0, BLOOD),
            (550.0, BONE),
            (1800.0, ENAMEL),
        ],
        opacities: &[(120.0, 0.0), (180.0, 0.15), (300.0, 0.6), (600.0, 0.7)],
        ..CT
    },
    Entry {
        name: "ct-skin",
        about: "the surface of the body",
        colours: &[(-400.0, SKIN), (100.0, SKIN), (400.0, BONE)],
        opacities: &[(-450.0, 0.0), (-250.0, 0.35), (-100.0, 0.9)],
        ..CT
    },
    Entry {
        name: "ct-lung",
        about: "lungs, blue to white; the body around them as a faint veil",
        scale: Hounsfield,
        shading: Shading::Lambert,
        blend: Blend::Emission,
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
        name: "ct-airways",
        about: "airways, sinuses and skin as glass",
        colours: &[(-900.0, [0.25, 0.55, 0.8]), (-300.0, [0.8, 0.85, 0.9])],
        opacities: &[(-850.0, 0.0), (-600.0, 0.06), (-400.0, 0.06), (-250.0, 0.0)],
        ..CT
    },
    Entry {
        name: "ct-mip",
        about: "the greatest value behind each pixel: bone, metal and contrast agent, white",
        scale: Hounsfield,
        shading: Shading::None,
        blend: Blend::Maximum,
        colours: &[(-50.0, BLACK), (1400.0, WHITE)],
        opacities: &[(-200.0, 0.0), (0.0, 1.0)],
    },
    Entry {
        name: "ct-xray",
        about: "the mean value behind each pixel, as on an X-ray film",
        scale: Hounsfield,
        shading: Shading::None,
        blend: Blend::Average,
        colours: &[(-950.0, BLACK), (100.0, WHITE)],
        opacities: &[(-990.0, 0.0), (-900.0, 1.0)],
    },
    Entry {
        name: "scan",
        about: "a scan without units, MR or CT: what is bright, from skin to bone",
        colours: &[(0.0, MUSCLE), (0.2, SKIN), (0.55, BRAIN), (1.0, ENAMEL)],
        opacities: &[(0.0, 0.0), (0.15, 0.06), (0.4, 0.3), (1.0, 0.8)],
        ..SIGNALS
    },
    Entry {
        name: "mr-head",
        about: "a head in MR: skin and brain",
        colours: &[(0.1, MUSCLE), (0.3, SKIN), (0.6, BRAIN), (1.0, ENAMEL)],
        opacities: &[(0.12, 0.0), (0.25, 0.06), (0.5, 0.3), (1.0, 0.8)],
        ..SHARES
    },
    Entry {
        name: "mr-brain",
        about: "a brain without its skull, as a surface",
        colours: &[(0.0, [0.5, 0.3, 0.25]), (0.5, BRAIN), (1.0, ENAMEL)],
        opacities: &[(0.05, 0.0), (0.3, 0.35), (0.6, 0.9)],
        ..SIGNALS
    },
    Entry {
        name: "mr-angio",
        about: "the greatest value behind each pixel: flowing blood, white",
        scale: Share,
        shading: Shading::None,
        blend: Blend::Maximum,
        colours: &[(0.1, BLACK), (0.95, WHITE)],
        opacities: &[(0.05, 0.0), (0.2, 1.0)],
    },
    Entry {
        name: "mr-vessels",
        about: "the brightest vessels, red and lit",
        colours: &[(0.3, MUSCLE), (0.6, BLOOD), (1.0, [0.9, 0.25, 0.15])],
        opacities: &[(0.35, 0.0), (0.55, 0.3), (0.8, 0.9)],
        ..SHARES
    },
    Entry {
        name: "green-channel",
        about: "a fluorescent channel, dark to green",
        scale: Signal,
        shading: Shading::None,
        blend: Blend::Emission,
        colours: &[
            (0.0, [0.0, 0.12, 0.02]),
            (0.6, [0.03, 0.75, 0.12]),
            (1.0, [0.6, 0.9, 0.6]),
        ],
        opacities: &[(0.0, 0.0), (0.4, 0.06), (1.0, 0.6)],
    },
    Entry {
        name: "magenta-channel",
        about: "a fluorescent channel, dark to magenta",
        scale: Signal,
        shading: Shading::None,
        blend: Blend::Emission,
        colours: &[
            (0.0, [0.12, 0.0, 0.1]),
            (0.6, [0.8, 0.05, 0.65]),
            (1.0, [0.9, 0.6, 0.85]),
        ],
        opacities: &[(0.0, 0.0), (0.4, 0.06), (1.0, 0.6)],
    },
    Entry {
        name: "cyan-channel",
        about: "a fluorescent channel, dark to cyan",
        scale: Signal,
        shading: Shading::None,
        blend: Blend::Emission,
        colours: &[
            (0.0, [0.0, 0.06, 0.14]),
            (0.6, [0.03, 0.55, 0.8]),
            (1.0, [0.6, 0.85, 0.9]),
        ],
        opacities: &[(0.0, 0.0), (0.4, 0.06), (1.0, 0.6)],
    },
    Entry {
        name: "brightest",
        about: "the greatest value behind each pixel, black to white, for any data",
        scale: Share,
        shading: Shading::None,
        blend: Blend::Maximum,
        colours: &[(0.0, BLACK), (1.0, WHITE)],
        opacities: &[(0.0, 0.0), (0.1, 1.0)],
    },
    Entry {
        name: "solid",
        about: "all that is no background, as one lit body of clay",
        colours: &[(0.0, CLAY), (1.0, CLAY)],
        opacities: &[(0.0, 0.0), (0.2, 0.9)],
        ..SIGNALS
    },
    Entry {
        name: "flame",
        about: "embers to white heat; what is low is clear",
        scale: Share,
        shading: Shading::None,
        blend: Blend::Emission,
        colours: &[
            (0.1, [0.08, 0.0, 0.0]),
            (0.35, [0.6, 0.04, 0.0]),
            (0.65, [0.9, 0.35, 0.02]),
            (0.85, [0.9, 0.75, 0.2]),
            (1.0, WHITE),
        ],
        opacities: &[(0.08, 0.0), (0.35, 0.05), (0.7, 0.2), (1.0, 0.7)],
    },
    Entry {
        name: "smoke",
        about: "grey smoke, thicker where values are high",
        scale: Share,
        shading: Shading::Lambert,
        blend: Blend::Emission,
        colours: &[(0.0, [0.3, 0.32, 0.36]), (1.0, [0.85, 0.85, 0.85])],
        opacities: &[(0.05, 0.0), (0.4, 0.03), (1.0, 0.25)],
    },
    Entry {
        name: "extremes",
        about: "signed fields such as vorticity: both ends, blue and red; the middle is clear",
        colours: &[
            (0.0, [0.02, 0.12, 0.7]),
            (0.35, [0.35, 0.55, 0.85]),
            (0.65, [0.85, 0.5, 0.4]),
            (1.0, [0.7, 0.03, 0.03]),
        ],
        opacities: &[
            (0.0, 0.8),
            (0.3, 0.05),
            (0.4, 0.0),
            (0.6, 0.0),
            (0.7, 0.05),
            (1.0, 0.8),
        ],
        ..SHARES
    },
    Entry {
        name: "shells",
        about: "thin shells of equal value, violet to yellow",
        colours: &[
            (0.1, [0.12, 0.02, 0.35]),
            (0.3, [0.05, 0.25, 0.6]),
            (0.5, [0.05, 0.5, 0.3]),
            (0.7, [0.7, 0.6, 0.05]),
            (0.9, [0.9, 0.3, 0.05]),
        ],
        opacities: &[
            (0.12, 0.0),
            (0.15, 0.12),
            (0.18, 0.0),
            (0.32, 0.0),
            (0.35, 0.25),
            (0.38, 0.0),
            (0.52, 0.0),
            (0.55, 0.4),
            (0.58, 0.0),
            (0.72, 0.0),
            (0.75, 0.6),
            (0.78, 0.0),
            (0.92, 0.0),
            (0.95, 0.9),
        ],
        ..SHARES
    },
];
