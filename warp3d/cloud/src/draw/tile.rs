//! One tile, with an apron: visibility, then the blend, then coverage.
//!
//! Takes the discs of a tile, nearest first, returns colour and depth of its pixels. The front is, at each pixel, the least depth of
//! a disc there plus the disc's tolerance; a disc before it belongs to the visible surface, and all that do are blended. Discs behind
//! the whole front are not even projected. A pixel whose neighbours are all covered is opaque. Else subpixels, of it and of its
//! neighbours, say whether a disc covers them, and the pixel's Gaussian sums them.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;
use resample_core::narrow::single;
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::sort::{entry_index, entry_key, sort_by_depth};
use resample_core::tile::MAX_CHUNK_LEN;

use crate::draw::blend::{Blended, Block, blended, mean_normals};
use crate::draw::choice::Fetched;
use crate::draw::listed::Listed;
use crate::draw::project::{Gathered, project};
use crate::draw::sizes::{APRON_PX, BLOCK_PX, TILE_PX};
use crate::draw::splat::Splat;
use crate::draw::view::View;
use crate::lanes::{LANES, Lanes};
use crate::options::CloudLayer;

/// Side of the tile with its apron, px.
const SIDE: usize = TILE_PX + 2 * APRON_PX;

/// Columns of a row of the front.
const STRIDE: usize = SIDE + PATCH_PX;

/// Pixels of a tile.
const TILE_AREA: usize = TILE_PX * TILE_PX;

/// Blocks of a tile.
const BLOCKS: usize = TILE_AREA / LANES;

/// Most subpixels of a pixel along one axis: a mask has 64 bits. With 4, an edge along an axis is known to 1/8 px, its coverage to
/// that times the greatest density of the pixel's Gaussian, 0.8 per px: 0.1.
const MOST_SUB: usize = 8;

/// Groups that are fetched between two looks for the farthest front.
const BATCH: usize = 6;

/// Rows and columns of pixels that are taken at once where a disc is put on the front.
const PATCH_PX: usize = 4;

/// The pixels of a patch, from the middle of its first.
const PATCH: [Lanes; 2] = {
    let mut places = [[0.0; LANES]; 2];
    let mut lane = 0;
    while lane < LANES {
        places[0][lane] = (lane % PATCH_PX) as f32;
        places[1][lane] = (lane / PATCH_PX) as f32;
        lane += 1;
    }
    places
};

/// A value of each pixel of the tile with its apron; patches may reach past its ends.
type Plane = [[f32; STRIDE]; SIDE + PATCH_PX];

/// The buffers of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileScratch {
    entries: Vec<u64>,
    sorted: Vec<u64>,
    fetched: [Fetched; BATCH],
    gathered: Gathered,
    splats: Vec<Splat>,
    of_block: [Vec<u32>; BLOCKS],
    /// The farthest depth of the visible surface; infinite where no disc is.
    front: Plane,
    /// Covered subpixels.
    masks: [[u64; SIDE]; SIDE],
    alpha: [f32; TILE_AREA],
    /// Subpixels of a pixel along one axis.
    sub: usize,
    /// Places of the subpixels from the pixel's centre along x and y, px, in fours of vectors.
    places: [[Lanes; MOST_SUB * MOST_SUB / LANES]; 2],
    /// Weights of the subpixels of three pixels along one axis.
    kernel: [f32; 3 * MOST_SUB],
    pixels: Vec<Pixel>,
    normals: Vec<[f32; 3]>,
}

/// The picture of a tile, pixel by pixel in rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown<'a> {
    pub(crate) pixels: &'a [Pixel],
    /// World normals towards the eye, times coverage; empty where they are not asked for.
    pub(crate) normals: &'a [[f32; 3]],
}

/// Where a tile lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TilePlace {
    /// First pixel column and row.
    pub(crate) first: [usize; 2],
    /// Columns and rows in the picture.
    pub(crate) size: [usize; 2],
    /// First and end, along each axis, of the places of the tile with its apron that lie in the picture.
    inside: [[usize; 2]; 2],
}

/// A drawn pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pixel {
    /// Linear premultiplied colour and alpha.
    pub(crate) rgba: [f32; 4],
    /// Camera z; infinite where nothing is.
    pub(crate) depth: f32,
}

