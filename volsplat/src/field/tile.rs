//! One tile of a frame of the field: its bricks, front to back, each by the rule that the settings require.
//!
//! The tables of the next brick are read while one is drawn, so that they are in the cache when its samples are taken.
//! A brick's tables are a few kilobytes that no tile has read for long. Lit pictures of the Engine took 0.85 of the time with
//! this, unlit ones 0.92 to 0.97 (2026-11-23, Zen 5).

use std::hint::black_box;

use resample_core::SurfaceTile;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::dispatch;

use crate::bricks::cells::{CELL_ROWS, CellBrick, Gradients, Scalars, VERTEX_SIDE};
use crate::field::batch;
use crate::field::batch::statistic;
use crate::field::settings::{AnchoredRays, FieldSettings, PlacedBrick, Rule, TileContext};
use crate::field::surfaces::{Place, Spans, TileSurfaces};
use crate::field::walk::constant_walk::add_uniform;
use crate::field::walk::scratch::{FieldScratch, Pixels, Window};
use crate::field::walk::{isosurface, segments};
use crate::slabs::view::TileView;

/// Renders a tile from the bricks that touch it, in front-to-back order.
pub(crate) fn render_tile<'a>(
    settings: &FieldSettings,
    view: &TileView,
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>> + Clone,
    surfaces: Option<&TileSurfaces>,
    scratch: &mut FieldScratch,
) -> (TileCounts, TilePixels) {
    scratch.begin(settings);
    let Some(surfaces) = surfaces else {
        let (counts, _) = advance_tile(settings, view, bricks, None, scratch);
        return (counts, end_tile(settings, scratch));
    };
    if settings.statistic.is_some() {
        let spans = surfaces.unhidden();
        let (counts, _) = advance_tile(settings, view, bricks, Some(&spans), scratch);
        end_tile(settings, scratch);
        add_under_light(surfaces, settings, &mut scratch.pixels);
        return (counts, scratch.pixels.planes());
    }
    let mut counts = TileCounts::default();
    for number in 0..=surfaces.layers().len() {
        let spans = surfaces.spans(number);
        let (more, state) = advance_tile(settings, view, bricks.clone(), Some(&spans), scratch);
        // Every span looks at the same bricks.
        counts.composited = counts.composited.max(more.composited);
        counts.pixels_touched += more.pixels_touched;
        let Some(layer) = surfaces.layers().get(number) else {
            break;
        };
        if state == TileState::Opaque {
            break;
        }
        scratch.pixels.add_layer(&settings.sheets, layer);
        if hides_all(layer, settings, scratch) {
            break;
        }
    }
    (counts, end_tile(settings, scratch))
}

/// Composites surfaces behind values of rays, which lie over them as light on a display: dark values cover nothing, whatever their
/// opacity. Pixels without a surface stay as they are.
fn add_under_light(surfaces: &TileSurfaces, settings: &FieldSettings, pixels: &mut Pixels) {
    let mut left = pixels.transmittance;
    for (rgb, transmittance) in pixels.rgb.iter().zip(&mut pixels.transmittance) {
        for ([red, green, blue, _], transmittance) in rgb.iter().zip(transmittance) {
            *transmittance = (1.0 - red.max(*green).max(*blue)).clamp(0.0, 1.0);
        }
    }
    for layer in surfaces.layers() {
        pixels.add_layer(&settings.sheets, layer);
        let colours = layer.rgba.as_flattened();
        for (left, [.., alpha]) in left.as_flattened_mut().iter_mut().zip(colours) {
            *left *= (1.0 - alpha).max(0.0);
        }
    }
    pixels.transmittance = left;
}

/// Returns true if nothing is seen through a layer of surfaces, at any pixel that has one.
fn hides_all(layer: &SurfaceTile, settings: &FieldSettings, scratch: &FieldScratch) -> bool {
    let left = scratch.pixels.transmittance.as_flattened().iter();
    let mut at = layer.depth.as_flattened().iter().zip(left);
    at.all(|(z, left)| z.is_infinite() || !(*left >= settings.sheets.min_transmittance))
}

/// Takes more bricks in, front to back, behind what `scratch` holds. Says also whether the tile is opaque now.
pub(crate) fn advance_tile<'a>(
    settings: &FieldSettings,
    view: &TileView,
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    spans: Option<&Spans>,
    scratch: &mut FieldScratch,
) -> (TileCounts, TileState) {
    if let Some(wanted) = settings.statistic {
        let mut bricks: Vec<&PlacedBrick> = bricks.collect();
        statistic::in_best_order(wanted, &mut bricks);
        let useful = |placed: &PlacedBrick, window: &Window, scratch: &FieldScratch| {
            !statistic::is_idle(wanted, placed, window, &scratch.rays)
        };
        return advance_while_open((settings, view, spans), bricks.into_iter(), useful, scratch);
    }
    advance_while_open((settings, view, spans), bricks, |_, _, _| true, scratch)
}

