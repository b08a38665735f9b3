//! One tile of sheets, summed from kernels cut into slab sections, or from points.
//!
//! Each voxel adds what it carries, times the integral of its kernel along each pixel's ray through the slab, to every slab
//! that cuts the kernel. As voxels come sorted by the first slab that they reach, only as many slabs are open as a kernel
//! spans. A slab that nothing can reach any more is composited behind those before it: its sums are either extinction and
//! colours (pre-classified), or scalar and weight, whose quotient is classified now (post-classified), and where samples
//! are lit also the gradient. The clip and the near plane cut each ray, and with it the sections, exactly.
//!
//! The distance at which a ray passes the centre is the same for all slabs. So pixels come first and slabs after: the distance, the
//! chord and the polynomial of the share are computed once for a vector of rays, and the share up to a plane between two slabs
//! serves both of them.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::DVec2;
use resample_core::composite::{DepthRule, TileCounts, TilePixels, opacity};
use resample_core::maps::TilePlane;
use resample_core::point::PixelFilter;
use resample_core::section::{ALONG, ALONG_POLYNOMIAL, Powers, SectionProfile};
use resample_core::sort::{entry_index, entry_key};
use resample_core::tile::TILE_PX;
use resample_core::{GridView, dispatch};

use crate::look::clip::GridClip;
use crate::look::options::{Classify, Interpolate};
use crate::slabs::settings::SheetSettings;
use crate::slabs::view::{HalfRow, PlaneView, TileView};

pub(crate) const LANES: usize = 8;

/// Most values that are summed for a voxel.
const MOST_SUMS: usize = 6;

/// How many values are summed: colour and strength; scalar, weight and need; the same and a gradient.
const SUMS_PRE: usize = 4;
const SUMS_POST: usize = 3;
const SUMS_LIT: usize = MOST_SUMS;

/// A voxel as the tiles need it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KernelSample {
    /// Position in the grid, relative to the anchor.
    pub(crate) grid: [f32; 3],
    /// Camera z relative to the anchor's, world units.
    pub(crate) offset_z: f32,
    /// The summed values. Pre-classified: red, green, blue times strength, strength. Post-classified: scalar or its
    /// coefficient, 1, and 1 for a voxel that something visible depends on; then the gradient in the world.
    pub(crate) value: [f32; MOST_SUMS],
    /// The voxel's own scalar, post-classified.
    pub(crate) scalar: f32,
    /// Section: camera x and y, world units. Point: screen position, px.
    pub(crate) across: [f32; 2],
    /// Point: its weight summed over the screen, opacity units times px^2. 0 marks a section.
    pub(crate) mass: f32,
}

/// Settings shared by every tile of a frame, beside the settings of all sheets.
#[derive(Clone, Debug)]
pub(crate) struct KernelSettings {
    /// The section table.
    pub(crate) profile: SectionProfile,
    pub(crate) filter: PixelFilter,
    pub(crate) classify: Classify,
    pub(crate) interpolate: Interpolate,
    /// The kept part of each ray.
    pub(crate) clip: GridClip,
}

/// The rays of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileRays {
    /// Unit direction in the grid.
    pub(crate) direction: [TilePlane; 3],
    /// Grid units per unit of camera z.
    pub(crate) per_z: TilePlane,
    /// Opacity units per grid unit.
    pub(crate) unit_per_grid: TilePlane,
    /// Camera z, relative to the anchor's, at which the ray enters and leaves what is kept.
    pub(crate) kept: [TilePlane; 2],
}

/// Sums of one slab over a tile.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct SlabSums {
    /// By row, and in each by the summed quantity.
    pub(crate) sums: [[[f32; TILE_PX]; MOST_SUMS]; TILE_PX],
    /// Of interpolating kernels: least and greatest scalar of the voxels in reach.
    pub(crate) range: [TilePlane; 2],
    /// Rows first..end that hold anything.
    pub(crate) rows: [usize; 2],
    pub(crate) view: PlaneView,
    /// Pixels per pixel of the middle plane, at the slab's near and far end.
    pub(crate) end_scales: [f32; 2],
    pub(crate) number: u32,
}