/// A pixel in which nothing is seen.
pub(crate) const EMPTY: Pixel = Pixel {
    rgba: [0.0; 4],
    depth: f32::INFINITY,
};

impl TilePlace {
    /// The tile in this column and row of tiles of a picture.
    pub(crate) fn new(tile: [usize; 2], picture: [usize; 2]) -> Self {
        let first = tile.map(|place| place * TILE_PX);
        let inside = |axis: usize| {
            let before = APRON_PX.min(first[axis]);
            let left = picture[axis] - first[axis];
            [APRON_PX - before, APRON_PX + left.min(TILE_PX + APRON_PX)]
        };
        Self {
            first,
            size: [0, 1].map(|axis: usize| (picture[axis] - first[axis]).min(TILE_PX)),
            inside: [inside(0), inside(1)],
        }
    }
}

impl TileScratch {
    /// Buffers for so many subpixels along one axis of a pixel, at most 8.
    pub(crate) fn new(sub: usize) -> Self {
        let middle = 0.5 * (3 * sub) as f64 - 0.5;
        let weight = |i: usize| {
            let d = (i as f64 - middle) / (sub as f64 * PIXEL_SIGMA_PX);
            (-0.5 * d * d).exp()
        };
        let sum: f64 = (0..3 * sub).map(weight).sum();
        let place = |i: usize| (i as f32 + 0.5) / sub as f32 - 0.5;
        let lanes = |of: &dyn Fn(usize) -> usize| {
            std::array::from_fn(|group| std::array::from_fn(|lane| place(of(LANES * group + lane))))
        };
        Self {
            entries: Vec::new(),
            sorted: Vec::new(),
            fetched: std::array::from_fn(|_| Fetched::new()),
            gathered: Gathered::new(),
            splats: Vec::new(),
            of_block: std::array::from_fn(|_| Vec::new()),
            front: [[f32::INFINITY; STRIDE]; SIDE + PATCH_PX],
            masks: [[0; SIDE]; SIDE],
            alpha: [1.0; TILE_AREA],
            sub,
            places: [lanes(&|i| i % sub), lanes(&|i| i / sub)],
            kernel: std::array::from_fn(|i| single(weight(i) / sum)),
            pixels: Vec::new(),
            normals: Vec::new(),
        }
    }

    /// Fetches the next groups that are not farther than `far`; fewer than [`BATCH`] where there are no more. They lie far apart in
    /// memory, and are waited for together.
    fn fetch(
        &mut self,
        view: &View,
        listed: &Listed,
        entries: &mut std::slice::Iter<u64>,
        far: f32,
    ) -> usize {
        let mut near = entries.filter(|entry| f32::from_bits(entry_key(**entry)) <= far);
        for (count, to) in self.fetched.iter_mut().enumerate() {
            let Some(&entry) = near.next() else {
                return count;
            };
            let index = entry_index(entry) as usize;
            let number = listed.chunks[index / MAX_CHUNK_LEN].primitives[index % MAX_CHUNK_LEN];
            to.fill(view, &view.groups.groups[number as usize]);
        }
        BATCH
    }

    /// Where subpixels matter: within two pixels of an uncovered one. `None` where every pixel is covered.
    fn rims(&mut self, place: &TilePlace) -> Option<[[bool; SIDE]; SIDE]> {
        let mut needed = [[false; SIDE]; SIDE];
        let mut any = false;
        let [[left, right], [top, bottom]] = place.inside;
        for y in top..bottom {
            for x in left..right {
                if self.front[y][x] < f32::INFINITY {
                    continue;
                }
                any = true;
                let columns = x.saturating_sub(2)..(x + 3).min(SIDE);
                for row in &mut needed[y.saturating_sub(2)..(y + 3).min(SIDE)] {
                    row[columns.clone()].fill(true);
                }
            }
        }
        any.then_some(needed)
    }

