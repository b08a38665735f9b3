//! Surfaces: one renderer draws them, and another composites them in its own picture, by depth.
//!
//! A surface has no thickness: one depth and one colour at each pixel. Tiles in which it is not seen take no memory.

use crate::Image;
use crate::composite::maps::TilePlane;
use crate::tile::TILE_PX;

/// Samples along a pixel's side of a surface that one renderer draws for another, at least: the default of meshes.
pub const SAMPLES_PER_SIDE: u32 = 4;

/// Pixels of a band: 64 MiB of colour.
const BAND_PX: usize = 1 << 22;

/// A depth map with colours: each pixel, or each sub-pixel of a picture, holds the depth and the colour of the nearest surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    width: usize,
    height: usize,
    /// Row by row; `None` where nothing is seen.
    tiles: Vec<Option<Box<SurfaceTile>>>,
}

/// The part of a surface in one tile.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceTile {
    /// Camera z, world units; +infinity where nothing is seen.
    pub depth: TilePlane,
    /// Linear and premultiplied.
    pub rgba: [[[f32; 4]; TILE_PX]; TILE_PX],
}

impl Default for SurfaceTile {
    fn default() -> Self {
        Self {
            depth: [[f32::INFINITY; TILE_PX]; TILE_PX],
            rgba: [[[0.0; 4]; TILE_PX]; TILE_PX],
        }
    }
}

impl Surface {
    /// A surface of this width and height, px, that no pixel sees.
    ///
    /// ```
    /// use resample_core::{Image, Surface};
    ///
    /// let mut image = Image::transparent(40, 20);
    /// image.rgba[3] = [0.5, 0.0, 0.0, 1.0];
    /// image.depth = Some(vec![7.0; 800]);
    /// let mut surface = Surface::unseen([40, 20]);
    /// surface.lay(&image, 0);
    /// assert!(surface.tile([0, 0]).is_some_and(|tile| tile.depth[0][3] == 7.0));
    /// assert!(surface.tile([1, 0]).is_none());
    /// ```
    pub fn unseen([width, height]: [usize; 2]) -> Self {
        let tiles = width.div_ceil(TILE_PX) * height.div_ceil(TILE_PX);
        Self {
            width,
            height,
            tiles: vec![None; tiles],
        }
    }

