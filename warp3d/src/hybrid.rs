//! The hybrid: surfaces are projected forward, coverage is resolved at sub-pixels, colour is reconstructed where it is
//! seen.
//!
//! First every pixel centre finds the piece of the reference that it sees. Near depth edges, and only there, a finer
//! lattice is drawn as well. Pixels inside one surface take their colour at the exact place in the reference; pixels
//! near an edge take it once for each surface that they see, weighted by the coverage that the pixel's Gaussian gives
//! each.

mod centres;
mod fine;
mod slots;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;
use resample_core::Camera;

use crate::Reference;
use crate::bands::BAND_ROWS;
use crate::colour::Colours;
use crate::epipole::OcclusionOrder;
use crate::flags::Flags;
use crate::layer::Layer;
use crate::options::{MixedPixels, Visibility, WarpOptions};
use crate::patch::NO_PATCH;
use crate::raster::{Projected, Quarters, Scene, Segments, Vertex};
use crate::resolve::Resolver;
use crate::rims::Rims;
use crate::spline::coefficients;
use crate::stats::{FrameStats, StageClock};
use crate::surface::Surfaces;
use crate::warp::Warp;
use centres::{Centres, Taking};
use fine::Fine;
pub(crate) use slots::{SlotPart, SlotParts, one_surface};

/// From this many samples to the nearest cut on a surface is looked up without a look at its edges.
const CLEAR: u8 = 3;

/// A pixel that no finer lattice belongs to.
pub(crate) const NO_SLOT: u32 = u32::MAX;

/// A reference made ready for the hybrid.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    /// Its surfaces.
    pub(crate) surfaces: Surfaces,
    /// Its colours.
    pub(crate) colours: Colours,
    /// Its cells, as they are drawn.
    segments: Segments,
    /// Number of samples with a depth.
    known: u64,
}

/// What the pixel centres see, and the finer lattice near edges.
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
    /// For each band, the pieces of the finer lattice, `subpixels`^2 a slot.
    pub(crate) fine: Vec<Vec<Seen>>,
    /// The same for each band, grouped into surfaces.
    pub(crate) parts: Vec<SlotParts>,
    /// Whether a pixel is resolved from the finer lattice.
    pub(crate) at_edge: Flags,
    /// Whether a pixel has a place in the finer lattice: those, and their neighbours.
    drawn: Flags,
}

/// What one place of the finer lattice sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Its nearness.
    pub(crate) nearness: f32,
    /// Its piece.
    pub(crate) patch: u32,
}

/// What is drawn, and how.
struct Drawing<'a> {
    scene: Scene<'a>,
    order: Option<OcclusionOrder>,
    level: Level,
}

impl Drawing<'_> {
    fn taking(&self) -> Taking {
        if self.order.is_some() { Taking::Always } else { Taking::Nearer }
    }
}

impl Prepared {
    /// Finds surfaces and edges of `reference`.
    pub(crate) fn new(reference: &Reference, options: &WarpOptions) -> Self {
        let surfaces = Surfaces::new(reference, options.tolerance);
        let mut samples: Vec<_> = reference.colour.par_iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
        let cuts = match options.mixed {
            MixedPixels::Keep => Rims::half_way(&surfaces),
            MixedPixels::Unmix => Rims::unmixed(&surfaces, &mut samples),
        };
        let coefficients = coefficients(&samples, &surfaces);
        let segments = Segments::new(&surfaces, Quarters::new(&surfaces, &cuts));
        let known = surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
        Self { surfaces, colours: Colours { samples, coefficients }, segments, known }
    }
}

impl Hybrid {
    /// Draws `prepared` from `target`.
    pub(crate) fn render(
        &mut self,
        (reference, prepared): (&Reference, &Prepared),
        target: &Camera,
        options: &WarpOptions,
        stats: &mut FrameStats,
    ) -> Layer {
        let warp = Warp::new(&reference.camera, target);
        let scene = Scene { surfaces: &prepared.surfaces, segments: &prepared.segments };
        let clock = StageClock::start();
        self.projected.project(&scene, &warp);
        stats.samples += prepared.known;
        stats.outside += prepared.known - self.projected.in_front();
        stats.stages.project.add(clock.stop());
        let clock = StageClock::start();
        let order = match options.visibility {
            Visibility::ZBuffer => None,
            Visibility::OcclusionOrder => {
                let size = prepared.surfaces.size.map(|n| n as u32 + 1);
                Some(OcclusionOrder::new(&reference.camera, target, size))
            }
        };
        let drawing = Drawing { scene, order, level: options.simd.resolve() };
        self.draw_centres(&drawing, target);
        self.mark_edges(target, prepared.surfaces.tolerance);
        self.draw_fine(&drawing, target, options.subpixels as usize);
        self.narrow_edges(&prepared.surfaces, target, options.subpixels as usize);
        stats.edge_pixels += edges(&self.at_edge, target);
        stats.stages.accumulate.add(clock.stop());
        let clock = StageClock::start();
        let layer = Resolver::new(self, (reference, prepared), &warp, target, options).layer();
        stats.stages.resolve.add(clock.stop());
        layer
    }

