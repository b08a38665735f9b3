//! The hybrid: surfaces are projected forward, coverage is resolved at sub-pixels, colour is reconstructed where it is
//! seen.
//!
//! First every pixel centre finds the piece of the reference that it sees. Near depth edges, and only there, a finer
//! lattice is drawn as well. Pixels inside one surface take their colour at the exact place in the reference; pixels
//! near an edge take it once for each surface that they see, weighted by the coverage that the pixel's Gaussian gives
//! each.

use rayon::prelude::*;
use resample_core::Camera;

use crate::Reference;
use crate::bands::{BAND_ROWS, RowRange};
use crate::colour::Colours;
use crate::epipole::OcclusionOrder;
use crate::layer::Layer;
use crate::options::{MixedPixels, Visibility, WarpOptions};
use crate::patch::NO_PATCH;
use crate::raster::{Projected, Rim, Scene, Sink, Vertex, scan_triangle};
use crate::resolve::Resolver;
use crate::rims::Rims;
use crate::spline::coefficients;
use crate::stats::{FrameStats, StageClock};
use crate::surface::Surfaces;
use crate::warp::Warp;

/// A pixel that no finer lattice belongs to.
pub(crate) const NO_SLOT: u32 = u32::MAX;

/// A reference made ready for the hybrid.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    /// Its surfaces.
    pub(crate) surfaces: Surfaces,
    /// Its colours.
    pub(crate) colours: Colours,
    /// Where its edges lie between the samples.
    pub(crate) cuts: Rims,
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
    /// Whether a pixel is resolved from the finer lattice.
    pub(crate) at_edge: Vec<bool>,
}

/// What one place of the finer lattice sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Its nearness.
    pub(crate) nearness: f32,
    /// Its piece.
    pub(crate) patch: u32,
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
        Self { surfaces, colours: Colours { samples, coefficients }, cuts }
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
        let scene = Scene { surfaces: &prepared.surfaces, warp: &warp, cuts: &prepared.cuts };
        let clock = StageClock::start();
        self.projected.project(&prepared.surfaces, &warp, &prepared.cuts);
        let known = prepared.surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
        stats.samples += known;
        stats.outside += known - self.projected.in_front();
        stats.stages.project.add(clock.stop());
        let clock = StageClock::start();
        let order = match options.visibility {
            Visibility::ZBuffer => None,
            Visibility::OcclusionOrder => {
                let size = prepared.surfaces.size.map(|n| n as u32 + 1);
                Some(OcclusionOrder::new(&reference.camera, target, size))
            }
        };
        self.draw_centres(&scene, target, order);
        self.mark_edges(target, prepared.surfaces.tolerance);
        self.draw_fine(&scene, target, order, options.subpixels as usize);
        stats.edge_pixels += self.at_edge.iter().filter(|&&edge| edge).count() as u64;
        stats.stages.accumulate.add(clock.stop());
        let clock = StageClock::start();
        let layer =
            Resolver::new(self, (reference, prepared), &warp, target, options.subpixels as usize).layer();
        stats.stages.resolve.add(clock.stop());
        layer
    }

    fn draw_centres(&mut self, scene: &Scene<'_>, target: &Camera, order: Option<OcclusionOrder>) {
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
                let mut sink = Centres { width, rows, nearness, patch, rim, order };
                projected.visit(scene, rows, order, &mut sink);
            },
        );
    }

    /// A pixel is at an edge if a visible rim is within two pixels, as far as the pixel's Gaussian reaches.
    fn mark_edges(&mut self, target: &Camera, tolerance: f32) {
        let visible = |(&rim, &nearness): (&f32, &f32)| {
            rim > f32::NEG_INFINITY && rim >= nearness - tolerance * nearness.abs()
        };
        let touched: Vec<bool> = self.rim.par_iter().zip(&self.nearness).map(visible).collect();
        let size = [target.width as usize, target.height as usize];
        self.at_edge = dilated(&touched, size, 2);
        let drawn = dilated(&self.at_edge, size, 1);
        self.slot.clear();
        self.slot.resize(drawn.len(), NO_SLOT);
        let band = size[0] * BAND_ROWS;
        self.slot.par_chunks_mut(band).zip(drawn.par_chunks(band)).for_each(|(slots, drawn)| {
            for (next, (slot, _)) in slots.iter_mut().zip(drawn).filter(|(_, drawn)| **drawn).enumerate() {
                *slot = next as u32;
            }
        });
    }

    fn draw_fine(
        &mut self,
        scene: &Scene<'_>,
        target: &Camera,
        order: Option<OcclusionOrder>,
        subpixels: usize,
    ) {
        let width = target.width as usize;
        let (projected, slots) = (&self.projected, &self.slot);
        self.fine.resize(slots.len().div_ceil(width * BAND_ROWS), Vec::new());
        self.fine.par_iter_mut().enumerate().for_each(|(index, fine)| {
            let first = index * BAND_ROWS;
            let rows = [first, (first + BAND_ROWS).min(target.height as usize)];
            let slot = &slots[rows[0] * width..rows[1] * width];
            let count = slot.iter().filter(|&&s| s != NO_SLOT).count();
            fine.clear();
            fine.resize(count * subpixels * subpixels, Seen { nearness: f32::NEG_INFINITY, patch: NO_PATCH });
            if count > 0 {
                let mut sink = Fine { width, rows, subpixels, slot, fine, order };
                projected.visit(scene, rows, order, &mut sink);
            }
        });
    }
}

