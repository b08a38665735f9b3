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
use crate::twins::trilinear::{last, scalar};

/// Steps per voxel.
const STEPS: f64 = 4.0;

/// Ambient and diffuse share of the light.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;

/// A volume of unit spacing at the origin of the world, and its light.
pub struct ShadowTruth<'a> {
    volume: &'a Volume,
    transfer: &'a TransferFunction,
    /// Unit directions towards the parts of the light.
    towards: Vec<DVec3>,
    /// Returns true for the positions that the clip keeps.
    keeps: &'a (dyn Fn(DVec3) -> bool + Sync),
    gain: f64,
}

impl<'a> ShadowTruth<'a> {
    /// The truth of light from these directions.
    pub fn new(
        volume: &'a Volume,
        transfer: &'a TransferFunction,
        towards: Vec<DVec3>,
        keeps: &'a (dyn Fn(DVec3) -> bool + Sync),
    ) -> Self {
        let mut truth = Self {
            volume,
            transfer,
            towards,
            keeps,
            gain: 1.0,
        };
        truth.gain = 1.0 / truth.mean_light();
        truth
    }

    fn strength(&self, at: DVec3) -> f64 {
        let is_inside = at.cmpge(DVec3::ZERO).all() && at.cmple(last(self.volume)).all();
        if !is_inside || !(self.keeps)(at) {
            return 0.0;
        }
        extinction(self.transfer.opacity(scalar(self.volume, at)))
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
        let at = |step: u32| from + (f64::from(step) + 0.5) / STEPS * towards;
        let depth: f64 = (0..steps).map(|step| self.strength(at(step)) / STEPS).sum();
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
            let [r, g, b] = self.transfer.colour(scalar(self.volume, at)).map(f64::from);
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
        let share = |towards: &DVec3| self.transmittance(at, *towards);
        let sum: f64 = self.towards.iter().map(share).sum();
        AMBIENT + DIFFUSE * self.gain * sum / self.towards.len() as f64
    }
}
