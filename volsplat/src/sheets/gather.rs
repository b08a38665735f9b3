//! One tile of an image-sheets frame, its sheets gathered from cells instead of summed from voxels.
//!
//! The trilinear kernel reaches exactly the eight voxels of a sample's cell, so the sum that a voxel scatters into a
//! plane can be gathered there: brick by brick, front to back, plane by plane, a row of pixels at a time. It is the
//! same sum in another order, and it needs no list of voxels, no sorting and no ring of planes. This file walks over
//! the samples; what becomes of them is a [`SampleRule`], compiled into the walk.
//! Bricks come in an order in which none hides an earlier one; a brick behind an opaque tile is never looked at.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8};
use fearless_simd_macros::simd;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::dispatch;
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use super::cell_sample::{CellBox, HalfRow, LANES, Located, located};
use super::channel::Reading;
use super::frame::{PlaneView, SheetSettings, TileView, covered};
use super::isosurface;
use super::kept::Kept;
use super::mixed::Mixed;
use super::over::Over;
use super::statistic::{self, Gathered, RayValues};
use super::uniform::Uniform;
use super::uniform_walk::add_uniform;
use crate::cells::CellBrick;

/// Planes whose views are remembered in a tile; neighbouring bricks share planes. A power of two; a brick of unit
/// cells spans at most 2 * 8 * sqrt(3) planes half a voxel apart.
const REMEMBERED_PLANES: usize = 64;

/// A brick as the tiles need it, from the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBrick<'a> {
    pub(crate) brick: &'a CellBrick,
    /// Where it is crossed in one step: its colour.
    pub(crate) uniform: Option<Uniform>,
    /// Planes first..end that cut the box of its visible cells.
    pub(crate) planes: [u32; 2],
    /// Pixel columns first..end and rows first..end that the box covers.
    pub(crate) columns: [u16; 2],
    pub(crate) rows: [u16; 2],
    /// Camera x and y of the middle of the brick.
    pub(crate) middle: [f32; 2],
    /// Its camera z, relative to the anchor's.
    pub(crate) middle_z: f32,
    /// The half-spaces of the clip that cut the box, by their bits.
    pub(crate) cuts: u32,
}

/// A brick and what it is drawn with.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(super) settings: &'a SheetSettings,
    pub(super) view: &'a TileView,
    pub(super) placed: &'a PlacedBrick<'a>,
}

/// What becomes of samples.
pub(super) trait SampleRule {
    /// Takes half a row of samples on a plane in. Returns whether a pixel became more opaque.
    fn take<S: Simd>(
        simd: S,
        job: &Job,
        on: (HalfRow, &PlaneView),
        located: &Located<S>,
        scratch: &mut GatherScratch,
    ) -> bool;
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug)]
pub(crate) struct GatherScratch {
    planes: Vec<(u32, PlaneView)>,
    /// Colour so far, premultiplied; interleaved, as one sample at a time is added.
    pub(super) rgb: [[[f32; 4]; TILE_PX]; TILE_PX],
    pub(crate) pixels: TilePixels,
    /// What rays have met, by channel; only where a statistic is shown.
    pub(super) rays: Vec<RayValues>,
    /// Camera z, relative to the anchor's, of the last surface that was hit.
    pub(super) last_hit: TilePlane,
}

/// What a tile holds that more bricks will be drawn in.
#[derive(Clone, Debug)]
pub(crate) struct Unfinished {
    pixels: TilePixels,
    rays: Vec<RayValues>,
    last_hit: Option<Box<TilePlane>>,
}

impl Unfinished {
    /// Bytes that one takes.
    pub(crate) fn bytes(settings: &SheetSettings) -> usize {
        let rays = settings
            .statistic
            .map_or(0, |_| settings.channels.len() * size_of::<RayValues>());
        size_of::<Self>() + rays + settings.iso.map_or(0, |_| size_of::<TilePlane>())
    }
}

impl Default for GatherScratch {
    fn default() -> Self {
        Self {
            planes: vec![(u32::MAX, PlaneView::default()); REMEMBERED_PLANES],
            rgb: [[[0.0; 4]; TILE_PX]; TILE_PX],
            pixels: TilePixels::default(),
            rays: Vec::new(),
            last_hit: [[f32::NEG_INFINITY; TILE_PX]; TILE_PX],
        }
    }
}

impl GatherScratch {
    /// The view of a plane, remembered.
    #[inline(always)]
    pub(super) fn plane(&mut self, view: &TileView, number: u32) -> &PlaneView {
        let slot = &mut self.planes[number as usize % REMEMBERED_PLANES];
        if slot.0 != number {
            *slot = (number, view.plane(number));
        }
        &slot.1
    }

