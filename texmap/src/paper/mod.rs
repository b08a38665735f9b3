//! Texture mapping by one look-up a triangle and pixel: the paper's points, and backward methods for comparison.
//!
//! `pixels` looks textures up for each triangle of each pixel; `look_ups` are the methods. The default method uses nothing of
//! this.

mod look_ups;
mod pixels;

pub(crate) use pixels::pixel_look_ups;
