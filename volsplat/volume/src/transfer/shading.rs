//! The light that a transfer function was made for.

/// How samples are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shading {
    /// Not at all: the colours of the transfer function
    None,
    /// Ambient and diffuse light, by the gradient
    Lambert,
    /// With a white highlight
    Phong,
}
