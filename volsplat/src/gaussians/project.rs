//! Gaussians in view: their axes and colours in camera space, the pixels that they may touch, and their lists by tile.

use glam::{DMat3, DQuat, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::narrow::{pixel, single};
use resample_core::sort::depth_key;
use resample_core::tile::{ChunkBins, TileGrid};
use resample_core::{Camera, Projection};
use resample_volume::Gaussians;

/// Gaussians of a chunk: enough that a chunk's lists cost little, few enough that all threads have work.
pub(crate) const CHUNK: usize = 1 << 14;

/// A Gaussian whose opacity is below this in a pixel adds nothing there: a quarter of a step of an 8-bit picture.
pub(crate) const LEAST_OPACITY: f64 = 1.0 / 2048.0;

/// Its log2.
pub(crate) const LEAST_EXPONENT: f32 = -11.0;

/// A Gaussian begins this many of its standard deviations along z before its centre: rays that meet it beside its centre may meet it
/// earlier, by sqrt(q + 5) at most. This holds for q up to 4, beyond which an eighth of its opacity is left; with less, pixels popped by
/// 0.006 as the view turned, and with the bound for all q pictures were no better and took a seventh more time.
const BEGIN_SIGMAS: f64 = 3.0;

/// Standard deviation of the pixel's Gaussian, px.
pub(crate) const PIXEL_SIGMA_PX: f64 = 0.5;

/// A Gaussian in view, in camera space relative to the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct InView {
    /// Centre, world units.
    pub(crate) centre: [f32; 3],
    /// Its axes, each as long as its standard deviation, world units.
    pub(crate) axes: [[f32; 3]; 3],
    /// Opacity at the centre, 0..1.
    pub(crate) opacity: f32,
    /// Square of the footprint's area, as the adjugate of the covariance has it towards the centre.
    pub(crate) area2: f64,
    /// Colour in the blend space.
    pub(crate) colour: [f32; 3],
    /// First and last pixel column and row, the last exclusive.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// Smaller standard deviation of the footprint, px.
    pub(crate) minor_px: f32,
}

impl InView {
    /// Covariance, world units squared, with variances along camera x and y added.
    #[inline(always)]
    pub(crate) fn widened(&self, [wide_x, wide_y]: [f64; 2]) -> DMat3 {
        let [a, b, c] = &self.axes;
        let (a, b, c) = (
            Vec3::from_array(*a),
            Vec3::from_array(*b),
            Vec3::from_array(*c),
        );
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        DMat3::from_cols(
            a * a.x + b * b.x + c * c.x + DVec3::X * wide_x,
            a * a.y + b * b.y + c * c.y + DVec3::Y * wide_y,
            a * a.z + b * b.z + c * c.z,
        )
    }

    /// Centre, world units.
    pub(crate) fn centre(&self) -> DVec3 {
        Vec3::from_array(self.centre).as_dvec3()
    }
}

/// The Gaussians in view of a window of the picture, by tile. Buffers are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Binned {
    pub(crate) chunks: Vec<ChunkBins<InView>>,
}

impl Binned {
    /// Projects all Gaussians for one camera.
    pub(crate) fn fill(&mut self, gaussians: &Gaussians, camera: &Camera) {
        let count = gaussians.len().div_ceil(CHUNK);
        self.chunks.resize_with(count, ChunkBins::default);
        let grid = TileGrid::new(camera.width as usize, camera.height as usize);
        let view = View::new(gaussians, camera);
        let chunks = self.chunks.par_iter_mut().enumerate();
        chunks.for_each(|(number, bins)| {
            bins.clear();
            let first = number * CHUNK;
            for index in first..(first + CHUNK).min(gaussians.len()) {
                if let Some((in_view, near_z)) = view.project(gaussians, index) {
                    let rect = grid.rect(in_view.columns, in_view.rows);
                    bins.push(in_view, depth_key(near_z), rect);
                }
            }
            bins.bin(number);
        });
    }