    /// Makes ready for an empty tile.
    pub(crate) fn begin(&mut self, settings: &SheetSettings) {
        self.planes.iter_mut().for_each(|plane| plane.0 = u32::MAX);
        self.rgb = [[[0.0; 4]; TILE_PX]; TILE_PX];
        self.pixels = TilePixels::default();
        self.rays = statistic::at_start(settings.statistic, &settings.channels);
        self.last_hit = [[f32::NEG_INFINITY; TILE_PX]; TILE_PX];
    }

    /// Makes ready for a tile that was begun before.
    pub(crate) fn resume(&mut self, settings: &SheetSettings, begun: &Unfinished) {
        self.begin(settings);
        self.pixels = begun.pixels.clone();
        for (y, row) in self.rgb.iter_mut().enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let [red, green, blue] = &begun.pixels.rgb;
                *pixel = [red[y][x], green[y][x], blue[y][x], 0.0];
            }
        }
        self.rays.clone_from(&begun.rays);
        if let Some(last_hit) = &begun.last_hit {
            self.last_hit = **last_hit;
        }
    }

    /// What [`GatherScratch::resume`] goes on from.
    pub(crate) fn suspend(&mut self, settings: &SheetSettings) -> Unfinished {
        self.place_colours();
        let last_hit = settings.iso.map(|_| Box::new(self.last_hit));
        Unfinished {
            pixels: self.pixels.clone(),
            rays: self.rays.clone(),
            last_hit,
        }
    }

    /// Classifies what waits for it, and puts the colours where the pixels are.
    pub(crate) fn end(&mut self, settings: &SheetSettings) {
        if let Some(wanted) = settings.statistic {
            statistic::classify(settings, wanted, self);
        }
        self.place_colours();
    }

    fn place_colours(&mut self) {
        for (y, row) in self.rgb.iter().enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                for (plane, value) in self.pixels.rgb.iter_mut().zip(pixel) {
                    plane[y][x] = *value;
                }
            }
        }
    }
}

/// Renders a tile whose first pixel is `corner_px` from the bricks that touch it, in front-to-back order.
pub(crate) fn render_tile<'a>(
    settings: &SheetSettings,
    view: &TileView,
    corner_px: [usize; 2],
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    scratch: &mut GatherScratch,
) -> TileCounts {
    scratch.begin(settings);
    let (counts, _) = advance_tile(settings, view, corner_px, bricks, scratch);
    scratch.end(settings);
    counts
}

/// Takes more bricks in, front to back, behind what `scratch` holds. Says also whether the tile is opaque now.
pub(crate) fn advance_tile<'a>(
    settings: &SheetSettings,
    view: &TileView,
    corner_px: [usize; 2],
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    scratch: &mut GatherScratch,
) -> (TileCounts, TileState) {
    if let Some(wanted) = settings.statistic {
        let mut bricks: Vec<&PlacedBrick> = bricks.collect();
        statistic::in_best_order(wanted, &mut bricks);
        let useful = |placed: &PlacedBrick, window: &Window, scratch: &GatherScratch| {
            !statistic::is_idle(wanted, placed, window, &scratch.rays)
        };
        return advance_while_open(
            (settings, view, corner_px),
            bricks.into_iter(),
            useful,
            scratch,
        );
    }
    advance_while_open((settings, view, corner_px), bricks, |_, _, _| true, scratch)
}

fn advance_while_open<'a>(
    (settings, view, corner_px): (&SheetSettings, &TileView, [usize; 2]),
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    is_useful: impl Fn(&PlacedBrick, &Window, &GatherScratch) -> bool,
    scratch: &mut GatherScratch,
) -> (TileCounts, TileState) {
    let mut counts = TileCounts::default();
    for placed in bricks {
        let window = Window::new(placed, corner_px);
        if !is_useful(placed, &window, scratch) {
            continue;
        }
        let job = Job {
            settings,
            view,
            placed,
        };
        let (touched, opaque) = add_brick_by_rule(&job, window, scratch);
        counts.composited += 1;
        counts.pixels_touched += touched;
        if opaque {
            return (counts, TileState::Opaque);
        }
    }
    (counts, TileState::Open)
}

/// Whether anything behind can still be seen in a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TileState {
    Open,
    Opaque,
}

