//! The parts of a figure that are drawn into a picture: bars, axes, a caption.

use clap::{Args, ValueEnum};

use crate::values;

/// The parts of a figure.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Figure")]
pub struct FigureArgs {
    /// Draw a bar of a round length, or of LENGTH world units
    ///
    /// In perspective it is true at the depth of the middle of the scene; --projection orthographic makes it true everywhere.
    #[arg(long, value_name = "LENGTH", num_args = 0..=1, require_equals = true, value_parser = values::positive)]
    pub scale_bar: Option<Option<f64>>,
    /// Draw the colours of the values, under TITLE
    #[arg(long, alias = "color-bar", value_name = "TITLE", num_args = 0..=1, require_equals = true)]
    pub colour_bar: Option<Option<String>>,
    /// Draw the axes of the world: their directions in a corner, or a box around the scene with numbers
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "directions")]
    pub axes: Option<AxesKind>,
    /// Write a line of text at the top
    #[arg(long, value_name = "TEXT")]
    pub caption: Option<String>,
}

/// `--axes`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AxesKind {
    /// Their directions in a corner
    Directions,
    /// A box around the visible part, with numbers
    Box,
}
