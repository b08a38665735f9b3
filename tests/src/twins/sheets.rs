//! The reference for image sheets: every sub-pixel's ray, plane by plane, in f64 and by definition.
//!
//! Takes what the renderer takes, gives colour, transmittance and expected depth per pixel. A ray reads the trilinear
//! scalar where it crosses the plane camera z = (k + 1/2) thickness, applies the transfer function itself (no table),
//! turns extinction and the length of the ray through the slab into opacity, and composites front to back; a pixel is
//! the mean of its sub-pixels. There are no cells, bricks, tiles or kernels. Source: the method, sections 3, 4 and 9.
//!
//! With the pixel comes the most by which the renderer may differ for two reasons that it admits: its table takes the
//! nearest of 4096 scalars, and its f32 positions may put what lies on the volume's face on either side.
//! Limits: opacity by extinction; a fixed number of sub-pixels; colours of at most 1.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::OpacityMode;
use volsplat::Subpixels;

use crate::choices::field;
use crate::twins::clip;
use crate::twins::field::extinction;
use crate::twins::rays::{Ray, RaySource};
use crate::twins::samples::Scene;

/// Scalars in the renderer's table, which span the visible part of the volume's range.
const TABLE_ENTRIES: f64 = 4096.0;

/// Error of a position, voxels: a few roundings of numbers up to 32 in f32 (4e-6 each at most).
const POSITION_ERROR: f64 = 2e-5;

/// The value of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SheetPixel {
    /// Linear, premultiplied.
    pub rgb: [f64; 3],
    /// Transmittance so far.
    pub transmittance: f64,
    /// Opacity-weighted mean camera z of the planes; +infinity if nothing is seen.
    pub depth: f64,
    /// The most by which a channel may differ: each sample's greatest change within what table and positions allow,
    /// times the most that is left in front of it. Replacing the samples one by one, front to back, shows that it is a
    /// bound.
    pub slack: f64,
}

/// Values shared by all rays.
struct Setup<'a> {
    scene: Scene<'a>,
    rays: RaySource,
    unit: f64,
    thickness: f64,
    /// Half the distance of two scalars in the table, and what an error of position may change.
    scalar_error: f64,
    /// How far from a face a sample may be taken for one on the other side, voxels.
    face_error: f64,
    subpixels: u32,
}

/// Colour and opacity of one slab.
#[derive(Clone, Copy)]
struct Slab {
    rgb: [f64; 3],
    opacity: f64,
}

/// Renders a picture, row by row. `slab_voxels`, `subpixels` and `opacity_unit` are taken from the options.
///
/// # Panics
/// Where the options ask for linear opacity or automatic sub-pixels, which this reference does not know.
pub fn render(scene: &Scene) -> Vec<SheetPixel> {
    assert_eq!(
        scene.options.opacity,
        OpacityMode::Extinction,
        "the reference knows extinction only"
    );
    let Subpixels::Fixed(subpixels) = scene.options.subpixels else {
        panic!("the reference wants a fixed number of sub-pixels");
    };
    let setup = Setup::new(scene, subpixels);
    let (width, height) = (scene.camera.width as usize, scene.camera.height as usize);
    (0..width * height)
        .into_par_iter()
        .map(|i| setup.pixel([i % width, i / width]))
        .collect()
}

impl<'a> Setup<'a> {
    fn new(scene: &Scene<'a>, subpixels: u32) -> Self {
        let smallest = DVec3::from(scene.volume.spacing()).min_element();
        let (low, high) = scene.volume.value_range();
        let shown = scene.transfer.visible_range().unwrap_or((low, high));
        let span = (shown.1.min(high) - shown.0.max(low)).max(0.0);
        Self {
            scene: *scene,
            rays: RaySource::new(scene.camera, &scene.volume.world_from_index),
            unit: scene.options.opacity_unit.unwrap_or(smallest),
            thickness: field(scene.options).slab_voxels * smallest,
            // f32 holds the scalar and its place in the table to 1e-6 of the range.
            scalar_error: 0.5 * span / (TABLE_ENTRIES - 1.0)
                + (3.0 * POSITION_ERROR + 1e-6) * (high - low),
            face_error: POSITION_ERROR,
            subpixels,
        }
    }

    fn pixel(&self, [x, y]: [usize; 2]) -> SheetPixel {
        let n = self.subpixels;
        let (mut sum, mut depth) = (SheetPixel::default(), 0.0);
        for part in 0..n * n {
            let inside =
                DVec2::new(f64::from(part % n) + 0.5, f64::from(part / n) + 0.5) / f64::from(n);
            let ray = self.rays.ray(DVec2::new(x as f64, y as f64) + inside);
            let add = self.ray(&ray);
            let share = 1.0 / f64::from(n * n);
            for (sum, add) in sum.rgb.iter_mut().zip(add.rgb) {
                *sum += share * add;
            }
            sum.transmittance += share * add.transmittance;
            sum.slack += share * add.slack;
            depth += share * add.depth;
        }
        let opacity = 1.0 - sum.transmittance;
        SheetPixel {
            depth: if opacity > 0.0 {
                depth / opacity
            } else {
                f64::INFINITY
            },
            ..sum
        }
    }

