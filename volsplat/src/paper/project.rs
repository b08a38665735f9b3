//! Projection: the samples of a brick become points and splats on the screen, and each tile composites its own (the stages sample, select,
//! accumulate and composite).
//!
//! Positions are f32 relative to the eye, taken there in f64 once per brick; so a volume may lie 1e7 units from the
//! origin. Geometry is computed for a block of samples at a time in plain loops over arrays, which the compiler turns
//! into vector code; the irregular steps (culling, rows, tiles) follow one by one. The formulas are those of
//! `resample_core::footprint`, which is the f64 twin.
//!
//! The outline of a kernel that holds the eye or crosses the near plane is a parabola, a hyperbola, or the whole screen, and only its part
//! beyond the near
//! plane is seen. There are few of them (within a kernel radius of the near plane, inside the view), so they are
//! integrated plainly in f64, pixel by pixel, with the kernel's own partial line integral, in front of all others.
//!
//! A tile gathers its slices from the chunks in source order, sorts them by depth, and composites until it is opaque.
//! One task owns a tile from start to end.

use fearless_simd::Simd;
use fearless_simd_macros::simd;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::clock::ThreadClock;
use resample_core::composite::{
    TilePixels, TileSettings, TileWork, composite_slices, composite_tile,
};
use resample_core::maps::{MapSource, TileMaps};
use resample_core::scratch::on_heap;
use resample_core::simd::Vectors;
use resample_core::sort::{depth_key, entry_key, sort_by_depth};
use resample_core::tile::{ChunkBins, POINT_ROWS, Primitive, TILE_PX, TileGrid, TileRect};
use resample_core::{Kernel, OpacityMode, SelectMode, dispatch};

use crate::bricks::cull::ViewVolume;
use crate::grid::place;
use crate::look::options::ColourBy;
use crate::paper::axis_sheets::SliceOrder;
use crate::paper::batches::Hiding;
use crate::paper::geometry::{BLOCK, Block, Lens};
use crate::paper::samples::sample::Brick;
use crate::paper::samples::sample_light::SampleLight;
use crate::picture::{Means, TileSlot};

/// A sample whose kernel is cut by the near plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearSample {
    /// Position in the indices of its layer.
    pub pos_in_grid: DVec3,
    /// The layer's number.
    pub layer: u8,
    /// Linear colour and strength, as in [`crate::paper::samples::sample::Brick::values`].
    pub value: [f32; 4],
    /// Distance from the eye, or camera z in orthographic views.
    pub depth: f32,
}

/// The input for integrating near samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearSetup {
    /// Camera in the grid, kernel radius, opacity unit.
    pub source: MapSource,
    /// The kernel.
    pub kernel: Kernel,
    /// Opacity of a pixel from optical depth.
    pub opacity: OpacityMode,
}

/// Composites `samples`, nearest first, onto the fresh pixels of the tile whose first pixel is `corner_px`; `setups` holds
/// one for each layer.
fn composite_near(
    setups: &[NearSetup],
    samples: &[NearSample],
    corner_px: [usize; 2],
    pixels: &mut TilePixels,
) {
    for row in 0..TILE_PX {
        for column in 0..TILE_PX {
            let pixel = DVec2::new(
                (corner_px[0] + column) as f64 + 0.5,
                (corner_px[1] + row) as f64 + 0.5,
            );
            composite_pixel(setups, samples, pixel, |weights| {
                pixels.transmittance[row][column] = weights.transmittance as f32;
                for (plane, c) in pixels.rgb.iter_mut().zip(weights.rgb) {
                    plane[row][column] = c as f32;
                }
                pixels.depth[row][column] = weights.depth as f32;
            });
        }
    }
}

struct PixelSum {
    transmittance: f64,
    rgb: [f64; 3],
    depth: f64,
}

