//! Surfaces that one renderer draws and another composites inside what it draws itself.
//!
//! A surface has no thickness: one depth and one colour at each pixel. Tiles in which it is not seen take no memory.

use crate::Image;
use crate::composite::maps::TilePlane;
use crate::tile::TILE_PX;

/// A surface before a camera: at each pixel, or at each sub-pixel of a picture, the depth and the colour of what is nearest.
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
    /// A surface of so many pixels that is seen nowhere.
    ///
    /// ```
    /// use resample_core::{Image, Surface};
    ///
    /// let mut image = Image::transparent(40, 20);
    /// image.rgba[3] = [0.5, 0.0, 0.0, 1.0];
    /// image.depth = Some(vec![7.0; 800]);
    /// let mut surface = Surface::unseen([40, 20]);
    /// surface.lay(&image, 0, 1);
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

    /// Returns true if it is seen nowhere.
    pub fn is_unseen(&self) -> bool {
        self.tiles.iter().all(Option::is_none)
    }

    /// Lays pixels of a picture with depth from row `first` on: the mean of each square of `side` x `side` of them is a pixel of the
    /// surface. What lies beyond the surface is left out.
    pub fn lay(&mut self, picture: &Image, first: usize, side: usize) {
        let Some(depth) = &picture.depth else {
            return;
        };
        let side = side.max(1);
        let columns = self.width.div_ceil(TILE_PX);
        let rows = (picture.height / side).min(self.height.saturating_sub(first));
        for row in 0..rows {
            for x in 0..(picture.width / side).min(self.width) {
                let (rgba, z) = mean(picture, depth, [x * side, row * side], side);
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

    /// Lets this share of what is behind it through, beside what it lets through already: 0 for none, 1 for all.
    pub fn fade(&mut self, transmittance: f32) {
        let pixels = self.tiles.iter_mut().flatten();
        for value in pixels.flat_map(|tile| tile.rgba.as_flattened_mut().as_flattened_mut()) {
            *value *= 1.0 - transmittance;
        }
    }
}

/// The mean colour of a square of pixels, and their depth by the weight of their alpha.
fn mean(picture: &Image, depth: &[f32], [x, y]: [usize; 2], side: usize) -> ([f32; 4], f32) {
    if side == 1 {
        let at = y * picture.width + x;
        return (picture.rgba[at], depth[at]);
    }
    let (mut sum, mut sum_z) = ([0.0f32; 4], 0.0f64);
    for row in y..y + side {
        let first = row * picture.width + x;
        let pixels = picture.rgba[first..].iter().zip(&depth[first..]);
        for (rgba, z) in pixels.take(side) {
            if !(rgba[3] > 0.0 && z.is_finite()) {
                continue;
            }
            for (sum, value) in sum.iter_mut().zip(rgba) {
                *sum += value;
            }
            sum_z += f64::from(rgba[3]) * f64::from(*z);
        }
    }
    let z = sum_z / f64::from(sum[3]);
    let share = 1.0 / (side * side) as f32;
    (sum.map(|value| share * value), z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_pixels_become_their_mean() {
        let mut picture = Image::transparent(4, 2);
        picture.depth = Some(vec![f32::INFINITY; 8]);
        for (at, alpha, z) in [(0, 1.0, 2.0), (5, 0.5, 8.0)] {
            picture.rgba[at] = [alpha, 0.0, 0.5 * alpha, alpha];
            if let Some(depth) = &mut picture.depth {
                depth[at] = z;
            }
        }
        let mut surface = Surface::unseen([2, 20]);
        surface.lay(&picture, 17, 2);
        assert!(surface.tile([0, 0]).is_none());
        let tile = surface.tile([0, 1]).expect("row 17");
        assert_eq!(tile.rgba[1][0], [0.375, 0.0, 0.1875, 0.375]);
        assert_eq!(tile.depth[1][0], 4.0);
        assert_eq!(tile.depth[1][1], f32::INFINITY);
        surface.fade(0.75);
        let tile = surface.tile([0, 1]).expect("row 17");
        assert_eq!(tile.rgba[1][0], [0.09375, 0.0, 0.046875, 0.09375]);
    }

    #[test]
    fn pixels_beyond_the_surface_are_left_out() {
        let mut picture = Image::transparent(8, 4);
        picture.rgba.fill([1.0; 4]);
        picture.depth = Some(vec![1.0; 32]);
        let mut surface = Surface::unseen([5, 3]);
        surface.lay(&picture, 2, 1);
        let tile = surface.tile([0, 0]).expect("row 2");
        let seen = tile.depth.as_flattened().iter().filter(|z| z.is_finite());
        assert_eq!(seen.count(), 5);
        surface.lay(&picture, 9, 1);
        assert!(surface.tile([1, 0]).is_none() && surface.tile([0, 1]).is_none());
    }
}
