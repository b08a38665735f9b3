//! The field: the trilinear interpolation of the voxels, sampled on sheets and classified there.
//!
//! 1. input: the voxels or cells that the transfer function may show were collected into bricks (`driver`, `settings`);
//! 2. sample: visible bricks are placed on the screen (`frame`, `streamed`);
//! 3. accumulate: on the plane through a slab's middle, the scalar at every sub-pixel is interpolated in the cell that the
//!    sample lies in (`tile`, `walk`, `batch`);
//! 4. composite: each plane is classified per sub-pixel and composited behind those before it;
//! 5. image: sub-pixels become pixels. Planes beside the colour are a pass of their own (`layers`).
//!
//! A sample on a plane is exactly what a ray caster with trilinear interpolation reads there,
//! reached in object order, so that cost follows what is visible and not the box around it.
//! Source: K. Mueller, R. Crawfis, "Eliminating Popping Artifacts in Sheet Buffer-Based Splatting", IEEE Visualization
//! 1998, for the sheets; we sample the plane through a slab's middle instead of integrating the kernel over the slab.

pub(crate) mod settings;
mod driver;
mod known_light;
mod lighting;
pub(crate) mod surfaces;
mod frame;
mod streamed;
pub(crate) mod tile;
pub(crate) mod walk;
pub(crate) mod batch;
mod layers;

pub(crate) use driver::{FieldPipeline, Kept};
pub use layers::Layer;
pub(crate) use layers::refused as layers_refused;
