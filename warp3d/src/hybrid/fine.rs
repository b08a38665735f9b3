//! A band drawn at the sub-pixels of the pixels that a rim touches, and nowhere else.
//!
//! All places of a pixel are asked at once: edge functions are linear over the screen, so each costs one addition a
//! pixel. The pieces that a pixel's places see are stored side by side, ready to be grouped.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, mask32x8, u32x16};

use crate::hybrid::centres::{Boxes, NO_SLOT, PixelBox};
use crate::project::{EightCells, EightQuads, EightTriangles, HALVES, SLACK, Sink, Vertex};
use crate::surfaces::patch::{Patch, share_a_corner};
use crate::surfaces::surface::{NO_PATCH, Surfaces};
use crate::view::flags::Flags;
use crate::view::layer::RowRange;

/// Places that are asked at once: those of a pixel with four sub-pixels along its side.
const PLACES: usize = 16;

/// Where the places of a pixel are, px from its corner; filled up with NaN, which lies in no triangle.
#[derive(Clone, Debug)]
pub(super) struct Places {
    x: Vec<f32>,
    y: Vec<f32>,
    /// A place this close outside an edge counts, px.
    slack: f32,
}

/// The pieces at the places of a band's slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lattice {
    /// Nearness of each place, slot by slot.
    nearness: Vec<f32>,
    /// Piece at each place.
    pub(super) patch: Vec<u32>,
    /// Entries of a slot.
    stride: usize,
}

/// Draws what the sub-pixels of a band's slots see.
pub(super) struct Fine<'a> {
    pub(super) width: usize,
    pub(super) rows: [usize; 2],
    pub(super) places: &'a Places,
    pub(super) slot: &'a [u32],
    pub(super) drawn: &'a Flags,
    pub(super) lattice: &'a mut Lattice,
}

impl Places {
    /// For `subpixels` places along a pixel's side.
    pub(super) fn new(subpixels: usize) -> Self {
        let at = |of: fn(usize, usize) -> usize| -> Vec<f32> {
            let place = |i: usize| (of(i, subpixels) as f32 + 0.5) / subpixels as f32;
            let mut places: Vec<f32> = (0..subpixels * subpixels).map(place).collect();
            places.resize(places.len().next_multiple_of(PLACES), f32::NAN);
            places
        };
        Self {
            x: at(|i, n| i % n),
            y: at(|i, n| i / n),
            slack: SLACK / subpixels as f32,
        }
    }

    /// Entries of a slot.
    pub(super) fn stride(&self) -> usize {
        self.x.len()
    }
}

impl Lattice {
    /// The piece that a place of a slot sees.
    #[inline(always)]
    pub(crate) fn piece(&self, slot: usize, place: usize) -> u32 {
        self.patch[slot * self.stride + place]
    }

    /// `slots` slots that see nothing.
    pub(super) fn clear(&mut self, slots: usize, places: &Places) {
        self.stride = places.stride();
        self.nearness.clear();
        self.nearness
            .resize(slots * places.stride(), f32::NEG_INFINITY);
        self.patch.clear();
        self.patch.resize(slots * places.stride(), NO_PATCH);
    }
}

/// A convex piece of N corners at sixteen places of a pixel, and how it goes on from pixel to pixel.
struct Scan<S: Simd, const N: usize> {
    /// Edge functions less what still counts: above 0 inside.
    edges: [f32x16<S>; N],
    /// The steps from a pixel to its right and to its lower neighbour.
    steps: [[f32; 2]; N],
    nearness: f32x16<S>,
    nearness_steps: [f32; 2],
    /// Slivers extrapolate without bound inside the slack.
    bounds: [f32; 2],
}

impl<S: Simd, const N: usize> Scan<S, N> {
    /// At the places `x`, `y` (px). The first three corners have the plane.
    #[inline(always)]
    fn new(simd: S, corners: &[Vertex; N], slack: f32, [x, y]: [f32x16<S>; 2]) -> Self {
        let constant = |v: f32| f32x16::splat(simd, v);
        let mut edges = [x; N];
        let mut steps = [[0.0; 2]; N];
        for k in 0..N {
            let (a, b) = (corners[k], corners[(k + 1) % N]);
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            // The slack is part of the constant.
            let at_zero = dy * a.x - dx * a.y + slack * (dx.abs() + dy.abs());
            edges[k] = constant(dx).mul_add(y, constant(at_zero)) - constant(dy) * x;
            steps[k] = [-dy, dx];
        }
        let [p, q, r] = [corners[0], corners[1], corners[2]];
        let (qx, qy, rx, ry) = (q.x - p.x, q.y - p.y, r.x - p.x, r.y - p.y);
        let scale = 1.0 / (qx * ry - qy * rx);
        let (near_q, near_r) = (q.nearness - p.nearness, r.nearness - p.nearness);
        let nearness_steps = [
            (near_q * ry - near_r * qy) * scale,
            (near_r * qx - near_q * rx) * scale,
        ];
        let nearness = constant(nearness_steps[0]).mul_add(x - constant(p.x), constant(p.nearness));
        let nearness = constant(nearness_steps[1]).mul_add(y - constant(p.y), nearness);
        let mut bounds = [p.nearness; 2];
        for corner in &corners[1..] {
            bounds = [
                bounds[0].min(corner.nearness),
                bounds[1].max(corner.nearness),
            ];
        }
        Self {
            edges,
            steps,
            nearness,
            nearness_steps,
            bounds,
        }
    }

