//! Point or splat: the choice of primitive for each sample.
//!
//! "Classification" is what a transfer function does to a scalar, so this choice is called selection.

/// The choice between points and splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum SelectMode {
    /// A sample whose spacing projects to less than the threshold is a point, the others are splats.
    Hybrid,
    /// Every sample is a point: fast, with holes where samples are magnified.
    Points,
    /// Every sample is a splat: minified ones fall between pixels and alias.
    Splats,
    /// Every sample is its footprint convolved with the pixel's Gaussian: covariances add (Heckbert 1989).
    Ewa,
}
