//! The field: the trilinear interpolation of the voxels, sampled on sheets and classified there.
//!
//! 1. input: the voxels or cells that the transfer function may show were collected into bricks;
//! 2. sample: visible bricks are placed on the screen;
//! 3. accumulate: on the plane through a slab's middle, the scalar at every sub-pixel is gathered from the cell that the
//!    sample lies in (`walk`);
//! 4. composite: each plane is classified per sub-pixel and composited behind those before it;
//! 5. image: sub-pixels become pixels.
//!
//! A sample on a plane is exactly what a ray caster with trilinear interpolation reads there,
//! reached in object order, so that cost follows what is visible and not the box around it.
//! Source: K. Mueller, R. Crawfis, "Eliminating Popping Artifacts in Sheet Buffer-Based Splatting", IEEE Visualization
//! 1998, for the sheets; we sample the plane through a slab's middle instead of integrating the kernel over the slab.
//!
//! Settings of a frame: takes a scene, options and a camera, returns what every tile reads.
//!
//! `prepare` turns a scene into bricks of cells; `constant_brick` finds bricks of one colour; `from_differences` turns
//! differences of voxels into gradients; `settings` holds what the tiles of a
//! frame share, `iso_rays` and `ray_values` what an isosurface and a projection need; `tile_context` is one brick in one tile.

pub(crate) mod driver;
mod layers;
mod frame;
pub(crate) mod tile;
mod streamed;
pub(crate) mod walk;
pub(crate) mod batch;
pub(crate) mod settings;

pub(crate) use driver::{FieldPipeline, Kept};
pub use layers::Layer;
pub(crate) use layers::refused as layers_refused;
