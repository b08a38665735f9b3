//! The slow f64 references: they integrate the ray of one pixel by definition.
//!
//! Rays are followed through the world by the inverse of the camera's pose. Kernels are integrated along them by
//! Simpson's rule; fields are sampled plane by plane and classified without a table.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::{Camera, Kernel};
use volsplat::TransferFunction;

/// Intervals of Simpson's rule along a chord of a kernel.
const INTERVALS: u32 = 512;

/// A ray in a grid: its parameter is camera z.
pub(super) struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// World length per unit of camera z.
    length: f64,
}

impl Ray {
    /// The ray through a pixel's centre.
    pub(super) fn new(camera: &Camera, world_from_index: &DAffine3, at: usize) -> Self {
        let width = camera.width as usize;
        let pixel = DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
        let (origin, direction) = camera.ray_in_camera(pixel);
        let index_from_camera = (camera.camera_from_world * *world_from_index).inverse();
        Self {
            origin: index_from_camera.transform_point3(origin),
            direction: index_from_camera.transform_vector3(direction),
            length: direction.length(),
        }
    }

    fn at(&self, camera_z: f64) -> DVec3 {
        self.origin + camera_z * self.direction
    }

    /// World length of the kernel's integral around a voxel along the ray, from the near plane on.
    pub(super) fn through_kernel(&self, kernel: &Kernel, voxel: DVec3, near: f64) -> f64 {
        let to_voxel = voxel - self.origin;
        let length2 = self.direction.length_squared();
        let nearest = to_voxel.dot(self.direction) / length2;
        let distance2 = to_voxel.cross(self.direction).length_squared() / length2;
        let inside2 = kernel.radius() * kernel.radius() - distance2;
        if !(inside2 > 0.0) {
            return 0.0;
        }
        let half = (inside2 / length2).sqrt();
        let (from, to) = ((nearest - half).max(near), nearest + half);
        let step = (to - from) / f64::from(INTERVALS);
        if !(step > 0.0) {
            return 0.0;
        }
        let value = |i: u32| {
            let along = from + f64::from(i) * step - nearest;
            kernel.value(distance2 + along * along * length2)
        };
        let weight = |i: u32| match i {
            0 | INTERVALS => 1.0,
            _ => f64::from(2 + 2 * (i % 2)),
        };
        let sum: f64 = (0..=INTERVALS).map(|i| weight(i) * value(i)).sum();
        sum * step / 3.0 * self.length
    }
}

/// A trilinear field, sampled on planes.
pub(super) struct Field<'a> {
    pub(super) dims: [usize; 3],
    pub(super) values: &'a [f64],
    pub(super) world_from_index: DAffine3,
    pub(super) transfer: &'a TransferFunction,
    /// Distance of planes, world units.
    pub(super) thickness: f64,
    /// Over which opacity is meant, world units.
    pub(super) unit: f64,
}

impl Field<'_> {
    /// Red and opacity of a pixel.
    pub(super) fn pixel(&self, camera: &Camera, at: usize) -> [f64; 2] {
        let ray = Ray::new(camera, &self.world_from_index, at);
        let [from, to] = self.inside(&ray, camera.near);
        let first = (from / self.thickness - 0.5).ceil();
        let last = (to / self.thickness - 0.5).floor();
        let (mut red, mut transmittance, mut number) = (0.0, 1.0, first);
        while number <= last {
            if let Some(value) = self.at(ray.at((number + 0.5) * self.thickness)) {
                let (rgb, opacity) = self.transfer.sample(value);
                let depth = -(-opacity).ln_1p() * self.thickness * ray.length / self.unit;
                let weight = transmittance * -(-depth).exp_m1();
                red += weight * f64::from(rgb[0]);
                transmittance *= (-depth).exp();
            }
            number += 1.0;
        }
        [red, 1.0 - transmittance]
    }

    /// Camera z between which a ray is inside the box and beyond the near plane.
    fn inside(&self, ray: &Ray, near: f64) -> [f64; 2] {
        let (mut from, mut to) = (near, f64::INFINITY);
        for axis in 0..3 {
            let (start, slope) = (ray.origin[axis], ray.direction[axis]);
            let ends = [0.0, (self.dims[axis] - 1) as f64].map(|end| (end - start) / slope);
            if slope != 0.0 {
                from = from.max(ends[0].min(ends[1]));
                to = to.min(ends[0].max(ends[1]));
            }
        }
        [from, to]
    }

    /// The field at a place of the grid; `None` outside.
    fn at(&self, place: DVec3) -> Option<f64> {
        let last = DVec3::from(self.dims.map(|n| (n - 1) as f64));
        if !(place.cmpge(DVec3::ZERO).all() && place.cmple(last).all()) {
            return None;
        }
        let base = place.floor().min(last - 1.0);
        let share = place - base;
        let mut sum = 0.0;
        for corner in 0..8 {
            let far = [0, 1, 2].map(|axis| corner >> axis & 1);
            let [x, y, z] = [0, 1, 2].map(|axis| base[axis] as usize + far[axis]);
            let weight = |axis: usize| {
                if far[axis] == 1 {
                    share[axis]
                } else {
                    1.0 - share[axis]
                }
            };
            let value = self.values[x + self.dims[0] * (y + self.dims[1] * z)];
            sum += weight(0) * weight(1) * weight(2) * value;
        }
        Some(sum)
    }
}