    fn draw_centres(&mut self, drawing: &Drawing<'_>, target: &Camera) {
        let width = target.width as usize;
        let pixels = width * target.height as usize;
        for plane in [&mut self.nearness, &mut self.rim] {
            plane.clear();
            plane.resize(pixels, f32::NEG_INFINITY);
        }
        self.patch.clear();
        self.patch.resize(pixels, NO_PATCH);
        let projected = &self.projected;
        let band = width * BAND_ROWS;
        let planes = self.nearness.par_chunks_mut(band).zip(self.patch.par_chunks_mut(band));
        planes.zip(self.rim.par_chunks_mut(band)).enumerate().for_each(
            |(index, ((nearness, patch), rim))| {
                let first = index * BAND_ROWS;
                let rows = [first, first + nearness.len() / width];
                let mut sink = Centres { width, rows, nearness, patch, rim, taking: drawing.taking() };
                let (scene, order) = (&drawing.scene, drawing.order);
                dispatch!(drawing.level, simd => projected.visit(simd, scene, (rows, order), &mut sink));
            },
        );
    }

    /// A pixel is at an edge if a visible rim is within two pixels, as far as the pixel's Gaussian reaches.
    fn mark_edges(&mut self, target: &Camera, tolerance: f32) {
        let size = [target.width as usize, target.height as usize];
        let (rim, nearness) = (&self.rim, &self.nearness);
        let touched = Flags::new(size[0], size[1], |i| {
            rim[i] > f32::NEG_INFINITY && rim[i] >= nearness[i] - tolerance * nearness[i].abs()
        });
        self.at_edge = touched.grown(2);
        self.drawn = self.at_edge.grown(1);
        self.slot.clear();
        self.slot.resize(size[0] * size[1], NO_SLOT);
        let (band, drawn) = (size[0] * BAND_ROWS, &self.drawn);
        self.slot.par_chunks_mut(band).enumerate().for_each(|(index, slots)| {
            let mut next = 0;
            for (y, row) in slots.chunks_mut(size[0]).enumerate() {
                for x in drawn.columns(index * BAND_ROWS + y, size[0]) {
                    row[x] = next;
                    next += 1;
                }
            }
        });
    }

    /// Of the pixels at edges, keeps those whose neighbours do not all see the whole of one surface, far from its cuts.
    fn narrow_edges(&mut self, surfaces: &Surfaces, target: &Camera, subpixels: usize) {
        let [width, height] = [target.width as usize, target.height as usize];
        let whole = u64::MAX >> (64 - subpixels * subpixels);
        let one = |at: usize| {
            let slot = self.slot[at];
            let parts = self.parts[at / width / BAND_ROWS].of_slot(slot as usize);
            parts.first().filter(|part| parts.len() == 1 && part.places == whole)
        };
        let mixed = |at: usize| {
            if self.slot[at] == NO_SLOT {
                return false;
            }
            let Some(part) = one(at) else { return true };
            if part.patch.clearance(surfaces) < CLEAR {
                return true;
            }
            let differs = |next: usize| {
                self.slot[next] != NO_SLOT && one(next).is_some_and(|next| !part.is_one_with(next, surfaces))
            };
            (at % width + 1 < width && differs(at + 1)) || (at / width + 1 < height && differs(at + width))
        };
        let mixed = Flags::new(width, height, mixed).grown(1);
        self.at_edge.keep(&mixed);
    }

    fn draw_fine(&mut self, drawing: &Drawing<'_>, target: &Camera, subpixels: usize) {
        let width = target.width as usize;
        let (projected, slots, drawn) = (&self.projected, &self.slot, &self.drawn);
        let bands = slots.len().div_ceil(width * BAND_ROWS);
        self.fine.resize(bands, Vec::new());
        self.parts.resize(bands, SlotParts::default());
        self.fine.par_iter_mut().zip(&mut self.parts).enumerate().for_each(|(index, (fine, parts))| {
            let first = index * BAND_ROWS;
            let rows = [first, (first + BAND_ROWS).min(target.height as usize)];
            let slot = &slots[rows[0] * width..rows[1] * width];
            let count = slot.iter().filter(|&&s| s != NO_SLOT).count();
            fine.clear();
            fine.resize(count * subpixels * subpixels, Seen { nearness: f32::NEG_INFINITY, patch: NO_PATCH });
            if count > 0 {
                let mut sink = Fine { width, rows, subpixels, slot, drawn, fine, taking: drawing.taking() };
                let (scene, order) = (&drawing.scene, drawing.order);
                dispatch!(drawing.level, simd => projected.visit(simd, scene, (rows, order), &mut sink));
            }
            parts.group(drawing.scene.surfaces, fine, subpixels * subpixels);
        });
    }
}

fn edges(at_edge: &Flags, target: &Camera) -> u64 {
    let width = target.width as usize;
    (0..target.height as usize).map(|y| at_edge.columns(y, width).count() as u64).sum()
}

/// First and last column and row that a triangle's bounding box touches inside a band.
fn pixels_of(corners: [Vertex; 3], width: usize, rows: [usize; 2]) -> Option<[[usize; 2]; 2]> {
    let range = |of: fn(&Vertex) -> f32, first: usize, end: usize| {
        let low = corners.iter().map(of).fold(f32::INFINITY, f32::min).floor().max(first as f32);
        let high = corners.iter().map(of).fold(f32::NEG_INFINITY, f32::max).floor().min(end as f32 - 1.0);
        (low <= high).then_some([low as usize, high as usize])
    };
    Some([range(|v| v.x, 0, width)?, range(|v| v.y, rows[0], rows[1])?])
}
