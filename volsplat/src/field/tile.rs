//! One tile of a frame of the field: its bricks, front to back, each by the rule that the settings ask for.

use resample_core::composite::TileCounts;
use resample_core::dispatch;

use crate::field::setup::iso_rays::AnchoredRays;
use crate::field::setup::settings::{FieldSettings, Rule};
use crate::field::setup::tile_context::{PlacedBrick, TileContext};
use crate::field::walk::constant_walk::add_uniform;
use crate::field::walk::gather::{GatherScratch, Window, add_brick};
use crate::field::walk::mixed::Mixed;
use crate::field::walk::statistic::Gathered;
use crate::field::walk::{isosurface, segments, statistic};
use crate::field::{batch, look_ahead};
use crate::slabs::view::TileView;

/// Renders a tile from the bricks that touch it, in front-to-back order.
pub(crate) fn render_tile<'a>(
    settings: &FieldSettings,
    view: &TileView,
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    scratch: &mut GatherScratch,
) -> TileCounts {
    scratch.begin(settings);
    let (counts, _) = advance_tile(settings, view, bricks, scratch);
    end_tile(settings, scratch);
    counts
}

/// Takes more bricks in, front to back, behind what `scratch` holds. Says also whether the tile is opaque now.
pub(crate) fn advance_tile<'a>(
    settings: &FieldSettings,
    view: &TileView,
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    scratch: &mut GatherScratch,
) -> (TileCounts, TileState) {
    if let Some(wanted) = settings.statistic {
        let mut bricks: Vec<&PlacedBrick> = bricks.collect();
        statistic::in_best_order(wanted, &mut bricks);
        let useful = |placed: &PlacedBrick, window: &Window, scratch: &GatherScratch| {
            !statistic::is_idle(wanted, placed, window, &scratch.rays)
        };
        return advance_while_open(settings, view, bricks.into_iter(), useful, scratch);
    }
    advance_while_open(settings, view, bricks, |_, _, _| true, scratch)
}

fn advance_while_open<'a>(
    settings: &FieldSettings,
    view: &TileView,
    bricks: impl Iterator<Item = &'a PlacedBrick<'a>>,
    is_useful: impl Fn(&PlacedBrick, &Window, &GatherScratch) -> bool,
    scratch: &mut GatherScratch,
) -> (TileCounts, TileState) {
    let mut counts = TileCounts::default();
    let rays = settings
        .walks_rays()
        .then(|| AnchoredRays::new(view, &settings.sheets.anchor));
    let mut bricks = bricks.peekable();
    while let Some(placed) = bricks.next() {
        if let Some(next) = bricks.peek() {
            look_ahead::touch(settings, next.brick);
        }
        let window = Window::new(placed, view);
        if !is_useful(placed, &window, scratch) {
            continue;
        }
        let job = TileContext {
            settings,
            view,
            placed,
            rays: rays.as_ref(),
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

/// Classifies what waits for it, and puts the colours where the pixels are.
pub(crate) fn end_tile(settings: &FieldSettings, scratch: &mut GatherScratch) {
    if let Some(wanted) = settings.statistic {
        statistic::classify(settings, wanted, scratch);
    }
    scratch.place_colours();
}

/// One kernel for each rule: what a rule needs would spill the registers of those that do without.
fn add_brick_by_rule(
    job: &TileContext,
    window: Window,
    scratch: &mut GatherScratch,
) -> (usize, bool) {
    macro_rules! add {
        ($rule:ty) => {
            dispatch!(job.settings.sheets.level, simd => add_brick::<_, $rule>(simd, job, window, scratch))
        };
    }
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
    if let Some(uniform) = job.placed.uniform {
        return dispatch!(settings.sheets.level, simd => add_uniform(simd, job, window, uniform, scratch));
    }
    dispatch!(level, simd => batch::runs::find(simd, job, window, &mut scratch.runs));
    match settings.rule() {
        Rule::Over => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Composite<false>>(simd, job, window, scratch))
        }
        Rule::Shaded => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Composite<true>>(simd, job, window, scratch))
        }
        Rule::Mixed => add!(Mixed),
        Rule::Statistic if settings.is_one_channel() => {
            dispatch!(level, simd => batch::add_brick::<_, batch::Statistics>(simd, job, window, scratch))
        }
        Rule::Statistic => add!(Gathered),
    }
}
