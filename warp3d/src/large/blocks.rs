//! Blocks of samples: the range of disparity that the pieces of each can take, and where they can lie on a screen.
//!
//! The homogeneous screen position is linear in (x, y, 1, d), so the picture of a box of positions and disparities lies
//! within the outline of its eight corners, as far as they are in front of the near plane; where it cuts the box, the
//! cuts with its edges take the place of the corners behind it.

use glam::DVec2;
use rayon::prelude::*;
use resample_core::Camera;

use super::sheet::Rect;
use crate::surfaces::gaps;
use crate::surfaces::surface::{BELOW, LIMB_RATIO, RIGHT, links};
use crate::view::warp::Warp;

/// Samples along a block's side.
pub(super) const BLOCK: usize = 64;

/// Rows and columns around samples that decide how they are linked: a link looks two samples to either side, at samples
/// that may have been continued from others.
pub(super) const HALO: usize = 3 + 2 * gaps::ROUNDS;

/// The blocks of a picture.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Blocks along x and y.
    count: [usize; 2],
    /// Samples along x and y.
    size: [usize; 2],
    /// Row by row.
    blocks: Vec<Block>,
}

/// What is known of a block.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Least and greatest disparity of its pieces; the least is above the greatest where nothing is known.
    range: [f32; 2],
    /// Its cut cells.
    cuts: u32,
    /// Its samples with a depth.
    known: u32,
}

/// Where the blocks lie on a screen: least and greatest x and y, px; empty where nothing is before the near plane.
pub(super) struct OnScreen<'a> {
    blocks: &'a Blocks,
    boxes: Vec<[[f32; 2]; 2]>,
}

/// Nowhere on a screen.
const NOWHERE: [[f32; 2]; 2] = [[f32::INFINITY, f32::NEG_INFINITY]; 2];

/// Anywhere on a screen.
const ANYWHERE: [[f32; 2]; 2] = [[f32::NEG_INFINITY, f32::INFINITY]; 2];

impl Blocks {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self {
            count: size.map(|n| n.div_ceil(BLOCK)),
            size,
            blocks: Vec::new(),
        }
    }

    /// Adds a row of blocks. `disparity` has some rows more above (`above`) and below, as far as there are any.
    pub(super) fn push_row(&mut self, disparity: &[f32], tolerance: f32, above: usize) {
        let width = self.size[0];
        let rows = disparity.len() / width;
        let mut disparity = disparity.to_vec();
        gaps::bridge(&mut disparity, [width, rows], tolerance);
        let links = links(&disparity, [width, rows], tolerance);
        let slab = Slab {
            disparity: &disparity,
            links: &links,
            width,
            rows,
        };
        let block = |column: usize| slab.block([column * BLOCK, above]);
        self.blocks
            .par_extend((0..self.count[0]).into_par_iter().map(block));
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Cut cells of the blocks that a part touches.
    pub(super) fn cuts_in(&self, part: &Rect) -> u64 {
        let range =
            |i: usize| part.first[i] / BLOCK..(part.first[i] + part.size[i]).div_ceil(BLOCK);
        let rows = range(1).flat_map(|y| range(0).map(move |x| y * self.count[0] + x));
        rows.map(|block| u64::from(self.blocks[block].cuts)).sum()
    }

    /// Where each block can lie on the screen of `target`, `reach_px` around it.
    pub(super) fn on_screen(
        &self,
        reference: &Camera,
        target: &Camera,
        reach_px: f32,
    ) -> OnScreen<'_> {
        let (warp, near) = (Warp::new(reference, target), target.near);
        let of_block = |(index, block): (usize, &Block)| {
            let [low, high] = block.range;
            if low > high {
                return NOWHERE;
            }
            // A piece reaches up to a sample beyond those of its block.
            let side = |block: usize| {
                let first = (block * BLOCK) as f64;
                [first - 0.5, first + BLOCK as f64 + 1.5]
            };
            let [x, y] = [side(index % self.count[0]), side(index / self.count[0])];
            let [[left, right], [top, bottom]] =
                outline(&warp, near, [x, y, [f64::from(low), f64::from(high)]]);
            [
                [left - reach_px, right + reach_px],
                [top - reach_px, bottom + reach_px],
            ]
        };
        OnScreen {
            blocks: self,
            boxes: self.blocks.par_iter().enumerate().map(of_block).collect(),
        }
    }
}