fn composite_pixel(
    setups: &[NearSetup],
    samples: &[NearSample],
    pixel: DVec2,
    store: impl FnOnce(&PixelSum),
) {
    let mut sum = PixelSum {
        transmittance: 1.0,
        rgb: [0.0; 3],
        depth: 0.0,
    };
    for sample in samples {
        let setup = &setups[usize::from(sample.layer)];
        let view = &setup.source.view;
        let (origin, direction) = view.ray(pixel);
        let length = direction.length();
        let unit_per_grid = view.world_per_grid_along(direction) / setup.source.unit_in_world;
        let to_centre = sample.pos_in_grid - origin;
        let nearest = to_centre.dot(direction) / length;
        let distance2 = to_centre.cross(direction).length_squared() / (length * length);
        // The ray parameter is camera z: the near plane lies at grid distance near * |w| along it.
        let integral = setup
            .kernel
            .line_integral_from(distance2, view.near * length - nearest);
        let added = f64::from(sample.value[3]) * unit_per_grid * integral;
        let opacity = match setup.opacity {
            OpacityMode::Extinction => -(-added).exp_m1(),
            OpacityMode::Linear => added.min(1.0),
        };
        let weight = sum.transmittance * opacity;
        sum.transmittance -= weight;
        for (c, value) in sum.rgb.iter_mut().zip(sample.value) {
            *c += weight * f64::from(value);
        }
        sum.depth += weight * f64::from(sample.depth);
    }
    store(&sum);
}

/// Settings that all samples of a frame share.
#[derive(Clone, Debug)]
pub(crate) struct ProjectSetup {
    /// Camera, kernel and modes, as the block geometry wants them.
    pub(crate) lens: Lens,
    /// The view volume of the camera.
    pub(crate) view_volume: ViewVolume,
    /// Tiles of the picture.
    pub(crate) grid: TileGrid,
    /// Point or splat.
    pub(crate) select: SelectMode,
    /// Square of the spacing, px^2, below which a sample is a point.
    pub(crate) threshold2_px2: f32,
    /// Where samples are lit: how.
    pub(crate) light: Option<SampleLight>,
    /// Colour of splats.
    pub(crate) painting: Painting,
    /// Vector instructions to use.
    pub(crate) level: Vectors,
    /// The sort keys of primitives.
    pub(crate) keys: SortKeys,
    /// The layer's number.
    pub(crate) layer: u8,
}

/// The sort keys of primitives.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SortKeys {
    /// Their depth.
    Depth,
    /// The slice of the grid that they lie in.
    Slice(SliceOrder),
}

impl SortKeys {
    #[inline(always)]
    fn of(&self, depth: f32, brick: &Brick, packed: u16) -> u32 {
        match self {
            Self::Depth => depth_key(depth),
            Self::Slice(order) => order.key(&brick.bounds, packed),
        }
    }
}

/// The result of projecting a chunk of bricks.
#[derive(Clone, Debug, Default)]
pub(crate) struct ProjectedChunk {
    /// Points and splats, listed by tile.
    pub(crate) bins: ChunkBins<Primitive>,
    /// Samples that cross the near plane.
    pub(crate) near: Vec<NearSample>,
    /// Samples outside the view.
    pub(crate) culled: u64,
    /// Samples that touch opaque tiles alone.
    pub(crate) hidden: u64,
    /// Points made.
    pub(crate) points: u64,
    /// Splats made, `near` included.
    pub(crate) splats: u64,
    block: Block,
}

/// How samples are painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Painting {
    /// In their own colours.
    Own,
    /// Splats in linear red (the paper, Figure 8a).
    SplatsRed,
    /// Points red, splats green: what each gives a pixel, in a channel of its own.
    Kinds,
}

impl From<ColourBy> for Painting {
    fn from(colour_by: ColourBy) -> Self {
        match colour_by {
            ColourBy::Transfer => Self::Own,
            ColourBy::Select => Self::SplatsRed,
        }
    }
}

impl Painting {
    #[inline(always)]
    fn point(self, [r, g, b, _]: &[f32; 4]) -> [f32; 3] {
        if self == Self::Kinds {
            [1.0, 0.0, 0.0]
        } else {
            [*r, *g, *b]
        }
    }

    #[inline(always)]
    fn splat(self, value: &[f32; 4]) -> [f32; 4] {
        match self {
            Self::Own => *value,
            Self::SplatsRed => [1.0, 0.0, 0.0, value[3]],
            Self::Kinds => [0.0, 1.0, 0.0, value[3]],
        }
    }
}

/// Greatest strength of a sample: opaque by far, and its products with lengths and depths, and their sums, are f32 numbers.
const MOST_STRENGTH: f32 = 1e9;

/// Pixels that a point reaches on either side of its position.
const POINT_REACH_PX: f32 = 2.0;

