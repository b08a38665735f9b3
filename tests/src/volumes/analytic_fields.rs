//! Fields with a formula, the volumes sampled from them, and their truth: the integral of the field itself, never of voxels.
//!
//! Takes a field and a camera, gives premultiplied colour and opacity per pixel: the mean over a regular grid of rays in
//! the pixel's square, each marched in f64 through the classified formula, midpoint rule. So the truth knows no kernel, and
//! every reconstruction is measured against what was there before it was sampled. Source of the first field: S. Marschner,
//! R. Lobb, "An Evaluation of Reconstruction Filters for Volume Rendering", IEEE Visualization 1994.
//! Limits: slow; unit spacing, the volume's box alone.

use std::f64::consts::PI;

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use volsplat::{RenderOptions, Shading, TransferFunction, Volume};

use crate::twins::field::extinction;
use crate::twins::light::lit;
use crate::twins::rays::{Ray, RaySource};
use crate::volumes::scenes::{perspective, transfer, volume};

/// A field with a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnalyticField {
    /// Waves of two frequencies, nearly all that the lattice can carry.
    MarschnerLobb,
    /// Nine soft balls, far below what the lattice can carry.
    Blobs,
    /// Rises evenly along a diagonal: every sound reconstruction gives it exactly.
    Ramp,
}

/// Samples along each side of the volumes.
pub const SIDE: usize = 41;

/// Steps of the truth per voxel.
const STEPS_PER_VOXEL: f64 = 8.0;

/// Rays of the truth along a pixel's side.
const RAYS: usize = 4;

