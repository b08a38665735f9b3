//! Reference views, target views, and the equation between them.
//!
//! A `reference` is a picture with depth and its camera, its lengths counted in a unit near the scene; `exposure` makes several alike; `warp` maps its pixels
//! to another screen; `panorama` divides an equirectangular picture into views. A `layer` is the picture that one reference yields, drawn
//! in bands of rows; `flags` are sets of its pixels; `keys` is a cubic between samples. `film` makes references of pictures one after another;
//! `multiview` puts views beside each other.

pub mod reference;
pub mod exposure;
pub mod warp;
pub mod panorama;
pub(crate) mod layer;
pub(crate) mod flags;
pub mod keys;
pub mod film;
pub mod multiview;
