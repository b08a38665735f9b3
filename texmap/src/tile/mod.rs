//! One tile of the picture, from its list of triangles to its pixels.
//!
//! Every stage is a function from the outputs of earlier stages to its own, whose storage it refills; `draw` calls them in
//! order. Inputs of all stages are in `task`. Visibility: `visible`, `cells`, `edges`. Accumulate: `patches`, `points` for pixels on one
//! minified plane, `splats` at sub-pixels elsewhere; `pixel_textures` and `texels` read textures, `pixel_light` and
//! `batch_light` light them. Resolve: `splats`, and `planes` for depth, normals and the others.

pub(crate) mod task;
pub(crate) mod visible;
pub(crate) mod cells;
pub(crate) mod edges;
pub(crate) mod patches;
pub(crate) mod pixel_textures;
pub(crate) mod texels;
pub(crate) mod pixel_light;
pub(crate) mod batch_light;
pub(crate) mod points;
pub(crate) mod splats;
pub(crate) mod planes;
pub(crate) mod draw;
