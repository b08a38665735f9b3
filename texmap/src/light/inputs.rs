//! The input of lighting: the numbers of sixteen places.

use crate::screen::lanes::{LANES, Lanes};

/// Surfaces as light meets them.
pub(crate) struct Inputs {
    /// Of length 1, in the world.
    pub(crate) normal: [Lanes; 3],
    /// Towards the eye, of length 1.
    pub(crate) eye: [Lanes; 3],
    /// Base colour, straight.
    pub(crate) base: [Lanes; 3],
    pub(crate) metal: Lanes,
    /// Covariances with metal, of base colour and of roughness: 0 where a footprint has one of each.
    pub(crate) base_with_metal: [Lanes; 3],
    pub(crate) roughness_with_metal: Lanes,
    /// Perceptual roughness: mean and variance.
    pub(crate) roughness: Lanes,
    pub(crate) roughness_variance: Lanes,
    /// Share of light that arrives.
    pub(crate) open: Lanes,
    /// Mean square of the distance of normals from their mean.
    pub(crate) variance: Lanes,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            normal: [[0.0; LANES]; 3],
            eye: [[0.0; LANES]; 3],
            base: [[0.0; LANES]; 3],
            metal: [0.0; LANES],
            base_with_metal: [[0.0; LANES]; 3],
            roughness_with_metal: [0.0; LANES],
            roughness: [0.0; LANES],
            roughness_variance: [0.0; LANES],
            open: [1.0; LANES],
            variance: [0.0; LANES],
        }
    }
}