impl AnalyticField {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::MarschnerLobb, Self::Blobs, Self::Ramp];

    /// For headings.
    pub fn name(self) -> &'static str {
        match self {
            Self::MarschnerLobb => "Marschner-Lobb 41^3",
            Self::Blobs => "blobs 41^3",
            Self::Ramp => "linear ramp 41^3",
        }
    }

    /// The field at a position in voxels, 0 to 1.
    pub fn value(self, at: DVec3) -> f64 {
        let p = 2.0 * at / (SIDE - 1) as f64 - 1.0;
        match self {
            Self::MarschnerLobb => {
                let (frequency, alpha) = (6.0, 0.25);
                let wave = (2.0 * PI * frequency * (0.5 * PI * p.x.hypot(p.y)).cos()).cos();
                (1.0 - (0.5 * PI * p.z).sin() + alpha * (1.0 + wave)) / (2.0 * (1.0 + alpha))
            }
            Self::Blobs => {
                let ball = |i: i32| {
                    let centre = DVec3::new(
                        f64::from(i % 3 - 1),
                        f64::from(i / 3 - 1),
                        f64::from(i * 5 % 7 - 3) / 4.0,
                    );
                    (-12.0 * (p - 0.55 * centre).length_squared()).exp()
                };
                (0..9).map(ball).sum::<f64>().min(1.0)
            }
            Self::Ramp => 0.5 + p.dot(DVec3::new(0.2, 0.17, 0.13)),
        }
    }

    /// The field at the voxels.
    pub fn volume(self) -> Volume {
        volume([SIDE; 3], DAffine3::IDENTITY, |index| self.value(index))
    }

    /// A look with a soft body and a surface: opacity per voxel.
    pub fn look(self) -> TransferFunction {
        let colours = [
            (0.0, [0.1, 0.2, 0.8]),
            (0.5, [0.9, 0.7, 0.3]),
            (1.0, [1.0, 0.9, 0.8]),
        ];
        match self {
            Self::Ramp => transfer(&colours, &[(0.0, 0.0), (1.0, 0.15)]),
            _ => transfer(
                &colours,
                &[
                    (0.0, 0.0),
                    (0.42, 0.0),
                    (0.5, 0.35),
                    (0.58, 0.03),
                    (1.0, 0.1),
                ],
            ),
        }
    }

    /// A view in which a voxel of the volume's middle is this many pixels large.
    pub fn camera(self, voxel_px: f64) -> Camera {
        let middle = DVec3::splat((SIDE - 1) as f64 / 2.0);
        let size = (1.9 * SIDE as f64 * voxel_px).ceil();
        let fov_deg = 40.0f64;
        let focal_px = 0.5 * size / (0.5 * fov_deg.to_radians()).tan();
        let eye = middle + focal_px / voxel_px * DVec3::new(0.55, 0.62, 0.56).normalize();
        perspective(eye, middle, fov_deg, [size as u32; 2])
    }

    /// The gradient of the formula, per voxel: a difference so small that its own error is 1e-8 of it.
    fn gradient(self, at: DVec3) -> DVec3 {
        const HALF_STEP: f64 = 1e-4;
        let along =
            |axis: DVec3| self.value(at + HALF_STEP * axis) - self.value(at - HALF_STEP * axis);
        DVec3::from(DVec3::AXES.map(along)) / (2.0 * HALF_STEP)
    }

    /// The truth of a view without light.
    pub fn truth(self, camera: &Camera) -> Image {
        self.truth_lit(camera, &RenderOptions::default())
    }

    /// The truth of a view, lit as the options say, by the gradient of the formula.
    pub fn truth_lit(self, camera: &Camera, options: &RenderOptions) -> Image {
        let rays = RaySource::new(camera, &DAffine3::IDENTITY);
        let look = self.look();
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixel = |i: usize| {
            let corner = DVec2::new((i % width) as f64, (i / width) as f64);
            let mut sum = [0.0f64; 4];
            for sub in 0..RAYS * RAYS {
                let offset =
                    DVec2::new((sub % RAYS) as f64 + 0.5, (sub / RAYS) as f64 + 0.5) / RAYS as f64;
                let seen = self.march(&look, &rays.ray(corner + offset), (camera, options));
                sum.iter_mut()
                    .zip(seen)
                    .for_each(|(sum, value)| *sum += value / (RAYS * RAYS) as f64);
            }
            sum.map(|value| value as f32)
        };
        let mut image = Image::transparent(width, height);
        image.rgba = (0..width * height).into_par_iter().map(pixel).collect();
        image
    }

    /// Colour and opacity along one ray.
    fn march(
        self,
        look: &TransferFunction,
        ray: &Ray,
        (camera, options): (&Camera, &RenderOptions),
    ) -> [f64; 4] {
        let (mut first, mut end) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            let ends = [0.0, (SIDE - 1) as f64]
                .map(|face| (face - ray.origin[axis]) / ray.direction[axis]);
            first = first.max(ends[0].min(ends[1]));
            end = end.min(ends[0].max(ends[1]));
        }
        let step = 1.0 / (STEPS_PER_VOXEL * ray.world_per_z);
        let (mut sum, mut left) = ([0.0; 4], 1.0);
        // Whole steps, and the rest: the box ends where it ends.
        let mut from = first;
        while from < end {
            let length = step.min(end - from);
            let at = ray.origin + (from + 0.5 * length) * ray.direction;
            let (rgb, opacity) = look.sample(self.value(at));
            let weight = left * -(-extinction(opacity) * length * ray.world_per_z).exp_m1();
            left -= weight;
            let mut rgb = rgb.map(f64::from);
            if weight > 0.0 && options.shading != Shading::None {
                rgb = lit(options, camera, rgb, (self.gradient(at), ray.direction));
            }
            for (sum, colour) in sum.iter_mut().zip(rgb) {
                *sum += weight * colour;
            }
            from += step;
        }
        sum[3] = 1.0 - left;
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_between_0_and_1() {
        for field in AnalyticField::ALL {
            for i in 0..1000 {
                let at = DVec3::new(
                    f64::from(i % 10),
                    f64::from(i / 10 % 10),
                    f64::from(i / 100),
                ) * 4.4;
                let value = field.value(at);
                assert!((0.0..=1.0).contains(&value), "{field:?} is {value} at {at}");
            }
        }
    }

    #[test]
    fn the_truth_shows_something() {
        for field in AnalyticField::ALL {
            let image = field.truth(&field.camera(0.4));
            let seen = image.rgba.iter().filter(|pixel| pixel[3] > 0.1).count();
            assert!(
                seen > 50,
                "{field:?}: {seen} pixels of {}",
                image.rgba.len()
            );
        }
    }
}
