//! The reference for image sheets summed from kernels: every voxel against every slab of every pixel's ray, in f64.
//!
//! Takes what the renderer takes, gives colour and opacity per pixel. A voxel's section is a numeric integral of its kernel
//! along the ray, from where the ray enters the slab to where it leaves it; a point is weighted by the pixel's Gaussian at
//! its true position. Pre-classified, extinction and colour are summed; post-classified, the quotient of the sums of scalar
//! and weight is classified by the transfer function itself. The volume is continued by its outermost voxels, and nothing
//! is dropped. Gradients are summed like scalars, and light the quotient; pre-classified, each voxel is lit by its own.
//! Source: the method, sections 3 and 4. Limits: slow; one sub-pixel; extinction only.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Projection, SelectMode};
use volsplat::{Cells, Classify, Interpolate};

use crate::choices::{samples, sheets};
use crate::twins::cells::{Part, parts};
use crate::twins::coefficients::coefficients;
use crate::twins::field::{ReferenceKernel, extinction};
use crate::twins::light::{gradient_of, lit, needs_gradients, ramp};
use crate::twins::rays::{Ray, RaySource};
use crate::twins::samples::{Scene, point_weight};

/// Voxels that continue the volume on each side where scalars are summed: no kernel reaches farther.
const MARGIN: i64 = 2;

struct Voxel {
    index: DVec3,
    /// Colour times extinction and extinction, or the scalar (or its coefficient) in the last place.
    value: [f64; 4],
    /// The voxel's own scalar.
    scalar: f64,
    /// The gradient in the world.
    gradient: DVec3,
    /// Of a point: camera z, screen position and weight summed over the screen.
    point: Option<(f64, DVec2, f64)>,
}

struct Setup<'a> {
    scene: Scene<'a>,
    rays: RaySource,
    kernel: ReferenceKernel,
    thickness: f64,
    unit: f64,
    voxels: Vec<Voxel>,
}

/// Renders a picture, row by row: linear premultiplied colour and opacity.
pub fn render(scene: &Scene) -> Vec<[f64; 4]> {
    let smallest = DVec3::from(scene.volume.spacing()).min_element();
    let mut setup = Setup {
        scene: *scene,
        rays: RaySource::new(scene.camera, &scene.volume.world_from_index),
        kernel: ReferenceKernel::new(samples(scene.options).kernel),
        thickness: sheets(scene.options).slab_voxels * smallest,
        unit: scene.options.opacity_unit.unwrap_or(smallest),
        voxels: Vec::new(),
    };
    // A section is cut along each ray; a point is there or not.
    let voxels = setup.voxels();
    setup.voxels = voxels
        .into_iter()
        .filter(|v| v.point.is_none() || setup.keeps(v.index))
        .collect();
    let (width, height) = (scene.camera.width as usize, scene.camera.height as usize);
    (0..width * height)
        .into_par_iter()
        .map(|i| setup.pixel([i % width, i / width]))
        .collect()
}