/// Settings and view that all voxels of a tile share.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'a> {
    pub(crate) settings: &'a SheetSettings,
    pub(crate) kernel: &'a KernelSettings,
    pub(crate) view: &'a TileView,
    pub(crate) rays: &'a TileRays,
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct KernelScratch {
    ring: Vec<SlabSums>,
    pub(crate) pixels: TilePixels,
    pub(crate) sort: Vec<u64>,
}

impl Default for SlabSums {
    fn default() -> Self {
        let range = [f32::INFINITY, f32::NEG_INFINITY].map(|end| [[end; TILE_PX]; TILE_PX]);
        Self {
            sums: [[[0.0; TILE_PX]; MOST_SUMS]; TILE_PX],
            range,
            rows: [TILE_PX, 0],
            view: PlaneView::default(),
            end_scales: [1.0; 2],
            number: u32::MAX,
        }
    }
}

impl TileRays {
    pub(crate) fn new(
        view: &GridView,
        corner_px: [usize; 2],
        settings: &SheetSettings,
        clip: &GridClip,
    ) -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        let mut rays = Self {
            direction: [zero; 3],
            per_z: zero,
            unit_per_grid: zero,
            kept: [zero; 2],
        };
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let pixel = DVec2::new(
                    (corner_px[0] + x) as f64 + 0.5,
                    (corner_px[1] + y) as f64 + 0.5,
                );
                let (origin, direction) = view.ray(pixel);
                let length = direction.length();
                for (plane, axis) in rays
                    .direction
                    .iter_mut()
                    .zip((direction / length).to_array())
                {
                    plane[y][x] = axis as f32;
                }
                rays.per_z[y][x] = length as f32;
                rays.unit_per_grid[y][x] =
                    (view.world_per_grid_along(direction) / settings.unit_in_world) as f32;
                let [enter, leave] = clip.interval(origin, direction);
                for (plane, z) in rays.kept.iter_mut().zip([enter.max(view.near), leave]) {
                    plane[y][x] = (z - settings.anchor.camera_z) as f32;
                }
            }
        }
        rays
    }
}

/// The sums of a slab, with its place.
#[inline(always)]
pub(crate) fn slab<'a>(tile: &Tile, number: u32, ring: &'a mut [SlabSums]) -> &'a mut SlabSums {
    let sums = &mut ring[number as usize & (tile.settings.ring_len - 1)];
    if sums.number != number {
        (sums.view, sums.number) = (tile.view.plane(number), number);
        sums.end_scales = tile.view.end_scales(number);
    }
    sums
}

impl SlabSums {
    /// The tile's pixels whose rays may meet a box of the camera in the slab: at either end, as the box is seen from
    /// there. Least x, y, greatest x, y; pixels first..end.
    #[inline(always)]
    pub(crate) fn covered(&self, ends: [f32; 4]) -> [usize; 4] {
        let mut pixels = [0; 4];
        for (k, pixel) in pixels.iter_mut().enumerate() {
            let at = |scale: f32| ends[k] * self.view.pixel_scale[k] * scale;
            let (a, b) = (at(self.end_scales[0]), at(self.end_scales[1]));
            let end = if k < 2 { a.min(b) } else { a.max(b) } + self.view.pixel_shift[k];
            *pixel = end.ceil().clamp(0.0, TILE_PX as f32) as usize;
        }
        pixels
    }

    /// Adds a voxel, by its weights, to one vector of pixels from `first` on.
    #[inline(always)]
    pub(crate) fn add<S: Simd, const SUMS: usize>(
        &mut self,
        simd: S,
        at: HalfRow,
        weight: f32x8<S>,
        value: &[f32; MOST_SUMS],
    ) {
        let HalfRow { row, first } = at;
        for (plane, value) in self.sums[row][..SUMS].iter_mut().zip(value) {
            let lanes = &mut plane[first..first + LANES];
            weight
                .mul_add(f32x8::splat(simd, *value), f32x8::from_slice(simd, lanes))
                .store_slice(lanes);
        }
    }

    /// Remembers the scalar of a voxel where it has weight.
    #[inline(always)]
    fn widen_range<S: Simd>(&mut self, simd: S, at: HalfRow, weight: f32x8<S>, scalar: f32) {
        let HalfRow { row, first } = at;
        let range = first..first + LANES;
        let reached = weight.simd_gt(f32x8::splat(simd, 0.0));
        let scalar = f32x8::splat(simd, scalar);
        let [low, high] = &mut self.range;
        let (low, high) = (&mut low[row][range.clone()], &mut high[row][range]);
        let before = f32x8::from_slice(simd, low);
        reached.select(before.min(scalar), before).store_slice(low);
        let before = f32x8::from_slice(simd, high);
        reached.select(before.max(scalar), before).store_slice(high);
    }
}

