//! The last stage: the tiles become a picture.

use glam::DVec2;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::tile::TILE_PX;
use resample_core::{Camera, Image};

use crate::options::DepthPlane;
use crate::picture::tiles::{ShownPixel, TileSlot};
use crate::stats::FrameStats;

/// How tiles lie in the picture, and what their depth means.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileLayout {
    /// The camera of the picture.
    pub(crate) camera: Camera,
    /// Sub-pixels along a pixel's side that the tiles were rendered with; a tile holds its pixels' means.
    pub(crate) subpixels: u32,
    /// What a tile's depth is.
    pub(crate) depth: TileDepth,
    /// The length in which that is counted, world units.
    pub(crate) length: f64,
}

/// What a tile's depth is.
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
    let side = TILE_PX / layout.subpixels as usize;
    let columns = width.div_ceil(side);
    let pixel_at = |x: usize, y: usize| -> Option<ShownPixel> {
        Some(tiles[y / side * columns + x / side].shown()?[y % side * side + x % side])
    };
    let mut image = Image::transparent(width, height);
    image
        .rgba
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let Some(shown) = pixel_at(x, y) else {
                    continue;
                };
                let [red, green, blue] = shown.rgb;
                *pixel = [red, green, blue, 1.0 - shown.transmittance];
            }
        });
    if depth == DepthPlane::Expected {
        let length = layout.length as f32;
        let plane = (0..width * height).map(|i| {
            let (x, y) = (i % width, i / width);
            let Some(shown) = pixel_at(x, y) else {
                return f32::INFINITY;
            };
            let opacity = 1.0 - shown.transmittance;
            let depth = shown.depth / opacity;
            if opacity > 0.0 {
                depth * camera_z_per_depth(layout, x, y) * length
            } else {
                f32::INFINITY
            }
        });
        image.depth = Some(plane.collect());
    }
    stats.stages.image = clock.stop();
    image
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
