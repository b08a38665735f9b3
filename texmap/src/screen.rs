//! Sizes and numbers on the screen that every stage shares: tiles with the border that the filter needs, the part of a picture that is
//! drawn, functions that are linear on the screen, and vectors of sub-pixels.

use glam::DVec3;
use resample_core::Camera;
use resample_core::tile::{TILE_PX, TileGrid};

use crate::Error;

/// A tile's width, px: a row is one vector.
pub(crate) const TILE_WIDTH: usize = TILE_PX;

/// A tile's height, px. Each tile computes its border, which neighbours compute too, so that high tiles compute less twice;
/// the storage of a tile grows with it, and is to stay in the second-level cache.
pub(crate) const TILE_HEIGHT: usize = 32;

/// A tile's sides with the border that its filter needs, px.
pub(crate) const SPAN_WIDTH: usize = TILE_WIDTH + 2 * BORDER_PX;
pub(crate) const SPAN_HEIGHT: usize = TILE_HEIGHT + 2 * BORDER_PX;

/// The tiles of a picture.
pub(crate) fn tile_grid(camera: &Camera) -> TileGrid {
    TileGrid {
        width: camera.width as usize,
        height: camera.height as usize,
        tile_height: TILE_HEIGHT,
    }
}

/// A sub-pixel that shows nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// How far the filter reaches: 4 sigma. A Gaussian cut at 3 sigma has lost 5 % of its variance over the plane, which
/// limits a picture to some 55 dB; at 4 sigma it is 0.3 %.
pub(crate) const REACH_PX: f64 = 2.0;

/// Pixels around a tile whose sub-pixels its filter needs.
pub(crate) const BORDER_PX: usize = 2;

/// Columns of pixels that a filter reaches.
pub(crate) const WINDOW_PX: usize = 2 * BORDER_PX + 1;

/// A window of a picture. Its tiles are those of the whole picture, so that its pixels are, too.
pub(crate) struct Window {
    /// Width and height, px.
    pub(crate) size: [usize; 2],
    /// Rows of the first tiles that lie above the window.
    above: usize,
    /// Column and row of the first tile.
    first: [usize; 2],
    /// Columns and rows of tiles.
    count: [usize; 2],
}

impl Window {
    /// The window of `size` pixels from column and row `first` on.
    pub(crate) fn new(
        whole: &TileGrid,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Result<Self, Error> {
        let is_inside = (0..2).all(|axis| {
            let side = [whole.width, whole.height][axis];
            first[axis].is_multiple_of(TILE_PX)
                && first[axis]
                    .checked_add(size[axis])
                    .is_some_and(|end| end <= side)
        });
        if !is_inside {
            return Err(Error::Option(format!(
                "a window of {size:?} pixels from {first:?} on is not inside of {}x{}, or begins within {TILE_PX} pixels",
                whole.width, whole.height
            )));
        }
        let above = first[1] % TILE_HEIGHT;
        Ok(Self {
            size,
            above,
            first: [first[0] / TILE_WIDTH, first[1] / TILE_HEIGHT],
            count: [
                size[0].div_ceil(TILE_WIDTH),
                (above + size[1]).div_ceil(TILE_HEIGHT),
            ],
        })
    }

    /// How many tiles it has.
    pub(crate) fn tiles(&self) -> usize {
        self.count[0] * self.count[1]
    }

    /// Column and row of a tile in the whole picture.
    pub(crate) fn tile(&self, index: usize) -> [usize; 2] {
        [
            self.first[0] + index % self.count[0],
            self.first[1] + index / self.count[0],
        ]
    }

    /// The tiles that hold row `y` of the window, of all its tiles, and which of their rows it is.
    pub(crate) fn row<'a, T>(&self, tiles: &'a [T], y: usize) -> (&'a [T], usize) {
        let y = self.above + y;
        let first = y / TILE_HEIGHT * self.count[0];
        (&tiles[first..first + self.count[0]], y % TILE_HEIGHT)
    }
}

/// A plane over the tile: value = `[0]` x + `[1]` y + `[2]`, x and y in px from the corner of the tile's border.
pub(crate) type Plane = [f32; 3];

/// A plane of the screen as one of the tile whose border's corner is at `corner_px`, in f64.
#[inline]
pub(crate) fn moved(plane: DVec3, corner_px: [f64; 2]) -> DVec3 {
    DVec3::new(
        plane.x,
        plane.y,
        plane.x * corner_px[0] + plane.y * corner_px[1] + plane.z,
    )
}

#[inline]
pub(crate) fn narrow(plane: DVec3) -> Plane {
    plane.to_array().map(|v| v as f32)
}

#[inline(always)]
pub(crate) fn value(plane: &Plane, at: [f32; 2]) -> f32 {
    plane[0] * at[0] + plane[1] * at[1] + plane[2]
}

/// Sub-pixels that are computed together.
pub(crate) const LANES: usize = 16;

/// A number for each of them.
pub(crate) type Lanes = [f32; LANES];

/// The number of each lane.
pub(crate) const IOTA: Lanes = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];
