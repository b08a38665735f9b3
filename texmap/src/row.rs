//! Storage for a row of sub-pixels, and the look-ups of its runs in textures.

use fearless_simd::prelude::*;
use glam::Vec4;

use crate::lanes::{Lanes, ROW};
use crate::light::physical::Inputs;
use crate::lookup::small_footprint;
use crate::places::Places;
use crate::prepare::MAPS;
use crate::run::Run;
use crate::scene::Magnify;
use crate::span::SPAN_PX;
use crate::surface::{Surface, UvPlanes};
use crate::taps::look_up;
use crate::tile::Tile;

/// What the sub-pixels of a row show.
pub(crate) struct RowColours {
    pub(crate) base: [Vec4; ROW],
    pub(crate) emissive: [Vec4; ROW],
    pub(crate) light: Lanes,
    /// The maps of light, where there is any.
    pub(crate) maps: [[Vec4; ROW]; MAPS],
}

impl Default for RowColours {
    fn default() -> Self {
        Self {
            base: [Vec4::ZERO; ROW],
            emissive: [Vec4::ONE; ROW],
            light: [1.0; ROW],
            maps: [[Vec4::ZERO; ROW]; MAPS],
        }
    }
}

/// A run of a row and what it shows.
#[derive(Clone, Copy)]
pub(crate) struct RowRun<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) run: Run,
    pub(crate) column: usize,
}

/// Storage for one row of sub-pixels.
#[derive(Default)]
pub(crate) struct RowWork<'a> {
    pub(crate) colours: RowColours,
    pub(crate) base: Places,
    pub(crate) emissive: Places,
    pub(crate) map_places: [Places; MAPS],
    pub(crate) inputs: Inputs,
    pub(crate) runs: [Option<RowRun<'a>>; SPAN_PX],
}

/// Looks up a row of runs, those of one texture that follow one another together.
#[inline(always)]
pub(crate) fn look_up_row<S: Simd>(
    simd: S,
    tile: &Tile,
    runs: &[Option<RowRun>],
    pyramid_of: impl Fn(&Surface) -> Option<usize>,
    (places, out): (&Places, &mut [Vec4; ROW]),
) {
    let mut next = 0;
    while next < runs.len() {
        let (first, mut end, mut texture) = (next, 0, None);
        while let Some(run) = runs.get(next).copied().flatten() {
            let pyramid = pyramid_of(run.surface);
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
}