    /// Gaussians in view.
    pub(crate) fn count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.primitives.len()).sum()
    }

    /// Gaussians in view times the tiles that each may touch.
    pub(crate) fn pairs(&self) -> usize {
        self.chunks.iter().map(ChunkBins::pairs).sum()
    }
}

/// A Gaussian in camera space.
pub(crate) struct Placed {
    /// Centre, world units.
    pub(crate) centre: DVec3,
    /// Its axes, each as long as its standard deviation, world units.
    pub(crate) axes: DMat3,
    /// Opacity at the centre, 0..1.
    pub(crate) opacity: f64,
    /// Colour towards the eye, in the blend space.
    pub(crate) colour: Vec3,
}

/// Camera and eye, which all Gaussians of a frame share.
pub(crate) struct View<'a> {
    pub(crate) camera: &'a Camera,
    camera_from_world: DMat3,
    /// Origin of the Gaussians in camera space, world units.
    origin: DVec3,
    /// The eye, relative to the origin of the Gaussians, world units; the direction of view of a parallel projection.
    eye: Vec3,
    forward: Vec3,
}

impl<'a> View<'a> {
    pub(crate) fn new(gaussians: &Gaussians, camera: &'a Camera) -> Self {
        let to_camera = camera.camera_from_world;
        Self {
            camera,
            camera_from_world: to_camera.matrix3,
            origin: to_camera.transform_point3(gaussians.origin_in_world),
            eye: (camera.eye_in_world() - gaussians.origin_in_world).as_vec3(),
            forward: camera.forward_in_world().as_vec3(),
        }
    }

    /// A Gaussian in camera space.
    pub(crate) fn placed(&self, gaussians: &Gaussians, index: usize) -> Placed {
        let gaussian = gaussians.get(index);
        let rotation = self.camera_from_world * DMat3::from_quat(quaternion(&gaussian.rotation));
        let scales = gaussian.scales.as_dvec3();
        let direction = match self.camera.projection {
            Projection::Perspective => (gaussian.centre - self.eye).normalize_or(self.forward),
            Projection::Orthographic => self.forward,
        };
        Placed {
            centre: self.origin + self.camera_from_world * gaussian.centre.as_dvec3(),
            axes: DMat3::from_cols(
                rotation.x_axis * scales.x,
                rotation.y_axis * scales.y,
                rotation.z_axis * scales.z,
            ),
            opacity: f64::from(gaussian.opacity),
            colour: gaussians.colour_towards(index, direction),
        }
    }

    /// A Gaussian in view with the camera z at which it begins; `None` where nothing of it is seen.
    fn project(&self, gaussians: &Gaussians, index: usize) -> Option<(InView, f32)> {
        if f64::from(gaussians.get(index).opacity) < LEAST_OPACITY {
            return None;
        }
        let placed = self.placed(gaussians, index);
        let (centre, axes) = (placed.centre, placed.axes);
        let covariance = axes * axes.transpose();
        let reach_z = covariance.z_axis.z.sqrt() * BEGIN_SIGMAS;
        if !(centre.z + reach_z > self.camera.near) {
            return None;
        }
        let (columns, rows) = self.pixels(centre, covariance, placed.opacity)?;
        let in_view = InView {
            centre: centre.as_vec3().to_array(),
            axes: [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.as_vec3().to_array()),
            opacity: single(placed.opacity),
            area2: self.area2(centre, &axes),
            colour: placed.colour.to_array(),
            columns,
            rows,
            minor_px: self.minor_px(centre, &covariance),
        };
        let near_z = (centre.z - reach_z).max(self.camera.near);
        Some((in_view, single(near_z)))
    }

    /// Of the axes' adjugate rather than the covariance's, which would lose thin ones.
    fn area2(&self, centre: DVec3, axes: &DMat3) -> f64 {
        let towards = match self.camera.projection {
            Projection::Perspective => centre,
            Projection::Orthographic => DVec3::Z,
        };
        (adjugate(axes).transpose() * towards).length_squared()
    }