    /// Gives an uncovered pixel, which may be covered in part, the least front of its neighbours.
    fn widen_front(&mut self) {
        let narrow = self.front;
        for y in 1..SIDE - 1 {
            for x in 1..SIDE - 1 {
                if narrow[y][x] < f32::INFINITY {
                    continue;
                }
                let near = narrow[y - 1..y + 2]
                    .iter()
                    .flat_map(|row| &row[x - 1..x + 2]);
                self.front[y][x] = near.fold(f32::INFINITY, |a, &b| a.min(b));
            }
        }
    }

    /// The part of each pixel's Gaussian that is covered.
    fn find_alpha(&mut self, place: &TilePlace) {
        for y in 0..place.size[1] {
            for x in 0..place.size[0] {
                self.alpha[y * TILE_PX + x] = self.alpha(place, x, y);
            }
        }
    }

    /// The part of the pixel's Gaussian that is covered; the picture goes on past its border as it is there.
    fn alpha(&self, place: &TilePlace, x: usize, y: usize) -> f32 {
        let [[left, right], [top, bottom]] = place.inside;
        let (mut alpha, side) = (0.0, self.sub);
        let near = self.masks[y..y + 3].iter().flat_map(|row| &row[x..x + 3]);
        let whole = u64::MAX >> (64 - side * side);
        if near.fold(whole, |all, mask| all & mask) == whole {
            return 1.0;
        }
        for row in 0..3 * side {
            let line = &self.masks[(y + row / side).clamp(top, bottom - 1)];
            let mut sum = 0.0;
            for block in 0..3 {
                let mask = line[(x + block).clamp(left, right - 1)] >> (row % side * side);
                for sub in 0..side {
                    let is_covered = mask >> sub & 1 == 1;
                    sum += if is_covered {
                        self.kernel[block * side + sub]
                    } else {
                        0.0
                    };
                }
            }
            alpha += self.kernel[row] * sum;
        }
        // The weights sum to 1 up to rounding.
        if alpha > 1.0 - 1e-5 { 1.0 } else { alpha }
    }

    /// Lists the splats by the blocks where they may lie before the front.
    fn list_by_block(&mut self, blocks: &[Block; BLOCKS]) {
        let far = blocks.map(|block| block.front.iter().fold(0.0, |a: f32, &b| a.max(b)));
        self.of_block.iter_mut().for_each(Vec::clear);
        for (splat, number) in self.splats.iter().zip(0..) {
            let mut left = splat.blocks;
            while left != 0 {
                let block = left.trailing_zeros() as usize;
                left &= left - 1;
                if splat.depths[0] <= far[block] {
                    self.of_block[block].push(number);
                }
            }
        }
    }

    /// The blocks with the front at their pixels.
    fn blocks(&self) -> [Block; BLOCKS] {
        std::array::from_fn(|block| {
            let pixel = |lane: usize| pixel_of(block, lane);
            Block {
                x: std::array::from_fn(|lane| pixel(lane)[0] as f32 + 0.5),
                y: std::array::from_fn(|lane| pixel(lane)[1] as f32 + 0.5),
                front: std::array::from_fn(|lane| {
                    let [x, y] = pixel(lane);
                    self.front[y + APRON_PX][x + APRON_PX]
                }),
            }
        })
    }

    fn put(&mut self, block: usize, blended: &Blended) {
        for lane in 0..LANES {
            let [x, y] = pixel_of(block, lane);
            let alpha = self.alpha[y * TILE_PX + x];
            let depth = blended.depth[lane];
            if alpha > 0.0 && depth < f32::INFINITY {
                let [r, g, b] = blended.rgb;
                self.pixels[y * TILE_PX + x] = Pixel {
                    rgba: [alpha * r[lane], alpha * g[lane], alpha * b[lane], alpha],
                    depth,
                };
            }
        }
    }
}

impl TileScratch {
    /// The normals of the surface that the pixels show.
    #[simd]
    fn find_normals<S: Simd>(
        &mut self,
        simd: S,
        view: &View,
        place: &TilePlace,
        blocks: &[Block; BLOCKS],
    ) {
        self.normals.resize(TILE_AREA, [0.0; 3]);
        for (number, block) in blocks.iter().enumerate() {
            let touching = self.of_block[number].iter().map(|&number| {
                let splat = self.splats[number as usize];
                (splat, view.normal_of(&splat, place.first).to_array())
            });
            let [x, y, z] = mean_normals(simd, block, touching);
            for lane in 0..LANES {
                let [column, row] = pixel_of(number, lane);
                let at = row * TILE_PX + column;
                let normal = Vec3::new(x[lane], y[lane], z[lane]).normalize_or_zero();
                let seen = self.pixels[at].rgba[3];
                self.normals[at] = (view.in_world(normal) * seen).to_array();
            }
        }
    }
}

