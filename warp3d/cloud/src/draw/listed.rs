//! Groups of discs listed by the tiles of the screen that they may touch.
//!
//! Takes a view, returns chunks of the numbers of groups, each with the least depth that a disc of it may have. A ball around the
//! discs bounds both. Near the eye, where the ball reaches behind the near plane, each disc is bounded by a ball of its own.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16, u32x16};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::Projection;
use resample_core::dispatch;
use resample_core::narrow::side;
use resample_core::sort::depth_key;
use resample_core::tile::{ChunkBins, MAX_CHUNK_LEN, TileRect};

use crate::draw::bounds::Balls;
use crate::draw::groups::Group;
use crate::draw::sizes::TILE_PX;
use crate::draw::view::View;
use crate::lanes::{LANES, Lanes, loaded};

/// Groups of a view by tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Listed {
    pub(crate) chunks: Vec<ChunkBins<u32>>,
}

/// Places and sizes of discs, or of groups of them.
struct Sizes {
    offset: [Lanes; 3],
    base: [Lanes; 3],
    /// Distance of the farthest disc's middle from a group's; 0 for discs.
    reach: Lanes,
    radius: Lanes,
    spacing: Lanes,
}

/// Where discs or groups may be seen.
struct Reached {
    /// One bit each.
    seen: u64,
    /// One bit for each that reaches behind the near plane.
    near: u64,
    /// First column and row of the pixels that each may reach, and the ends.
    boxes: [[u32; LANES]; 4],
    /// The least depth of each.
    nearest: Lanes,
}

impl Sizes {
    fn new() -> Self {
        Self {
            offset: [[0.0; LANES]; 3],
            base: [[0.0; LANES]; 3],
            reach: [0.0; LANES],
            radius: [0.0; LANES],
            spacing: [0.0; LANES],
        }
    }

    #[inline(always)]
    fn fill_groups(&mut self, view: &View, groups: &[Group]) {
        for (lane, group) in groups.iter().enumerate() {
            self.put(lane, view.base(group), &group.middle);
            self.reach[lane] = group.reach;
            self.radius[lane] = group.radius;
            self.spacing[lane] = group.spacing;
        }
    }

    fn fill_discs(&mut self, view: &View, group: &Group) {
        let discs = view.groups.discs(view.discs, group);
        for (lane, disc) in discs.enumerate() {
            self.put(lane, view.base(group), &disc.position);
            self.reach[lane] = 0.0;
            self.radius[lane] = disc.radius;
            self.spacing[lane] = disc.spacing;
        }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, (from, base): ([f32; 3], [f32; 3]), at: &[f32; 3]) {
        for axis in 0..3 {
            self.offset[axis][lane] = at[axis] - from[axis];
            self.base[axis][lane] = base[axis];
        }
    }
}

impl Listed {
    /// Lists the groups; buffers are kept from frame to frame.
    pub(crate) fn fill(&mut self, view: &View) {
        let groups = &view.groups.groups;
        let chunks = groups.len().div_ceil(MAX_CHUNK_LEN);
        self.chunks.resize_with(chunks, ChunkBins::default);
        let numbered = self.chunks.par_iter_mut().enumerate();
        numbered.for_each(|(number, bins)| {
            bins.clear();
            dispatch!(view.level, simd => list(simd, view, number, bins));
            bins.bin(number);
        });
    }

    /// How many discs the listed groups have.
    pub(crate) fn discs(&self, view: &View) -> u64 {
        let numbers = self.chunks.iter().flat_map(|chunk| &chunk.primitives);
        let counts = numbers.map(|&number| u64::from(view.groups.groups[number as usize].count));
        counts.sum()
    }
}

