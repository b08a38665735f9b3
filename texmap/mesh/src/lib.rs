//! Triangle meshes in memory, and the files they come from: glTF 2.0, OBJ with MTL, PLY and STL.
//!
//! Takes a path and [`LoadOptions`], returns a checked [`Scene`] and notes about what was ignored. The format follows from the
//! content, never from the name. All formats end in one check (`finish`), so that the promises of a scene do not depend on
//! its format. An ignored part that does not change the picture is noted; a part that would make the picture wrong, or a named
//! picture that cannot be read, is an error.
//!
//! ```
//! use resample_mesh::{LoadOptions, load};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let path = std::env::temp_dir().join("resample-mesh-example.obj");
//! std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")?;
//! let loaded = load(&path, &LoadOptions::default())?;
//! assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2]]);
//! # std::fs::remove_file(&path)?;
//! # Ok(())
//! # }
//! ```

pub mod procedural;
pub mod scene;

#[cfg(feature = "input")]
pub mod input;

#[cfg(feature = "input")]
pub use input::{LoadOptions, Loaded, Pose, load, load_picture};
pub use resample_core::Error;
pub use scene::Scene;