/// Column and row of a block's pixel in the tile.
fn pixel_of(block: usize, lane: usize) -> [usize; 2] {
    let across = TILE_PX / BLOCK_PX;
    [
        block % across * BLOCK_PX + lane % BLOCK_PX,
        block / across * BLOCK_PX + lane / BLOCK_PX,
    ]
}

/// Draws a tile, pixel by pixel in rows; `None` where no disc may be.
#[simd]
pub(crate) fn draw_tile<'a, S: Simd>(
    simd: S,
    view: &View,
    listed: &Listed,
    tile: [u16; 2],
    scratch: &'a mut TileScratch,
) -> Option<Shown<'a>> {
    scratch.entries.clear();
    for chunk in &listed.chunks {
        scratch
            .entries
            .extend_from_slice(chunk.tile(tile[0], tile[1]));
    }
    if scratch.entries.is_empty() {
        return None;
    }
    sort_by_depth(&mut scratch.entries, &mut scratch.sorted);
    let place = TilePlace::new(tile.map(usize::from), view.size);
    scratch.front = [[f32::INFINITY; STRIDE]; SIDE + PATCH_PX];
    scratch.splats.clear();
    find_front(simd, view, listed, &place, scratch);
    let needed = scratch.rims(&place);
    scratch.alpha.fill(1.0);
    if let Some(needed) = &needed {
        scratch.widen_front();
        cover(simd, &place, needed, scratch);
        scratch.find_alpha(&place);
    }
    let blocks = scratch.blocks();
    scratch.list_by_block(&blocks);
    scratch.pixels.clear();
    scratch.pixels.resize(TILE_AREA, EMPTY);
    let blend = view.options.blend;
    for (number, block) in blocks.iter().enumerate() {
        let touching = &scratch.of_block[number];
        if !touching.is_empty() {
            let blended = blended(simd, block, blend, &scratch.splats, touching);
            scratch.put(number, &blended);
        }
    }
    scratch.normals.clear();
    if view.options.layers.contains(&CloudLayer::Normal) {
        scratch.find_normals(simd, view, &place, &blocks);
    }
    Some(Shown {
        pixels: &scratch.pixels,
        normals: &scratch.normals,
    })
}

/// Projects the discs that are not hidden by those before them, and finds the front.
#[simd]
fn find_front<S: Simd>(
    simd: S,
    view: &View,
    listed: &Listed,
    place: &TilePlace,
    scratch: &mut TileScratch,
) {
    let mut far = f32::INFINITY;
    let mut known = 0;
    let entries = std::mem::take(&mut scratch.entries);
    let mut rest = entries.iter();
    scratch.gathered.clear();
    loop {
        let groups = scratch.fetch(view, listed, &mut rest, far);
        for group in &scratch.fetched[..groups] {
            let chosen = group.chosen(simd, view, place.first, far);
            let mut needed = chosen.needed;
            while needed != 0 {
                let lane = needed.trailing_zeros() as usize % LANES;
                needed &= needed - 1;
                let [x, y, z] = &chosen.place;
                let at = [x[lane], y[lane], z[lane]];
                scratch.gathered.push(&group.discs()[lane], at);
                if scratch.gathered.is_full() {
                    let to = &mut scratch.splats;
                    project(simd, view, (place.first, far), &scratch.gathered, to);
                    scratch.gathered.clear();
                }
            }
        }
        let is_last = groups < BATCH;
        if is_last && !scratch.gathered.is_empty() {
            let to = &mut scratch.splats;
            project(simd, view, (place.first, far), &scratch.gathered, to);
        }
        lower_front(simd, &scratch.splats[known..], &mut scratch.front);
        if is_last {
            break;
        }
        far = farthest(place, &scratch.front);
        known = scratch.splats.len();
    }
    scratch.entries = entries;
}