/// Draws a band at the pixel centres.
struct Centres<'a> {
    width: usize,
    rows: [usize; 2],
    nearness: &'a mut [f32],
    patch: &'a mut [u32],
    rim: &'a mut [f32],
    order: Option<OcclusionOrder>,
}

impl Centres<'_> {
    fn mark(&mut self, corners: [Vertex; 3]) {
        let Some([columns, rows]) = pixels_of(corners, self.width, self.rows) else { return };
        let nearness = corners.iter().fold(f32::NEG_INFINITY, |n, v| n.max(v.nearness));
        for row in rows[0]..=rows[1] {
            let first = (row - self.rows[0]) * self.width;
            for rim in &mut self.rim[first + columns[0]..=first + columns[1]] {
                *rim = rim.max(nearness);
            }
        }
    }
}

impl Sink for Centres<'_> {
    fn triangle(&mut self, corners: [Vertex; 3], id: u32, rim: Rim) {
        if rim == Rim::Rim {
            self.mark(corners);
        }
        let clip = [[0, self.width as i32], self.rows.map(|r| r as i32)];
        let first_row = self.rows[0] as i32;
        let centred = corners.map(|v| Vertex { x: v.x - 0.5, y: v.y - 0.5, ..v });
        scan_triangle(centred, clip, |column, row, nearness| {
            let at = (row - first_row) as usize * self.width + column as usize;
            if self.order.is_some() || nearness > self.nearness[at] {
                self.nearness[at] = nearness;
                self.patch[at] = id;
            }
        });
    }

    fn wants(&self, _columns: RowRange, _rows: RowRange) -> bool {
        true
    }

    fn turned_away(&mut self, corners: [Vertex; 3]) {
        self.mark(corners);
    }
}

/// Draws a band at the sub-pixels of the slots.
struct Fine<'a> {
    width: usize,
    rows: [usize; 2],
    subpixels: usize,
    slot: &'a [u32],
    fine: &'a mut [Seen],
    order: Option<OcclusionOrder>,
}

impl Sink for Fine<'_> {
    fn triangle(&mut self, corners: [Vertex; 3], id: u32, _rim: Rim) {
        let Some([columns, rows]) = pixels_of(corners, self.width, self.rows) else { return };
        let slot_of = |column: usize, row: usize| self.slot[(row - self.rows[0]) * self.width + column];
        let any =
            (rows[0]..=rows[1]).any(|row| (columns[0]..=columns[1]).any(|c| slot_of(c, row) != NO_SLOT));
        if !any {
            return;
        }
        let n = self.subpixels;
        let scale = n as f32;
        let fine = corners.map(|v| Vertex { x: v.x * scale - 0.5, y: v.y * scale - 0.5, ..v });
        let clip = [[0, (self.width * n) as i32], self.rows.map(|r| (r * n) as i32)];
        scan_triangle(fine, clip, |column, row, nearness| {
            let (column, row) = (column as usize, row as usize);
            let slot = slot_of(column / n, row / n);
            if slot == NO_SLOT {
                return;
            }
            let seen = &mut self.fine[(slot as usize * n + row % n) * n + column % n];
            if self.order.is_some() || nearness > seen.nearness {
                *seen = Seen { nearness, patch: id };
            }
        });
    }

    fn wants(&self, columns: RowRange, rows: RowRange) -> bool {
        let first = (rows.low.max(self.rows[0] as f32)) as usize;
        let last = (rows.high.min(self.rows[1] as f32 - 1.0)) as usize;
        let left = columns.low.max(0.0) as usize;
        let right = (columns.high.max(-1.0) + 1.0).min(self.width as f32) as usize;
        left < right
            && (first..=last).any(|row| {
                let from = (row - self.rows[0]) * self.width;
                self.slot[from + left..from + right].iter().any(|&slot| slot != NO_SLOT)
            })
    }

    fn turned_away(&mut self, _corners: [Vertex; 3]) {}
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

/// The flags, grown by `by` pixels along each axis.
fn dilated(flags: &[bool], size: [usize; 2], by: usize) -> Vec<bool> {
    let [width, height] = size;
    let mut wide = vec![false; flags.len()];
    wide.par_chunks_mut(width).zip(flags.par_chunks(width)).for_each(|(wide, row)| {
        for x in (0..width).filter(|&x| row[x]) {
            wide[x.saturating_sub(by)..(x + by + 1).min(width)].fill(true);
        }
    });
    let mut grown = vec![false; flags.len()];
    grown.par_chunks_mut(width).enumerate().for_each(|(y, grown)| {
        for from in y.saturating_sub(by)..(y + by + 1).min(height) {
            for (g, &w) in grown.iter_mut().zip(&wide[from * width..(from + 1) * width]) {
                *g |= w;
            }
        }
    });
    grown
}
