//! Settings of a frame: takes a scene, options and a camera, returns what every tile reads.
//!
//! `prepare` turns a scene into bricks of cells; `constant_brick` finds bricks of one colour; `from_differences` turns
//! differences of voxels into gradients; `settings` holds what the tiles of a
//! frame share, `iso_rays` and `ray_values` what an isosurface and a projection need; `tile_context` is one brick in one tile.

pub(crate) mod prepare;
pub(crate) mod constant_brick;
pub(crate) mod iso_rays;
pub(crate) mod ray_values;
pub(crate) mod from_differences;
pub(crate) mod settings;
pub(crate) mod tile_context;