/// The farthest front of the pixels in the picture.
fn farthest(place: &TilePlace, front: &Plane) -> f32 {
    let [[left, right], [top, bottom]] = place.inside;
    let mut far = 0f32;
    for row in &front[top..bottom] {
        let most = row[left..right]
            .iter()
            .fold(0.0, |a: f32, &b| if b > a { b } else { a });
        if most == f32::INFINITY {
            return most;
        }
        far = far.max(most);
    }
    far
}

/// Lowers the front to where discs are, at the pixels whose centres they cover.
#[simd]
fn lower_front<S: Simd>(simd: S, splats: &[Splat], front: &mut Plane) {
    let patch = [
        f32x16::from_slice(simd, &PATCH[0]),
        f32x16::from_slice(simd, &PATCH[1]),
    ];
    for disc in splats {
        let [x0, y0, x1, y1] = disc.disc_box;
        let [x0, y0, x1, y1] = [x0 as usize, y0 as usize, x1 as usize, y1 as usize];
        let offset = |first: usize, axis: usize| {
            patch[axis] + (first as f32 + (0.5 - APRON_PX as f32) - disc.at[axis])
        };
        for y in (y0..y1).step_by(PATCH_PX) {
            for x in (x0..x1).step_by(PATCH_PX) {
                let (dx, dy) = (offset(x, 0), offset(y, 1));
                let met = disc.met(simd, [dx, dy]);
                let covers = disc.covers(simd, &met, [dx, dy]);
                let new = covers.select(met.z + disc.tolerance, f32x16::splat(simd, f32::INFINITY));
                lower(simd, front, [x, y], new);
            }
        }
    }
}

/// Lowers the front in a patch.
#[inline(always)]
fn lower<S: Simd>(simd: S, front: &mut Plane, [x, y]: [usize; 2], new: f32x16<S>) {
    let rows: &mut [[f32; STRIDE]; PATCH_PX] = match front[y..].first_chunk_mut() {
        Some(rows) => rows,
        None => return,
    };
    let (top, bottom) = new.split();
    let (first, second) = top.split();
    let (third, fourth) = bottom.split();
    for (row, new) in rows.iter_mut().zip([first, second, third, fourth]) {
        let to = &mut row[x..x + PATCH_PX];
        f32x4::from_slice(simd, to).min(new).store_slice(to);
    }
}

/// Marks the subpixels that discs cover, where they are needed; elsewhere all are covered.
#[simd]
fn cover<S: Simd>(
    simd: S,
    place: &TilePlace,
    needed: &[[bool; SIDE]; SIDE],
    scratch: &mut TileScratch,
) {
    let side = scratch.sub;
    let whole = u64::MAX >> (64 - side * side);
    for (masks, needed) in scratch.masks.iter_mut().zip(needed) {
        for (mask, &needed) in masks.iter_mut().zip(needed) {
            *mask = if needed { 0 } else { u64::MAX };
        }
    }
    let [[left, right], [top, bottom]] = place.inside;
    for disc in &scratch.splats {
        // Subpixels lie up to half a pixel from their pixel's centre.
        let [x0, y0, x1, y1] = disc.disc_box.map(|edge| edge as usize);
        for y in y0.saturating_sub(1).max(top)..(y1 + 1).min(bottom) {
            for x in x0.saturating_sub(1).max(left)..(x1 + 1).min(right) {
                let mask = &mut scratch.masks[y][x];
                if *mask & whole == whole {
                    continue;
                }
                let offset = [x, y].map(|place| place as f32 + 0.5 - APRON_PX as f32);
                for group in 0..(side * side).div_ceil(LANES) {
                    let place = |axis: usize| {
                        let from_centre = f32x16::from_slice(simd, &scratch.places[axis][group]);
                        from_centre + (offset[axis] - disc.at[axis])
                    };
                    let (dx, dy) = (place(0), place(1));
                    let met = disc.met(simd, [dx, dy]);
                    let covered = disc.covers(simd, &met, [dx, dy]);
                    *mask |= covered.to_bitmask() << (LANES * group) & whole;
                }
            }
        }
    }
}
