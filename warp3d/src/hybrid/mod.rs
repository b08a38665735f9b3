//! The hybrid: surfaces are projected forward, coverage is resolved at sub-pixels, colour is reconstructed where it is
//! seen.
//!
//! First every pixel centre finds the piece of the reference that it sees. Near depth edges, and only there, a finer
//! lattice is drawn as well. Pixels inside one surface take their colour at the exact place in the reference; pixels
//! near an edge take it once for each surface that they see, weighted by the coverage that the pixel's Gaussian gives
//! each.

mod cells;
mod centres;
mod fine;

use std::ops::Range;

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::simd::Vectors;
use resample_core::{Camera, dispatch};

use crate::hybrid::fine::{Fine, Lattice, Places, one_beyond_doubt};
pub(crate) use crate::hybrid::fine::{SlotParts, one_surface};
use crate::project::prepared::Prepared;
use crate::project::{Projected, Scene, Terms, in_front};
use crate::stats::FrameStats;
use crate::surfaces::surface::{NO_PATCH, Surfaces};
use crate::view::flags::Flags;
use crate::view::layer::{BAND_ROWS, Purpose};
use crate::view::warp::Warp;
use centres::Centres;
pub(crate) use centres::NO_SLOT;

/// The pieces at the pixel centres, and the finer lattice near edges.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hybrid {
    projected: Projected,
    /// Nearness at each pixel centre.
    nearness: Vec<f32>,
    /// Piece at each pixel centre.
    pub(crate) patch: Vec<u32>,
    /// Largest nearness of a rim that touches the pixel.
    rim: Vec<f32>,
    /// For each pixel, its place in the band's finer lattice.
    pub(crate) slot: Vec<u32>,
    /// For each band, what the places of the finer lattice see.
    pub(crate) fine: Vec<Lattice>,
    /// The same for each band, grouped into surfaces.
    pub(crate) parts: Vec<SlotParts>,
    /// Pixels that are resolved from the finer lattice.
    pub(crate) at_edge: Flags,
    /// Pixels that a visible rim touches: they have a place in the finer lattice. Of any other pixel its centre
    /// sees all.
    touched: Flags,
}

/// The pieces at all places of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sight {
    Nothing,
    /// One surface, by one of its pieces.
    One(u32),
    Several,
}

/// How a picture is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct How {
    /// Sub-pixels along a pixel's side near depth edges.
    pub(crate) subpixels: usize,
    /// Vector instructions.
    pub(crate) level: Vectors,
    /// The purpose of the picture.
    pub(crate) purpose: Purpose,
}

/// The input of a drawing.
struct Drawing<'a> {
    scene: Scene<'a>,
    level: Vectors,
}

impl Hybrid {
    /// Draws `prepared` as `warp` lays it on the screen of `target`.
    pub(crate) fn draw(
        &mut self,
        prepared: &Prepared,
        warp: &Warp,
        target: &Camera,
        how: How,
        stats: &mut FrameStats,
    ) {
        let terms = Terms::new(warp);
        let scene = Scene {
            surfaces: &prepared.surfaces,
            segments: &prepared.segments,
            terms: &terms,
        };
        let clock = StageClock::start();
        self.projected.project(&scene, how.level);
        let known = prepared.known;
        stats.samples += known;
        stats.outside += known - in_front(&prepared.surfaces, &terms, known, how.level);
        stats.stages.project += clock.stop();
        let clock = StageClock::start();
        let drawing = Drawing {
            scene,
            level: how.level,
        };
        self.draw_centres(&drawing, target);
        self.give_slots(target, prepared.surfaces.tolerance);
        self.draw_fine(&drawing, target, how.subpixels);
        self.find_edges(&prepared.surfaces, target, how.subpixels);
        stats.edge_pixels += edges(&self.at_edge, target);
        stats.stages.accumulate += clock.stop();
    }

    fn draw_centres(&mut self, drawing: &Drawing<'_>, target: &Camera) {
        let width = target.width as usize;
        let pixels = width * target.height as usize;
        self.nearness.resize(pixels, 0.0);
        self.rim.resize(pixels, 0.0);
        self.patch.resize(pixels, NO_PATCH);
        let projected = &self.projected;
        let band = width * BAND_ROWS;
        let planes = self
            .nearness
            .par_chunks_mut(band)
            .zip(self.patch.par_chunks_mut(band));
        planes
            .zip(self.rim.par_chunks_mut(band))
            .enumerate()
            .for_each(|(index, ((nearness, patch), rim))| {
                // The last frame is cleared band by band: the band is then still in the cache when it is drawn.
                nearness.fill(f32::NEG_INFINITY);
                rim.fill(f32::NEG_INFINITY);
                patch.fill(NO_PATCH);
                let first = index * BAND_ROWS;
                let rows = [first, first + nearness.len() / width];
                let mut sink = Centres {
                    width,
                    rows,
                    nearness,
                    patch,
                    rim,
                };
                let scene = &drawing.scene;
                dispatch!(drawing.level, simd => projected.visit(simd, scene, rows, &mut sink));
            });
    }

