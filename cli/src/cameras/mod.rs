//! Cameras: takes files, words and the bounds of a scene, returns the cameras of the pictures.
//!
//! Camera files of other programs (`camera_file`, read by `json_fields`), paths through keys (`camera_path`), a view given in words
//! and the point of a scene under a pixel (`viewpoint`), and the view that shows all of a scene (`framing`).

pub(crate) mod json_fields;
pub mod camera_file;
pub(crate) mod camera_path;
pub mod viewpoint;
pub mod framing;
