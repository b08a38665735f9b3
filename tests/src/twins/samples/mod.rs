//! The reference renderer: every voxel, or part of a cell, against every pixel, in f64, by definition.
//!
//! Takes what the renderer takes, gives colour, transmittance and expected depth per pixel. Each voxel's line integral
//! is a numeric integral at the distance from the pixel's ray, found by a cross product; voxels are sorted by distance
//! with all their digits. Points are weighted by the pixel's Gaussian at their true position; those of one depth range
//! are summed until a splat of the same 16 px tile comes between (this rule is the renderer's: which splats part a
//! sheet is decided by tile, not by pixel). With `axis-sheets` whole slices of the grid are summed instead. Source: the
//! method, sections 2, 3 and 4.
//!
//! Limits: `exact` footprints only; EWA in grids of equal, perpendicular axes. The renderer sorts long lists by depth
//! to 16 bits of their range; [`ReferencePixel::swap_cost`] bounds what a swap of near-ties may change.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::{Camera, Projection, SelectMode};
use volsplat::{RenderOptions, SampleOrder, TransferFunction, Volume};

use crate::choices::samples;
use crate::twins::cells::{Part, parts};
use crate::twins::field::ReferenceKernel;
use crate::twins::rays::{Ray, RaySource};

mod footprint;
mod pixel;

pub(crate) use pixel::point_weight;

use footprint::{Ewa, outline_box};

/// Side of the tiles that part sheets of points, px.
const TILE: usize = 16;

/// Variance of the pixel's Gaussian, px^2.
const PIXEL_VARIANCE: f64 = 0.25;

/// The scene to render.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The voxels.
    pub volume: &'a Volume,
    /// Their look.
    pub transfer: &'a TransferFunction,
    /// The view.
    pub camera: &'a Camera,
    /// The choices; `footprint` is taken as exact.
    pub options: &'a RenderOptions,
}

/// The value of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferencePixel {
    /// Linear, premultiplied.
    pub rgb: [f64; 3],
    /// Transmittance so far.
    pub transmittance: f64,
    /// Opacity-weighted mean of camera z along this pixel's ray, at the distances of the samples; +infinity if empty.
    pub depth: f64,
    /// The most by which a channel may change when splats swap whose depths the renderer's keys cannot tell apart.
    pub swap_cost: f64,
    /// The most by which a channel may change because points stand at 256 positions a pixel, up to 1/512 px off.
    pub phase_cost: f64,
}

/// How a voxel reaches the screen.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Cut by the near plane: composited before all others.
    Near,
    /// Its footprint on the screen.
    Splat,
    /// Its mass (optical depth summed over the screen, px^2) at its position.
    Point { mass: f64 },
    /// Its footprint convolved with the pixel's Gaussian.
    Ewa(Ewa),
}

/// A visible voxel.
#[derive(Clone, Copy, Debug)]
struct Sample {
    index: DVec3,
    side: f64,
    rgb: [f64; 3],
    strength: f64,
    depth: f64,
    /// The first key of the order: the depth, or the distance of the sample's slice from the eye.
    rank: f64,
    screen: DVec2,
    kind: Kind,
    /// Tiles first..end along x and y that its box touches.
    tiles: [[usize; 2]; 2],
}

/// Values shared by all pixels.
struct Setup<'a> {
    scene: Scene<'a>,
    kernel: ReferenceKernel,
    rays: RaySource,
    unit: f64,
    sheet_thickness: f64,
    slices: Option<Slices>,
}

/// The slices of `axis-sheets`: across this grid axis, counted from the eye's place on it.
#[derive(Clone, Copy, Debug)]
struct Slices {
    axis: usize,
    eye: f64,
}

/// Renders a picture, row by row.
pub fn render(scene: &Scene) -> Vec<ReferencePixel> {
    let smallest = DVec3::from(scene.volume.spacing()).min_element();
    let setup = Setup {
        scene: *scene,
        kernel: ReferenceKernel::new(samples(scene.options).kernel),
        rays: RaySource::new(scene.camera, &scene.volume.world_from_index),
        unit: scene.options.opacity_unit.unwrap_or(smallest),
        sheet_thickness: samples(scene.options).sheet_voxels * smallest,
        slices: (samples(scene.options).order == SampleOrder::AxisSheets).then(|| slices(scene)),
    };
    let drawn = parts(scene.volume, scene.transfer, scene.options);
    let mut samples: Vec<Sample> = drawn.iter().filter_map(|part| setup.sample(part)).collect();
    samples.sort_by(|a, b| {
        let near = |s: &Sample| !matches!(s.kind, Kind::Near);
        let by_rank = if near(a) {
            a.rank.total_cmp(&b.rank)
        } else {
            a.depth.total_cmp(&b.depth)
        };
        near(a).cmp(&near(b)).then(by_rank)
    });
    let (width, height) = (scene.camera.width as usize, scene.camera.height as usize);
    (0..width * height)
        .into_par_iter()
        .map(|i| setup.pixel(&samples, [i % width, i / width]))
        .collect()
}

/// The grid axis whose slices face the view: the angle between their normal and the view direction is the least.
fn slices(scene: &Scene) -> Slices {
    let axes = scene.volume.world_from_index.matrix3;
    let columns = [axes.x_axis, axes.y_axis, axes.z_axis];
    let forward = scene.camera.camera_from_world.matrix3.row(2).normalize();
    let facing = |axis: usize| {
        let normal = columns[(axis + 1) % 3].cross(columns[(axis + 2) % 3]);
        (normal.dot(forward) / normal.length()).abs()
    };
    let axis = (0..3)
        .max_by(|&a, &b| facing(a).total_cmp(&facing(b)))
        .unwrap_or(0);
    let ray = RaySource::new(scene.camera, &scene.volume.world_from_index).pixel(0, 0);
    let eye = match scene.camera.projection {
        Projection::Perspective => ray.origin[axis],
        // So far away that every slice lies on one side.
        Projection::Orthographic => -1e9 * ray.direction[axis].signum(),
    };
    Slices { axis, eye }
}

