//! Per-pixel maps of a tile: the part of an exact footprint that only the pixel decides.
//!
//! With w the pixel's ray direction in the grid, a splat's form times 1 / (r^2 |w|^2) is its squared index, and one
//! grid unit along the ray is |v| / |w| world units long. Both are computed per tile, in f32 relative to the tile's
//! own ray, so that nothing cancels and no map of the whole picture has to be kept.

use crate::dispatch;
use crate::simd::Vectors;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DVec2, DVec3, Vec3};

use crate::camera::Projection;
use crate::camera::view::GridView;
use crate::kernels::footprint::FootprintMode;
use crate::tile::TILE_PX;

/// One plane of a tile: rows of pixels.
pub type TilePlane = [[f32; TILE_PX]; TILE_PX];

/// The maps of one tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct TileMaps {
    /// Factor of a splat's form: 1 / (r^2 |w|^2) for exact footprints, 1 otherwise.
    pub form_scale: TilePlane,
    /// Length, in units of the transfer function, of one grid unit along the pixel's ray.
    pub unit_per_grid: TilePlane,
}

/// The input of a frame's maps.
#[derive(Clone, Copy, Debug)]
pub struct MapSource {
    /// The camera in the grid.
    pub view: GridView,
    /// Kernel radius, grid units.
    pub radius: f64,
    /// World length over which the transfer function's opacity is meant.
    pub unit_in_world: f64,
    /// How footprints are evaluated: only `Exact` needs a factor of the form.
    pub mode: FootprintMode,
}

impl Default for TileMaps {
    fn default() -> Self {
        Self {
            form_scale: [[1.0; TILE_PX]; TILE_PX],
            unit_per_grid: [[1.0; TILE_PX]; TILE_PX],
        }
    }
}

impl TileMaps {
    /// Fills both maps for the tile whose first pixel is `corner_px`.
    pub fn fill(&mut self, level: Vectors, source: &MapSource, corner_px: [usize; 2]) {
        let first_centre = DVec2::new(corner_px[0] as f64 + 0.5, corner_px[1] as f64 + 0.5);
        let view = &source.view;
        let (_, in_grid) = view.ray(first_centre);
        let in_camera = view.camera_from_grid.matrix3 * in_grid;
        // In an orthographic view the direction does not change from pixel to pixel.
        let step = |v: DVec3| {
            if view.projection == Projection::Perspective {
                v.as_vec3()
            } else {
                Vec3::ZERO
            }
        };
        let rays = TileRays {
            in_grid: [in_grid.as_vec3(), step(view.wx), step(view.wy)],
            in_camera: [
                in_camera.as_vec3(),
                step(DVec3::X / view.focal.x),
                step(DVec3::Y / view.focal.y),
            ],
            form_scale: match source.mode {
                FootprintMode::Exact => Some((1.0 / (source.radius * source.radius)) as f32),
                _ => None,
            },
            units_per_world: (1.0 / source.unit_in_world) as f32,
        };
        dispatch!(level, simd => fill_rows(simd, &rays, self));
    }
}

/// Ray directions over a tile: at its first pixel, and their change per pixel along x and y.
struct TileRays {
    in_grid: [Vec3; 3],
    in_camera: [Vec3; 3],
    form_scale: Option<f32>,
    units_per_world: f32,
}

#[simd]
fn fill_rows<S: Simd>(_: S, rays: &TileRays, maps: &mut TileMaps) {
    for row in 0..TILE_PX {
        for x in 0..TILE_PX {
            let grid2 = length2_at(&rays.in_grid, x, row);
            let camera2 = length2_at(&rays.in_camera, x, row);
            maps.unit_per_grid[row][x] = (camera2 / grid2).sqrt() * rays.units_per_world;
            maps.form_scale[row][x] = rays.form_scale.map_or(1.0, |scale| scale / grid2);
        }
    }
}

#[inline(always)]
fn length2_at(directions: &[Vec3; 3], x: usize, y: usize) -> f32 {
    let (x, y) = (x as f32, y as f32);
    let [d, dx, dy] = directions;
    let at = Vec3::new(
        d.x + x * dx.x + y * dy.x,
        d.y + x * dx.y + y * dy.y,
        d.z + x * dx.z + y * dy.z,
    );
    at.x * at.x + at.y * at.y + at.z * at.z
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3};

    use super::*;
    use crate::camera::{Camera, LookAt};
    use crate::simd::SimdLevel;

    #[test]
    fn maps_are_what_the_rays_say() {
        let pose = LookAt {
            position: DVec3::new(9.0, 4.0, -7.0),
            target: DVec3::ONE,
            up: DVec3::Y,
        };
        let grid = DAffine3::from_mat3(DMat3::from_cols(
            DVec3::new(2.0, 0.1, 0.0),
            DVec3::new(0.3, 1.0, -0.2),
            DVec3::new(0.0, 0.4, 0.5),
        ));
        for camera in [
            Camera::perspective(&pose, 1.9, [320, 240]).expect("valid"),
            Camera::orthographic(&pose, 12.0, [320, 240]).expect("valid"),
        ] {
            let view = GridView::new(&camera, &grid);
            let source = MapSource {
                view,
                radius: 1.8,
                unit_in_world: 0.7,
                mode: FootprintMode::Exact,
            };
            for level in SimdLevel::ALL {
                let mut maps = TileMaps::default();
                maps.fill(level.resolve(), &source, [304, 16]);
                for (x, y) in [(0, 0), (15, 3), (7, 15)] {
                    let pixel = DVec2::new(304.5 + x as f64, 16.5 + y as f64);
                    let direction = view.ray(pixel).1;
                    let scale = 1.0 / (1.8 * 1.8 * direction.length_squared());
                    let length = view.world_per_grid_along(direction) / 0.7;
                    let (got_scale, got_length) = (maps.form_scale[y][x], maps.unit_per_grid[y][x]);
                    assert!(
                        (f64::from(got_scale) / scale - 1.0).abs() < 1e-6,
                        "{got_scale} against {scale}"
                    );
                    assert!(
                        (f64::from(got_length) / length - 1.0).abs() < 1e-6,
                        "{got_length} against {length}"
                    );
                }
            }
        }
    }
}