/// The slabs that a ball reaches, and the one that its rays are placed on.
struct Slabs {
    first: u32,
    count: u32,
    /// Counted from the first: the slab nearest to the centre, and its plane.
    middle: u32,
    view: PlaneView,
}

/// Adds a voxel to every slab that cuts its kernel. Returns the pixels looked at.
#[inline(always)]
fn add_ball<S: Simd, const SUMS: usize, const POWERS: usize>(
    simd: S,
    tile: Tile,
    first: u32,
    voxel: &KernelSample,
    scratch: &mut KernelScratch,
) -> usize {
    let Some((slabs, [x0, y0, x1, y1])) = placed(&tile, first, voxel, &mut scratch.ring) else {
        return 0;
    };
    // A ball of one vector's width takes one, wherever it begins.
    let starts = if x1 - x0 <= LANES {
        [x0.min(TILE_PX - LANES); 2]
    } else {
        [0, LANES]
    };
    let count = if x1 - x0 <= LANES { 1 } else { 2 };
    for row in y0..y1 {
        for &start in &starts[..count] {
            let open = f32x8::from_slice(
                simd,
                &scratch.pixels.transmittance[row][start..start + LANES],
            );
            if open
                .simd_ge(f32x8::splat(simd, tile.settings.min_transmittance))
                .all_false()
            {
                continue;
            }
            let at = HalfRow { row, first: start };
            add_rays::<_, SUMS, POWERS>(simd, tile, &slabs, at, voxel, &mut scratch.ring);
        }
    }
    (y1 - y0) * count * LANES * slabs.count as usize
}

/// The slabs of a ball and the pixels of the tile that may see it; `None` where none does.
#[inline(always)]
fn placed(
    tile: &Tile,
    first: u32,
    voxel: &KernelSample,
    ring: &mut [SlabSums],
) -> Option<(Slabs, [usize; 4])> {
    let settings = tile.settings;
    let nearest = slab(tile, first, ring);
    let per_slab = 1.0 / settings.thickness as f32;
    let to_centre = (voxel.offset_z - nearest.view.offset_z) * per_slab;
    let reach = settings.reach.z * per_slab;
    // The last slab may begin where the ball ends: it then gets nothing.
    let count = ((to_centre + reach).floor().max(-1.0) as i32 + 1)
        .clamp(0, settings.ring_len as i32) as u32;
    let last = count.checked_sub(1)?;
    let middle = (to_centre.round().max(0.0) as u32).min(last);
    let [x, y] = voxel.across;
    let [left, top, right, bottom] = settings.reach.ends;
    let ends = [x + left, y + top, x + right, y + bottom];
    let near = nearest.covered(ends);
    let far = slab(tile, first + last, ring).covered(ends);
    let [x0, y0] = [near[0].min(far[0]), near[1].min(far[1])];
    let [x1, y1] = [near[2].max(far[2]), near[3].max(far[3])];
    if x0 >= x1 || y0 >= y1 {
        return None;
    }
    for number in first..first + count {
        let sums = slab(tile, number, ring);
        sums.rows = [sums.rows[0].min(y0), sums.rows[1].max(y1)];
    }
    Some((
        Slabs {
            first,
            count,
            middle,
            view: slab(tile, first + middle, ring).view,
        },
        [x0, y0, x1, y1],
    ))
}