/// The slice that a part lies in: that of its voxel, or of its cell.
fn slice_of(part: &Part, axis: usize) -> f64 {
    part.index[axis].floor()
}

impl Setup<'_> {
    /// A voxel or part of a cell, if it is visible at all.
    fn sample(&self, part: &Part) -> Option<Sample> {
        let &Part {
            index,
            side,
            rgb,
            strength,
        } = part;
        let camera = self.scene.camera;
        let in_camera = self.rays.in_camera(index);
        let reach = self.rays.depth_reach(self.kernel.radius * side);
        if !(in_camera.z + reach > camera.near) {
            return None;
        }
        let is_near = in_camera.z - reach <= camera.near;
        let kind = if is_near {
            Kind::Near
        } else {
            self.kind(part, in_camera)
        };
        let depth = match camera.projection {
            Projection::Perspective => in_camera.length(),
            Projection::Orthographic => in_camera.z,
        };
        let rank = self.slices.map_or(depth, |slices| {
            (slice_of(part, slices.axis) - slices.eye).abs()
        });
        let screen = self.rays.screen(index);
        let tiles = self.tiles(part, screen, &kind);
        Some(Sample {
            index,
            side,
            rgb,
            strength,
            depth,
            rank,
            screen,
            kind,
            tiles,
        })
    }

    fn kind(
        &self,
        &Part {
            index,
            side,
            strength,
            ..
        }: &Part,
        in_camera: DVec3,
    ) -> Kind {
        let options = samples(self.scene.options);
        let columns = self.rays.jacobian(index);
        let gram = columns.iter().fold([0.0; 3], |g, j| {
            [g[0] + j.x * j.x, g[1] + j.x * j.y, g[2] + j.y * j.y]
        });
        let gram = gram.map(|g| g * side * side);
        let (mean, half) = (0.5 * (gram[0] + gram[2]), 0.5 * (gram[0] - gram[2]));
        let spacing = (mean + half.hypot(gram[1])).sqrt();
        let mass = strength * self.mass(in_camera) * side.powi(3);
        match options.select {
            SelectMode::Splats => Kind::Splat,
            SelectMode::Points => Kind::Point { mass },
            SelectMode::Hybrid if spacing < f64::from(options.point_threshold_px) => {
                Kind::Point { mass }
            }
            SelectMode::Hybrid => Kind::Splat,
            SelectMode::Ewa => Kind::Ewa(Ewa::new(&self.kernel, gram, PIXEL_VARIANCE, mass)),
        }
    }

    /// Optical depth of a unit sample summed over the screen, px^2: its world volume over the opacity unit, times the
    /// pixels per world area across the ray, there. The area of a pixel seen square on is z^3 / (fx fy distance).
    fn mass(&self, in_camera: DVec3) -> f64 {
        let camera = self.scene.camera;
        let area_per_px = match camera.projection {
            Projection::Perspective => {
                in_camera.z.powi(3) / (camera.fx * camera.fy * in_camera.length())
            }
            Projection::Orthographic => 1.0 / (camera.fx * camera.fy),
        };
        self.rays.cell_volume() / (self.unit * area_per_px)
    }

    /// Tiles that a sample's box of pixel centres touches.
    fn tiles(&self, part: &Part, screen: DVec2, kind: &Kind) -> [[usize; 2]; 2] {
        let camera = self.scene.camera;
        let bounds = match kind {
            Kind::Near => return [[0, usize::MAX]; 2],
            Kind::Splat => outline_box(
                &self.rays,
                camera,
                part.index,
                self.kernel.radius * part.side,
            ),
            Kind::Point { .. } => [screen - 2.0, screen + 2.0],
            Kind::Ewa(ewa) => [screen - ewa.half_extent, screen + ewa.half_extent],
        };
        let pixels = |axis: usize, count: u32| {
            let end = f64::from(count);
            let first = (bounds[0][axis] - 0.5).ceil().clamp(0.0, end) as usize;
            [
                first,
                ((bounds[1][axis] - 0.5).floor() + 1.0).clamp(0.0, end) as usize,
            ]
        };
        let (x, y) = (pixels(0, camera.width), pixels(1, camera.height));
        if x[0] >= x[1] || y[0] >= y[1] {
            return [[0, 0]; 2];
        }
        [x, y].map(|[first, end]| [first / TILE, (end - 1) / TILE + 1])
    }

    /// The optical depth (or opacity) that a splat adds to a ray: the kernel's line integral beyond the near plane.
    fn along_ray(&self, sample: &Sample, ray: &Ray) -> f64 {
        let start = (self.scene.camera.near - ray.nearest(sample.index)) * ray.direction.length();
        let start = if matches!(sample.kind, Kind::Near) {
            start
        } else {
            f64::NEG_INFINITY
        };
        // The kernel is as much smaller as the part is, and higher, so that its integral over space is the part's volume.
        let side = sample.side;
        let integral = side
            * self
                .kernel
                .line_integral(ray.distance(sample.index) / side, start / side);
        sample.strength * integral * ray.world_per_voxel() / self.unit
    }
}
