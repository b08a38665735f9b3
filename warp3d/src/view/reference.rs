//! A reference view: a picture, its depth and its camera, as every input format leaves them.
//!
//! After input everything is one convention: linear light, camera z as depth, the core's camera. Later stages do not
//! check again.

use rayon::prelude::*;
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

// Scenes in a very small or very large unit of length are counted in another one.
//
// Depths are f32, and what is made of them (disparities, their steps, their products) may lie at the end of f32 where
// the depths do not. A power of two changes no digit of them.

/// Binary exponents up to this are left as they are.
const USUAL: i32 = 40;

/// Exponents of f32.
const EXPONENTS: usize = 256;

/// The length, world units, in which references are best counted: 1, or a power of two near the median of their depths.
pub(crate) fn length_of(references: &[Reference]) -> f64 {
    let counts = references
        .iter()
        .map(|reference| exponents(&reference.depth))
        .fold([0; EXPONENTS], added);
    let known: usize = counts.iter().sum();
    let mut before = 0;
    let is_median = |count: &usize| {
        before += count;
        2 * before > known
    };
    let median = counts.iter().position(is_median).unwrap_or(127) as i32 - 127;
    if median.abs() <= USUAL {
        1.0
    } else {
        2f64.powi(median)
    }
}

/// A reference counted in another length.
pub(crate) fn counted_in(mut reference: Reference, length: f64) -> Reference {
    reference.camera = reference.camera.in_unit(length);
    scaled(&mut reference.depth, 1.0 / length);
    reference
}

/// Multiplies depths by a power of two.
pub(crate) fn scaled(depths: &mut [f32], factor: f64) {
    depths
        .par_iter_mut()
        .for_each(|depth| *depth = (f64::from(*depth) * factor) as f32);
}

/// How many depths have each binary exponent, of those that are known.
fn exponents(depth: &[f32]) -> [usize; EXPONENTS] {
    let of_part = |part: &[f32]| {
        let mut counts = [0; EXPONENTS];
        for depth in part {
            let is_known = depth.is_normal() && *depth > 0.0;
            counts[(depth.to_bits() >> 23) as usize % EXPONENTS] += usize::from(is_known);
        }
        counts
    };
    depth
        .par_chunks(1 << 16)
        .map(of_part)
        .reduce(|| [0; EXPONENTS], added)
}

fn added(mut a: [usize; EXPONENTS], b: [usize; EXPONENTS]) -> [usize; EXPONENTS] {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}
