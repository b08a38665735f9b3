//! Pictures with shadows, in f64 and by definition.
//!
//! Takes a volume and a light, gives premultiplied colour and opacity: the mean over rays in a pixel's square, each the integral of
//! emission and absorption by short steps, in which diffuse light is multiplied by the transmittance towards the light, summed by steps
//! as short from the sample to the end of the volume. No table and no grid of light. Limits: slow; the shading is flat.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{code32, pixel, single};
use resample_core::{Camera, Image};
use volsplat::{TransferFunction, Volume};

use crate::twins::field::extinction;
use crate::twins::rays::RaySource;
use crate::twins::trilinear::last;

/// Steps per voxel.
const STEPS: f64 = 4.0;

/// Ambient and diffuse share of the light.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;

/// A volume of unit spacing at the origin of the world, and its light.
pub struct ShadowTruth<'a> {
    volume: &'a Volume,
    /// Its scalars, x fastest.
    values: Vec<f64>,
    transfer: &'a TransferFunction,
    /// Unit directions towards the parts of the light; none where no shadows are drawn.
    towards: Vec<DVec3>,
    /// The sky, where occlusion is drawn.
    sky: Option<Sky>,
    sky_gain: f64,
    /// Returns true for the positions that the clip keeps.
    keeps: &'a (dyn Fn(DVec3) -> bool + Sync),
    gain: f64,
}

/// Directions all around, and how far matter counts, voxels.
pub struct Sky {
    directions: Vec<DVec3>,
    radius: f64,
}

impl Sky {
    /// A sky of so many directions, evenly spread.
    pub fn new(count: u32, radius: f64) -> Self {
        const TURN: f64 = 2.399_963_229_728_653;
        let direction = |number: u32| {
            let z = (f64::from(number) + 0.5) / f64::from(count) * 2.0 - 1.0;
            let (sin, cos) = (TURN * f64::from(number)).sin_cos();
            let flat = (1.0 - z * z).sqrt();
            DVec3::new(flat * cos, flat * sin, z)
        };
        Self {
            directions: (0..count).map(direction).collect(),
            radius,
        }
    }
}

impl<'a> ShadowTruth<'a> {
    /// The truth of light from these directions.
    pub fn new(
        volume: &'a Volume,
        transfer: &'a TransferFunction,
        towards: Vec<DVec3>,
        keeps: &'a (dyn Fn(DVec3) -> bool + Sync),
    ) -> Self {
        let count = volume.dims.iter().product();
        let mut truth = Self {
            volume,
            values: (0..count).map(|voxel| volume.value(voxel)).collect(),
            transfer,
            towards,
            sky: None,
            sky_gain: 1.0,
            keeps,
            gain: 1.0,
        };
        if !truth.towards.is_empty() {
            truth.gain = 1.0 / truth.mean_light();
        }
        truth
    }

    /// The same with the light of a sky.
    pub fn with_sky(self, sky: Sky) -> Self {
        let mut truth = Self {
            sky: Some(sky),
            ..self
        };
        truth.sky_gain = 1.0 / truth.mean_sky();
        truth
    }

    /// The mean of the sky's light over what views along both directions of the axes see, weighted by luminance, with a ray for each two voxels
    /// along the sides.
    fn mean_sky(&self) -> f64 {
        let last = last(self.volume);
        let rays_of = |side: usize| {
            let along = DVec3::AXES[side % 3];
            let (right, up) = (DVec3::AXES[(side + 1) % 3], DVec3::AXES[(side + 2) % 3]);
            let from = if side < 3 { DVec3::ZERO } else { along * last };
            let towards = if side < 3 { along } else { -along };
            let [rays_x, rays_y] = [right, up].map(|axis| code32(last.dot(axis) / 2.0));
            (0..rays_x * rays_y).map(move |ray| {
                // Somewhere in a square of two voxels.
                let place = |at: u32, times: f64, axis: DVec3| {
                    2.0 * (f64::from(at) + (times * f64::from(ray)).fract()) * axis
                };
                let right = place(ray % rays_x, 0.754_877_666, right);
                (
                    from + right + place(ray / rays_x, 0.569_840_291, up),
                    towards,
                )
            })
        };
        let rays: Vec<(DVec3, DVec3)> = (0..6).flat_map(rays_of).collect();
        let seen = rays.into_par_iter().map(|(from, towards)| {
            let (mut light, mut bright, mut left) = (0.0, 0.0, 1.0);
            for step in 0..code32(last.max_element() * STEPS) {
                let at = from + (f64::from(step) + 0.5) / STEPS * towards;
                let opacity = -(-self.strength(at) / STEPS).exp_m1();
                if opacity > 0.0 {
                    let colour = self.transfer.colour(self.scalar(at)).map(f64::from);
                    let luminance = DVec3::new(0.2126, 0.7152, 0.0722).dot(colour.into());
                    bright += left * opacity * luminance;
                    light += left * opacity * luminance * self.of_sky(at);
                    left *= 1.0 - opacity;
                }
                if left < 1e-3 {
                    break;
                }
            }
            [light, bright]
        });
        let (mut light, mut opacity) = (0.0, 0.0);
        for [own_light, own_opacity] in seen.collect::<Vec<_>>() {
            light += own_light;
            opacity += own_opacity;
        }
        light / opacity
    }

    fn strength(&self, at: DVec3) -> f64 {
        let is_inside = at.cmpge(DVec3::ZERO).all() && at.cmple(last(self.volume)).all();
        if !is_inside || !(self.keeps)(at) {
            return 0.0;
        }
        extinction(self.transfer.opacity(self.scalar(at)))
    }