    /// Gives the pixels that a visible rim touches their places in the finer lattice.
    fn give_slots(&mut self, target: &Camera, tolerance: f32) {
        let size = [target.width as usize, target.height as usize];
        let (rim, nearness) = (&self.rim, &self.nearness);
        // The farthest surface that the pixel and its neighbours see: at the limb of a round body the rim is well behind the
        // middle of its pixel, but not behind what is seen beyond it.
        let farthest = |at: usize| {
            let (x, y) = (at % size[0], at / size[0]);
            let rows = y.saturating_sub(1)..(y + 2).min(size[1]);
            let columns = x.saturating_sub(1)..(x + 2).min(size[0]);
            let of_row = |y: usize| nearness[y * size[0]..][columns.clone()].iter().copied();
            rows.flat_map(of_row).fold(f32::INFINITY, f32::min)
        };
        let none = f32::NEG_INFINITY.to_bits();
        let any_rim = |range: Range<usize>| {
            let differs = |any, v: &f32| any | (v.to_bits() != none);
            rim[range].iter().fold(false, differs)
        };
        self.touched = Flags::by_words(size[0], size[1], any_rim, |at| {
            rim[at] > f32::NEG_INFINITY && {
                let farthest = farthest(at);
                rim[at] >= farthest - tolerance * farthest.abs()
            }
        });
        self.slot.resize(size[0] * size[1], NO_SLOT);
        let (band, touched) = (size[0] * BAND_ROWS, &self.touched);
        self.slot
            .par_chunks_mut(band)
            .enumerate()
            .for_each(|(index, slots)| {
                slots.fill(NO_SLOT);
                let mut next = 0;
                for (y, row) in slots.chunks_mut(size[0]).enumerate() {
                    for x in touched.columns(index * BAND_ROWS + y, size[0]) {
                        row[x] = next;
                        next += 1;
                    }
                }
            });
    }

    /// A pixel is at an edge if it or one of its eight neighbours, as far as its Gaussian reaches, sees several surfaces,
    /// or another one than the next.
    fn find_edges(&mut self, surfaces: &Surfaces, target: &Camera, subpixels: usize) {
        let [width, height] = [target.width as usize, target.height as usize];
        let whole = u64::MAX >> (64 - subpixels * subpixels);
        let sight = |at: usize| self.sight(at, width, whole);
        let mixed = |at: usize| {
            if sight(at) == Sight::Several {
                return true;
            }
            // Between two pixels that no rim touches there is no edge.
            let differs = |next: usize| {
                (self.slot[at] != NO_SLOT || self.slot[next] != NO_SLOT)
                    && differ(sight(at), sight(next), surfaces)
            };
            (at % width + 1 < width && differs(at + 1))
                || (at / width + 1 < height && differs(at + width))
        };
        let near = self.touched.grown(1);
        self.at_edge = near.kept(width, mixed).grown(1);
    }

    fn sight(&self, at: usize, width: usize, whole: u64) -> Sight {
        if self.slot[at] == NO_SLOT {
            return if self.patch[at] == NO_PATCH {
                Sight::Nothing
            } else {
                Sight::One(self.patch[at])
            };
        }
        match self.parts[at / width / BAND_ROWS].of_slot(self.slot[at] as usize) {
            [] => Sight::Nothing,
            [part] if part.places == whole => Sight::One(part.id),
            _ => Sight::Several,
        }
    }

    fn draw_fine(&mut self, drawing: &Drawing<'_>, target: &Camera, subpixels: usize) {
        let width = target.width as usize;
        let (projected, slots, drawn) = (&self.projected, &self.slot, &self.touched);
        let places = Places::new(subpixels);
        let bands = slots.len().div_ceil(width * BAND_ROWS);
        self.fine.resize(bands, Lattice::default());
        self.parts.resize(bands, SlotParts::default());
        self.fine
            .par_iter_mut()
            .zip(&mut self.parts)
            .enumerate()
            .for_each(|(index, (lattice, parts))| {
                let first = index * BAND_ROWS;
                let rows = [first, (first + BAND_ROWS).min(target.height as usize)];
                let slot = &slots[rows[0] * width..rows[1] * width];
                let count = slot.iter().filter(|&&s| s != NO_SLOT).count();
                lattice.clear(count, &places);
                if count > 0 {
                    let mut sink = Fine {
                        width,
                        rows,
                        places: &places,
                        slot,
                        drawn,
                        lattice,
                    };
                    let scene = &drawing.scene;
                    dispatch!(drawing.level, simd => projected.visit(simd, scene, rows, &mut sink));
                }
                parts.group(
                    drawing.scene.surfaces,
                    &lattice.patch,
                    [subpixels * subpixels, places.stride()],
                );
            });
    }
}

/// Returns true if there is an edge between two neighbours that each see one thing.
fn differ(a: Sight, b: Sight, surfaces: &Surfaces) -> bool {
    match (a, b) {
        (Sight::Several, _) | (_, Sight::Several) => false,
        (Sight::One(a), Sight::One(b)) => !one_beyond_doubt(surfaces, a, b),
        _ => a != b,
    }
}

fn edges(at_edge: &Flags, target: &Camera) -> u64 {
    let width = target.width as usize;
    (0..target.height as usize)
        .map(|y| at_edge.columns(y, width).count() as u64)
        .sum()
}