impl OnScreen<'_> {
    /// Samples with a depth in blocks that cannot show in a picture of this size.
    pub(super) fn outside(&self, size: [u32; 2]) -> u64 {
        let ends = size.map(|side| [0.0, side as f32]);
        let blocks = self.blocks.blocks.iter().zip(&self.boxes);
        blocks
            .filter(|(_, place)| !touches(place, ends))
            .map(|(block, _)| u64::from(block.known))
            .sum()
    }

    /// The smallest part of the reference with all samples that may show in a window (first and end column and row),
    /// with `margin` samples around it; `None` without one.
    pub(super) fn seen_in(&self, window: [[u32; 2]; 2], margin: usize) -> Option<Rect> {
        let [across, _] = self.blocks.count;
        let ends = window.map(|range| range.map(|v| v as f32));
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for (index, _) in self
            .boxes
            .iter()
            .enumerate()
            .filter(|(_, place)| touches(place, ends))
        {
            for (i, block) in [index % across, index / across].into_iter().enumerate() {
                (low[i], high[i]) = (low[i].min(block), high[i].max(block));
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let first = [0, 1].map(|i| (low[i] * BLOCK).saturating_sub(margin));
        let end = [0, 1].map(|i| ((high[i] + 1) * BLOCK + margin).min(self.blocks.size[i]));
        Some(Rect {
            first,
            size: [end[0] - first[0], end[1] - first[1]],
        })
    }
}

/// Whether two boxes on the screen touch.
fn touches(place: &[[f32; 2]; 2], other: [[f32; 2]; 2]) -> bool {
    (0..2).all(|i| place[i][0] <= other[i][1] && place[i][1] >= other[i][0])
}

/// Some rows of samples and how they are linked.
struct Slab<'a> {
    disparity: &'a [f32],
    links: &'a [u8],
    width: usize,
    rows: usize,
}

impl Slab<'_> {
    /// The block whose first sample is this one.
    fn block(&self, [left, top]: [usize; 2]) -> Block {
        let mut block = Block {
            range: [f32::INFINITY, f32::NEG_INFINITY],
            cuts: 0,
            known: 0,
        };
        // The cells of a block end at the first samples of the next ones.
        for y in top..(top + BLOCK + 1).min(self.rows) {
            for x in left..(left + BLOCK + 1).min(self.width) {
                let Some([low, high]) = self.pieces(x, y) else {
                    continue;
                };
                block.range = [block.range[0].min(low), block.range[1].max(high)];
                if x < left + BLOCK && y < top + BLOCK {
                    block.known += 1;
                    block.cuts += u32::from(self.is_cut(x, y));
                }
            }
        }
        block
    }

    /// The disparities that the pieces of a sample can take: its own, and those of its tangent plane up to a sample
    /// away along each axis. A slope is at most the larger step to a linked neighbour, grown as at a limb; a tangent
    /// plane stays above a quarter of its sample's disparity (`raster::quarters`).
    fn pieces(&self, x: usize, y: usize) -> Option<[f32; 2]> {
        let index = y * self.width + x;
        let here = self.disparity[index];
        if here.is_nan() {
            return None;
        }
        let mut reach = 0.0;
        for (bit, step, place) in [(RIGHT, 1, x), (BELOW, self.width, y)] {
            let jump = |from: usize, to: usize| (self.disparity[to] - self.disparity[from]).abs();
            let after = if self.links[index] & bit != 0 {
                jump(index, index + step)
            } else {
                0.0
            };
            let linked = place > 0 && self.links[index - step] & bit != 0;
            let before = if linked {
                jump(index - step, index)
            } else {
                0.0
            };
            reach += LIMB_RATIO * after.max(before);
        }
        Some([(here - reach).max(0.25 * here), here + reach])
    }

    /// Whether fewer than three links go around the cell to the right and below.
    fn is_cut(&self, x: usize, y: usize) -> bool {
        if x + 1 >= self.width || y + 1 >= self.rows {
            return true;
        }
        let at = y * self.width + x;
        let linked = |index: usize, bit: u8| u32::from(self.links[index] & bit != 0);
        let around = linked(at, RIGHT)
            + linked(at, BELOW)
            + linked(at + 1, BELOW)
            + linked(at + self.width, RIGHT);
        around < 3
    }
}

