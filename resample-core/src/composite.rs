//! Compositing: from optical depth to opacity, and the over operator, front to back.

/// How the opacity of a sample becomes the opacity of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpacityMode {
    /// Opacity is turned into extinction; a pixel's opacity is 1 - exp(-optical depth). Transmittance is then exact
    /// however many footprints overlap.
    Extinction,
    /// A pixel's opacity is the sample's opacity times the footprint (Westover 1990), for comparison.
    Linear,
}
