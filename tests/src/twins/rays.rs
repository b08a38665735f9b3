//! Rays: what a pixel sees, as a line in voxel indices.
//!
//! Takes a camera and the place of a grid, gives origin and direction by the definition of the pinhole (or of parallel
//! rays), carried through the inverse of the whole map. The parameter of a ray is camera z.

use glam::{DAffine3, DVec2, DVec3};
use resample_core::{Camera, Projection};

/// A camera and a grid.
#[derive(Clone, Copy, Debug)]
pub struct RaySource {
    camera: Camera,
    camera_from_index: DAffine3,
    index_from_camera: DAffine3,
}

/// The ray of one screen position, in voxel indices.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where camera z is 0.
    pub origin: DVec3,
    /// Change per unit of camera z.
    pub direction: DVec3,
    /// World length per unit of camera z.
    pub world_per_z: f64,
}

impl RaySource {
    /// The rays of `camera` through the grid that `world_from_index` places in the world.
    pub fn new(camera: &Camera, world_from_index: &DAffine3) -> Self {
        let camera_from_index = camera.camera_from_world * *world_from_index;
        Self {
            camera: *camera,
            camera_from_index,
            index_from_camera: camera_from_index.inverse(),
        }
    }

    /// The ray through a screen position, px.
    pub fn ray(&self, screen: DVec2) -> Ray {
        let (x, y) = (
            (screen.x - self.camera.cx) / self.camera.fx,
            (screen.y - self.camera.cy) / self.camera.fy,
        );
        let (origin, direction) = match self.camera.projection {
            Projection::Perspective => (DVec3::ZERO, DVec3::new(x, y, 1.0)),
            Projection::Orthographic => (DVec3::new(x, y, 0.0), DVec3::Z),
        };
        Ray {
            origin: self.index_from_camera.transform_point3(origin),
            direction: self.index_from_camera.transform_vector3(direction),
            world_per_z: direction.length(),
        }
    }

    /// The ray through the centre of pixel (x, y).
    pub fn pixel(&self, x: usize, y: usize) -> Ray {
        self.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5))
    }

    /// Camera space position of a voxel.
    pub fn in_camera(&self, index: DVec3) -> DVec3 {
        self.camera_from_index.transform_point3(index)
    }

    /// Screen position of a voxel, px.
    pub fn screen(&self, index: DVec3) -> DVec2 {
        let p = self.in_camera(index);
        let divisor = if self.camera.projection == Projection::Perspective {
            p.z
        } else {
            1.0
        };
        DVec2::new(
            self.camera.fx * p.x / divisor + self.camera.cx,
            self.camera.fy * p.y / divisor + self.camera.cy,
        )
    }

    /// Screen movement per voxel along each grid axis at a voxel, by central differences; good to 1e-8.
    pub fn jacobian(&self, index: DVec3) -> [DVec2; 3] {
        const STEP: f64 = 1e-4;
        DVec3::AXES.map(|axis| {
            (self.screen(index + STEP * axis) - self.screen(index - STEP * axis)) / (2.0 * STEP)
        })
    }

    /// World volume of a voxel's cell.
    pub fn cell_volume(&self) -> f64 {
        self.camera_from_index.matrix3.determinant().abs()
    }

    /// How far a ball of this radius (voxels) reaches along camera z, world units.
    pub fn depth_reach(&self, radius: f64) -> f64 {
        let m = self.camera_from_index.matrix3;
        radius * DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z).length()
    }
}

impl Ray {
    /// Distance of a position from the line, voxels, without cancellation.
    pub fn distance(&self, to: DVec3) -> f64 {
        (to - self.origin).cross(self.direction).length() / self.direction.length()
    }

    /// The ray parameter (camera z) of the nearest approach to a position.
    pub fn nearest(&self, to: DVec3) -> f64 {
        (to - self.origin).dot(self.direction) / self.direction.length_squared()
    }

    /// World length of one voxel length along the ray.
    pub fn world_per_voxel(&self) -> f64 {
        self.world_per_z / self.direction.length()
    }
}
