//! The antialiased truth of a volume: rays through every pixel's area, marched in f64.
//!
//! Takes a scene, gives premultiplied colour and opacity per pixel: the mean over a regular grid of rays in the pixel's
//! square, each the integral of emission and absorption by steps of a quarter of a voxel, midpoint rule. The field is
//! trilinear and classified where it is sampled (the transfer function itself is asked, without a table), or classified
//! at the voxels and then summed with a kernel, which is what splatting of classified voxels claims to show. Blocks of
//! cells in which nothing shows are stepped over, which changes nothing. Limits: slow; rays end at a transmittance of 1e-6.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Image, KernelShape};
use volsplat::{TransferFunction, Volume};

use crate::twins::field::{ReferenceKernel, extinction};
use crate::twins::rays::{Ray, RaySource};

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
    /// Samples at least while the scalar passes through what is visible; 0 for no more than those of a voxel.
    pub steps_per_range: f64,
    blocks: [usize; 3],
    seen: Vec<bool>,
    values: Vec<f64>,
    classified: Option<Classified>,
}

/// A surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct MetSurface {
    /// Camera z.
    pub z: f64,
    /// Linear and premultiplied.
    pub rgba: [f64; 4],
}

/// Voxels with their own colour and extinction, summed with a kernel.
struct Classified {
    /// Extinction times red, green and blue, and extinction, of each voxel; per smallest spacing.
    voxels: Vec<[f64; 4]>,
    /// The kernel at squared distances, evenly spaced from 0 to the square of its radius.
    kernel: Vec<f64>,
    radius: f64,
}

/// Entries of a kernel's table; with linear interpolation they err by 1e-7.
const KERNEL_ENTRIES: usize = 4096;

impl<'a> AreaTruth<'a> {
    /// The truth of the trilinear field, classified where it is sampled. Finds the blocks that may show something.
    pub fn new(volume: &'a Volume, transfer: &'a TransferFunction) -> Self {
        let blocks = volume.dims.map(|n| (n - 1).div_ceil(BLOCK));
        let values: Vec<f64> = (0..volume.len()).map(|i| volume.value(i)).collect();
        let mut truth = Self {
            volume,
            transfer,
            rays_per_side: 6,
            steps_per_voxel: 4.0,
            steps_per_range: 0.0,
            blocks,
            seen: Vec::new(),
            values,
            classified: None,
        };
        truth.seen = (0..blocks.iter().product())
            .map(|i| truth.shows(i))
            .collect();
        truth
    }

    /// The truth of voxels that are classified one by one, and then summed with a kernel.
    pub fn of_classified(
        volume: &'a Volume,
        transfer: &'a TransferFunction,
        kernel: KernelShape,
    ) -> Self {
        let mut truth = Self::new(volume, transfer);
        let shape = ReferenceKernel::new(kernel);
        let entry =
            |i: usize| shape.value(shape.radius * (i as f64 / KERNEL_ENTRIES as f64).sqrt());
        let voxel = |&value: &f64| {
            let (rgb, opacity) = transfer.sample(value);
            let strength = extinction(opacity);
            let [r, g, b] = rgb.map(|channel| f64::from(channel) * strength);
            [r, g, b, strength]
        };
        truth.classified = Some(Classified {
            voxels: truth.values.iter().map(voxel).collect(),
            // One more, so that there is a next entry everywhere.
            kernel: (0..=KERNEL_ENTRIES + 1).map(entry).collect(),
            radius: shape.radius,
        });
        truth.seen = (0..truth.blocks.iter().product())
            .map(|i| truth.reaches(i))
            .collect();
        truth
    }

    /// Returns true if a classified voxel shows in a block or reaches into it.
    fn reaches(&self, block: usize) -> bool {
        let Some(classified) = &self.classified else {
            return false;
        };
        let [nx, ny, _] = self.blocks;
        let at = [block % nx, block / nx % ny, block / (nx * ny)];
        let reach = classified.radius.ceil() as usize;
        let range = |axis: usize| {
            let first = (at[axis] * BLOCK).saturating_sub(reach);
            first..((at[axis] + 1) * BLOCK + 1 + reach).min(self.volume.dims[axis])
        };
        let place =
            |x: usize, y: usize, z: usize| x + self.volume.dims[0] * (y + self.volume.dims[1] * z);
        range(2)
            .any(|z| range(1).any(|y| range(0).any(|x| classified.voxels[place(x, y, z)][3] > 0.0)))
    }

