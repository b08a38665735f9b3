//! How far around each triangle a texture is black: most surfaces of a mesh that glows do not.
//!
//! Takes the emissive texture of a mesh and its coordinates; gives, for each triangle, a distance within which every texel
//! is 0. A surface whose footprints stay within it is drawn as one that emits nothing, to the same bits. Texels are counted
//! in blocks, in a table of sums, so that a triangle costs a few additions.
//!
//! Limits: nothing is known of triangles beside which the picture ends or begins anew.

use glam::{DVec2, Vec3};
use rayon::prelude::*;
use resample_mesh::scene::Wrap;

use crate::prepare::mip::Pyramid;

/// Side of a block, texels: a few footprints.
const BLOCK: usize = 8;

/// Longest distance that is looked for, texels.
const FARTHEST: f64 = 4096.0;

/// Numbers of blocks that are not black, above and left of each corner of a block.
struct SummedBlocks {
    /// Blocks along u and v.
    blocks: [usize; 2],
    /// Texels along u and v.
    size: [f64; 2],
    wrap: [Wrap; 2],
    sums: Vec<u32>,
}

/// By triangle: how far around it the texture is black, texels; empty where that is nowhere.
pub(crate) fn black_around(pyramid: &Pyramid, uv: &[DVec2], triangles: &[[u32; 3]]) -> Vec<f32> {
    let sums = SummedBlocks::new(pyramid);
    let [columns, rows] = sums.blocks;
    if uv.is_empty() || sums.count([0, 0], [columns, rows]) as usize == columns * rows {
        return Vec::new();
    }
    let around = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| uv[i as usize]);
        sums.black_around(a.min(b).min(c), a.max(b).max(c))
    };
    triangles.par_iter().map(around).collect()
}

impl SummedBlocks {
    fn new(pyramid: &Pyramid) -> Self {
        let level = &pyramid.levels[0];
        let blocks = level.size.map(|count| count.div_ceil(BLOCK));
        let colours_of_row = |row: usize| {
            let mut found = vec![false; blocks[0]];
            for y in row * BLOCK..level.size[1].min((row + 1) * BLOCK) {
                for x in 0..level.size[0] {
                    let texel = level.texels.at(y * level.stride + x);
                    found[x / BLOCK] |= texel.truncate() != Vec3::ZERO;
                }
            }
            found
        };
        let found: Vec<Vec<bool>> = (0..blocks[1]).into_par_iter().map(colours_of_row).collect();
        let stride = blocks[0] + 1;
        let mut sums = vec![0; stride * (blocks[1] + 1)];
        for (row, found) in found.iter().enumerate() {
            let mut along = 0;
            for (column, &found) in found.iter().enumerate() {
                along += u32::from(found);
                sums[(row + 1) * stride + column + 1] = sums[row * stride + column + 1] + along;
            }
        }
        Self {
            blocks,
            size: level.size.map(|count| count as f64),
            wrap: pyramid.wrap,
            sums,
        }
    }

    /// Blocks that are not black, from `first` to before `end`.
    fn count(&self, first: [usize; 2], end: [usize; 2]) -> u32 {
        let at = |x: usize, y: usize| self.sums[y * (self.blocks[0] + 1) + x];
        at(end[0], end[1]) + at(first[0], first[1]) - at(end[0], first[1]) - at(first[0], end[1])
    }

    /// How far around a rectangle all texels are black; 0 where it holds others.
    fn black_around(&self, low: DVec2, high: DVec2) -> f32 {
        let mut reach = 0.0;
        let mut next = BLOCK as f64;
        while next <= FARTHEST && self.is_black(low - next, high + next) {
            reach = next as f32;
            // Of the size of footprints near by, twice as far each time beyond.
            next += if next < 64.0 { BLOCK as f64 } else { next };
        }
        reach
    }

    fn is_black(&self, low: DVec2, high: DVec2) -> bool {
        let period = DVec2::from([0, 1].map(|k| match self.wrap[k] {
            Wrap::Repeat => (low[k] / self.size[k]).floor() * self.size[k],
            Wrap::Mirror | Wrap::Clamp => 0.0,
        }));
        let (low, high) = (low - period, high - period);
        let inside = low.min_element() >= 0.0 && high.x <= self.size[0] && high.y <= self.size[1];
        if !inside {
            return false;
        }
        let block = |at: f64| at as usize / BLOCK;
        let end = [0, 1].map(|k| (block(high[k]) + 1).min(self.blocks[k]));
        self.count([block(low.x), block(low.y)], end) == 0
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::prepare::texel_use::TexelUse;
    use resample_mesh::scene::{Magnify, Texels, Texture};

    /// Black, with one bright texel.
    fn pyramid(size: [usize; 2], [x, y]: [usize; 2]) -> Pyramid {
        let mut texels = vec![[0, 0, 0, 255]; size[0] * size[1]];
        texels[y * size[0] + x] = [0, 1, 0, 255];
        let texture = Texture {
            name: String::new(),
            width: size[0],
            height: size[1],
            texels: Texels::Srgb8(Arc::new(texels)),
        };
        Pyramid::new(
            (&[texture], 0),
            TexelUse::Opaque,
            [Wrap::Repeat; 2],
            Magnify::Linear,
        )
    }

    #[test]
    fn a_triangle_is_dark_as_far_as_no_texel_shines() {
        let pyramid = pyramid([300, 200], [290, 100]);
        let corners = |u: f64, v: f64| [[u, v], [u + 4.0, v], [u, v + 4.0]].map(DVec2::from);
        let far = |u: f64, v: f64| black_around(&pyramid, &corners(u, v), &[[0, 1, 2]])[0];
        // From 100 to 104 texels: the picture ends 96 above, 96 below and the texel shines 186 to the right.
        assert_eq!(far(100.0, 98.0), 64.0);
        assert_eq!(far(250.0, 98.0), 32.0);
        assert_eq!(
            far(286.0, 98.0),
            0.0,
            "the texel is within the triangle's box"
        );
        assert_eq!(far(274.0, 98.0), 8.0);
        assert_eq!(far(0.0, 98.0), 0.0, "beyond the picture nothing is known");
        assert_eq!(far(-200.0, 298.0), 64.0, "the picture again");
    }

    #[test]
    fn nothing_is_kept_where_a_texture_shines_everywhere() {
        let bright = pyramid([5, 5], [2, 2]);
        assert!(black_around(&bright, &[DVec2::splat(2.0); 3], &[[0, 1, 2]]).is_empty());
    }
}
