//! The antialiased truth of a volume: rays through every pixel's area, marched in f64, trilinear and post-classified.
//!
//! Takes a scene, gives premultiplied colour and opacity per pixel: the mean over a regular grid of rays in the pixel's
//! square, each the integral of emission and absorption by steps of a quarter of a voxel, midpoint rule. The
//! transfer function itself is asked, without a table. Blocks of cells in which the volume's range shows nothing are
//! stepped over, which changes nothing. Limits: slow; rays end at a transmittance of 1e-6.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image};
use volsplat::{TransferFunction, Volume};

use crate::field::extinction;
use crate::rays::{Ray, RaySource};

/// Transmittance at which a ray ends.
const END: f64 = 1e-6;

/// Cells along the side of a block that is stepped over when it is empty.
const BLOCK: usize = 8;

/// A volume made ready for its truths.
pub struct AreaTruth<'a> {
    volume: &'a Volume,
    transfer: &'a TransferFunction,
    /// Rays along a pixel's side.
    pub rays_per_side: usize,
    /// Samples per smallest spacing.
    pub steps_per_voxel: f64,
    blocks: [usize; 3],
    seen: Vec<bool>,
    values: Vec<f64>,
}

impl<'a> AreaTruth<'a> {
    /// Finds the blocks that may show something.
    pub fn new(volume: &'a Volume, transfer: &'a TransferFunction) -> Self {
        let blocks = volume.dims.map(|n| (n - 1).div_ceil(BLOCK));
        let values: Vec<f64> = (0..volume.len()).map(|i| volume.value(i)).collect();
        let mut truth = Self {
            volume,
            transfer,
            rays_per_side: 6,
            steps_per_voxel: 4.0,
            blocks,
            seen: Vec::new(),
            values,
        };
        truth.seen = (0..blocks.iter().product()).map(|i| truth.shows(i)).collect();
        truth
    }

    /// Whether any scalar between the least and the greatest of a block is visible: asked at the ends, and at knots
    /// between them.
    fn shows(&self, block: usize) -> bool {
        let [nx, ny, _] = self.blocks;
        let at = [block % nx, block / nx % ny, block / (nx * ny)];
        let range = |axis: usize| at[axis] * BLOCK..((at[axis] + 1) * BLOCK + 1).min(self.volume.dims[axis]);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let value = self.values[x + self.volume.dims[0] * (y + self.volume.dims[1] * z)];
                    (low, high) = (low.min(value), high.max(value));
                }
            }
        }
        let knots =
            self.transfer.opacity_knots().iter().any(|k| k.opacity > 0.0 && k.value > low && k.value < high);
        knots || self.transfer.opacity(low) > 0.0 || self.transfer.opacity(high) > 0.0
    }

    /// The truth of one view; opacity is meant per smallest spacing.
    pub fn render(&self, camera: &Camera) -> Image {
        let rays = RaySource::new(camera, &self.volume.world_from_index);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixel = |i: usize| {
            let corner = DVec2::new((i % width) as f64, (i / width) as f64);
            let mut sum = [0.0f64; 4];
            for sub in 0..self.rays_per_side.pow(2) {
                let offset = DVec2::new((sub % self.rays_per_side) as f64, (sub / self.rays_per_side) as f64);
                let ray = rays.ray(corner + (offset + 0.5) / self.rays_per_side as f64);
                for (sum, value) in sum.iter_mut().zip(self.march(&ray, camera.near)) {
                    *sum += value / self.rays_per_side.pow(2) as f64;
                }
            }
            sum.map(|value| value as f32)
        };
        let mut image = Image::transparent(width, height);
        image.rgba = (0..width * height).into_par_iter().map(pixel).collect();
        image
    }

    fn march(&self, ray: &Ray, near: f64) -> [f64; 4] {
        let last = DVec3::from(self.volume.dims.map(|n| (n - 1) as f64));
        let [first, end] = crossing(ray, DVec3::ZERO, last);
        let (first, spacing) = (first.max(near), self.volume.smallest_spacing());
        let step = spacing / self.steps_per_voxel / ray.world_per_z;
        let units = step * ray.world_per_z / spacing;
        let (mut sum, mut left, mut number) = ([0.0f64; 4], 1.0, 0u64);
        while left > END {
            let z = first + (number as f64 + 0.5) * step;
            // Written so that a ray beside the volume, whose ends are no numbers, ends too.
            if !(z < end) {
                break;
            }
            let at = ray.origin + z * ray.direction;
            let block: [usize; 3] = std::array::from_fn(|a| (at[a] as usize / BLOCK).min(self.blocks[a] - 1));
            if !self.seen[block[0] + self.blocks[0] * (block[1] + self.blocks[1] * block[2])] {
                let corner = DVec3::from(block.map(|b| (b * BLOCK) as f64));
                let [_, leaves] = crossing(ray, corner, corner + BLOCK as f64);
                number = (((leaves - first) / step - 0.5).floor() as u64).max(number) + 1;
                continue;
            }
            number += 1;
            let (rgb, opacity) = self.transfer.sample(self.scalar(at));
            let weight = left * -(-extinction(opacity) * units).exp_m1();
            left -= weight;
            for (sum, colour) in sum.iter_mut().zip(rgb) {
                *sum += weight * f64::from(colour);
            }
        }
        sum[3] = 1.0 - left;
        sum
    }

    fn scalar(&self, at: DVec3) -> f64 {
        let [nx, ny, _] = self.volume.dims;
        let cell: [usize; 3] = std::array::from_fn(|a| (at[a] as usize).min(self.volume.dims[a] - 2));
        let share = at - DVec3::from(cell.map(|c| c as f64));
        let value =
            |x: usize, y: usize, z: usize| self.values[cell[0] + x + nx * (cell[1] + y + ny * (cell[2] + z))];
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |y: usize, z: usize| mix(value(0, y, z), value(1, y, z), share.x);
        mix(mix(row(0, 0), row(1, 0), share.y), mix(row(0, 1), row(1, 1), share.y), share.z)
    }
}

/// Where a ray enters and leaves a box, in its parameter; the first is not before the second if it misses.
fn crossing(ray: &Ray, low: DVec3, high: DVec3) -> [f64; 2] {
    let (mut first, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let ends = [low, high].map(|face| (face[axis] - ray.origin[axis]) / ray.direction[axis]);
        first = first.max(ends[0].min(ends[1]));
        end = end.min(ends[0].max(ends[1]));
    }
    [first, end]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{grey, perspective, volume};
    use glam::DAffine3;

    #[test]
    fn a_constant_volume_follows_the_law_of_beer() {
        let volume = volume([5, 5, 5], DAffine3::IDENTITY, |_| 1.0);
        let camera = perspective(DVec3::new(2.0, 2.0, -10.0), DVec3::splat(2.0), 2.0, [3, 3]);
        let image = AreaTruth::new(&volume, &grey(0.3)).render(&camera);
        let error = (f64::from(1.0 - image.rgba[4][3]) - 0.7f64.powi(4)).abs();
        assert!(error < 2e-3, "off by {error}");
    }
}