    /// One ray; `depth` is the sum of opacity times camera z.
    fn ray(&self, ray: &Ray) -> SheetPixel {
        let mut sum = SheetPixel {
            transmittance: 1.0,
            ..SheetPixel::default()
        };
        // The most that may be left where the renderer's samples are all as faint as they may be.
        let mut most_left = 1.0;
        for k in self.planes(ray) {
            let z = (k + 0.5) * self.thickness;
            let at = ray.origin + z * ray.direction;
            let slab = self.slab(at, 0.0, 0.0, ray);
            let candidates = self.candidates(at, ray);
            let (mut change, mut faintest) = (0.0f64, slab.opacity);
            for other in candidates {
                let colour = slab
                    .rgb
                    .iter()
                    .zip(other.rgb)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                let opacity = (slab.opacity - other.opacity).abs();
                change = change.max(opacity + colour * slab.opacity.min(other.opacity));
                faintest = faintest.min(other.opacity);
            }
            sum.slack += most_left * change;
            most_left *= 1.0 - faintest;
            let weight = sum.transmittance * slab.opacity;
            for (sum, c) in sum.rgb.iter_mut().zip(slab.rgb) {
                *sum += weight * c;
            }
            sum.depth += weight * z;
            sum.transmittance -= weight;
        }
        sum
    }

    /// The numbers of the planes, from the near plane on, on which the ray is in or next to the volume.
    fn planes(&self, ray: &Ray) -> impl Iterator<Item = f64> + use<> {
        let (mut first, mut last) = (self.scene.camera.near, f64::INFINITY);
        for axis in 0..3 {
            let beyond = 0.01;
            let high = (self.scene.volume.dims[axis] - 1) as f64 + beyond;
            let ends = [-beyond, high].map(|side| (side - ray.origin[axis]) / ray.direction[axis]);
            // A ray along a face gives 0/0, which min and max pass over: then the axis does not bound it.
            first = first.max(ends[0].min(ends[1]));
            last = last.min(ends[0].max(ends[1]));
        }
        let first_plane = (first / self.thickness - 0.5).ceil();
        let last_plane = (last / self.thickness - 0.5).floor();
        let count = if last_plane >= first_plane {
            (last_plane - first_plane) as u64 + 1
        } else {
            0
        };
        (0..count).map(move |i| first_plane + i as f64)
    }

    /// The values that the renderer may use for a sample.
    fn candidates(&self, at: DVec3, ray: &Ray) -> [Slab; 4] {
        let error = self.scalar_error;
        let [low, high] = [-error, error].map(|by| self.slab(at, by, 0.0, ray));
        // Just inside or just outside the volume: seen or not seen.
        let [inside, outside] =
            [self.face_error, -self.face_error].map(|by| self.slab(at, 0.0, by, ray));
        [low, high, inside, outside]
    }

    /// The slab at a grid position; `by` is added to the scalar, and the volume is `wider` on all sides.
    fn slab(&self, at: DVec3, by: f64, wider: f64, ray: &Ray) -> Slab {
        let last = DVec3::from(self.scene.volume.dims.map(|n| (n - 1) as f64));
        let outside = at.cmplt(DVec3::splat(-wider)).any() || at.cmpgt(last + wider).any();
        if outside || !clip::keeps(&self.scene, at, wider) {
            return Slab {
                rgb: [0.0; 3],
                opacity: 0.0,
            };
        }
        let (rgb, opacity) = self
            .scene
            .transfer
            .sample(self.scalar(at.clamp(DVec3::ZERO, last)) + by);
        let length = self.thickness * ray.world_per_z / self.unit;
        Slab {
            rgb: rgb.map(f64::from),
            opacity: -(-extinction(opacity) * length).exp_m1(),
        }
    }

    /// The trilinear scalar at a position inside the volume.
    fn scalar(&self, at: DVec3) -> f64 {
        let dims = self.scene.volume.dims;
        let cell: [usize; 3] = std::array::from_fn(|axis| (at[axis] as usize).min(dims[axis] - 2));
        let mut sum = 0.0;
        for corner in 0..8 {
            let voxel: [usize; 3] = std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1));
            let weight: f64 = (0..3)
                .map(|axis| 1.0 - (at[axis] - voxel[axis] as f64).abs())
                .product();
            sum += weight
                * self
                    .scene
                    .volume
                    .value((voxel[2] * dims[1] + voxel[1]) * dims[0] + voxel[0]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choices::with_field;
    use crate::volumes::scenes::{grey, perspective, volume};
    use glam::DAffine3;
    use volsplat::RenderOptions;

    /// A slab of constant extinction seen head on: Beer's law, whatever the thickness of the sheets.
    #[test]
    fn a_constant_volume_follows_the_law_of_beer() {
        let volume = volume([5, 5, 5], DAffine3::IDENTITY, |_| 1.0);
        let (eye, target) = (DVec3::new(2.0, 2.0, -10.0), DVec3::splat(2.0));
        let camera = perspective(eye, target, 2.0, [3, 3]);
        for slab_voxels in [0.01, 0.001] {
            let options = with_field(
                RenderOptions {
                    subpixels: Subpixels::Fixed(1),
                    ..RenderOptions::default()
                },
                |field| field.slab_voxels = slab_voxels,
            );
            let scene = Scene {
                volume: &volume,
                transfer: &grey(0.3),
                camera: &camera,
                options: &options,
            };
            let middle = render(&scene)[4];
            let truth = 0.7f64.powi(4);
            let error = (middle.transmittance - truth).abs();
            assert!(
                error < 0.4 * slab_voxels,
                "slab {slab_voxels}: off by {error}"
            );
            assert!(
                (middle.rgb[0] + middle.transmittance - 1.0).abs() < 1e-12,
                "white on nothing"
            );
            assert!(
                middle.depth > 10.0 && middle.depth < 12.0,
                "nearer than the middle: {}",
                middle.depth
            );
        }
    }
}
