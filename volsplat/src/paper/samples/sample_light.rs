//! Gradients of samples, and the light on those that are classified by themselves.
//!
//! In sums of kernels a voxel's gradient is laid down with the same weights as its scalar, so that its sum, over that of the
//! weights, is the gradient at the pixel. A sample that is classified before it is laid (the orders of samples, and image
//! sheets with pre-classification) is lit by itself, with the ray to its own position, once for each picture.
//! The gradient is a difference of fourth order over five voxels, mixed trilinearly between voxels. On fields with a formula
//! that was nearer than the usual difference over three voxels for every kernel, and than the kernel's own derivative for all
//! but the wide kernels at the limit of what the voxels can carry (see the accuracy ladder); and it serves points too, which
//! have no derivative. Where kernels interpolate, the differences are those of the coefficients.
//! Limits: beyond the volume its outermost voxels go on, so that across its faces the gradient is half of the one inside; a cell,
//! or a part of one, has the gradient in its middle.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::simd::Vectors;
use resample_core::{Camera, GridView, Projection, dispatch};
use resample_volume::volume::{Grid, Volume, with_voxels};

use crate::grid::{gradient_from_differences, place};
use crate::light::{GradientCurve, ShadeSettings, gradient_in_f32};
use crate::paper::samples::sample::{Brick, Samples};

const LANES: usize = 8;

impl Samples {
    /// Gives the samples the gradients of a volume's scalars.
    pub(crate) fn set_gradients_of(&mut self, volume: &Volume) {
        let (dims, axes) = (volume.dims, &volume.world_from_index.matrix3);
        let place = GradientPlace::new(self, axes);
        self.bricks.par_iter_mut().for_each(|brick| {
            with_voxels!(&volume.voxels, slice => {
                place.set(brick, &Grid { voxels: slice, dims });
            });
        });
    }

    /// Gives the samples the gradients of what their kernels are multiplied with.
    pub(crate) fn set_gradients_of_grid(&mut self, grid: &Grid<f32>, world_from_index: &DMat3) {
        let place = GradientPlace::new(self, world_from_index);
        self.bricks
            .par_iter_mut()
            .for_each(|brick| place.set(brick, grid));
    }
}

/// From the places of samples to voxels, and from differences of voxels to gradients.
struct GradientPlace {
    gradient_from_differences: DMat3,
    index_from_voxel: [f64; 2],
}

impl GradientPlace {
    fn new(samples: &Samples, world_from_index: &DMat3) -> Self {
        Self {
            gradient_from_differences: gradient_from_differences(world_from_index),
            index_from_voxel: samples.index_from_voxel,
        }
    }

    /// Gives the samples of a brick their gradients, in the world.
    fn set<T: Copy + Into<f64>>(&self, brick: &mut Brick, grid: &Grid<T>) {
        let [scale, shift] = self.index_from_voxel;
        let corner = DVec3::from(brick.bounds.corner.map(f64::from));
        let voxel = |place: [f64; 3]| (corner + DVec3::from(place) - shift) / scale;
        let differences = Differences::new(
            grid,
            brick.bounds.range().map(|end| voxel(end.map(f64::from))),
        );
        let gradient = |&packed: &u16| {
            let at = differences.at(voxel(place(packed).map(f64::from)));
            gradient_in_f32(self.gradient_from_differences * at)
        };
        brick.gradients = brick.places.iter().map(gradient).collect();
    }
}

/// Differences at the voxels around a brick of samples, per voxel.
struct Differences {
    first: DVec3,
    size: [usize; 3],
    at_voxels: Vec<DVec3>,
}

impl Differences {
    /// The differences at the voxels around a box of places.
    fn new<T: Copy + Into<f64>>(grid: &Grid<T>, [low, high]: [DVec3; 2]) -> Self {
        let first = low.floor();
        let size: [usize; 3] = (high.ceil() - first)
            .to_array()
            .map(|steps| steps as usize + 1);
        let difference_at = |i: usize| {
            let place = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            // What lies beyond the volume has the gradient of the nearest voxel.
            let voxel = |axis: usize| {
                (first[axis] as isize + place[axis] as isize).clamp(0, grid.dims[axis] as isize - 1)
            };
            difference(grid, [0, 1, 2].map(voxel))
        };
        let at_voxels = (0..size.iter().product()).map(difference_at).collect();
        Self {
            first,
            size,
            at_voxels,
        }
    }

