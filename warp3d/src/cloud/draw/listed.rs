//! Discs listed by the tiles of the screen that they may touch.
//!
//! Takes a view, returns chunks of the numbers of discs, each with the least depth that it may have. A ball around the disc bounds
//! both: the disc itself is put on the screen tile by tile, and only where nothing nearer hides it.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::Projection;
use resample_core::dispatch;
use resample_core::narrow::{side, single};
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::sort::depth_key;
use resample_core::tile::{ChunkBins, MAX_CHUNK_LEN, TileGrid};

use crate::cloud::draw::project::{APRON_PX, LEAST_HALF_AXIS_PX, MOST_REACH_PX, REACH_SIGMAS};
use crate::cloud::draw::view::View;
use crate::cloud::lanes::{LANES, Lanes};

/// Discs of a view by tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Listed {
    pub(crate) chunks: Vec<ChunkBins<u32>>,
}

/// Places and sizes of discs.
struct Balls {
    count: usize,
    number: [u32; LANES],
    offset: [Lanes; 3],
    base: [Lanes; 3],
    radius: Lanes,
    spacing: Lanes,
}

impl Balls {
    fn new() -> Self {
        Self {
            count: 0,
            number: [0; LANES],
            offset: [[0.0; LANES]; 3],
            base: [[0.0; LANES]; 3],
            radius: [0.0; LANES],
            spacing: [0.0; LANES],
        }
    }

    #[inline(always)]
    fn fill(&mut self, view: &View, discs: &mut impl Iterator<Item = u32>) {
        self.count = 0;
        for (lane, number) in discs.take(LANES).enumerate() {
            let disc = &view.discs[number as usize];
            let (offset, base) = view.placed(number as usize, disc);
            for axis in 0..3 {
                self.offset[axis][lane] = offset[axis];
                self.base[axis][lane] = base[axis];
            }
            self.number[lane] = number;
            self.radius[lane] = disc.radius;
            self.spacing[lane] = disc.spacing;
            self.count = lane + 1;
        }
    }
}

impl Listed {
    /// Lists the discs; buffers are kept from frame to frame.
    pub(crate) fn fill(&mut self, view: &View) {
        let chunks = view.discs.len().div_ceil(MAX_CHUNK_LEN);
        self.chunks.resize_with(chunks, ChunkBins::default);
        let numbered = self.chunks.par_iter_mut().enumerate();
        numbered.for_each(|(number, bins)| {
            bins.clear();
            dispatch!(view.level, simd => list(simd, view, number, bins));
            bins.bin(number);
        });
    }
}

/// Adds the discs of a chunk.
#[simd]
fn list<S: Simd>(simd: S, view: &View, chunk: usize, bins: &mut ChunkBins<u32>) {
    let grid = TileGrid::new(view.size[0], view.size[1]);
    let first = chunk * MAX_CHUNK_LEN;
    let end = (first + MAX_CHUNK_LEN).min(view.discs.len());
    let mut numbers = (first as u32..end as u32).step_by(view.options.every as usize);
    let mut balls = Balls::new();
    loop {
        balls.fill(view, &mut numbers);
        if balls.count == 0 {
            break;
        }
        let (seen, boxes, nearest) = reached(simd, view, &balls);
        let [x0, y0, x1, y1] = boxes;
        for lane in (0..balls.count).filter(|lane| seen >> lane & 1 == 1) {
            let columns = [side(x0[lane] as usize), side(x1[lane] as usize)];
            let rows = [side(y0[lane] as usize), side(y1[lane] as usize)];
            let rect = grid.rect(columns, rows);
            bins.push(balls.number[lane], depth_key(nearest[lane]), rect);
        }
    }
}

/// One bit a disc that is seen, the pixels that each may reach (first column and row, and the ends), and the least depth.
#[simd]
fn reached<S: Simd>(simd: S, view: &View, balls: &Balls) -> (u64, [[u32; LANES]; 4], Lanes) {
    let splat = |value: f32| f32x16::splat(simd, value);
    let middles = view.middles(simd, &balls.offset, &balls.base, [0.0; 2]);
    let z = middles.place[2];
    let larger = splat(view.larger);
    let radius = f32x16::from_slice(simd, &balls.radius) * larger;
    let spacing = f32x16::from_slice(simd, &balls.spacing) * larger;
    let sigma =
        (spacing * single(view.options.sigma_spacings)).max(radius * single(1.0 / REACH_SIGMAS));
    let nearest = z - radius;
    let grown = match view.projection {
        Projection::Perspective => z / nearest.max(splat(view.near)),
        Projection::Orthographic => splat(1.0),
    };
    let most = splat(MOST_REACH_PX);
    let pixel = splat(single(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX));
    let edge = splat(LEAST_HALF_AXIS_PX * LEAST_HALF_AXIS_PX);
    let mut seen = z.simd_gt(splat(view.near));
    let mut boxes = [[0; LANES]; 4];
    for axis in 0..2 {
        let (at, ray) = (middles.at[axis], middles.ray[axis]);
        let unit = ray.mul_add(ray, splat(1.0)).sqrt() * middles.scale * view.focal[axis];
        let (blend, disc) = (sigma * unit, radius * unit);
        let blend = blend.mul_add(blend, pixel).sqrt() * grown * single(REACH_SIGMAS);
        let disc = disc.mul_add(disc, edge).sqrt() * grown;
        // A little more, for rounding; the disc's neighbouring pixels count.
        let margin = APRON_PX as f32 + 0.01;
        let reach = (blend.min(most) + margin).max(disc.min(most) + (margin + 1.0));
        let (zero, size) = (splat(0.0), splat(view.size[axis] as f32));
        let low = (at - reach - 0.5).ceil().max(zero).min(size);
        let high = ((at + reach - 0.5).floor() + 1.0).max(zero).min(size);
        seen &= high.simd_gt(low);
        low.to_int::<u32x16<S>>().store_slice(&mut boxes[axis]);
        high.to_int::<u32x16<S>>().store_slice(&mut boxes[axis + 2]);
    }
    let mut depths = [0.0; LANES];
    nearest.max(splat(0.0)).store_slice(&mut depths);
    (seen.to_bitmask(), boxes, depths)
}
