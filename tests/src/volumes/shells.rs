//! Thin opaque shells with a formula: a peak of the transfer function on the distance to a point or to a circle.
//!
//! The volume holds the distance; the truth integrates the distance itself, in f64, over a regular grid of rays in each
//! pixel. A distance changes by at most its step, so that the march steps over what surely shows nothing and takes
//! 64 steps through the peak: it misses no shell and is converged to 1e-5.
//! Limits: unit spacing, the volume's box alone, no light.

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use volsplat::{TransferFunction, Volume};

use crate::twins::field::extinction;
use crate::twins::rays::{Ray, RaySource};
use crate::volumes::scenes::{perspective, transfer, volume};

/// A shell around a point or a circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shell {
    /// A sphere.
    Sphere,
    /// A torus, tilted against the grid.
    Torus,
}

/// Samples along each side of the volumes.
pub const SIDE: usize = 48;

/// Rays of the truth along a pixel's side.
const RAYS: usize = 8;

/// Steps of the truth through the peak.
const STEPS: f64 = 64.0;

/// Transmittance at which a ray of the truth ends.
const END: f64 = 1e-6;

impl Shell {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Sphere, Self::Torus];

    /// For headings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Torus => "torus",
        }
    }

    /// The distance, voxels.
    pub fn value(self, at: DVec3) -> f64 {
        let p = at - middle();
        match self {
            Self::Sphere => p.length(),
            Self::Torus => {
                let axis = DVec3::new(0.3, 0.8, 0.5).normalize();
                let along = p.dot(axis);
                ((p - along * axis).length() - 13.0).hypot(along)
            }
        }
    }

    /// The distance at the voxels.
    pub fn volume(self) -> Volume {
        volume([SIDE; 3], DAffine3::IDENTITY, |index| self.value(index))
    }

    /// A peak that is `width` of the volume's range wide, and its opacity over a voxel.
    pub fn look(self, width: f64, opacity: f64) -> TransferFunction {
        let (low, high) = self.volume().value_range();
        let (centre, half) = (self.centre(), 0.5 * width * (high - low));
        transfer(
            &[
                (centre - half, [0.9, 0.3, 0.2]),
                (centre + half, [1.0, 0.8, 0.3]),
            ],
            &[
                (centre - half, 0.0),
                (centre, opacity),
                (centre + half, 0.0),
            ],
        )
    }

    /// The distance in the middle of the shell.
    fn centre(self) -> f64 {
        match self {
            Self::Sphere => 19.3,
            Self::Torus => 6.2,
        }
    }

    /// A view in which a voxel of the volume's middle is this many pixels large.
    pub fn camera(self, voxel_px: f64) -> Camera {
        let size = (SIDE as f64 * voxel_px).ceil();
        let fov_deg = 30.0f64;
        let focal_px = 0.5 * size / (0.5 * fov_deg.to_radians()).tan();
        let eye = middle() + focal_px / voxel_px * DVec3::new(0.62, 0.38, 0.69).normalize();
        perspective(eye, middle(), fov_deg, [size as u32; 2])
    }

    /// The truth of a view.
    pub fn truth(self, look: &TransferFunction, camera: &Camera) -> Image {
        let rays = RaySource::new(camera, &DAffine3::IDENTITY);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixel = |i: usize| {
            let corner = DVec2::new((i % width) as f64, (i / width) as f64);
            let mut sum = [0.0f64; 4];
            for sub in 0..RAYS * RAYS {
                let offset = DVec2::new((sub % RAYS) as f64 + 0.5, (sub / RAYS) as f64 + 0.5);
                let seen = self.march(look, &rays.ray(corner + offset / RAYS as f64));
                for (sum, value) in sum.iter_mut().zip(seen) {
                    *sum += value / (RAYS * RAYS) as f64;
                }
            }
            sum.map(|value| value as f32)
        };
        let mut image = Image::transparent(width, height);
        image.rgba = (0..width * height).into_par_iter().map(pixel).collect();
        image
    }

    /// Colour and opacity along one ray.
    fn march(self, look: &TransferFunction, ray: &Ray) -> [f64; 4] {
        let (mut at, mut end) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            let ends = [0.0, (SIDE - 1) as f64]
                .map(|face| (face - ray.origin[axis]) / ray.direction[axis]);
            at = at.max(ends[0].min(ends[1]));
            end = end.min(ends[0].max(ends[1]));
        }
        let (low, high) = look.visible_range().expect("a look that shows something");
        let fine = (high - low) / STEPS;
        let (mut sum, mut left) = ([0.0; 4], 1.0);
        while at < end && left > END {
            let value = self.value(ray.origin + at * ray.direction);
            // So far the distance stays outside the peak, whatever the direction.
            let outside = (low - value).max(value - high);
            let length = outside.max(fine).min((end - at) * ray.world_per_z);
            if outside <= 0.0 {
                let middle = at + 0.5 * length / ray.world_per_z;
                let (rgb, opacity) = look.sample(self.value(ray.origin + middle * ray.direction));
                let weight = left * -(-extinction(opacity) * length).exp_m1();
                left -= weight;
                for (sum, colour) in sum.iter_mut().zip(rgb) {
                    *sum += weight * f64::from(colour);
                }
            }
            at += length / ray.world_per_z;
        }
        sum[3] = 1.0 - left;
        sum
    }
}

fn middle() -> DVec3 {
    DVec3::splat((SIDE - 1) as f64 / 2.0)
}