    /// The pixels of the picture in which the Gaussian, widened by the pixel's Gaussian, may have the least opacity.
    fn pixels(
        &self,
        centre: DVec3,
        mut covariance: DMat3,
        opacity: f64,
    ) -> Option<([u16; 2], [u16; 2])> {
        let [wide_x, wide_y] = pixel_variance(self.camera, centre.z, PIXEL_SIGMA_PX);
        covariance.x_axis.x += wide_x;
        covariance.y_axis.y += wide_y;
        let reach2 = 2.0 * (opacity / LEAST_OPACITY).ln();
        let camera = self.camera;
        let (x, y) = (
            [camera.fx, camera.cx, f64::from(camera.width)],
            [camera.fy, camera.cy, f64::from(camera.height)],
        );
        let m = centre;
        let columns = self.extent(
            x,
            [m.x, m.z],
            [
                covariance.x_axis.x,
                covariance.x_axis.z,
                covariance.z_axis.z,
            ]
            .map(|c| reach2 * c),
        )?;
        let rows = self.extent(
            y,
            [m.y, m.z],
            [
                covariance.y_axis.y,
                covariance.y_axis.z,
                covariance.z_axis.z,
            ]
            .map(|c| reach2 * c),
        )?;
        Some((columns, rows))
    }

    /// The pixels along one axis of the picture that an ellipsoid may touch: `shape` holds its squared half width along the axis,
    /// along z, and their product's share.
    fn extent(
        &self,
        [focal, principal, size]: [f64; 3],
        [across, z]: [f64; 2],
        [s_xx, s_xz, s_zz]: [f64; 3],
    ) -> Option<[u16; 2]> {
        let (low, high) = match self.camera.projection {
            Projection::Orthographic => (across - s_xx.sqrt(), across + s_xx.sqrt()),
            // All of it lies before the eye: the planes x = u z that touch it.
            Projection::Perspective if z > 0.0 && z * z > 1.001 * s_zz => {
                let (a, b, c) = (z * z - s_zz, across * z - s_xz, across * across - s_xx);
                let root = (b * b - a * c).max(0.0).sqrt();
                ((b - root) / a, (b + root) / a)
            }
            // Part of it lies at the eye's plane or behind: any pixel may see it.
            Projection::Perspective => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let first = (focal * low + principal - 0.5).ceil().max(0.0);
        let end = ((focal * high + principal - 0.5).floor() + 1.0).min(size);
        (first < end).then_some([pixel(first), pixel(end)])
    }

    /// The smaller standard deviation of the footprint, px; 0 where the centre lies at the eye's plane.
    fn minor_px(&self, centre: DVec3, covariance: &DMat3) -> f32 {
        let camera = self.camera;
        let (row_x, row_y) = match camera.projection {
            Projection::Perspective => {
                let scale = 1.0 / centre.z.abs().max(camera.near);
                (
                    DVec3::new(1.0, 0.0, -centre.x * scale) * (camera.fx * scale),
                    DVec3::new(0.0, 1.0, -centre.y * scale) * (camera.fy * scale),
                )
            }
            Projection::Orthographic => (DVec3::X * camera.fx, DVec3::Y * camera.fy),
        };
        let (xx, xy, yy) = (
            row_x.dot(*covariance * row_x),
            row_x.dot(*covariance * row_y),
            row_y.dot(*covariance * row_y),
        );
        let middle = 0.5 * (xx + yy);
        let apart = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        single((middle - apart).max(0.0).sqrt())
    }
}

/// Variances, world units squared, along camera x and y that widen a Gaussian at depth `z` by a pixel's Gaussian.
pub(crate) fn pixel_variance(camera: &Camera, z: f64, sigma_px: f64) -> [f64; 2] {
    let z = match camera.projection {
        Projection::Perspective => z.max(0.0),
        Projection::Orthographic => 1.0,
    };
    [camera.fx, camera.fy].map(|focal| (sigma_px * z / focal).powi(2))
}

fn quaternion(rotation: &glam::Quat) -> DQuat {
    let rotation = rotation.as_dquat();
    rotation.normalize()
}

/// The adjugate of a symmetric matrix, or the transposed one of any other.
#[inline(always)]
pub(crate) fn adjugate(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}