impl ProjectedChunk {
    /// Forgets the last frame; keeps the buffers.
    pub(crate) fn clear(&mut self) {
        self.bins.clear();
        self.near.clear();
        (self.culled, self.hidden, self.points, self.splats) = (0, 0, 0, 0);
    }

    /// Projects one brick; what `hiding` hides is left out.
    pub(crate) fn project(&mut self, setup: &ProjectSetup, hiding: &Hiding, brick: &Brick) {
        let corner = DVec3::from(brick.bounds.corner.map(f64::from));
        let lit = setup.light.as_ref().map(|light| light.values(brick));
        let values = lit.as_ref().unwrap_or(&brick.values);
        for (places, values) in brick.places.chunks(BLOCK).zip(values.chunks(BLOCK)) {
            for (i, &packed) in places.iter().enumerate() {
                let [x, y, z] = place(packed).map(f32::from);
                (self.block.x[i], self.block.y[i], self.block.z[i]) = (x, y, z);
            }
            let corner = setup.lens.at_corner(corner);
            dispatch!(setup.level, simd => block_geometry(simd, setup, corner, &mut self.block));
            for (i, value) in values.iter().enumerate() {
                let sample = BlockSample {
                    i,
                    packed: places[i],
                    value,
                };
                self.emit(setup, hiding, brick, &sample);
            }
        }
    }

    /// Turns sample `i` of the block into a point, a splat, a near sample, or nothing.
    #[inline(always)]
    fn emit(&mut self, setup: &ProjectSetup, hiding: &Hiding, brick: &Brick, sample: &BlockSample) {
        let (lens, i) = (&setup.lens, sample.i);
        let camera_z = self.block.camera_z[i];
        if !(camera_z - lens.depth_reach > lens.near) {
            return self.emit_near(setup, brick, sample);
        }
        let is_point = match setup.select {
            SelectMode::Hybrid => self.block.spacing2_px2[i] < setup.threshold2_px2,
            SelectMode::Points => true,
            SelectMode::Splats | SelectMode::Ewa => false,
        };
        let key = setup.keys.of(self.block.depth[i], brick, sample.packed);
        if is_point {
            self.emit_point(setup, hiding, key, sample);
        } else {
            self.emit_splat(setup, hiding, key, sample);
        }
    }

    fn emit_near(&mut self, setup: &ProjectSetup, brick: &Brick, sample: &BlockSample) {
        let &BlockSample { i, packed, value } = sample;
        let (camera_z, depth) = (self.block.camera_z[i], self.block.depth[i]);
        let corner = DVec3::from(brick.bounds.corner.map(f64::from));
        let pos_in_grid = corner + DVec3::from(place(packed).map(f64::from));
        // The negation keeps NaN out of the picture.
        let reaches_near = camera_z + setup.lens.depth_reach > setup.lens.near;
        if !reaches_near || !setup.view_volume.sees_ball(pos_in_grid) {
            self.culled += 1;
            return;
        }
        let value = setup.painting.splat(value);
        self.near.push(NearSample {
            pos_in_grid,
            layer: setup.layer,
            value,
            depth,
        });
        self.splats += 1;
    }

    #[inline(always)]
    fn emit_point(
        &mut self,
        setup: &ProjectSetup,
        hiding: &Hiding,
        key: u32,
        sample: &BlockSample,
    ) {
        let &BlockSample { i, value, .. } = sample;
        let (x, y) = (self.block.screen_x[i], self.block.screen_y[i]);
        let columns = pixels(x, POINT_REACH_PX, setup.grid.width);
        let rows = pixels(y, POINT_REACH_PX, setup.grid.height);
        let rect = setup.grid.rect(columns, rows);
        if rect.area() == 0 {
            self.culled += 1;
            return;
        }
        if hiding.hides(&rect) {
            self.hidden += 1;
            return;
        }
        self.points += 1;
        let point = Primitive {
            x,
            y,
            strength: (value[3] * self.block.area_px2[i]).min(MOST_STRENGTH),
            rgb: setup.painting.point(value),
            rows: POINT_ROWS,
            depth: self.block.depth[i],
            ..Primitive::default()
        };
        self.bins.push(point, key, rect);
    }