/// Adds a voxel to one vector of pixels in all slabs.
#[inline(always)]
fn add_rays<S: Simd, const SUMS: usize, const POWERS: usize>(
    simd: S,
    tile: Tile,
    slabs: &Slabs,
    at: HalfRow,
    voxel: &KernelSample,
    ring: &mut [SlabSums],
) {
    let constant = |v: f32| f32x8::splat(simd, v);
    let (view, row) = (&slabs.view, at.row);
    let range = at.first..at.first + LANES;
    let load = |plane: &TilePlane| f32x8::from_slice(simd, &plane[row][range.clone()]);
    // From the voxel to the ray's place on the middle slab's plane.
    let mut p = [constant(0.0); 3];
    for (axis, p) in p.iter_mut().enumerate() {
        let start = view.first[axis] - voxel.grid[axis] + row as f32 * view.step_y[axis];
        *p = f32x8::from_slice(simd, &view.lanes[axis][range.clone()]) + constant(start);
    }
    let rays = tile.rays;
    let d = [
        load(&rays.direction[0]),
        load(&rays.direction[1]),
        load(&rays.direction[2]),
    ];
    let t = p[0].mul_add(d[0], p[1].mul_add(d[1], p[2] * d[2]));
    let across = [p[0] - t * d[0], p[1] - t * d[1], p[2] - t * d[2]];
    let distance2 = across[0].mul_add(
        across[0],
        across[1].mul_add(across[1], across[2] * across[2]),
    );
    let Some(chord) = tile.kernel.profile.chord::<_, _, POWERS>(simd, distance2) else {
        return;
    };
    // Places on the chord, -1 to 1.
    let per_z = load(&rays.per_z) * chord.per_half;
    let middle = t * chord.per_half;
    let ends = [constant(-1.0), constant(1.0)];
    let mut kept = [load(&rays.kept[0]), load(&rays.kept[1])];
    for end in &mut kept {
        *end = (*end - constant(view.offset_z))
            .mul_add(per_z, middle)
            .max(ends[0])
            .min(ends[1]);
    }
    let [low, high] = kept;
    let step = per_z * constant(tile.settings.thickness as f32);
    let near_end = middle - step * constant(slabs.middle as f32 + 0.5);
    let whole = chord.whole * load(&rays.unit_per_grid);
    let mut before = chord.share(near_end.max(low).min(high));
    for k in 0..slabs.count {
        let place = step.mul_add(constant((k + 1) as f32), near_end);
        let share = chord.share(place.max(low).min(high));
        let weight = whole * (share - before).max(constant(0.0));
        before = share;
        if weight.simd_gt(constant(0.0)).all_false() {
            continue;
        }
        let number = slabs.first + k;
        let sums = &mut ring[number as usize & (tile.settings.ring_len - 1)];
        sums.add::<_, SUMS>(simd, at, weight, &voxel.value);
        if tile.kernel.interpolate == Interpolate::On {
            sums.widen_range(simd, at, weight, voxel.scalar);
        }
    }
}

/// A vector of pixels of one kind of sum.
type Lanes<S> = f32x8<S>;

/// Composites slabs, nearest first, and empties them. Returns whether the tile is opaque.
#[inline(always)]
fn close_slabs<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    numbers: std::ops::Range<u32>,
    scratch: &mut KernelScratch,
) -> bool {
    let mut changed = false;
    for number in numbers {
        let sums = &mut scratch.ring[number as usize & (tile.settings.ring_len - 1)];
        let [first, end] = sums.rows;
        for row in first..end {
            if tile.kernel.interpolate == Interpolate::On {
                clamp_row(sums, row);
            }
            for half in [0, LANES] {
                let at = HalfRow { row, first: half };
                close_half::<_, SUMS>(simd, tile, sums, &mut scratch.pixels, at);
            }
            sums.sums[row] = [[0.0; TILE_PX]; MOST_SUMS];
            changed = true;
        }
        sums.rows = [TILE_PX, 0];
    }
    changed
        && scratch
            .pixels
            .is_opaque(simd, tile.settings.min_transmittance)
}

/// Clamps a row's sums of scalar times weight to what the voxels in reach allow, and forgets these.
#[inline(always)]
fn clamp_row(sums: &mut SlabSums, row: usize) {
    let [scalars, weights, ..] = &mut sums.sums[row];
    for x in 0..TILE_PX {
        let ends = [0, 1].map(|end| sums.range[end][row][x] * weights[x]);
        // Where nothing reaches, the ends are no numbers, and the sum stays 0.
        scalars[x] = scalars[x].max(ends[0]).min(ends[1]);
        (sums.range[0][row][x], sums.range[1][row][x]) = (f32::INFINITY, f32::NEG_INFINITY);
    }
}

