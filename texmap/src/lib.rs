//! Forward texture mapping: the texels of a mesh laid on the screen as points or as splats.
//!
//! In the order in which data flows: a file becomes a [`Scene`] of triangles in world space with their materials and
//! textures; visible triangles' texels are projected, selected, accumulated and resolved into a picture.

mod error;
pub mod scene;

pub use error::Error;
pub use scene::Scene;
