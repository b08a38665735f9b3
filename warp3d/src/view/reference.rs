//! A reference view: a picture, its depth and its camera, as every input format leaves them.
//!
//! After input everything is one convention: linear light, camera z as depth, the core's camera. Later stages do not
//! check again.

use resample_core::Camera;

/// A picture with depth and the camera that took it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The camera; its width and height are those of the planes.
    pub camera: Camera,
    /// Linear red, green and blue, rows from the top. A sample lies at its pixel's centre.
    pub colour: Vec<[f32; 3]>,
    /// Camera z of each pixel, world units, above 0; NaN where nothing is known.
    pub depth: Vec<f32>,
}

impl Reference {
    /// Camera z of the nearest sample, world units; infinite where there is none.
    ///
    /// ```
    /// use resample_core::{Camera, LookAt};
    /// use warp3d::Reference;
    ///
    /// let pose = LookAt {
    ///     position: [0.0; 3].into(),
    ///     target: [0.0, 0.0, 1.0].into(),
    ///     up: [0.0, -1.0, 0.0].into(),
    /// };
    /// let reference = Reference {
    ///     camera: Camera::perspective(&pose, 0.8, [2, 1])?,
    ///     colour: vec![[0.5; 3]; 2],
    ///     depth: vec![3.0, 2.0],
    /// };
    /// assert_eq!(reference.nearest(), 2.0);
    /// # Ok::<(), resample_core::CameraError>(())
    /// ```
    pub fn nearest(&self) -> f32 {
        nearest(&self.depth)
    }
}

/// The least of some camera z, those left out that are unknown.
pub(crate) fn nearest(depth: &[f32]) -> f32 {
    depth.iter().copied().fold(f32::INFINITY, f32::min)
}