/// Composites half a row of a slab's sums.
#[inline(always)]
fn close_half<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    sums: &SlabSums,
    pixels: &mut TilePixels,
    at: HalfRow,
) {
    let row = &sums.sums[at.row];
    let load = |k: usize| f32x8::from_slice(simd, &row[k][at.first..at.first + LANES]);
    let added = match tile.kernel.classify {
        Classify::Pre => [load(0), load(1), load(2), load(3)],
        Classify::Post => {
            let Some(classified) = classified(simd, tile.settings, [load(0), load(1), load(2)])
            else {
                return;
            };
            if SUMS == SUMS_LIT {
                lit(
                    simd,
                    tile,
                    at,
                    load(1),
                    [load(3), load(4), load(5)],
                    classified,
                )
            } else {
                classified
            }
        }
    };
    composite(simd, tile.settings, sums.view.camera_z, pixels, at, added);
}

/// From sums of scalar, weight and need to colours times optical depth, and optical depth; `None` where nothing is seen.
#[inline(always)]
fn classified<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    [scalars, weights, needed]: [Lanes<S>; 3],
) -> Option<[Lanes<S>; 4]> {
    let zero = f32x8::splat(simd, 0.0);
    // Where no voxel that matters reaches, nothing is visible, and some of those that reach it may be missing.
    let matters = needed.simd_gt(zero) & weights.simd_gt(f32x8::splat(simd, f32::MIN_POSITIVE));
    if matters.all_false() {
        return None;
    }
    let weights = matters.select(weights, zero);
    let quotient = scalars / matters.select(weights, f32x8::splat(simd, 1.0));
    let places = settings.table.places(simd, quotient).to_array();
    let mut values = [[0.0f32; LANES]; 4];
    for lane in 0..LANES {
        let entry = settings.table.entry(places[lane]);
        for channel in 0..4 {
            values[channel][lane] = entry[channel];
        }
    }
    let value = |channel: usize| f32x8::from_slice(simd, &values[channel]);
    let depth = value(3) * weights;
    Some([value(0) * depth, value(1) * depth, value(2) * depth, depth])
}

/// Lights classified samples, and applies the ramp over the gradient.
#[inline(always)]
fn lit<S: Simd>(
    simd: S,
    tile: Tile,
    at: HalfRow,
    weights: Lanes<S>,
    gradient_sums: [Lanes<S>; 3],
    [red, green, blue, depth]: [Lanes<S>; 4],
) -> [Lanes<S>; 4] {
    let per_weight = f32x8::splat(simd, 1.0) / weights.max(f32x8::splat(simd, f32::MIN_POSITIVE));
    let [x, y, z] = gradient_sums;
    let gradient = [x * per_weight, y * per_weight, z * per_weight];
    let one = f32x8::splat(simd, 1.0);
    let left = tile
        .settings
        .gradient_curve
        .map_or(one, |ramp| ramp.factor(simd, gradient));
    let depth = depth * left;
    let (body, added) = match &tile.settings.shade {
        None => (left, f32x8::splat(simd, 0.0)),
        Some(shade) => {
            let lit = shade.light(simd, gradient, tile.view.rays(simd, at));
            (left * lit.body, lit.highlight * depth)
        }
    };
    [
        red.mul_add(body, added),
        green.mul_add(body, added),
        blue.mul_add(body, added),
        depth,
    ]
}

/// Composites colours times optical depth, and optical depth, behind what the pixels hold.
#[inline(always)]
fn composite<S: Simd>(
    simd: S,
    settings: &SheetSettings,
    camera_z: f32,
    pixels: &mut TilePixels,
    at: HalfRow,
    [red, green, blue, depth]: [Lanes<S>; 4],
) {
    let range = at.first..at.first + LANES;
    let load = |plane: &[f32; TILE_PX]| f32x8::from_slice(simd, &plane[range.clone()]);
    let before = load(&pixels.transmittance[at.row]);
    // Opaque pixels take no more: whether its sums are whole depends on the pixels beside it.
    let open = before.simd_ge(f32x8::splat(simd, settings.min_transmittance));
    let weight = open.select(
        before * opacity(simd, settings.opacity, depth),
        f32x8::splat(simd, 0.0),
    );
    (before - weight).store_slice(&mut pixels.transmittance[at.row][range.clone()]);
    let share = weight / depth.max(f32x8::splat(simd, f32::MIN_POSITIVE));
    for (plane, colour) in pixels.rgb.iter_mut().zip([red, green, blue]) {
        let sum = share.mul_add(colour, load(&plane[at.row]));
        sum.store_slice(&mut plane[at.row][range.clone()]);
    }
    if settings.depth == DepthRule::Expected {
        let sum = weight.mul_add(f32x8::splat(simd, camera_z), load(&pixels.depth[at.row]));
        sum.store_slice(&mut pixels.depth[at.row][range.clone()]);
    }
}

