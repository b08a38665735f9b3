//! The rays of a tile, and an isosurface's settings.

use glam::DVec2;
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use crate::slabs::settings::Anchor;
use crate::slabs::view::TileView;

/// The settings of an isosurface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IsoSettings {
    pub(crate) value: f32,
    /// Linear.
    pub(crate) rgb: [f32; 3],
    /// Of the surface, 0..=1.
    pub(crate) opacity: f32,
    /// Longest step along camera z.
    pub(crate) step: f32,
}

/// The rays of a tile's pixels in the grid, relative to the anchor; their parameter is camera z relative to the anchor's.
#[derive(Clone, Debug)]
pub(crate) struct AnchoredRays {
    /// Of the near plane.
    pub(crate) near: f32,
    pub(crate) start: [TilePlane; 3],
    pub(crate) direction: [TilePlane; 3],
}

impl AnchoredRays {
    /// The rays of a tile.
    pub(crate) fn new(tile: &TileView, anchor: &Anchor) -> Self {
        let (view, corner_px) = (tile.camera(), tile.corner);
        let zero = [[[0.0; TILE_PX]; TILE_PX]; 3];
        let mut rays = Self {
            near: (view.near - anchor.camera_z) as f32,
            start: zero,
            direction: zero,
        };
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let (origin, direction) =
                    view.ray(corner_px + DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
                let start = origin - anchor.grid + anchor.camera_z * direction;
                for axis in 0..3 {
                    rays.start[axis][y][x] = start[axis] as f32;
                    rays.direction[axis][y][x] = direction[axis] as f32;
                }
            }
        }
        rays
    }
}
