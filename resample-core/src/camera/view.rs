//! The camera as a sample grid sees it.
//!
//! A kernel is a ball in its own grid, however the grid is stretched or sheared in the world. So the camera is
//! carried into grid space instead of the kernel into the world: rays become w0 + x wx + y wy, with (x, y) the pixel
//! offset from the principal point, and every footprint formula for a sphere holds for non-uniform spacing too.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::camera::{Camera, Projection};

/// A camera carried into the space of a sample grid (texels, voxels), f64.
#[derive(Clone, Copy, Debug)]
pub struct GridView {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// From grid positions to camera space (world units).
    pub camera_from_grid: DAffine3,
    /// Grid position of the eye (perspective), or of the image plane at the principal point (orthographic).
    pub origin: DVec3,
    /// Ray direction at the principal point, grid units per unit of camera z.
    pub w0: DVec3,
    /// Change of the ray direction (perspective) or of the ray origin (orthographic) per pixel along x.
    pub wx: DVec3,
    /// As `wx`, along y.
    pub wy: DVec3,
    /// Principal point, px.
    pub principal_px: DVec2,
    /// Focal lengths, px (perspective) or px per world unit (orthographic).
    pub focal: DVec2,
    /// Camera z of the near plane, world units; in orthographic views minus infinity is allowed.
    pub near: f64,
}

impl GridView {
    /// Carries `camera` into the grid whose positions `world_from_grid` places in the world.
    ///
    /// The grid's axes must be linearly independent.
    pub fn new(camera: &Camera, world_from_grid: &DAffine3) -> Self {
        let camera_from_grid = camera.camera_from_world * *world_from_grid;
        let grid_from_camera = camera_from_grid.matrix3.inverse();
        Self {
            projection: camera.projection,
            camera_from_grid,
            origin: grid_from_camera * -camera_from_grid.translation,
            w0: grid_from_camera.z_axis,
            wx: grid_from_camera.x_axis / camera.fx,
            wy: grid_from_camera.y_axis / camera.fy,
            principal_px: DVec2::new(camera.cx, camera.cy),
            focal: DVec2::new(camera.fx, camera.fy),
            near: camera.near,
        }
    }

    /// Origin and direction, in the grid, of the ray through a screen position; its parameter is camera z.
    pub fn ray(&self, pos_in_screen: DVec2) -> (DVec3, DVec3) {
        let offset = pos_in_screen - self.principal_px;
        let across = offset.x * self.wx + offset.y * self.wy;
        match self.projection {
            Projection::Perspective => (self.origin, self.w0 + across),
            Projection::Orthographic => (self.origin + across, self.w0),
        }
    }

    /// World length of one grid unit along a ray in this grid direction.
    pub fn world_per_grid_along(&self, direction: DVec3) -> f64 {
        (self.camera_from_grid.matrix3 * direction).length() / direction.length()
    }

    /// World volume of a grid cell.
    pub fn cell_volume(&self) -> f64 {
        self.camera_from_grid.matrix3.determinant().abs()
    }

    /// Screen displacement (px) per grid unit along each grid axis, at a point given in camera space: the Jacobian of
    /// the projection, one column per axis.
    pub fn jacobian_screen_from_grid(&self, pos_in_camera: DVec3) -> [DVec2; 3] {
        let axes: DMat3 = self.camera_from_grid.matrix3;
        [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| match self.projection {
            Projection::Perspective => {
                let on_plane = pos_in_camera.truncate() / pos_in_camera.z;
                self.focal * (axis.truncate() - on_plane * axis.z) / pos_in_camera.z
            }
            Projection::Orthographic => self.focal * axis.truncate(),
        })
    }

    /// Sum over the grid axes of the outer product of their Jacobian columns (xx, xy, yy), px^2: the screen
    /// covariance of a kernel of unit variance, and the square of the spacing that selection looks at.
    pub fn gram_px2(&self, pos_in_camera: DVec3) -> [f64; 3] {
        let columns = self.jacobian_screen_from_grid(pos_in_camera);
        columns.iter().fold([0.0; 3], |g, j| {
            [g[0] + j.x * j.x, g[1] + j.x * j.y, g[2] + j.y * j.y]
        })
    }
}

/// The larger eigenvalue of a symmetric 2x2 matrix (xx, xy, yy).
pub fn largest_eigenvalue(m: [f64; 3]) -> f64 {
    0.5 * (m[0] + m[2]) + (0.25 * (m[0] - m[2]).powi(2) + m[1] * m[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::LookAt;

    #[test]
    fn rays_agree_with_the_camera_through_any_affine_grid() {
        let pose = LookAt {
            position: DVec3::new(9.0, 4.0, -7.0),
            target: DVec3::ONE,
            up: DVec3::Y,
        };
        let grid = DAffine3::from_mat3_translation(
            DMat3::from_cols(
                DVec3::new(2.0, 0.1, 0.0),
                DVec3::new(0.3, 1.0, -0.2),
                DVec3::new(0.0, 0.4, 0.5),
            ),
            DVec3::new(-1.0, 2.0, 3.0),
        );
        for camera in [
            Camera::perspective(&pose, 0.9, [320, 240]).expect("valid"),
            Camera::orthographic(&pose, 12.0, [320, 240]).expect("valid"),
        ] {
            let view = GridView::new(&camera, &grid);
            let pixel = DVec2::new(17.5, 200.25);
            let (origin, direction) = view.ray(pixel);
            let in_camera = view
                .camera_from_grid
                .transform_point3(origin + 6.5 * direction);
            let (expected_origin, expected_direction) = camera.ray_in_camera(pixel);
            let expected = expected_origin + 6.5 * expected_direction;
            assert!(
                (in_camera - expected).length() < 1e-9,
                "{in_camera} against {expected}"
            );
        }
    }

    #[test]
    fn jacobian_is_the_derivative_of_the_projection() {
        let pose = LookAt {
            position: DVec3::new(3.0, 4.0, -7.0),
            target: DVec3::ONE,
            up: DVec3::Y,
        };
        let camera = Camera::perspective(&pose, 0.9, [320, 240]).expect("valid");
        let grid = DAffine3::from_scale(DVec3::new(1.0, 2.0, 0.5));
        let view = GridView::new(&camera, &grid);
        let at = DVec3::new(0.7, 0.2, 1.3);
        let screen =
            |p: DVec3| camera.screen_from_camera(view.camera_from_grid.transform_point3(p));
        let jacobian = view.jacobian_screen_from_grid(view.camera_from_grid.transform_point3(at));
        for (axis, column) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(jacobian) {
            let numeric = (screen(at + 1e-5 * axis) - screen(at - 1e-5 * axis)) / 2e-5;
            assert!(
                (numeric - column).length() < 1e-5 * column.length(),
                "{numeric} against {column}"
            );
        }
    }
}