/// Least and greatest screen x and y of a box of positions and disparities.
fn outline(warp: &Warp, near: f64, sides: [[f64; 2]; 3]) -> [[f32; 2]; 2] {
    let corner = |i: usize| [sides[0][i & 1], sides[1][i >> 1 & 1], sides[2][i >> 2 & 1]];
    let (depth, divisor) = warp.depth_terms();
    // Numerator of depth less near times its divisor: at least 0 in front of the near plane.
    let in_front = |[x, y, d]: [f64; 3]| {
        depth[0] * x + depth[1] * y + depth[2] + depth[3] * d - near * (divisor[0] + divisor[1] * d)
    };
    let mut found = NOWHERE;
    let mut include = |[x, y, d]: [f64; 3]| {
        let at = warp.at(DVec2::new(x, y), d).pos_in_screen();
        if !at.is_finite() {
            found = ANYWHERE;
        }
        for (range, v) in found.iter_mut().zip([at.x as f32, at.y as f32]) {
            *range = [range[0].min(v), range[1].max(v)];
        }
    };
    for i in 0..8 {
        let (here, front) = (corner(i), in_front(corner(i)));
        if front >= 0.0 {
            include(here);
        }
        for axis in 0..3 {
            let other = corner(i | 1 << axis);
            let beyond = in_front(other);
            if i >> axis & 1 == 0 && (front >= 0.0) != (beyond >= 0.0) {
                let t = front / (front - beyond);
                include([0, 1, 2].map(|k| here[k] + t * (other[k] - here[k])));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, DVec3};
    use resample_core::Projection;

    use super::*;

    fn camera(projection: Projection, camera_from_world: DAffine3) -> Camera {
        Camera {
            projection,
            width: 300,
            height: 200,
            fx: 250.0,
            fy: 240.0,
            cx: 151.0,
            cy: 99.0,
            camera_from_world,
            near: 0.5,
        }
    }

    /// Points of a box, projected one by one, lie in its outline; also where the near plane cuts it.
    #[test]
    fn an_outline_holds_every_point_in_front() {
        let turned = |x: f64, y: f64| DMat3::from_rotation_x(x) * DMat3::from_rotation_y(y);
        let poses = [
            DAffine3::IDENTITY,
            DAffine3::from_translation(DVec3::new(0.3, -0.2, -2.0)),
            DAffine3 {
                matrix3: turned(0.4, -0.8),
                translation: DVec3::new(0.5, 0.1, -1.0),
            },
            DAffine3 {
                matrix3: turned(0.1, 2.9),
                translation: DVec3::new(0.0, 0.0, 1.5),
            },
        ];
        let (mut inside, mut cut) = (0, 0);
        for (pose, from, to) in poses.into_iter().flat_map(|pose| {
            let both = [Projection::Perspective, Projection::Orthographic];
            both.into_iter()
                .flat_map(move |from| both.map(|to| (pose, from, to)))
        }) {
            let reference = camera(from, DAffine3::IDENTITY);
            let target = camera(to, pose);
            let warp = Warp::new(&reference, &target);
            for block in 0..12 {
                let x = f64::from(block % 4) * 64.0;
                let y = f64::from(block / 4) * 64.0;
                let range = if from == Projection::Perspective {
                    [0.2, 1.9]
                } else {
                    [0.6, 5.0]
                };
                let sides = [[x, x + 64.0], [y, y + 64.0], range];
                let [columns, rows] = outline(&warp, target.near, sides);
                let mut behind = false;
                for i in 0..1000 {
                    let part = |k: usize| f64::from(i / 10i32.pow(k as u32) % 10) / 9.0;
                    let at = [0, 1, 2].map(|k| sides[k][0] + part(k) * (sides[k][1] - sides[k][0]));
                    let warped = warp.at(DVec2::new(at[0], at[1]), at[2]);
                    if !warp.in_front(&warped) {
                        behind = true;
                        continue;
                    }
                    inside += 1;
                    let found = warped.pos_in_screen();
                    let held = |v: f64, range: [f32; 2]| {
                        let slack = 1e-3 + 1e-6 * v.abs() as f32;
                        v as f32 >= range[0] - slack && v as f32 <= range[1] + slack
                    };
                    assert!(
                        held(found.x, columns) && held(found.y, rows),
                        "{found} in {columns:?} {rows:?}"
                    );
                }
                cut += usize::from(behind);
            }
        }
        assert!(
            inside > 10_000 && cut > 20,
            "{inside} points in front, {cut} boxes cut by the near plane"
        );
    }
}
