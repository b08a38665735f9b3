//! Splats: the texels around each sub-pixel that some pixel is made from, summed there; and sub-pixels to pixels.
//!
//! Sub-pixels that show one triangle and stand beside each other in a row are taken together, in vector code. Where the
//! place of an edge is known, sub-pixels are corrected before anything translucent is laid over them.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;

use crate::filter::PixelFilter;
use crate::run::Run;
use crate::scene::AlphaMode;
use crate::span::{NONE, SPAN_PX, TILE_PX};
use crate::surface::{Surface, UvPlanes};
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

    /// Premultiplied colours of a surface along a run, into `out`.
    #[inline(always)]
    fn lay_run(&self, surface: &Surface, run: &Run, out: &mut [Vec4]) {
        let material = surface.material(self.frame.scene);
        self.look_up_run(surface, &surface.base, run, out);
        let mut light = [1.0; SPAN_PX];
        run.light(surface, &self.view, &mut light);
        let plain = material.alpha == AlphaMode::Opaque && material.emissive_colour == Vec4::ZERO;
        if plain && surface.colours.is_none() {
            let factor = material.base_colour;
            for (colour, light) in out.iter_mut().zip(light) {
                *colour = (factor * *colour * light).truncate().extend(1.0);
            }
            return;
        }
        let mut emissive = [Vec4::ONE; SPAN_PX];
        self.look_up_run(surface, &surface.emissive, run, &mut emissive);
        for (k, colour) in out.iter_mut().enumerate() {
            *colour = self.shaded(surface, run.at(k), light[k], *colour, emissive[k]);
        }
    }

    #[inline(always)]
    fn look_up_run(
        &self,
        surface: &Surface,
        planes: &Option<UvPlanes>,
        run: &Run,
        out: &mut [Vec4],
    ) {
        match planes {
            None => out.fill(Vec4::ONE),
            Some(planes) => {
                let pyramid = &self.frame.scene.pyramids[planes.pyramid];
                run.look_up(surface, planes, pyramid, self.frame.filter.spacing_px, out);
            }
        }
    }
}

/// Lays the splats of every wanted sub-pixel; how many sub-pixels there were.
#[simd]
fn lay_rows<S: Simd>(_: S, tile: &Tile, work: &mut TileWork) -> u64 {
    let filter = tile.frame.filter;
    let TileWork {
        visibility,
        surfaces,
        colours,
        wanted,
        ..
    } = work;
    let mut count = 0;
    for row in 0..SPAN_PX * filter.per_pixel {
        let wanted = &wanted[row / filter.per_pixel * SPAN_PX..][..SPAN_PX];
        let ids = &visibility.ids[row * SPAN_PX..][..SPAN_PX];
        let colours = &mut colours[row * SPAN_PX..][..SPAN_PX];
        let mut column = 0;
        while column < SPAN_PX {
            let id = ids[column];
            let same = (column..SPAN_PX)
                .take_while(|&c| wanted[c] && ids[c] == id)
                .count();
            let run = Run {
                first_px: filter.position_px(column, row),
                len: same,
            };
            let out = &mut colours[column..column + same];
            let mut run_colours = [Vec4::ZERO; SPAN_PX];
            match surfaces.get(id as usize).and_then(Option::as_deref) {
                Some(surface) if id != NONE && same > 0 => {
                    tile.lay_run(surface, &run, &mut run_colours[..same]);
                    count += same as u64;
                }
                _ => {}
            }
            for (out, colour) in out.iter_mut().zip(&run_colours) {
                *out = colour.to_array();
            }
            column += same.max(1);
        }
    }
    count
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
