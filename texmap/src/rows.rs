//! A row of sub-pixels: the splats of the texels around each, run by run.
//!
//! Sub-pixels that show one triangle and stand beside each other are a run; runs of one texture that follow one another
//! are looked up together.

use fearless_simd::prelude::*;
use glam::Vec4;

use crate::lanes::{Lanes, ROW};
use crate::lookup::small_footprint;
use crate::places::Places;
use crate::run::Run;
use crate::scene::{AlphaMode, Magnify};
use crate::span::{NONE, SPAN_PX};
use crate::surface::{Surface, UvPlanes};
use crate::taps::look_up;
use crate::tile::Tile;

/// What the sub-pixels of a row show.
pub(crate) struct RowColours {
    pub(crate) base: [Vec4; ROW],
    emissive: [Vec4; ROW],
    light: Lanes,
}

impl Default for RowColours {
    fn default() -> Self {
        Self {
            base: [Vec4::ZERO; ROW],
            emissive: [Vec4::ONE; ROW],
            light: [1.0; ROW],
        }
    }
}

/// A run of a row and what it shows.
#[derive(Clone, Copy)]
struct RowRun<'a> {
    surface: &'a Surface,
    run: Run,
    column: usize,
}

/// Storage for one row of sub-pixels.
#[derive(Default)]
pub(crate) struct RowWork<'a> {
    pub(crate) colours: RowColours,
    base: Places,
    emissive: Places,
    runs: [Option<RowRun<'a>>; SPAN_PX],
}

/// What a row of sub-pixels shows, and where that is wanted.
pub(crate) struct RowIds<'a> {
    pub(crate) row: usize,
    pub(crate) ids: &'a [u32],
    pub(crate) wanted: &'a [bool],
}

/// Lays the splats of a row into the colours of `work`; how many sub-pixels there were.
#[inline(always)]
pub(crate) fn lay_ids<'a, S: Simd>(
    simd: S,
    tile: &Tile,
    surfaces: &'a [Option<Box<Surface>>],
    shown: &RowIds,
    work: &mut RowWork<'a>,
) -> u64 {
    let RowIds { row, ids, wanted } = *shown;
    let (mut runs, mut column, mut all) = (0, 0, 0);
    while column < SPAN_PX {
        let id = ids[column];
        if !wanted[column] || id == NONE {
            work.colours.base[column] = Vec4::ZERO;
            column += 1;
            continue;
        }
        let mut end = column + 1;
        while end < SPAN_PX && wanted[end] && ids[end] == id {
            end += 1;
        }
        if let Some(surface) = &surfaces[id as usize] {
            let run = Run {
                first_px: tile.frame.filter.position_px(column, row),
                len: end - column,
            };
            work.runs[runs] = Some(RowRun {
                surface,
                run,
                column,
            });
            runs += 1;
            all += run.len;
        }
        column = end;
    }
    lay_row(simd, tile, work, runs);
    all as u64
}

/// Lays the splats of the first `count` runs of a row.
#[inline(always)]
fn lay_row<S: Simd>(simd: S, tile: &Tile, work: &mut RowWork, count: usize) {
    let RowWork {
        colours,
        base,
        emissive,
        runs,
    } = work;
    let mut emits = false;
    for RowRun {
        surface,
        run,
        column,
    } in runs[..count].iter().flatten()
    {
        run.light(simd, (surface, &tile.view), *column, &mut colours.light);
        let run = (run, *column);
        tile.place_run(
            simd,
            surface,
            surface.base.as_ref(),
            run,
            (base, &mut colours.base),
        );
        emits |= surface.emissive.is_some();
    }
    look_up_row(
        simd,
        tile,
        &runs[..count],
        |surface| surface.base.as_ref(),
        (base, &mut colours.base),
    );
    if emits {
        for RowRun {
            surface,
            run,
            column,
        } in runs[..count].iter().flatten()
        {
            let out = (&mut *emissive, &mut colours.emissive);
            tile.place_run(
                simd,
                surface,
                surface.emissive.as_ref(),
                (run, *column),
                out,
            );
        }
        look_up_row(
            simd,
            tile,
            &runs[..count],
            |surface| surface.emissive.as_ref(),
            (emissive, &mut colours.emissive),
        );
    }
    for RowRun {
        surface,
        run,
        column,
    } in runs[..count].iter().flatten()
    {
        tile.shade_run(surface, (run, *column), colours);
    }
}

/// Looks up a row of runs, those of one texture that follow one another together.
#[inline(always)]
fn look_up_row<S: Simd>(
    simd: S,
    tile: &Tile,
    runs: &[Option<RowRun>],
    planes: impl Fn(&Surface) -> Option<&UvPlanes>,
    (places, out): (&Places, &mut [Vec4; ROW]),
) {
    let mut next = 0;
    while next < runs.len() {
        let (first, mut end, mut texture) = (next, 0, None);
        while let Some(run) = runs.get(next).copied().flatten() {
            let pyramid = planes(run.surface).map(|planes| planes.pyramid);
            if next > first && (pyramid != texture || run.column != end) {
                break;
            }
            texture = pyramid;
            end = run.column + run.run.len;
            next += 1;
        }
        if let (Some(pyramid), Some(Some(run))) = (texture, runs.get(first)) {
            let pyramid = &tile.frame.scene.pyramids[pyramid];
            look_up(simd, pyramid, places, run.column..end, out);
        }
    }
}

impl Tile<'_> {
    /// Looks up what a run of a row sees in a texture: only places where others are to be looked up with them.
    #[inline(always)]
    pub(crate) fn place_run<S: Simd>(
        &self,
        simd: S,
        surface: &Surface,
        planes: Option<&UvPlanes>,
        (run, column): (&Run, usize),
        (places, out): (&mut Places, &mut [Vec4; ROW]),
    ) {
        let Some(planes) = planes else {
            places.count[column..column + run.len].fill(0.0);
            return out[column..column + run.len].fill(Vec4::ONE);
        };
        out[column..column + run.len].fill(Vec4::ZERO);
        let side_px = self.frame.filter.spacing_px;
        let pyramid = &self.frame.scene.pyramids[planes.pyramid];
        places.set(simd, (surface, planes), (run, column), (pyramid, side_px));
        let nearest = pyramid.magnify == Magnify::Nearest;
        if !nearest && !planes.borders.any() {
            return;
        }
        for k in 0..run.len {
            let at = column + k;
            if (nearest && places.is_plain(at)) || places.sees_border(at, planes) {
                places.count[at] = 0.0;
                let uv = surface.uv_at(planes, run.at(k));
                out[at] = small_footprint(pyramid, &uv, side_px, &planes.borders);
            }
        }
    }

    /// Turns what a run's look-ups gave into premultiplied colours.
    #[inline(always)]
    fn shade_run(&self, surface: &Surface, (run, column): (&Run, usize), row: &mut RowColours) {
        let material = surface.material(self.frame.scene);
        let plain = material.alpha == AlphaMode::Opaque && material.emissive_colour == Vec4::ZERO;
        if plain && surface.colours.is_none() {
            let factor = material.base_colour;
            for at in column..column + run.len {
                row.base[at] = (factor * row.base[at] * row.light[at])
                    .truncate()
                    .extend(1.0);
            }
            return;
        }
        for k in 0..run.len {
            let at = column + k;
            let emissive = row.emissive[at];
            row.base[at] = self.shaded(surface, run.at(k), row.light[at], row.base[at], emissive);
        }
    }
}
