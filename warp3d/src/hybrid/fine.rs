//! A band drawn at the sub-pixels near depth edges, and nowhere else.

use fearless_simd::prelude::*;

use super::centres::Taking;
use super::{NO_SLOT, Seen, pixels_of};
use crate::bands::RowRange;
use crate::flags::Flags;
use crate::raster::{EightCells, LANES, Rim, Sink, Vertex, scan_triangle};

/// What the sub-pixels of a band's slots see.
pub(super) struct Fine<'a> {
    pub(super) width: usize,
    pub(super) rows: [usize; 2],
    pub(super) subpixels: usize,
    pub(super) slot: &'a [u32],
    pub(super) drawn: &'a Flags,
    pub(super) fine: &'a mut [Seen],
    pub(super) taking: Taking,
}

impl Fine<'_> {
    /// The whole numbers of a range of coordinates, cut at `first` and `end`.
    #[inline(always)]
    fn whole(range: RowRange, first: usize, end: usize) -> Option<[usize; 2]> {
        let (low, high) = (range.low.floor().max(first as f32), range.high.floor().min(end as f32 - 1.0));
        (low <= high).then_some([low as usize, high as usize])
    }

    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32) {
        let n = self.subpixels;
        let scale = n as f32;
        let [p, q, r] = corners;
        let finer = |v: Vertex| Vertex { x: v.x * scale - 0.5, y: v.y * scale - 0.5, ..v };
        let clip = [[0, (self.width * n) as i32], [(self.rows[0] * n) as i32, (self.rows[1] * n) as i32]];
        scan_triangle(simd, [finer(p), finer(q), finer(r)], clip, |column, row, nearness| {
            let (column, row) = (column as usize, row as usize);
            let slot = self.slot[(row / n - self.rows[0]) * self.width + column / n];
            if slot == NO_SLOT {
                return;
            }
            let seen = &mut self.fine[(slot as usize * n + row % n) * n + column % n];
            if self.taking == Taking::Always || nearness > seen.nearness {
                *seen = Seen { nearness, patch: id };
            }
        });
    }
}

impl Sink for Fine<'_> {
    #[inline(always)]
    fn eight<S: Simd>(&mut self, simd: S, cells: &EightCells<S>) {
        let [[left, right], [top, bottom]] = cells.bounds();
        for lane in (0..LANES).filter(|&lane| cells.joined >> lane & 1 != 0) {
            let columns = RowRange { low: left[lane], high: right[lane] };
            let rows = RowRange { low: top[lane], high: bottom[lane] };
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
    fn triangle<S: Simd>(&mut self, simd: S, corners: [Vertex; 3], id: u32, _rim: Rim) {
        let pixels = pixels_of(corners, self.width, self.rows);
        if pixels.is_some_and(|[columns, rows]| self.drawn.any(columns, rows)) {
            self.draw(simd, corners, id);
        }
    }

    #[inline(always)]
    fn wants(&self, columns: RowRange, rows: RowRange) -> bool {
        let pixels = Self::whole(columns, 0, self.width).zip(Self::whole(rows, self.rows[0], self.rows[1]));
        pixels.is_some_and(|(columns, rows)| self.drawn.any(columns, rows))
    }

    fn turned_away(&mut self, _corners: [Vertex; 3]) {}
}
