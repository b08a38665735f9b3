//! Forward texture mapping: the texels of a mesh laid on the screen as points or as splats.
//!
//! In the order in which data flows: a file becomes a [`Scene`] of triangles in world space with their materials and
//! textures; a [`Renderer`] prepares it; visible triangles' texels are projected, selected, accumulated and resolved
//! into a picture, as [`RenderOptions`] says.
//!
//! ```
//! use resample_core::{Camera, LookAt};
//! use texmap::scene::{Material, Mesh};
//! use texmap::{RenderOptions, Renderer, Scene};
//!
//! let mesh = Mesh {
//!     positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
//!     triangles: vec![[0, 1, 2]],
//!     ..Mesh::default()
//! };
//! let scene = Scene {
//!     meshes: vec![mesh],
//!     materials: vec![Material::default()],
//!     ..Scene::default()
//! };
//! let pose = LookAt {
//!     position: [0.0, 0.0, 4.0].into(),
//!     target: [0.0; 3].into(),
//!     up: [0.0, 1.0, 0.0].into(),
//! };
//! let camera = Camera::perspective(&pose, 0.8, [64, 48])?;
//! let mut renderer = Renderer::new(&scene, &RenderOptions::default())?;
//! let image = renderer.render(&camera)?.image;
//! assert_eq!(image.pixel(32, 24)[3], 1.0);
//! assert_eq!(image.pixel(2, 2)[3], 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod scene_camera;
#[cfg(feature = "input")]
pub mod input;

// In the order in which data flow through a frame.
pub mod options;
mod light;
mod screen;
mod prepare;
mod shadow;
mod project;
mod visibility;
mod texture;
mod tile;
mod paper;
mod finish;
pub mod render;
pub mod stats;

#[cfg(feature = "input")]
pub use finish::background;
#[cfg(feature = "input")]
pub use input::{LoadOptions, Loaded, Pose, load, load_picture};
pub use options::{Method, PlaneKind, RenderOptions, Shade, Shadows, ToneMap};
pub use prepare::textures::Textures;
pub use render::{Frame, Renderer};
pub use resample_core::clock::StageTime;
pub use resample_core::{Error, Reuse};
pub use resample_mesh::procedural;
pub use resample_mesh::scene::{self, Scene};
pub use stats::{FrameStats, StageTimes};