/// One kernel for each rule: what a rule needs would spill the registers of those that do without.
fn add_brick_by_rule(job: &Job, window: Window, scratch: &mut GatherScratch) -> (usize, bool) {
    macro_rules! add {
        ($rule:ty) => {
            dispatch!(job.settings.level, simd => add_brick::<_, $rule>(simd, job, window, scratch))
        };
    }
    let settings = job.settings;
    if let (Some(iso), Some(rays)) = (&settings.iso, &job.view.iso_rays) {
        return dispatch!(settings.level, simd => isosurface::add_brick(simd, job, (iso, rays), window, scratch));
    }
    if let Some(uniform) = job.placed.uniform {
        return dispatch!(settings.level, simd => add_uniform(simd, job, (window, uniform), scratch));
    }
    let is_cut = job.placed.cuts != 0 || job.placed.brick.mask.is_some();
    match (rule(settings), is_cut) {
        (Rule::Over, false) => add!(Over<false>),
        (Rule::Over, true) => add!(Kept<Over<false>>),
        (Rule::Shaded, false) => add!(Over<true>),
        (Rule::Shaded, true) => add!(Kept<Over<true>>),
        (Rule::Mixed, false) => add!(Mixed),
        (Rule::Mixed, true) => add!(Kept<Mixed>),
        (Rule::Statistic, false) => add!(Gathered),
        (Rule::Statistic, true) => add!(Kept<Gathered>),
    }
}

/// The least rule that does what the settings ask for.
enum Rule {
    Over,
    Shaded,
    Mixed,
    Statistic,
}

/// Whether samples are only classified and composited: not lit, mixed, or searched for a surface.
pub(super) fn is_plain(settings: &SheetSettings) -> bool {
    settings.iso.is_none() && matches!(rule(settings), Rule::Over)
}

fn rule(settings: &SheetSettings) -> Rule {
    let is_plain = settings.channels.len() == 1
        && settings.channels[0].reading == Reading::Trilinear
        && settings.gradient_ramp.is_none();
    match (
        settings.statistic.is_some(),
        is_plain,
        settings.shade.is_some(),
    ) {
        (true, ..) => Rule::Statistic,
        (_, false, _) => Rule::Mixed,
        (_, true, true) => Rule::Shaded,
        (_, true, false) => Rule::Over,
    }
}

/// The pixels of a tile that a brick covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) columns: [usize; 2],
    pub(super) rows: [usize; 2],
}

impl Window {
    fn new(placed: &PlacedBrick, corner_px: [usize; 2]) -> Self {
        let inside = |pixel: u16, axis: usize| {
            usize::from(pixel)
                .saturating_sub(corner_px[axis])
                .min(TILE_PX)
        };
        Self {
            columns: placed.columns.map(|c| inside(c, 0)),
            rows: placed.rows.map(|r| inside(r, 1)),
        }
    }

    /// The part that one plane's section of the brick covers; empty where it covers nothing.
    #[inline(always)]
    fn section<S: Simd>(
        &self,
        simd: S,
        settings: &SheetSettings,
        plane: &PlaneView,
        placed: &PlacedBrick,
    ) -> Self {
        let Some(reach) = settings.brick_sections.at(plane.offset_z - placed.middle_z) else {
            return Self {
                columns: [0; 2],
                rows: [0; 2],
            };
        };
        let [x, y] = placed.middle;
        let ends = f32x4::from_slice(simd, &[x, y, x, y]) + f32x4::from_slice(simd, &reach.ends);
        let [x0, y0, x1, y1] = covered(simd, plane, ends);
        Self {
            columns: [x0.max(self.columns[0]), x1.min(self.columns[1])],
            rows: [y0.max(self.rows[0]), y1.min(self.rows[1])],
        }
    }
}

/// Takes all samples of a brick in. Returns the pixels looked at, and whether the tile is opaque now.
#[simd]
fn add_brick<S: Simd, R: SampleRule>(
    simd: S,
    job: &Job,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    let (settings, placed) = (job.settings, job.placed);
    let cells = CellBox::new(placed.brick, &settings.anchor);
    let mut touched = 0;
    let mut seen = false;
    for number in placed.planes[0]..placed.planes[1] {
        let plane = *scratch.plane(job.view, number);
        let section = window.section(simd, settings, &plane, placed);
        let halves = section.columns[0] / LANES..section.columns[1].div_ceil(LANES);
        for row in section.rows[0]..section.rows[1] {
            for first in halves.clone().map(|half| half * LANES) {
                let at = HalfRow { row, first };
                touched += LANES;
                let left = f32x8::from_slice(
                    simd,
                    &scratch.pixels.transmittance[row][first..first + LANES],
                );
                // What is opaque is left alone pixel by pixel, so that the picture does not depend on which other
                // bricks the tile saw before.
                let open = left.simd_ge(f32x8::splat(simd, settings.min_transmittance));
                if open.all_false() {
                    continue;
                }
                let Some(located) = located(simd, &plane, (&cells, open), at) else {
                    continue;
                };
                seen |= R::take(simd, job, (at, &plane), &located, scratch);
            }
        }
    }
    (
        touched,
        seen && scratch.pixels.is_opaque(simd, settings.min_transmittance),
    )
}
