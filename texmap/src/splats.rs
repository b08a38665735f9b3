//! Splats: the texels around each sub-pixel that some pixel is made from, summed there; and sub-pixels to pixels.
//!
//! Sub-pixels that show one triangle and stand beside each other in a row are taken together, in vector code. Where the
//! place of an edge is known, sub-pixels are corrected before anything translucent is laid over them.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;

use crate::filter::PixelFilter;
use crate::lookup::small_footprint;
use crate::places::{Lanes, Places, ROW};
use crate::run::Run;
use crate::scene::{AlphaMode, Magnify};
use crate::span::{NONE, SPAN_PX, TILE_PX};
use crate::surface::{Surface, UvPlanes};
use crate::taps::look_up;
use crate::tile::{Tile, TileImage, TileWork, subpixel_px};

/// Pixels that are filtered together: four of four channels fill one 512-bit vector.
const GROUP_PX: usize = 4;

/// Which groups of pixels of a tile are made from sub-pixels.
type Groups = [[bool; TILE_PX / GROUP_PX]; TILE_PX];

/// The pixels of a tile.
type Pixels = [[Vec4; TILE_PX]; TILE_PX];

impl Tile<'_> {
    /// Colours of the sub-pixels that some pixel wants: splats, and translucent surfaces over those behind.
    pub(crate) fn lay_splats(&self, work: &mut TileWork, image: &mut TileImage) {
        if work.from_subpixels.is_empty() {
            return;
        }
        work.colours.resize(work.visibility.ids.len(), [0.0; 4]);
        image.splats += 4 * dispatch!(self.frame.simd, simd => lay_rows(simd, self, work));
        let per_pixel = self.frame.filter.per_pixel;
        correct_edges(work, per_pixel);
        for layer in &work.visibility.layers {
            let Some(surface) = &work.surfaces[layer.id as usize] else {
                continue;
            };
            let at = layer.subpixel as usize;
            if !work.wanted[at / SPAN_PX / per_pixel * SPAN_PX + at % SPAN_PX] {
                continue;
            }
            let front = self.colour(surface, subpixel_px(self.frame.filter, at));
            let behind = &mut work.colours[at];
            *behind = (front + (1.0 - front.w) * Vec4::from(*behind)).to_array();
            image.splats += 4;
        }
    }

    /// Filters sub-pixels down to the pixels that are made from them.
    pub(crate) fn resolve(&self, work: &TileWork, image: &mut TileImage) {
        let place = |pixel: u16| [usize::from(pixel) % TILE_PX, usize::from(pixel) / TILE_PX];
        let mut wanted = Groups::default();
        for [x, y] in work.from_subpixels.iter().copied().map(place) {
            wanted[y][x / GROUP_PX] = true;
        }
        let mut pixels = [[Vec4::ZERO; TILE_PX]; TILE_PX];
        let filter = self.frame.filter;
        dispatch!(self.frame.simd, simd => filter_groups(simd, filter, &work.colours, &wanted, &mut pixels));
        for &pixel in &work.from_subpixels {
            let [x, y] = place(pixel);
            // The corrections at edges are exact only in their sum, and may leave a remainder of either sign.
            let sum = pixels[y][x].max(Vec4::ZERO);
            image.rgba[usize::from(pixel)] = sum.truncate().extend(sum.w.min(1.0)).to_array();
        }
    }

    /// Looks up what a run of a row sees in a texture: only places where others are to be looked up with them.
    #[inline(always)]
    fn place_run<S: Simd>(
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

/// What the sub-pixels of a row show.
struct RowColours {
    base: [Vec4; ROW],
    emissive: [Vec4; ROW],
    light: Lanes,
}

/// A run of a row and what it shows.
#[derive(Clone, Copy)]
struct RowRun<'a> {
    surface: &'a Surface,
    run: Run,
    column: usize,
}

/// Storage for one row of sub-pixels.
struct RowWork<'a> {
    colours: RowColours,
    base: Places,
    emissive: Places,
    runs: [Option<RowRun<'a>>; SPAN_PX],
}

