//! A row of sub-pixels: the splats of the texels around each, run by run.
//!
//! Sub-pixels that show one triangle and stand beside each other are a run; runs of one texture that follow one another
//! are looked up together.

use fearless_simd::prelude::*;
use glam::Vec4;

use crate::row::{RowColours, RowRun, RowWork, look_up_row};
use crate::row_light::light_row;
use crate::run::Run;
use crate::scene::AlphaMode;
use crate::span::{NONE, SPAN_PX};
use crate::surface::Surface;
use crate::tile::Tile;

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
        ..
    } = work;
    let mut emits = false;
    let mut reflects = false;
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
        emits |= surface.emissive_colour != Vec4::ZERO;
        reflects |= surface.maps.is_some();
    }
    look_up_row(
        simd,
        tile,
        &runs[..count],
        |surface| surface.base.as_ref().map(|planes| planes.pyramid),
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
            |surface| surface.emissive.as_ref().map(|planes| planes.pyramid),
            (emissive, &mut colours.emissive),
        );
    }
    if reflects {
        light_row(simd, tile, work, count);
    }
    let RowWork { colours, runs, .. } = work;
    for RowRun {
        surface,
        run,
        column,
    } in runs[..count].iter().flatten()
    {
        if surface.maps.is_none() {
            tile.shade_run(surface, (run, *column), colours);
        }
    }
}

impl Tile<'_> {
    /// Turns what a run's look-ups gave into premultiplied colours.
    #[inline(always)]
    fn shade_run(&self, surface: &Surface, (run, column): (&Run, usize), row: &mut RowColours) {
        let material = surface.material(self.frame.scene);
        let plain = material.alpha == AlphaMode::Opaque && surface.emissive_colour == Vec4::ZERO;
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
