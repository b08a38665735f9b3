//! The last stage: the tiles become a picture.

use glam::DVec2;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::tile::TILE_PX;
use resample_core::{Camera, Image};

use crate::look::options::DepthPlane;
use crate::picture::means::{Four, PixelGrid, correct};
use crate::picture::tiles::{Means, TileSlot, Values};
use crate::stats::FrameStats;

/// How tiles lie in the picture, and what their depth means.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileLayout {
    /// The camera of the picture.
    pub(crate) camera: Camera,
    /// Sub-pixels along a pixel's side that the tiles were rendered with; a tile holds its pixels' means.
    pub(crate) subpixels: u32,
    /// How pixels follow from them.
    pub(crate) means: Means,
    /// The depth of a tile.
    pub(crate) depth: TileDepth,
    /// The length in which that is counted, world units.
    pub(crate) length: f64,
}

/// The depth of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TileDepth {
    /// Distance from the eye (perspective) or camera z.
    Distance,
    /// Camera z.
    CameraZ,
}

/// Copies the tiles into a picture.
pub(crate) fn picture(
    tiles: &[TileSlot],
    layout: &TileLayout,
    depth: DepthPlane,
    stats: &mut FrameStats,
) -> Image {
    let clock = StageClock::start();
    let (width, height) = (layout.camera.width as usize, layout.camera.height as usize);
    let mut image = Image::transparent(width, height);
    let colours = |&[red, green, blue, opacity, _]: &Values| [red, green, blue, opacity];
    take(tiles, layout, colours, &mut image.rgba);
    if depth == DepthPlane::Expected {
        let length = layout.length as f32;
        let mut depths = vec![[0.0; 4]; width * height];
        let with_opacity = |&[.., opacity, depth]: &Values| [depth, 0.0, 0.0, opacity];
        take(tiles, layout, with_opacity, &mut depths);
        let plane = depths
            .iter()
            .enumerate()
            .map(|(i, &[depth, _, _, opacity])| {
                if opacity > 0.0 {
                    depth / opacity * camera_z_per_depth(layout, i % width, i / width) * length
                } else {
                    f32::INFINITY
                }
            });
        image.depth = Some(plane.collect());
    }
    stats.stages.image = clock.stop();
    image
}

/// Takes four numbers of each pixel out of the tiles; a pixel that shows nothing is left alone.
fn take(
    tiles: &[TileSlot],
    layout: &TileLayout,
    picked: impl Fn(&Values) -> Four + Sync,
    pixels: &mut [Four],
) {
    let grid = PixelGrid {
        width: layout.camera.width as usize,
        height: layout.camera.height as usize,
        subpixels: layout.subpixels as usize,
    };
    if layout.means == Means::Corrected {
        correct(tiles, grid, picked, pixels);
        return;
    }
    let side = TILE_PX / grid.subpixels;
    let columns = grid.width.div_ceil(side);
    let rows = pixels.par_chunks_mut(grid.width).enumerate();
    rows.for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            if let Some(shown) = tiles[y / side * columns + x / side].shown() {
                *pixel = picked(&shown[y % side * side + x % side].values());
            }
        }
    });
}

/// Camera z per unit of a tile's depth, at a pixel.
fn camera_z_per_depth(layout: &TileLayout, x: usize, y: usize) -> f32 {
    if layout.depth == TileDepth::CameraZ {
        return 1.0;
    }
    let (_, direction) = layout
        .camera
        .ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    (1.0 / direction.length()) as f32
}