    /// The places inside, some pixels further.
    #[inline(always)]
    fn inside(&self, simd: S, [columns, rows]: [f32; 2]) -> fearless_simd::mask32x16<S> {
        let at = |k: usize| {
            let step = self.steps[k][0] * columns + self.steps[k][1] * rows;
            self.edges[k] + f32x16::splat(simd, step)
        };
        let mut least = at(0);
        for k in 1..N {
            least = least.min(at(k));
        }
        least.simd_ge(f32x16::splat(simd, 0.0))
    }

    /// The nearness of the places, some pixels further.
    #[inline(always)]
    fn nearness(&self, simd: S, [columns, rows]: [f32; 2]) -> f32x16<S> {
        let step = self.nearness_steps[0] * columns + self.nearness_steps[1] * rows;
        let [farthest, nearest] = self.bounds.map(|v| f32x16::splat(simd, v));
        (self.nearness + f32x16::splat(simd, step))
            .max(farthest)
            .min(nearest)
    }
}

impl Fine<'_> {
    /// The whole numbers of a range of coordinates, cut at `first` and `end`.
    #[inline(always)]
    fn whole(range: RowRange, first: usize, end: usize) -> Option<[usize; 2]> {
        let (low, high) = (
            range.low.floor().max(first as f32),
            range.high.floor().min(end as f32 - 1.0),
        );
        (low <= high).then_some([low as usize, high as usize])
    }

    /// Draws a convex piece that faces the eye, in the pixels of its box. Coordinates count from the box: numbers stay small.
    #[inline(always)]
    fn draw<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        mut corners: [Vertex; N],
        PixelBox { columns, rows }: PixelBox,
        id: u32,
    ) {
        for corner in &mut corners {
            corner.x -= columns[0] as f32;
            corner.y -= rows[0] as f32;
        }
        for first in (0..self.places.stride()).step_by(PLACES) {
            let x = f32x16::from_slice(simd, &self.places.x[first..first + PLACES]);
            let y = f32x16::from_slice(simd, &self.places.y[first..first + PLACES]);
            let scan = Scan::new(simd, &corners, self.places.slack, [x, y]);
            for row in rows[0]..=rows[1] {
                let from = (row - self.rows[0]) * self.width;
                for column in columns[0]..=columns[1] {
                    let slot = self.slot[from + column];
                    if slot == NO_SLOT {
                        continue;
                    }
                    let step = [(column - columns[0]) as f32, (row - rows[0]) as f32];
                    let at = slot as usize * self.places.stride() + first;
                    self.lattice.take(simd, &scan, at, step, id);
                }
            }
        }
    }

    /// Draws those of eight triangles in `some`, which face the eye.
    #[inline(always)]
    fn draw_all<S: Simd>(
        &mut self,
        simd: S,
        some: mask32x8<S>,
        triangles: &EightTriangles<S>,
        id: impl Fn(usize) -> u32,
    ) {
        let boxes = Boxes::new(simd, some, triangles.bounds(), self.width, self.rows);
        self.draw_boxes(simd, &boxes, |lane| triangles.lane(lane), id);
    }

    /// Draws the pieces whose boxes touch any pixel that is drawn.
    #[inline(always)]
    fn draw_boxes<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        boxes: &Boxes<S>,
        piece: impl Fn(usize) -> [Vertex; N],
        id: impl Fn(usize) -> u32,
    ) {
        let mut bits = boxes.some.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let pixels = boxes.lane(lane);
            if self.drawn.any(pixels.columns, pixels.rows) {
                self.draw(simd, piece(lane), pixels, id(lane));
            }
        }
    }
}

impl Lattice {
    #[inline(always)]
    fn take<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        scan: &Scan<S, N>,
        at: usize,
        step: [f32; 2],
        id: u32,
    ) {
        let inside = scan.inside(simd, step);
        if !inside.any_true() {
            return;
        }
        let (nearness, patch) = (
            &mut self.nearness[at..at + PLACES],
            &mut self.patch[at..at + PLACES],
        );
        let (before, near) = (
            f32x16::from_slice(simd, nearness),
            scan.nearness(simd, step),
        );
        let taken = inside & near.simd_gt(before);
        taken.select(near, before).store_slice(nearness);
        let seen = u32x16::from_slice(simd, patch);
        taken
            .select(u32x16::splat(simd, id), seen)
            .store_slice(patch);
    }
}