    /// Returns true if any scalar between the least and the greatest of a block is visible: asked at the ends, and at knots
    /// between them.
    fn shows(&self, block: usize) -> bool {
        let [nx, ny, _] = self.blocks;
        let at = [block % nx, block / nx % ny, block / (nx * ny)];
        let range = |axis: usize| {
            at[axis] * BLOCK..((at[axis] + 1) * BLOCK + 1).min(self.volume.dims[axis])
        };
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let value =
                        self.values[x + self.volume.dims[0] * (y + self.volume.dims[1] * z)];
                    (low, high) = (low.min(value), high.max(value));
                }
            }
        }
        let knots = self
            .transfer
            .opacity_knots()
            .iter()
            .any(|k| k.opacity > 0.0 && k.value > low && k.value < high);
        knots || self.transfer.opacity(low) > 0.0 || self.transfer.opacity(high) > 0.0
    }

    /// The truth of one view; opacity is meant per smallest spacing.
    pub fn render(&self, camera: &Camera) -> Image {
        self.render_among(camera, &|_| Vec::new())
    }

    /// The truth of one view of the volume with surfaces inside: `met` gives those that the ray of a screen position meets.
    pub fn render_among(
        &self,
        camera: &Camera,
        met: &(dyn Fn(DVec2) -> Vec<MetSurface> + Sync),
    ) -> Image {
        let rays = RaySource::new(camera, &self.volume.world_from_index);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixel = |i: usize| {
            let corner = DVec2::new((i % width) as f64, (i / width) as f64);
            let mut sum = [0.0f64; 4];
            for sub in 0..self.rays_per_side.pow(2) {
                let offset = DVec2::new(
                    (sub % self.rays_per_side) as f64,
                    (sub / self.rays_per_side) as f64,
                );
                let screen = corner + (offset + 0.5) / self.rays_per_side as f64;
                let seen = self.along(&rays.ray(screen), camera.near, met(screen));
                for (sum, value) in sum.iter_mut().zip(seen) {
                    *sum += value / self.rays_per_side.pow(2) as f64;
                }
            }
            sum.map(|value| value as f32)
        };
        let mut image = Image::transparent(width, height);
        image.rgba = (0..width * height).into_par_iter().map(pixel).collect();
        image
    }

    /// Colour and opacity of a ray that meets these surfaces.
    fn along(&self, ray: &Ray, near: f64, mut surfaces: Vec<MetSurface>) -> [f64; 4] {
        surfaces.retain(|surface| surface.z > near);
        surfaces.sort_by(|a, b| a.z.total_cmp(&b.z));
        let (mut sum, mut from) = ([0.0; 4], near);
        for surface in surfaces {
            self.march(ray, [from, surface.z], &mut sum);
            let left = 1.0 - sum[3];
            for (sum, value) in sum.iter_mut().zip(surface.rgba) {
                *sum += left * value;
            }
            from = surface.z;
        }
        self.march(ray, [from, f64::INFINITY], &mut sum);
        sum
    }

    /// Marches along a ray between two depths, and composites the samples behind `shown`.
    fn march(&self, ray: &Ray, [near, far]: [f64; 2], shown: &mut [f64; 4]) {
        let last = DVec3::from(self.volume.dims.map(|n| (n - 1) as f64));
        // Kernels reach beyond the voxels at the faces.
        let margin = self
            .classified
            .as_ref()
            .map_or(0.0, |classified| classified.radius);
        let [first, end] = crossing(ray, DVec3::splat(-margin), last + margin);
        let (first, end) = (first.max(near), end.min(far));
        let spacing = self.volume.smallest_spacing();
        let longest = spacing / self.steps_per_voxel / ray.world_per_z;
        let step = (end - first) / ((end - first) / longest).ceil();
        let units = step * ray.world_per_z / spacing;
        let (mut sum, mut left, mut number) = (*shown, 1.0 - shown[3], 0u64);
        while left > END {
            let z = first + (number as f64 + 0.5) * step;
            // Written so that a ray beside the volume, whose ends are no numbers, ends too.
            if !(z < end) {
                break;
            }
            let at = ray.origin + z * ray.direction;
            let block: [usize; 3] =
                std::array::from_fn(|a| (at[a] as usize / BLOCK).min(self.blocks[a] - 1));
            if !self.seen[block[0] + self.blocks[0] * (block[1] + self.blocks[1] * block[2])] {
                let corner = DVec3::from(block.map(|b| (b * BLOCK) as f64));
                let [_, leaves] = crossing(ray, corner, corner + BLOCK as f64);
                number = (((leaves - first) / step - 0.5).floor() as u64).max(number) + 1;
                continue;
            }
            number += 1;
            let parts = self.parts([-0.5, 0.0, 0.5].map(|by| at + by * step * ray.direction));
            for part in 0..parts {
                let by = ((part as f64 + 0.5) / parts as f64 - 0.5) * step;
                let [r, g, b, strength] = self.sample(at + by * ray.direction);
                if strength <= 0.0 {
                    continue;
                }
                let weight = left * -(-strength * units / parts as f64).exp_m1();
                left -= weight;
                for (sum, emitted) in sum.iter_mut().zip([r, g, b]) {
                    *sum += weight * emitted / strength;
                }
            }
        }
        sum[3] = 1.0 - left;
        *shown = sum;
    }

    /// The samples of a step whose ends and middle are these: more where the scalar passes through what is visible.
    fn parts(&self, places: [DVec3; 3]) -> usize {
        let visible = self.transfer.visible_range();
        let (Some((low, high)), None) = (visible, &self.classified) else {
            return 1;
        };
        let last = DVec3::from(self.volume.dims.map(|n| (n - 1) as f64));
        let [a, b, c] = places.map(|at| self.scalar(at.clamp(DVec3::ZERO, last)));
        let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
        let bend = 0.3 * (greatest - least);
        if self.steps_per_range == 0.0 || greatest + bend < low || least - bend > high {
            return 1;
        }
        let path = (b - a).abs() + (c - b).abs();
        ((path * self.steps_per_range / (high - low)).ceil() as usize).clamp(1, 400)
    }

    /// Extinction times red, green and blue, and extinction per smallest spacing, at a position.
    fn sample(&self, at: DVec3) -> [f64; 4] {
        if let Some(classified) = &self.classified {
            return classified.sum(at, self.volume.dims);
        }
        let (rgb, opacity) = self.transfer.sample(self.scalar(at));
        let strength = extinction(opacity);
        let [r, g, b] = rgb.map(|channel| f64::from(channel) * strength);
        [r, g, b, strength]
    }

    fn scalar(&self, at: DVec3) -> f64 {
        let [nx, ny, _] = self.volume.dims;
        let cell: [usize; 3] =
            std::array::from_fn(|a| (at[a] as usize).min(self.volume.dims[a] - 2));
        let share = at - DVec3::from(cell.map(|c| c as f64));
        let value = |x: usize, y: usize, z: usize| {
            self.values[cell[0] + x + nx * (cell[1] + y + ny * (cell[2] + z))]
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |y: usize, z: usize| mix(value(0, y, z), value(1, y, z), share.x);
        mix(
            mix(row(0, 0), row(1, 0), share.y),
            mix(row(0, 1), row(1, 1), share.y),
            share.z,
        )
    }
}