/// Adds the groups of a chunk.
#[simd]
fn list<S: Simd>(simd: S, view: &View, chunk: usize, bins: &mut ChunkBins<u32>) {
    let all = &view.groups.groups;
    let first = chunk * MAX_CHUNK_LEN;
    let end = (first + MAX_CHUNK_LEN).min(all.len());
    let (mut sizes, mut own) = (Sizes::new(), Sizes::new());
    for (row, groups) in all[first..end].chunks(LANES).enumerate() {
        sizes.fill_groups(view, groups);
        let reached = reached(simd, view, &sizes);
        let mut found = reached.seen | reached.near;
        found &= u64::MAX >> (64 - groups.len());
        while found != 0 {
            let lane = found.trailing_zeros() as usize % LANES;
            found &= found - 1;
            let number = (first + row * LANES + lane) as u32;
            let ([x0, y0, x1, y1], nearest) = if reached.near >> lane & 1 == 0 {
                let edges = [0, 1, 2, 3].map(|edge: usize| reached.boxes[edge][lane]);
                (edges, reached.nearest[lane])
            } else {
                own.fill_discs(view, &groups[lane]);
                match together(simd, view, &own, groups[lane].count as usize) {
                    Some(found) => found,
                    None => continue,
                }
            };
            let first = |pixel: u32| side(pixel as usize / TILE_PX);
            let end = |pixel: u32| side((pixel as usize).div_ceil(TILE_PX));
            let rect = TileRect {
                x0: first(x0),
                x1: end(x1),
                y0: first(y0),
                y1: end(y1),
            };
            bins.push(number, depth_key(nearest), rect);
        }
    }
}

/// The pixels that any of these discs may reach, and their least depth; `None` where all are out of sight.
fn together<S: Simd>(simd: S, view: &View, discs: &Sizes, count: usize) -> Option<([u32; 4], f32)> {
    let reached = reached(simd, view, discs);
    let mut all: Option<([u32; 4], f32)> = None;
    for lane in (0..count).filter(|lane| reached.seen >> lane & 1 == 1) {
        let [x0, y0, x1, y1] = [0, 1, 2, 3].map(|edge: usize| reached.boxes[edge][lane]);
        let nearest = reached.nearest[lane];
        let ([a0, b0, a1, b1], least) = all.unwrap_or(([x0, y0, x1, y1], nearest));
        let edges = [x0.min(a0), y0.min(b0), x1.max(a1), y1.max(b1)];
        all = Some((edges, nearest.min(least)));
    }
    all
}

/// Where discs or groups are seen. What reaches behind the near plane counts as `near` only if it has a reach of its own.
#[simd]
fn reached<S: Simd>(simd: S, view: &View, sizes: &Sizes) -> Reached {
    let splat = |value: f32| f32x16::splat(simd, value);
    let load = |values: &Lanes| f32x16::from_slice(simd, values);
    let place = view.places(simd, &sizes.offset, &loaded(simd, &sizes.base));
    let (reach, radius) = (load(&sizes.reach), load(&sizes.radius));
    let middles = view.middles(simd, place, [0.0; 2]);
    let balls = Balls::new(simd, view, middles, [reach, radius, load(&sizes.spacing)]);
    let bounds = balls.bounds(simd, view);
    let (zero, near) = (splat(0.0), splat(view.near));
    let mut seen = (place[2] + reach).simd_gt(near);
    let behind = match view.projection {
        Projection::Perspective => reach.simd_gt(zero) & bounds.nearest.simd_le(near) & seen,
        Projection::Orthographic => mask32x16::splat(simd, false),
    };
    let mut boxes = [[0; LANES]; 4];
    for axis in 0..2 {
        let (at, reach) = (balls.middles.at[axis], bounds.reach[axis]);
        let size = splat(view.size[axis] as f32);
        let low = (at - reach - 0.5).ceil().max(zero).min(size);
        let high = ((at + reach - 0.5).floor() + 1.0).max(zero).min(size);
        seen &= high.simd_gt(low);
        low.to_int::<u32x16<S>>().store_slice(&mut boxes[axis]);
        high.to_int::<u32x16<S>>().store_slice(&mut boxes[axis + 2]);
    }
    let mut depths = [0.0; LANES];
    bounds.nearest.max(zero).store_slice(&mut depths);
    Reached {
        seen: seen.to_bitmask(),
        near: behind.to_bitmask(),
        boxes,
        nearest: depths,
    }
}
