//! Projection: the samples of a brick become points and splats on the screen (the stages sample and select).
//!
//! Positions are f32 relative to the eye, taken there in f64 once per brick; so a volume may lie 1e7 units from the
//! origin. Geometry is computed for a block of samples at a time in plain loops over arrays, which the compiler turns
//! into vector code; the irregular steps (culling, rows, tiles) follow one by one. The formulas are those of
//! `resample_core::footprint`, which is the f64 twin.

use fearless_simd::Simd;
use fearless_simd_macros::simd;
use glam::{DVec3, Vec3};
use resample_core::simd::Vectors;
use resample_core::sort::depth_key;
use resample_core::tile::{ChunkBins, POINT_ROWS, Primitive, TileGrid, TileRect};
use resample_core::{SelectMode, dispatch};

use crate::bricks::cull::ViewVolume;
use crate::grid::bounds::place;
use crate::look::options::ColourBy;
use crate::paper::axis_sheets::SliceOrder;
use crate::paper::geometry::{BLOCK, Block, Lens};
use crate::paper::hiding::Hiding;
use crate::paper::near::NearSample;
use crate::paper::samples::sample::Brick;
use crate::paper::samples::sample_light::SampleLight;

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