/// Lays the splats of every wanted sub-pixel; how many sub-pixels there were.
#[simd]
fn lay_rows<S: Simd>(simd: S, tile: &Tile, work: &mut TileWork) -> u64 {
    let filter = tile.frame.filter;
    let TileWork {
        visibility,
        surfaces,
        colours,
        wanted,
        ..
    } = work;
    let mut row_work = RowWork {
        colours: RowColours {
            base: [Vec4::ZERO; ROW],
            emissive: [Vec4::ONE; ROW],
            light: [1.0; ROW],
        },
        base: Places::default(),
        emissive: Places::default(),
        runs: [None; SPAN_PX],
    };
    let mut count = 0;
    for row in 0..SPAN_PX * filter.per_pixel {
        let wanted = &wanted[row / filter.per_pixel * SPAN_PX..][..SPAN_PX];
        let ids = &visibility.ids[row * SPAN_PX..][..SPAN_PX];
        let mut runs = 0;
        let mut column = 0;
        let mut all = 0;
        while column < SPAN_PX {
            let id = ids[column];
            if !wanted[column] || id == NONE {
                row_work.colours.base[column] = Vec4::ZERO;
                column += 1;
                continue;
            }
            let mut end = column + 1;
            while end < SPAN_PX && wanted[end] && ids[end] == id {
                end += 1;
            }
            if let Some(surface) = &surfaces[id as usize] {
                let run = Run {
                    first_px: filter.position_px(column, row),
                    len: end - column,
                };
                row_work.runs[runs] = Some(RowRun {
                    surface,
                    run,
                    column,
                });
                runs += 1;
                all += run.len;
            }
            column = end;
        }
        lay_row(simd, tile, &mut row_work, runs);
        count += all as u64;
        let colours = &mut colours[row * SPAN_PX..][..SPAN_PX];
        for (out, colour) in colours.iter_mut().zip(&row_work.colours.base) {
            *out = colour.to_array();
        }
    }
    count
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

/// Filters the sub-pixels of the wanted groups of pixels.
#[simd]
fn filter_groups<S: Simd>(
    _: S,
    filter: &PixelFilter,
    colours: &[[f32; 4]],
    wanted: &Groups,
    pixels: &mut Pixels,
) {
    const NUMBERS: usize = 4 * GROUP_PX;
    for y in 0..TILE_PX {
        for group in (0..TILE_PX / GROUP_PX).filter(|&group| wanted[y][group]) {
            let first = y * filter.per_pixel * SPAN_PX + group * GROUP_PX;
            let mut sums = [0.0; NUMBERS];
            for window in &filter.rows {
                let colours =
                    colours[first + window.row * SPAN_PX + window.column..].as_flattened();
                for (k, weight) in window.weights.iter().enumerate() {
                    for (sum, colour) in sums.iter_mut().zip(&colours[4 * k..4 * k + NUMBERS]) {
                        *sum += colour * weight;
                    }
                }
            }
            for (pixel, sum) in pixels[y][group * GROUP_PX..]
                .iter_mut()
                .zip(sums.chunks_exact(4))
            {
                *pixel = Vec4::from_slice(sum);
            }
        }
    }
}

/// Adds to the colours of neighbouring sub-pixels what the place of the edge between them makes of the jump.
fn correct_edges(work: &mut TileWork, per_pixel: usize) {
    let TileWork {
        edges,
        colours,
        wanted,
        jumps,
        ..
    } = work;
    let wanted =
        |at: u32| wanted[at as usize / SPAN_PX / per_pixel * SPAN_PX + at as usize % SPAN_PX];
    jumps.clear();
    jumps.extend(
        edges
            .all
            .iter()
            .map(|edge| match edge.between.map(&wanted) {
                [true, true] => {
                    let [p, q] = edge.between.map(|at| Vec4::from(colours[at as usize]));
                    p - q
                }
                _ => Vec4::ZERO,
            }),
    );
    for (edge, jump) in edges.all.iter().zip(jumps) {
        for (at, share) in edge.between.into_iter().zip(edge.shares) {
            let colour = &mut colours[at as usize];
            *colour = (Vec4::from(*colour) + *jump * share).to_array();
        }
    }
}
