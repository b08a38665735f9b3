//! The files of a reference that stays in them.

use resample_core::Camera;

use crate::input::{DepthMeaning, Part};

/// The files of a reference and their properties.
#[derive(Clone, Copy, Debug)]
pub struct Files<'a> {
    /// The picture.
    pub colour: &'a Part,
    /// Its depth.
    pub depth: &'a Part,
    /// Its camera, of the picture's size.
    pub camera: &'a Camera,
    /// What the numbers of the depth say.
    pub meaning: &'a DepthMeaning,
}
