//! The parts of a figure: a scale bar, a colour bar, axes, and the ground that they stand on.

use glam::DVec3;

/// The ground of letters and lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Ground {
    /// A dark colour: letters are white.
    Dark,
    /// A light colour: letters are black.
    Light,
    /// Nothing, or a picture: letters are black with a white rim.
    #[default]
    Unknown,
}

/// A bar of a length in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleBar {
    /// Its length, world units; `None` is a round one near a fifth of the picture's width.
    pub length: Option<f64>,
    /// The unit, written behind the number.
    pub unit: Option<String>,
    /// Where the length is true: in perspective lengths shrink with depth.
    pub at: DVec3,
}

/// Colours and their values, from the bottom up.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourBar {
    /// A line above it.
    pub title: Option<String>,
    /// The values at its ends.
    pub range: [f64; 2],
    /// Linear light, from the first value to the last, at least one.
    pub colours: Vec<[f32; 3]>,
}

/// The axes of the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Axes {
    /// Their names.
    pub names: [String; 3],
    /// The box that they bound, with numbers; `None` shows their directions in a corner.
    pub bounds: Option<[DVec3; 2]>,
    /// The unit, written behind the names.
    pub unit: Option<String>,
}