    /// A surface of this size of which `draw` gives the picture of some rows, from the first one and how many they are: whole rows of tiles, so that memory does not
    /// grow with the picture.
    ///
    /// # Errors
    /// Those of `draw`.
    pub fn in_bands<E>(
        [width, height]: [usize; 2],
        mut draw: impl FnMut(usize, usize) -> Result<Image, E>,
    ) -> Result<Self, E> {
        let mut surface = Self::unseen([width, height]);
        let rows = (BAND_PX / width).next_multiple_of(TILE_PX).max(TILE_PX);
        for first in (0..height).step_by(rows) {
            surface.lay(&draw(first, rows.min(height - first))?, first);
        }
        Ok(surface)
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The tile of this column and row of tiles; `None` where nothing is seen in it.
    pub fn tile(&self, [column, row]: [usize; 2]) -> Option<&SurfaceTile> {
        let columns = self.width.div_ceil(TILE_PX);
        let tile = self.tiles.get(row * columns + column)?;
        tile.as_deref().filter(|_| column < columns)
    }

    /// The surfaces that are seen in a tile, front to back at each pixel: the first holds the nearest of all, and so on.
    pub fn sorted(surfaces: &[Self], tile: [usize; 2]) -> Vec<SurfaceTile> {
        let seen = surfaces.iter().filter_map(|surface| surface.tile(tile));
        let mut layers: Vec<SurfaceTile> = seen.cloned().collect();
        for end in 1..layers.len() {
            for far in (1..=end).rev() {
                let (before, after) = layers.split_at_mut(far);
                let (Some(near), Some(far)) = (before.last_mut(), after.first_mut()) else {
                    continue;
                };
                let depths = near.depth.as_flattened_mut().iter_mut();
                let depths = depths.zip(far.depth.as_flattened_mut());
                let colours = near.rgba.as_flattened_mut().iter_mut();
                let colours = colours.zip(far.rgba.as_flattened_mut());
                for ((near_z, far_z), (near, far)) in depths.zip(colours) {
                    if *far_z < *near_z {
                        std::mem::swap(near_z, far_z);
                        std::mem::swap(near, far);
                    }
                }
            }
        }
        layers
    }

    /// Lays a picture with depth from row `first` on. What lies beyond the surface is left out.
    pub fn lay(&mut self, picture: &Image, first: usize) {
        let Some(depth) = &picture.depth else {
            return;
        };
        let columns = self.width.div_ceil(TILE_PX);
        for row in 0..picture.height.min(self.height.saturating_sub(first)) {
            for x in 0..picture.width.min(self.width) {
                let at = row * picture.width + x;
                let (rgba, z) = (picture.rgba[at], depth[at]);
                if !(rgba[3] > 0.0 && z.is_finite()) {
                    continue;
                }
                let y = first + row;
                let tile = &mut self.tiles[y / TILE_PX * columns + x / TILE_PX];
                let tile = tile.get_or_insert_default();
                tile.depth[y % TILE_PX][x % TILE_PX] = z;
                tile.rgba[y % TILE_PX][x % TILE_PX] = rgba;
            }
        }
    }

    /// Multiplies colour and alpha by `1 - transmittance`; the transmittance is 0 to 1.
    pub fn fade(&mut self, transmittance: f32) {
        let pixels = self.tiles.iter_mut().flatten();
        for value in pixels.flat_map(|tile| tile.rgba.as_flattened_mut().as_flattened_mut()) {
            *value *= 1.0 - transmittance;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_lies_where_it_is_laid_and_fades() {
        let mut picture = Image::transparent(2, 2);
        picture.rgba[3] = [0.5, 0.0, 0.25, 0.5];
        picture.depth = Some(vec![3.0; 4]);
        let mut surface = Surface::unseen([2, 20]);
        surface.lay(&picture, 16);
        assert!(surface.tile([0, 0]).is_none());
        surface.fade(0.75);
        let tile = surface.tile([0, 1]).expect("row 17");
        assert_eq!(tile.rgba[1][1], [0.125, 0.0, 0.0625, 0.125]);
        assert_eq!((tile.depth[1][1], tile.depth[1][0]), (3.0, f32::INFINITY));
    }

    #[test]
    fn bands_are_the_rows_of_one_surface() {
        let width = BAND_PX / 16;
        let mut bands = Vec::new();
        let surface = Surface::in_bands([width, 24], |first, rows| {
            bands.push([first, rows]);
            let mut picture = Image::transparent(width, rows);
            picture.rgba[0] = [1.0; 4];
            picture.depth = Some(vec![first as f32; width * rows]);
            Ok::<_, ()>(picture)
        });
        let surface = surface.expect("drawn");
        let [first, second] = bands[..] else {
            panic!("two bands: {bands:?}");
        };
        assert_eq!([first[0], second[0] + second[1]], [0, 24]);
        assert_eq!(first[1] % TILE_PX, 0);
        let tile = surface.tile([0, second[0] / TILE_PX]).expect("a tile");
        assert_eq!(tile.depth[0][0], second[0] as f32);
    }

    #[test]
    fn surfaces_are_sorted_at_every_pixel() {
        let surface = |depths: [f32; 3]| {
            let mut picture = Image::transparent(3, 1);
            for (rgba, z) in picture.rgba.iter_mut().zip(depths) {
                *rgba = [z, 0.0, 0.0, if z.is_finite() { 1.0 } else { 0.0 }];
            }
            picture.depth = Some(depths.to_vec());
            let mut surface = Surface::unseen([3, 1]);
            surface.lay(&picture, 0);
            surface
        };
        let none = f32::INFINITY;
        let three = [
            surface([3.0, 1.0, none]),
            surface([1.0, 2.0, 5.0]),
            surface([2.0, none, 4.0]),
        ];
        let sorted = Surface::sorted(&three, [0, 0]);
        for (layer, depths) in
            sorted
                .iter()
                .zip([[1.0, 1.0, 4.0], [2.0, 2.0, 5.0], [3.0, none, none]])
        {
            assert_eq!(layer.depth[0][..3], depths);
            for (rgba, z) in layer.rgba[0].iter().zip(depths) {
                assert_eq!(rgba[0], if z.is_finite() { z } else { 0.0 });
            }
        }
        assert!(Surface::sorted(&three, [1, 0]).is_empty());
    }

    #[test]
    fn pixels_beyond_the_surface_are_left_out() {
        let mut picture = Image::transparent(8, 4);
        picture.rgba.fill([1.0; 4]);
        picture.depth = Some(vec![1.0; 32]);
        let mut surface = Surface::unseen([5, 3]);
        surface.lay(&picture, 2);
        let tile = surface.tile([0, 0]).expect("row 2");
        let seen = tile.depth.as_flattened().iter().filter(|z| z.is_finite());
        assert_eq!(seen.count(), 5);
        surface.lay(&picture, 9);
        assert!(surface.tile([1, 0]).is_none() && surface.tile([0, 1]).is_none());
    }
}