fn advance_while_open<'a>(
    (settings, view, spans): (&FieldSettings, &TileView, Option<&Spans>),
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    is_useful: impl Fn(&PlacedBrick, &Window, &FieldScratch) -> bool,
    scratch: &mut FieldScratch,
) -> (TileCounts, TileState) {
    let mut counts = TileCounts::default();
    let rays = settings
        .walks_rays()
        .then(|| AnchoredRays::new(view, &settings.sheets.anchor));
    let mut bricks = bricks.peekable();
    while let Some(placed) = bricks.next() {
        if let Some(next) = bricks.peek() {
            touch(settings, next.brick);
        }
        let window = Window::new(placed, view);
        let place = spans.map_or(Place::Inside, |spans| {
            spans.place(&settings.sheets, placed.planes, window.ranges())
        });
        if place == Place::Outside || !is_useful(placed, &window, scratch) {
            continue;
        }
        let job = TileContext {
            settings,
            view,
            placed,
            rays: rays.as_ref(),
            spans: spans.filter(|_| place == Place::Across),
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

/// The state of a tile: open while samples behind can still contribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TileState {
    Open,
    Opaque,
}

/// Classifies the rays that wait for it, and returns the pixels.
pub(crate) fn end_tile(settings: &FieldSettings, scratch: &mut FieldScratch) -> TilePixels {
    if let Some(wanted) = settings.statistic {
        statistic::classify(settings, wanted, scratch);
    }
    scratch.pixels.planes()
}

/// One kernel for each rule: what a rule needs would spill the registers of those that do without.
fn add_brick_by_rule(
    job: &TileContext,
    window: Window,
    scratch: &mut FieldScratch,
) -> (usize, bool) {
    let settings = job.settings;
    let level = settings.sheets.level;
    match (job.rays, &settings.iso) {
        (Some(rays), Some(iso)) => {
            return dispatch!(level, simd => isosurface::add_brick(simd, job, iso, rays, window, scratch));
        }
        (Some(rays), None) if settings.rule() == Rule::Shaded => {
            return dispatch!(level, simd => segments::add_brick::<_, true>(simd, job, rays, window, scratch));
        }
        (Some(rays), None) => {
            return dispatch!(level, simd => segments::add_brick::<_, false>(simd, job, rays, window, scratch));
        }
        (None, _) => {}
    }
    if let Some(uniform) = job.placed.uniform.filter(|_| job.spans.is_none()) {
        return dispatch!(settings.sheets.level, simd => add_uniform(simd, job, window, uniform, scratch));
    }
    dispatch!(level, simd => batch::planes::find(simd, job, window, &mut scratch.runs));
    match settings.rule() {
        Rule::Over => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Composite<false>>(simd, job, window, scratch))
        }
        Rule::Shaded => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Composite<true>>(simd, job, window, scratch))
        }
        Rule::Mixed => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Mixed>(simd, job, window, scratch))
        }
        Rule::Statistic => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Statistics>(simd, job, window, scratch))
        }
    }
}

/// Bytes of a line of the cache, on all machines that have vectors which we use.
const LINE_BYTES: usize = 64;

/// Reads one number of each line, of bricks that are drawn by samples in cells. Statistics pass over most bricks unread, and
/// cutting shells into segments takes much longer than waiting for tables.
fn touch(settings: &FieldSettings, brick: &CellBrick) {
    if settings.walks_rays() {
        return;
    }
    let is_lit = match settings.rule() {
        Rule::Over => false,
        Rule::Shaded => true,
        Rule::Mixed | Rule::Statistic => return,
    };
    let [least, greatest] = brick.bounds.range();
    let layers = usize::from(least[2])..usize::from(greatest[2]) + 1;
    let vertices = layers.start * LAYER..layers.end * LAYER;
    let mut read = 0;
    match &brick.scalars {
        Scalars::Bytes(faces) => {
            let faces = &faces[layers.start * CELL_ROWS..layers.end * CELL_ROWS];
            for line in faces.chunks(LINE_BYTES / size_of::<u32>()) {
                read ^= line[0];
            }
        }
        Scalars::Numbers(table) => {
            for line in table[vertices.clone()].chunks(LINE_BYTES / size_of::<f32>()) {
                read ^= line[0].to_bits();
            }
        }
    }
    match brick.gradients.as_ref().filter(|_| is_lit) {
        Some(Gradients::Vectors(table)) => {
            for line in table[vertices].chunks(LINE_BYTES / size_of::<[f32; 4]>()) {
                read ^= line[0][0].to_bits();
            }
        }
        Some(Gradients::Differences(table)) => {
            for line in table[vertices].chunks(LINE_BYTES / size_of::<u32>()) {
                read ^= line[0];
            }
        }
        None => {}
    }
    black_box(read);
}

/// Vertices of a layer of a brick.
const LAYER: usize = VERTEX_SIDE * VERTEX_SIDE;