impl Sink for Fine<'_> {
    #[inline(always)]
    fn eight<S: Simd>(&mut self, simd: S, cells: &EightCells<S>) {
        let joined = mask32x8::from_bitmask(simd, cells.joined);
        let [columns, rows] = cells.bounds(simd, joined);
        if !self.wants(columns, rows) {
            return;
        }
        for k in 0..2 {
            let triangles = cells.triangles(k);
            let front = joined & triangles.area().simd_gt(f32x8::splat(simd, 0.0));
            self.draw_all(simd, front, &triangles, |lane| cells.id(lane, k));
        }
    }

    #[inline(always)]
    fn quads<S: Simd>(&mut self, simd: S, quads: &EightQuads<S>, id: impl Fn(usize) -> u32) {
        if quads.halves.any_true() {
            for half in HALVES {
                let triangles = quads.half(half);
                let front = triangles.area().simd_gt(f32x8::splat(simd, 0.0));
                self.draw_all(simd, front & quads.halves, &triangles, &id);
            }
        }
        let boxes = Boxes::new(simd, quads.whole, quads.bounds(), self.width, self.rows);
        self.draw_boxes(simd, &boxes, |lane| quads.lane(lane), id);
    }

    #[inline(always)]
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool {
        let pixels =
            Self::whole(columns, 0, self.width).zip(Self::whole(rows, self.rows[0], self.rows[1]));
        pixels.is_some_and(|(columns, rows)| self.drawn.any(columns, rows))
    }
}

// The surfaces at each pixel near an edge, grouped once, for all the pixels whose Gaussian reaches it.
//
// Pieces of joined cells that share a corner are one surface, as their numbers alone show; other pieces are
// one if the one lies on the plane of the other.

/// One surface in one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlotPart {
    /// The places of the finer lattice that see it, one bit each.
    pub(crate) places: u64,
    /// One of its pieces.
    pub(crate) id: u32,
    /// The plane of that piece.
    pub(crate) patch: Patch,
}

/// The parts of the slots of a band.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlotParts {
    parts: Vec<SlotPart>,
    /// First part of each slot, and the end.
    first: Vec<u32>,
}

impl SlotParts {
    /// Groups the places of every slot: the first `count` of each `stride` of `pieces`.
    pub(super) fn group(
        &mut self,
        surfaces: &Surfaces,
        pieces: &[u32],
        [count, stride]: [usize; 2],
    ) {
        self.parts.clear();
        self.first.clear();
        self.first.push(0);
        // The last piece of each part of the slot at hand.
        let mut last = Vec::new();
        for places in pieces.chunks_exact(stride) {
            let begin = self.parts.len();
            last.clear();
            for (place, &piece) in places[..count]
                .iter()
                .enumerate()
                .filter(|(_, piece)| **piece != NO_PATCH)
            {
                let parts = &mut self.parts[begin..];
                match find(surfaces, parts, &last, piece) {
                    Ok(part) => {
                        parts[part].places |= 1 << place;
                        last[part] = piece;
                    }
                    Err(patch) => {
                        self.parts.push(SlotPart {
                            places: 1 << place,
                            id: piece,
                            patch,
                        });
                        last.push(piece);
                    }
                }
            }
            self.first.push(self.parts.len() as u32);
        }
    }

    /// The parts of a slot.
    pub(crate) fn of_slot(&self, slot: usize) -> &[SlotPart] {
        &self.parts[self.first[slot] as usize..self.first[slot + 1] as usize]
    }
}

/// The part that a piece belongs to, or the plane of a new one.
fn find(surfaces: &Surfaces, parts: &[SlotPart], last: &[u32], id: u32) -> Result<usize, Patch> {
    let near = last
        .iter()
        .position(|&last| share_a_corner(surfaces, last, id));
    if let Some(part) = near {
        return Ok(part);
    }
    let patch = Patch::new(surfaces, id);
    let tolerance = surfaces.tolerance;
    parts
        .iter()
        .position(|part| one_surface(&part.patch, &patch, tolerance))
        .ok_or(patch)
}

/// Two pixels are separate from this part of the tolerance on: one surface must not hold a jump across which
/// colours are taken apart, four tolerances, at up to three samples' distance.
const STRICTLY: f32 = 0.75;

/// Returns true if two pieces are of the same surface beyond doubt.
pub(super) fn one_beyond_doubt(surfaces: &Surfaces, a: u32, b: u32) -> bool {
    let plane = |id: u32| Patch::new(surfaces, id);
    share_a_corner(surfaces, a, b)
        || one_surface(&plane(a), &plane(b), STRICTLY * surfaces.tolerance)
}

/// Returns true if two pieces are of one plane: the one lies on the other's, as far away as it is, and slopes as it does.
pub(crate) fn one_surface(a: &Patch, b: &Patch, tolerance: f32) -> bool {
    let allowed = f64::from(tolerance) * b.disparity.abs();
    let distance = (a.place - b.place).abs().max_element();
    let expected = a.disparity_at(b.place);
    (expected - b.disparity).abs() <= allowed * (2.0 + distance)
        && (a.slope - b.slope).abs().max_element() <= 2.0 * allowed
}