    #[inline(always)]
    fn emit_splat(
        &mut self,
        setup: &ProjectSetup,
        hiding: &Hiding,
        key: u32,
        sample: &BlockSample,
    ) {
        let &BlockSample { i, value, .. } = sample;
        let block = &self.block;
        let columns = pixels(block.middle_x[i], block.half_width[i], setup.grid.width);
        let rows = pixels(block.middle_y[i], block.half_height[i], setup.grid.height);
        let rect = setup.grid.rect(columns, rows);
        if rect.area() == 0 && outside(setup.grid, block, i) {
            self.culled += 1;
            return;
        }
        if hiding.hides(&rect) {
            self.hidden += 1;
            return;
        }
        let value = setup.painting.splat(value);
        let [form, length] = [setup.lens.form_factor, setup.lens.length_factor];
        let splat = Primitive {
            x: block.form_x[i],
            y: block.form_y[i],
            form: [
                form * block.form_xx[i],
                2.0 * form * block.form_xy[i],
                form * block.form_yy[i],
            ],
            sin2_cone: block.sin2_cone[i],
            strength: (value[3] * block.splat_scale[i] * length).min(MOST_STRENGTH),
            rgb: [value[0], value[1], value[2]],
            rows,
            depth: block.depth[i],
        };
        self.splats += 1;
        if rect != TileRect::default() {
            self.bins.push(splat, key, rect);
        }
    }
}

/// One sample of a block.
struct BlockSample<'a> {
    /// Its place in the block.
    i: usize,
    /// Its place in the brick.
    packed: u16,
    value: &'a [f32; 4],
}

/// Returns true if the box of a footprint misses the picture altogether (a small one inside may still miss every centre).
fn outside(grid: TileGrid, block: &Block, i: usize) -> bool {
    let misses = |middle: f32, half: f32, count: usize| {
        !(middle + half > 0.0 && middle - half < count as f32)
    };
    misses(block.middle_x[i], block.half_width[i], grid.width)
        || misses(block.middle_y[i], block.half_height[i], grid.height)
}

/// The pixels first..end whose centres lie within `half` of `middle`, inside 0..count. Casts saturate; NaN gives 0.
#[inline(always)]
fn pixels(middle: f32, half: f32, count: usize) -> [u16; 2] {
    let limit = count as f32;
    let first = (middle - half - 0.5).ceil().clamp(0.0, limit);
    let end = ((middle + half - 0.5).floor() + 1.0).clamp(0.0, limit);
    [first as u16, end as u16]
}

#[simd]
fn block_geometry<S: Simd>(_: S, setup: &ProjectSetup, corner: [Vec3; 2], block: &mut Block) {
    setup.lens.fill(corner, block);
}

/// The input of a frame's tiles.
pub(crate) struct TileStage<'a> {
    /// Compositing settings.
    pub(crate) settings: TileSettings,
    /// Per-pixel maps.
    pub(crate) maps: MapSource,
    /// Tiles of the picture.
    pub(crate) grid: TileGrid,
    /// Samples at the eye, nearest first.
    pub(crate) near: Vec<NearSample>,
    /// How those of each layer are integrated.
    pub(crate) near_setups: &'a [NearSetup],
    /// The samples that are composited together.
    pub(crate) layers: Layers,
    /// Sub-pixels along a pixel's side.
    pub(crate) subpixels: usize,
}

/// The samples that are composited together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layers {
    /// A sample; points in sheets of their own.
    Samples,
    /// All of one sorting key.
    Slices,
}

/// Storage of one task, reused from tile to tile.
#[derive(Default)]
struct Scratch {
    ready: Vec<u64>,
    sort: Vec<u64>,
    work: TileWork,
}

/// A tile between two batches of samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct OpenTile {
    /// Accumulated pixels; made when something touches the tile.
    pixels: Option<Box<TilePixels>>,
    /// Listed samples that may still have something before them.
    pending: Vec<u64>,
    pub(crate) is_opaque: bool,
}

impl OpenTile {
    /// Forgets the last frame.
    fn reset(&mut self) {
        self.pixels = None;
        self.pending.clear();
        self.is_opaque = false;
    }
}