    /// The trilinear scalar.
    fn scalar(&self, at: DVec3) -> f64 {
        let [width, height, depth] = self.volume.dims;
        let cell = |at: f64, len: usize| {
            let first = (at as usize).min(len - 2);
            (first, at - first as f64)
        };
        let ((x, u), (y, v), (z, w)) = (cell(at.x, width), cell(at.y, height), cell(at.z, depth));
        let row = |y: usize, z: usize| {
            let first = x + width * (y + height * z);
            self.values[first] * (1.0 - u) + self.values[first + 1] * u
        };
        let layer = |z: usize| row(y, z) * (1.0 - v) + row(y + 1, z) * v;
        layer(z) * (1.0 - w) + layer(z + 1) * w
    }

    /// Transmittance from a place along a direction.
    fn transmittance(&self, from: DVec3, towards: DVec3) -> f64 {
        let mut depth = 0.0;
        for step in 0.. {
            let at = from + (f64::from(step) + 0.5) / STEPS * towards;
            let gone = at.cmplt(DVec3::splat(-1.0)) | at.cmpgt(last(self.volume) + 1.0);
            if gone.any() || depth > 20.0 {
                break;
            }
            depth += self.strength(at) / STEPS;
        }
        (-depth).exp()
    }

    /// The mean transmittance of light where it is absorbed, over rays half a voxel apart.
    fn mean_light(&self) -> f64 {
        let middle = 0.5 * last(self.volume);
        let radius = middle.length();
        let side = i32::from(pixel((4.0 * radius).ceil()));
        let (mut taken, mut weighted) = (0.0, 0.0);
        for &towards in &self.towards[..self.towards.len().min(4)] {
            let (right, up) = towards.any_orthonormal_pair();
            let rays = (0..side * side).into_par_iter().map(|ray| {
                let place = |at: i32| (f64::from(at) + 0.5) / f64::from(side) * 2.0 - 1.0;
                let across = place(ray % side) * right + place(ray / side) * up;
                let from = middle + radius * (across - towards);
                let through = self.through(from, towards, 2.0 * radius);
                [1.0 - through, 0.5 * (1.0 - through * through)]
            });
            for [own, of_light] in rays.collect::<Vec<_>>() {
                taken += own;
                weighted += of_light;
            }
        }
        weighted / taken
    }

    /// Transmittance over a length.
    fn through(&self, from: DVec3, towards: DVec3, length: f64) -> f64 {
        let steps = code32((length * STEPS).ceil());
        let step = length / f64::from(steps);
        let mut depth = 0.0;
        for number in 0..steps {
            depth += step * self.strength(from + (f64::from(number) + 0.5) * step * towards);
            if depth > 20.0 {
                break;
            }
        }
        (-depth).exp()
    }

    /// The picture, the mean of `side` x `side` rays a pixel.
    pub fn picture(&self, camera: &Camera, side: usize) -> Image {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let rays = RaySource::new(camera, &self.volume.world_from_index);
        let pixel = |index: usize| {
            let mut sum = [0.0; 4];
            for part in 0..side * side {
                let part = DVec2::new((part % side) as f64, (part / side) as f64);
                let corner = DVec2::new((index % width) as f64, (index / width) as f64);
                let ray = rays.ray(corner + (part + 0.5) / side as f64);
                let length = (ray.direction.length()).recip();
                let seen = self.ray(ray.origin, ray.direction * length);
                for (sum, value) in sum.iter_mut().zip(seen) {
                    *sum += value / (side * side) as f64;
                }
            }
            sum.map(single)
        };
        let rgba = (0..width * height).into_par_iter().map(pixel).collect();
        Image {
            rgba,
            ..Image::transparent(width, height)
        }
    }

    fn ray(&self, origin: DVec3, direction: DVec3) -> [f64; 4] {
        let middle = 0.5 * last(self.volume);
        let reach = middle.length() + 1.0;
        let first = ((middle - origin).dot(direction) - reach).max(0.0);
        let (mut sum, mut left) = ([0.0; 4], 1.0);
        for step in 0..code32(2.0 * reach * STEPS) {
            let at = origin + (first + (f64::from(step) + 0.5) / STEPS) * direction;
            let strength = self.strength(at);
            if strength == 0.0 {
                continue;
            }
            let opacity = -(-strength / STEPS).exp_m1();
            let [r, g, b] = self.transfer.colour(self.scalar(at)).map(f64::from);
            let light = self.light(at);
            for (sum, colour) in sum.iter_mut().zip([r, g, b]) {
                *sum += left * opacity * colour * light;
            }
            left *= 1.0 - opacity;
            if left < 1e-3 {
                break;
            }
        }
        sum[3] = 1.0 - left;
        sum
    }

    fn light(&self, at: DVec3) -> f64 {
        let sky = self.sky_gain * self.of_sky(at);
        if self.towards.is_empty() {
            return sky;
        }
        let share = |towards: &DVec3| self.transmittance(at, *towards);
        let sum: f64 = self.towards.iter().map(share).sum();
        AMBIENT * sky + DIFFUSE * self.gain * sum / self.towards.len() as f64
    }

    /// The share of the sky that a place sees.
    fn of_sky(&self, at: DVec3) -> f64 {
        let Some(sky) = &self.sky else {
            return 1.0;
        };
        let share = |towards: &DVec3| self.through(at, *towards, sky.radius);
        sky.directions.iter().map(share).sum::<f64>() / sky.directions.len() as f64
    }
}