    /// The difference at a place inside the box.
    fn at(&self, voxel: DVec3) -> DVec3 {
        let from_first = voxel - self.first;
        let (base, share) = (from_first.floor(), from_first.fract());
        let mut sum = DVec3::ZERO;
        for corner in 0..8 {
            let is_far = [0, 1, 2].map(|axis| corner >> axis & 1);
            let weight: f64 = (0..3)
                .map(|axis| {
                    if is_far[axis] == 1 {
                        share[axis]
                    } else {
                        1.0 - share[axis]
                    }
                })
                .product();
            // On a voxel the far corners may lie outside the box, and count nothing.
            if weight > 0.0 {
                let [x, y, z] = [0, 1, 2].map(|axis| base[axis] as usize + is_far[axis]);
                sum += weight * self.at_voxels[x + self.size[0] * (y + self.size[1] * z)];
            }
        }
        sum
    }
}

/// The difference of fourth order at a voxel.
fn difference<T: Copy + Into<f64>>(grid: &Grid<T>, voxel: [isize; 3]) -> DVec3 {
    DVec3::from([0, 1, 2].map(|axis| {
        let at = |offset: isize| {
            let mut place = voxel;
            place[axis] += offset;
            grid.stored(place)
        };
        (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / 12.0
    }))
}

/// Light on the samples of one lattice in one picture.
#[derive(Clone, Debug)]
pub(crate) struct SampleLight {
    level: Vectors,
    shade: Option<ShadeSettings>,
    /// Where extinction follows the gradient: how.
    ramp: Option<GradientCurve>,
    projection: Projection,
    camera_from_grid: DAffine3,
    world_from_camera: DMat3,
}

impl SampleLight {
    /// `None` where nothing is lit and no extinction follows the gradient. `view` is that of the samples' lattice.
    pub(crate) fn new(
        shade: Option<ShadeSettings>,
        ramp: Option<GradientCurve>,
        camera: &Camera,
        view: &GridView,
        level: Vectors,
    ) -> Option<Self> {
        (shade.is_some() || ramp.is_some()).then(|| Self {
            level,
            shade,
            ramp,
            projection: view.projection,
            camera_from_grid: view.camera_from_grid,
            world_from_camera: camera.camera_from_world.matrix3.transpose(),
        })
    }

    /// The colours and strengths of a brick's samples as light and the ramp over the gradient leave them.
    pub(crate) fn values(&self, brick: &Brick) -> Vec<[f32; 4]> {
        let first = self
            .camera_from_grid
            .transform_point3(DVec3::from(brick.bounds.corner.map(f64::from)));
        let mut values = brick.values.clone();
        let parts = values
            .chunks_mut(LANES)
            .zip(brick.places.chunks(LANES))
            .zip(brick.gradients.chunks(LANES));
        for ((values, places), gradients) in parts {
            let rays = places.iter().map(|&packed| self.ray(first, packed));
            let mut lanes = [[0.0; LANES]; 6];
            for (lane, (gradient, ray)) in gradients.iter().zip(rays).enumerate() {
                for (k, value) in gradient.iter().chain(&ray).enumerate() {
                    lanes[k][lane] = *value;
                }
            }
            let [factors, bodies, highlights] =
                dispatch!(self.level, simd => light_lanes(simd, self, &lanes));
            for (lane, value) in values.iter_mut().enumerate() {
                for channel in &mut value[..3] {
                    *channel = *channel * bodies[lane] + highlights[lane];
                }
                value[3] *= factors[lane];
            }
        }
        values
    }

    /// The unit direction, in the world, of the ray to a sample of the brick whose first place lies here in camera space.
    fn ray(&self, first: DVec3, packed: u16) -> [f32; 3] {
        let direction = match self.projection {
            Projection::Orthographic => DVec3::Z,
            Projection::Perspective => {
                let at = Vec3::from(place(packed).map(f32::from)).as_dvec3();
                (first + self.camera_from_grid.matrix3 * at).normalize_or_zero()
            }
        };
        (self.world_from_camera * direction).as_vec3().to_array()
    }
}

/// For gradients and unit rays: the factor of the strength, that of the colour, and the highlight.
#[simd]
fn light_lanes<S: Simd>(
    simd: S,
    light: &SampleLight,
    lanes: &[[f32; LANES]; 6],
) -> [[f32; LANES]; 3] {
    let load = |k: usize| f32x8::from_slice(simd, &lanes[k]);
    let gradient = [load(0), load(1), load(2)];
    let one = f32x8::splat(simd, 1.0);
    let factor = light.ramp.map_or(one, |ramp| ramp.factor(simd, gradient));
    match &light.shade {
        None => [factor.to_array(), one.to_array(), [0.0; LANES]],
        Some(shade) => {
            let lit = shade.light(simd, gradient, [load(3), load(4), load(5)]);
            [
                factor.to_array(),
                lit.body.to_array(),
                lit.highlight.to_array(),
            ]
        }
    }
}
