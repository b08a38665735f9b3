//! Cameras: takes files, words and the bounds of a scene, returns the cameras of the pictures.
//!
//! Camera files (`resample_io::camera_file`), paths through keys (`camera_path`), a view given in words
//! and the point of a scene under a pixel (`viewpoint`), and the view that shows all of a scene (`framing`).

pub use resample_io::camera_file;
pub(crate) mod camera_path;
pub mod viewpoint;
pub mod framing;