impl Classified {
    /// The sum of all voxels times the kernel at a position.
    fn sum(&self, at: DVec3, dims: [usize; 3]) -> [f64; 4] {
        let range = |axis: usize| {
            let first = (at[axis] - self.radius).ceil().max(0.0) as usize;
            let end = ((at[axis] + self.radius).floor() + 1.0).max(0.0) as usize;
            first..end.min(dims[axis])
        };
        let per_entry = KERNEL_ENTRIES as f64 / (self.radius * self.radius);
        let mut sum = [0.0; 4];
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let distance2 = at.distance_squared(DVec3::new(x as f64, y as f64, z as f64));
                    let place = distance2 * per_entry;
                    if place >= KERNEL_ENTRIES as f64 {
                        continue;
                    }
                    let (entry, share) = (place as usize, place.fract());
                    let weight =
                        self.kernel[entry] + share * (self.kernel[entry + 1] - self.kernel[entry]);
                    let voxel = self.voxels[x + dims[0] * (y + dims[1] * z)];
                    for (sum, value) in sum.iter_mut().zip(voxel) {
                        *sum += weight * value;
                    }
                }
            }
        }
        sum
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
    use crate::volumes::scenes::{grey, perspective, transfer, volume};
    use glam::DAffine3;

    #[test]
    fn a_constant_volume_follows_the_law_of_beer() {
        let volume = volume([5, 5, 5], DAffine3::IDENTITY, |_| 1.0);
        let camera = perspective(DVec3::new(2.0, 2.0, -10.0), DVec3::splat(2.0), 2.0, [3, 3]);
        let image = AreaTruth::new(&volume, &grey(0.3)).render(&camera);
        let error = (f64::from(1.0 - image.rgba[4][3]) - 0.7f64.powi(4)).abs();
        assert!(error < 2e-3, "off by {error}");
    }

    /// One voxel alone: its optical depth on a ray is extinction times the kernel's line integral, in closed terms.
    #[test]
    fn a_classified_voxel_is_its_kernel() {
        let voxel = volume([5, 5, 5], DAffine3::IDENTITY, |p| {
            f64::from(p == DVec3::splat(2.0))
        });
        let transfer = transfer(&[(0.0, [0.2, 0.6, 1.0])], &[(0.0, 0.0), (1.0, 0.9)]);
        let camera = perspective(
            DVec3::new(2.0, 2.0, -60.0),
            DVec3::splat(2.0),
            4.0,
            [31, 31],
        );
        let mut truth = AreaTruth::of_classified(&voxel, &transfer, KernelShape::Gaussian);
        (truth.rays_per_side, truth.steps_per_voxel) = (1, 16.0);
        let image = truth.render(&camera);
        let (kernel, rays) = (
            ReferenceKernel::new(KernelShape::Gaussian),
            RaySource::new(&camera, &voxel.world_from_index),
        );
        for (x, y) in [(15, 15), (11, 15), (18, 9)] {
            let ray = rays.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            let away = (DVec3::splat(2.0) - ray.origin)
                .cross(ray.direction.normalize())
                .length();
            let depth = extinction(0.9) * kernel.line_integral(away, f64::NEG_INFINITY);
            let got = image.rgba[x + 31 * y];
            let wanted = -(-depth).exp_m1();
            assert!(
                (f64::from(got[3]) - wanted).abs() < 1e-4,
                "({x}, {y}): {got:?}, {wanted}"
            );
            assert!(
                (f64::from(got[1]) - 0.6 * wanted).abs() < 1e-4,
                "({x}, {y}): green of {got:?}"
            );
        }
    }
}