impl TileStage<'_> {
    /// Makes tiles ready for a frame.
    pub(crate) fn begin(&self, slots: &mut Vec<TileSlot>, open: &mut Vec<OpenTile>) {
        let count = self.grid.columns() * self.grid.rows();
        slots.resize_with(count, TileSlot::default);
        open.resize_with(count, OpenTile::default);
        slots.par_iter_mut().for_each(|slot| slot.reset(0));
        open.par_iter_mut().for_each(OpenTile::reset);
    }

    /// Composites what the chunks from `first` on hold, and what was left before, as far as nothing that is still to come
    /// lies before it: up to the sheet that holds the depth `frontier`. A tile is shown once it is opaque or nothing is to
    /// come (`frontier` is infinite).
    pub(crate) fn advance(
        &self,
        chunks: &[ProjectedChunk],
        first: usize,
        frontier: f64,
        slots: &mut [TileSlot],
        open: &mut [OpenTile],
    ) {
        let columns = self.grid.columns();
        let primitives: Vec<&[Primitive]> = chunks
            .iter()
            .map(|chunk| chunk.bins.primitives.as_slice())
            .collect();
        let tiles = slots.par_iter_mut().zip(open).enumerate();
        tiles.for_each_init(on_heap::<Scratch>, |scratch, (index, (slot, open))| {
            let at = [index % columns, index / columns];
            let start = ThreadClock::start();
            let before = open.pending.len();
            for chunk in &chunks[first..] {
                // Tile numbers fit: a picture side is at most 32768 px.
                open.pending
                    .extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
            }
            slot.list_more(open.pending.len() - before);
            let is_begun = first > 0 || self.near.is_empty();
            if open.is_opaque {
                open.pending.clear();
                return;
            }
            if !(open.pending.is_empty() && is_begun) {
                self.take_ready(frontier, open, &mut scratch.ready);
                sort_by_depth(&mut scratch.ready, &mut scratch.sort);
                slot.sort_ms += start.elapsed_ms();
                let start = ThreadClock::start();
                let corner_px = at.map(|tile| tile * TILE_PX);
                if !is_begun {
                    let kept = open.pixels.get_or_insert_default();
                    composite_near(self.near_setups, &self.near, corner_px, kept);
                }
                self.composite(corner_px, &primitives, slot, open, scratch);
                slot.composite_ms += start.elapsed_ms();
            }
            if (open.is_opaque || frontier == f64::INFINITY)
                && let Some(pixels) = open.pixels.take()
            {
                slot.show(&pixels, self.subpixels, Means::Own);
            }
        });
    }

    /// Moves what may be composited now out of the pending entries.
    fn take_ready(&self, frontier: f64, open: &mut OpenTile, ready: &mut Vec<u64>) {
        ready.clear();
        if self.layers == Layers::Slices || frontier == f64::INFINITY {
            ready.append(&mut open.pending);
            return;
        }
        // As the points of a sheet are numbered when they are composited: a sheet is not cut in two.
        let sheets_per_unit = 1.0 / self.settings.sheet_thickness;
        let number = |depth: f32| (depth * sheets_per_unit) as u32;
        let end = number(frontier.max(0.0) as f32);
        open.pending.retain(|&entry| {
            let is_ready = number(f32::from_bits(entry_key(entry))) < end;
            if is_ready {
                ready.push(entry);
            }
            !is_ready
        });
    }

    fn composite(
        &self,
        corner_px: [usize; 2],
        primitives: &[&[Primitive]],
        slot: &mut TileSlot,
        open: &mut OpenTile,
        scratch: &mut Scratch,
    ) {
        let Scratch { work, ready, .. } = scratch;
        if ready.is_empty() && open.pixels.is_none() {
            return;
        }
        let kept = open.pixels.get_or_insert_default();
        if !ready.is_empty() {
            std::mem::swap(&mut work.pixels, kept);
            TileMaps::fill(&mut work.maps, self.settings.level, &self.maps, corner_px);
            let composite = match self.layers {
                Layers::Samples => composite_tile,
                Layers::Slices => composite_slices,
            };
            slot.count(composite(
                &self.settings,
                work,
                corner_px,
                ready,
                primitives,
            ));
            std::mem::swap(&mut work.pixels, kept);
        }
        let most = kept
            .transmittance
            .iter()
            .flatten()
            .fold(0.0f32, |most, &t| most.max(t));
        open.is_opaque = most < self.settings.min_transmittance;
        if open.is_opaque {
            open.pending.clear();
        }
    }
}
