//! Depth-image warping: the pixels of a picture with depth laid on the screen of another camera.
//!
//! In the order in which data flows: files become [`Reference`] views; their samples are warped, grouped into surfaces,
//! selected, accumulated and resolved into a picture; holes are left or filled, and said.

mod error;
pub mod reference;

pub use error::Error;
pub use reference::Reference;
