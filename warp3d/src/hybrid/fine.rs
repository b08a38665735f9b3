//! A band drawn at the sub-pixels of the pixels that a rim touches, and nowhere else.
//!
//! All places of a pixel are asked at once: edge functions are linear over the screen, so each costs one addition a
//! pixel. The pieces that a pixel's places see are stored side by side, ready to be grouped.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, u32x16};

use super::pixels::{NO_SLOT, pixels_of};
use crate::bands::RowRange;
use crate::flags::Flags;
use crate::piece::NO_PATCH;
use crate::raster::{EightCells, LANES, SLACK, Sink, Vertex};

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

/// What the places of a band's slots see.
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

/// A triangle at sixteen places of a pixel, and how it goes on from pixel to pixel.
struct Scan<S: Simd> {
    /// Edge functions less what still counts: above 0 inside.
    edges: [f32x16<S>; 3],
    /// What a pixel to the right and a pixel below add.
    steps: [[f32; 2]; 3],
    nearness: f32x16<S>,
    nearness_steps: [f32; 2],
    /// Slivers extrapolate without bound inside the slack.
    bounds: [f32; 2],
}

impl<S: Simd> Scan<S> {
    /// At the places `x`, `y` (px).
    #[inline(always)]
    fn new(simd: S, [p, q, r]: [Vertex; 3], slack: f32, [x, y]: [f32x16<S>; 2]) -> Self {
        let constant = |v: f32| f32x16::splat(simd, v);
        let mut edges = [x; 3];
        let mut steps = [[0.0; 2]; 3];
        let scale = 1.0 / ((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x));
        let mut nearness = constant(0.0);
        let mut nearness_steps = [0.0; 2];
        for (k, (a, b, over)) in [(q, r, p), (r, p, q), (p, q, r)].into_iter().enumerate() {
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            let edge = constant(dx) * (y - constant(a.y)) - constant(dy) * (x - constant(a.x));
            let share = over.nearness * scale;
            nearness += edge * constant(share);
            nearness_steps = [
                nearness_steps[0] - dy * share,
                nearness_steps[1] + dx * share,
            ];
            edges[k] = edge + constant(slack * (dx.abs() + dy.abs()));
            steps[k] = [-dy, dx];
        }
        let bounds = [
            p.nearness.min(q.nearness).min(r.nearness),
            p.nearness.max(q.nearness).max(r.nearness),
        ];
        Self {
            edges,
            steps,
            nearness,
            nearness_steps,
            bounds,
        }
    }

    /// Which places lie inside, some pixels further.
    #[inline(always)]
    fn inside(&self, simd: S, [columns, rows]: [f32; 2]) -> fearless_simd::mask32x16<S> {
        let at = |k: usize| {
            let step = self.steps[k][0] * columns + self.steps[k][1] * rows;
            self.edges[k] + f32x16::splat(simd, step)
        };
        at(0)
            .min(at(1))
            .min(at(2))
            .simd_ge(f32x16::splat(simd, 0.0))
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

    /// Draws a triangle that faces the eye.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32) {
        let Some([columns, rows]) = pixels_of(corners, self.width, self.rows) else {
            return;
        };
        let corner = [columns[0], rows[0]].map(|v| f32x16::splat(simd, v as f32));
        for first in (0..self.places.stride()).step_by(PLACES) {
            let x = f32x16::from_slice(simd, &self.places.x[first..first + PLACES]) + corner[0];
            let y = f32x16::from_slice(simd, &self.places.y[first..first + PLACES]) + corner[1];
            let scan = Scan::new(simd, corners, self.places.slack, [x, y]);
            for row in rows[0]..=rows[1] {
                let slots =
                    &self.slot[(row - self.rows[0]) * self.width..][columns[0]..=columns[1]];
                for (column, &slot) in slots
                    .iter()
                    .enumerate()
                    .filter(|(_, slot)| **slot != NO_SLOT)
                {
                    let step = [column as f32, (row - rows[0]) as f32];
                    let at = slot as usize * self.places.stride() + first;
                    self.lattice.take(simd, &scan, at, step, id);
                }
            }
        }
    }
}

impl Lattice {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, scan: &Scan<S>, at: usize, step: [f32; 2], id: u32) {
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
        let [[left, right], [top, bottom]] = cells.bounds();
        for lane in (0..LANES).filter(|&lane| cells.joined >> lane & 1 != 0) {
            let columns = RowRange {
                low: left[lane],
                high: right[lane],
            };
            let rows = RowRange {
                low: top[lane],
                high: bottom[lane],
            };
            if !self.wants(columns, rows) {
                continue;
            }
            for k in 0..2 {
                let [p, q, r] = cells.triangles(k).lane(lane);
                if (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) > 0.0 {
                    self.draw(simd, [p, q, r], cells.id(lane, k));
                }
            }
        }
    }

    #[inline(always)]
    fn rim<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32) {
        self.draw(simd, corners, id);
    }

    #[inline(always)]
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool {
        let pixels =
            Self::whole(columns, 0, self.width).zip(Self::whole(rows, self.rows[0], self.rows[1]));
        pixels.is_some_and(|(columns, rows)| self.drawn.any(columns, rows))
    }

    fn turned_away(&mut self, _corners: [Vertex; 3]) {}
}
