//! Brute-force optical depth: small steps along a ray through the whole extinction field.
//!
//! Takes a field, a camera and a step, gives exp(-integral) per pixel. No kernel is known to it as a footprint; the
//! field is asked at every step for the sum of all kernels there. The trapezoid's own error falls with the square of
//! the step: callers choose it by halving, as the test of this module does.

use glam::DVec2;
use rayon::prelude::*;
use resample_core::Camera;

use crate::twins::field::Field;
use crate::twins::rays::{Ray, RaySource};

/// Optical depth along the ray of every pixel, row by row; `step` in voxels, `unit` the length that opacity is per.
pub fn optical_depths(field: &Field, camera: &Camera, unit: f64, step: f64) -> Vec<f64> {
    let source = RaySource::new(camera, &field.world_from_index);
    let (width, height) = (camera.width as usize, camera.height as usize);
    (0..width * height)
        .into_par_iter()
        .map(|i| {
            let at = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            optical_depth(field, &source.ray(at), camera.near, step) / unit
        })
        .collect()
}

/// The integral of the field along one ray from camera z `near` on, in world units.
fn optical_depth(field: &Field, ray: &Ray, near: f64, step: f64) -> f64 {
    let [low, high] = field.bounds();
    let (mut first, mut last) = (near, f64::INFINITY);
    for axis in 0..3 {
        let ends =
            [low[axis], high[axis]].map(|side| (side - ray.origin[axis]) / ray.direction[axis]);
        // A ray along a face gives 0/0, which min and max pass over: then the axis does not bound it.
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
    }
    if !(last > first) {
        return 0.0;
    }
    let steps = ((last - first) * ray.direction.length() / step).ceil() as usize;
    let dz = (last - first) / steps as f64;
    let at = |i: usize| field.value(ray.origin + (first + i as f64 * dz) * ray.direction);
    let inner: f64 = (1..steps).map(at).sum();
    (inner + 0.5 * (at(0) + at(steps))) * dz * ray.world_per_z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volumes::scenes::{grey, perspective, random_volume};
    use glam::{DAffine3, DVec3};
    use resample_core::KernelShape;

    #[test]
    fn the_reference_is_converged() {
        let volume = random_volume([5, 6, 7], DAffine3::IDENTITY);
        let field = Field::new(&volume, &grey(0.3), KernelShape::Gaussian);
        let camera = perspective(
            DVec3::new(12.0, 9.0, -11.0),
            DVec3::new(2.0, 2.5, 3.0),
            40.0,
            [12, 12],
        );
        let [coarse, fine] = [0.02, 0.005].map(|step| optical_depths(&field, &camera, 1.0, step));
        let error = coarse
            .iter()
            .zip(&fine)
            .map(|(a, b)| ((-a).exp() - (-b).exp()).abs())
            .fold(0.0, f64::max);
        println!("error of the marched transmittance at a step of 0.02: {error:.1e}");
        assert!(error < 1e-6, "the reference itself is off by {error}");
    }
}