/// Renders a tile from its sorted entries. `voxels` holds each chunk's voxels.
pub(crate) fn render_tile(
    tile: Tile,
    entries: &[u64],
    voxels: &[&[KernelSample]],
    scratch: &mut KernelScratch,
) -> TileCounts {
    macro_rules! sum {
        ($count:expr) => {
            dispatch!(tile.settings.level, simd => render_entries::<_, { $count }>(simd, tile, entries, voxels, scratch))
        };
    }
    match tile.kernel.classify {
        Classify::Pre => sum!(SUMS_PRE),
        Classify::Post if tile.settings.needs_gradients() => sum!(SUMS_LIT),
        Classify::Post => sum!(SUMS_POST),
    }
}

#[simd]
fn render_entries<S: Simd, const SUMS: usize>(
    simd: S,
    tile: Tile,
    entries: &[u64],
    voxels: &[&[KernelSample]],
    scratch: &mut KernelScratch,
) -> TileCounts {
    let mut counts = TileCounts::default();
    let ring_len = tile.settings.ring_len;
    scratch.ring.clear();
    scratch.ring.resize_with(ring_len, SlabSums::default);
    let Some(&nearest) = entries.first() else {
        return counts;
    };
    let mut open = entry_key(nearest);
    for &entry in entries {
        let index = entry_index(entry) as usize;
        let voxel = &voxels[index >> 16][index & 0xffff];
        let first = entry_key(entry);
        if first > open {
            let end = first.min(open.saturating_add(ring_len as u32));
            let opaque = close_slabs::<_, SUMS>(simd, tile, open..end, scratch);
            open = first;
            if opaque {
                return counts;
            }
        }
        counts.pixels_touched += if voxel.mass > 0.0 {
            add_point::<SUMS>(tile, first, voxel, scratch)
        } else {
            match tile.kernel.profile.powers() {
                Powers::Few => {
                    add_ball::<_, SUMS, ALONG_POLYNOMIAL>(simd, tile, first, voxel, scratch)
                }
                Powers::All => add_ball::<_, SUMS, ALONG>(simd, tile, first, voxel, scratch),
            }
        };
        counts.composited += 1;
    }
    let end = open.saturating_add(ring_len as u32);
    close_slabs::<_, SUMS>(simd, tile, open..end, scratch);
    counts
}

/// Adds a point to the slab that it lies in, through the pixel's Gaussian. Returns the pixels touched.
#[inline(always)]
fn add_point<const SUMS: usize>(
    tile: Tile,
    number: u32,
    point: &KernelSample,
    scratch: &mut KernelScratch,
) -> usize {
    let sums = slab(&tile, number, &mut scratch.ring);
    let corner = tile.view.corner_px();
    let across = tile.kernel.filter.along_axis(point.across[0] - corner[0]);
    let down = tile.kernel.filter.along_axis(point.across[1] - corner[1]);
    let mut touched = 0;
    let inside = |first: i32, tap: usize| {
        usize::try_from(first + tap as i32)
            .ok()
            .filter(|&p| p < TILE_PX)
    };
    for (tap_y, weight_y) in down.weights.iter().enumerate() {
        let Some(row) = inside(down.first, tap_y) else {
            continue;
        };
        for (tap_x, weight_x) in across.weights.iter().enumerate() {
            let Some(column) = inside(across.first, tap_x) else {
                continue;
            };
            let weight = weight_x * weight_y * point.mass;
            for (plane, value) in sums.sums[row][..SUMS].iter_mut().zip(point.value) {
                plane[column] += weight * value;
            }
            if tile.kernel.interpolate == Interpolate::On && weight > 0.0 {
                let [low, high] = &mut sums.range;
                low[row][column] = low[row][column].min(point.scalar);
                high[row][column] = high[row][column].max(point.scalar);
            }
            touched += 1;
        }
        sums.rows = [sums.rows[0].min(row), sums.rows[1].max(row + 1)];
    }
    touched
}