impl Setup<'_> {
    fn post(&self) -> bool {
        sheets(self.scene.options).classify == Classify::Post
    }

    fn voxels(&self) -> Vec<Voxel> {
        if samples(self.scene.options).cells == Cells::Mean {
            let Scene {
                volume,
                transfer,
                options,
                ..
            } = self.scene;
            let own = self.scalars();
            let sample = |part: &Part| {
                let gradient = gradient_of(volume, &own, part.index);
                let value = self.lit_voxel(part.index, (part.rgb, part.strength), gradient);
                Voxel {
                    index: part.index,
                    value,
                    scalar: 0.0,
                    gradient,
                    point: self.point(part.index),
                }
            };
            return parts(volume, transfer, options)
                .iter()
                .map(sample)
                .collect();
        }
        let dims = self.scene.volume.dims.map(|n| n as i64);
        let margin = if self.post() { MARGIN } else { 0 };
        let solved = match sheets(self.scene.options).interpolate {
            Interpolate::On => Some(coefficients(self.scene.volume, &self.kernel)),
            Interpolate::Off => None,
        };
        let own = self.scalars();
        let laid = solved.as_ref().unwrap_or(&own);
        let mut voxels = Vec::new();
        for z in -margin..dims[2] + margin {
            for y in -margin..dims[1] + margin {
                for x in -margin..dims[0] + margin {
                    let held: [i64; 3] =
                        std::array::from_fn(|axis| [x, y, z][axis].clamp(0, dims[axis] - 1));
                    let place = (held[0] + dims[0] * (held[1] + dims[1] * held[2])) as usize;
                    let index = DVec3::new(x as f64, y as f64, z as f64);
                    let point = self.point(index);
                    // What completes the sums of splats around the volume is no matter of its own.
                    if point.is_some() && held != [x, y, z] {
                        continue;
                    }
                    let gradient = if needs_gradients(self.scene.options) {
                        gradient_of(self.scene.volume, laid, DVec3::from(held.map(|i| i as f64)))
                    } else {
                        DVec3::ZERO
                    };
                    let value = self.value(laid[place], index, gradient);
                    voxels.push(Voxel {
                        index,
                        value,
                        scalar: own[place],
                        gradient,
                        point,
                    });
                }
            }
        }
        voxels
    }

    fn scalars(&self) -> Vec<f64> {
        (0..self.scene.volume.len())
            .map(|i| self.scene.volume.value(i))
            .collect()
    }

    fn value(&self, scalar: f64, index: DVec3, gradient: DVec3) -> [f64; 4] {
        if self.post() {
            return [0.0, 0.0, 0.0, scalar];
        }
        let (rgb, opacity) = self.scene.transfer.sample(scalar);
        self.lit_voxel(index, (rgb.map(f64::from), extinction(opacity)), gradient)
    }

    /// Colour times extinction and extinction of a classified voxel in its own light.
    fn lit_voxel(&self, index: DVec3, (rgb, tau): ([f64; 3], f64), gradient: DVec3) -> [f64; 4] {
        let Scene {
            camera, options, ..
        } = self.scene;
        let in_camera = match camera.projection {
            Projection::Perspective => self.rays.in_camera(index),
            Projection::Orthographic => DVec3::Z,
        };
        let ray = camera.camera_from_world.matrix3.transpose() * in_camera;
        let tau = tau * ramp(options, gradient);
        let [r, g, b] = lit(options, camera, rgb, (gradient, ray)).map(|c| c * tau);
        [r, g, b, tau]
    }

    fn point(&self, index: DVec3) -> Option<(f64, DVec2, f64)> {
        let options = samples(self.scene.options);
        let in_camera = self.rays.in_camera(index);
        if options.select == SelectMode::Splats || in_camera.z <= self.scene.camera.near {
            return None;
        }
        let gram = self.rays.jacobian(index).iter().fold([0.0; 3], |g, j| {
            [g[0] + j.x * j.x, g[1] + j.x * j.y, g[2] + j.y * j.y]
        });
        let half = 0.5 * (gram[0] - gram[2]);
        let spacing = (0.5 * (gram[0] + gram[2]) + half.hypot(gram[1])).sqrt();
        if options.select == SelectMode::Hybrid && spacing >= f64::from(options.point_threshold_px)
        {
            return None;
        }
        let camera = self.scene.camera;
        let area_per_px = match camera.projection {
            Projection::Perspective => {
                in_camera.z.powi(3) / (camera.fx * camera.fy * in_camera.length())
            }
            Projection::Orthographic => 1.0 / (camera.fx * camera.fy),
        };
        Some((
            in_camera.z,
            self.rays.screen(index),
            self.rays.cell_volume() / (self.unit * area_per_px),
        ))
    }

    /// Returns true if a voxel's centre lies in the clip: as a point it is there or not.
    fn keeps(&self, index: DVec3) -> bool {
        let Scene {
            volume, options, ..
        } = self.scene;
        let at = volume.world_from_index.transform_point3(index);
        let in_planes = options
            .clip
            .planes
            .iter()
            .all(|plane| plane.normal.dot(at) >= plane.offset);
        let in_box = options
            .clip
            .crop_in_world
            .is_none_or(|[low, high]| at.cmpge(low).all() && at.cmple(high).all());
        in_planes && in_box
    }

    fn pixel(&self, [x, y]: [usize; 2]) -> [f64; 4] {
        let ray = self.rays.pixel(x, y);
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let near: Vec<&Voxel> = self
            .voxels
            .iter()
            .filter(|voxel| match voxel.point {
                Some((_, screen, _)) => (screen - centre).abs().max_element() < 2.0,
                None => ray.distance(voxel.index) < self.kernel.radius,
            })
            .collect();
        let depths = near.iter().map(|voxel| self.rays.in_camera(voxel.index).z);
        let (low, high) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| {
            (l.min(z), h.max(z))
        });
        let reach = self.rays.depth_reach(2.0) + self.thickness;
        let first = ((low - reach).max(self.scene.camera.near) / self.thickness).floor();
        let slabs = (((high + reach) / self.thickness - first).ceil()).max(0.0) as u64;
        let (mut left, mut rgb) = (1.0, [0.0; 3]);
        for slab in (0..slabs).map(|i| first + i as f64) {
            let added = self.slab(&near, &ray, (centre, slab));
            if added[3] > 0.0 {
                let weight = left * -(-added[3]).exp_m1();
                left -= weight;
                for (sum, c) in rgb.iter_mut().zip(added) {
                    *sum += weight * c / added[3];
                }
            }
        }
        [rgb[0], rgb[1], rgb[2], 1.0 - left]
    }

    /// Colours times optical depth, and optical depth, of a slab.
    fn slab(&self, voxels: &[&Voxel], ray: &Ray, (centre, slab): (DVec2, f64)) -> [f64; 4] {
        let ends = [slab * self.thickness, (slab + 1.0) * self.thickness];
        let kept = self.kept(ray);
        let [from, to] = [ends[0].max(kept[0]), ends[1].min(kept[1])];
        let (mut sums, mut weights, mut gradient) = ([0.0; 4], 0.0, DVec3::ZERO);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for voxel in voxels {
            let weight = match voxel.point {
                Some((z, screen, mass)) if ends[0] <= z && z < ends[1] => {
                    mass * point_weight(centre, screen)
                }
                Some(_) => 0.0,
                None if from < to => self.section(voxel, ray, [from, to]),
                None => 0.0,
            };
            weights += weight;
            gradient += weight * voxel.gradient;
            if weight > 0.0 {
                range = [range[0].min(voxel.scalar), range[1].max(voxel.scalar)];
            }
            for (sum, value) in sums.iter_mut().zip(voxel.value) {
                *sum += weight * value;
            }
        }
        if !self.post() {
            return sums;
        }
        if weights <= 0.0 {
            return [0.0; 4];
        }
        let mut scalar = sums[3] / weights;
        if sheets(self.scene.options).interpolate == Interpolate::On {
            scalar = scalar.clamp(range[0], range[1]);
        }
        let Scene {
            camera, options, ..
        } = self.scene;
        let gradient = gradient / weights;
        let (rgb, opacity) = self.scene.transfer.sample(scalar);
        let (_, in_camera) = camera.ray_in_camera(centre);
        let ray = camera.camera_from_world.matrix3.transpose() * in_camera;
        let added = extinction(opacity) * weights * ramp(options, gradient);
        let [r, g, b] =
            lit(options, camera, rgb.map(f64::from), (gradient, ray)).map(|c| c * added);
        [r, g, b, added]
    }

    /// Camera z between which the ray is in front of the near plane, in the clip and, for scalars, in the volume.
    fn kept(&self, ray: &Ray) -> [f64; 2] {
        let mut kept = self.clipped(ray, [self.scene.camera.near, f64::INFINITY]);
        for axis in (0..3).filter(|_| self.post()) {
            let high = (self.scene.volume.dims[axis] - 1) as f64;
            let ends = [0.0, high].map(|side| (side - ray.origin[axis]) / ray.direction[axis]);
            kept = [
                kept[0].max(ends[0].min(ends[1])),
                kept[1].min(ends[0].max(ends[1])),
            ];
        }
        kept
    }

    /// The part of a ray between two camera z that a box and planes in the world keep.
    fn clipped(&self, ray: &Ray, [mut from, mut to]: [f64; 2]) -> [f64; 2] {
        let Scene {
            volume, options, ..
        } = self.scene;
        let origin = volume.world_from_index.transform_point3(ray.origin);
        let direction = volume.world_from_index.transform_vector3(ray.direction);
        let mut halves: Vec<(DVec3, f64)> = options
            .clip
            .planes
            .iter()
            .map(|plane| (plane.normal, plane.offset))
            .collect();
        for axis in (0..3).filter(|_| options.clip.crop_in_world.is_some()) {
            let [low, high] = options.clip.crop_in_world.expect("some");
            halves.push((DVec3::AXES[axis], low[axis]));
            halves.push((-DVec3::AXES[axis], -high[axis]));
        }
        for (normal, offset) in halves {
            // Kept is what lies where normal . p is the offset or more.
            let (height, rise) = (normal.dot(origin) - offset, normal.dot(direction));
            let crossing = -height / rise;
            match rise {
                r if r > 0.0 => from = from.max(crossing),
                r if r < 0.0 => to = to.min(crossing),
                _ if height < 0.0 => to = from,
                _ => {}
            }
        }
        [from, to]
    }

    /// The section of a voxel's kernel between two camera z, opacity units.
    fn section(&self, voxel: &Voxel, ray: &Ray, [from, to]: [f64; 2]) -> f64 {
        let unit_per_voxel = ray.world_per_voxel() / self.unit;
        let length = ray.direction.length();
        let kernel = &self.kernel;
        let (distance, nearest) = (ray.distance(voxel.index), ray.nearest(voxel.index));
        let [start, end] = [from, to].map(|z| (z - nearest) * length);
        if end <= -kernel.radius || start >= kernel.radius {
            return 0.0;
        }
        let beyond = |t: f64| kernel.line_integral(distance, t);
        (beyond(start) - beyond(end)) * unit_per_voxel
    }
}
