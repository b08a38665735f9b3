//! The light that arrives at surfaces of a scene that blocks it: `shadow` makes it, pixels look it up.
//!
//! In the order in which data flow: triangles that block light (`bvh`), directions of light (`sky`), the light of a place (`place`), places on
//! triangles (`grids`), rays to small bright lights (`sun_rays`), the light of pixels (`look`).

pub(crate) mod bvh;
pub(crate) mod sky;
pub(crate) mod place;
pub(crate) mod grids;
pub(crate) mod sun_rays;
pub(crate) mod look;

use crate::light::blocked::bvh::Tree;
use crate::light::blocked::grids::Grids;
use crate::light::blocked::place::PlaceLight;

/// The light on a scene whose triangles block it.
#[derive(Clone, Debug)]
pub(crate) struct BlockedLight {
    pub(crate) grids: Grids,
    pub(crate) lights: Vec<PlaceLight>,
    pub(crate) tree: Tree,
    /// Rays begin this far from surfaces, world units.
    pub(crate) above: f32,
}
