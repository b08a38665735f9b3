//! The exact place between two neighbouring sub-pixels at which the visible surface changes.
//!
//! A sum over sub-pixels counts each as if its whole cell showed what its middle shows, so an edge is seen in steps.
//! Between two neighbours p and q of the lattice that show different triangles, the place t (0 at p, 1 at q) of the
//! edge is known: the triangles' own lines, or where their depths cross. Along the lattice's line the sum then lacks
//! the integral of the pixel's filter from the middle to t, times the jump in colour, and the first end term of the
//! midpoint rule. With the filter linear between p and q both are one number for p and one for q:
//!
//! u/2 -+ (u^2/2 + 1/24), u = t - 1/2,
//!
//! by which the jump is added to the colours of p and of q. Of the lattice's two directions the one that crosses the
//! edge more steeply is corrected: across its lines the sum is then over a smooth function, which needs no correction.
//!
//! Limits: edges are straight between neighbours; what no sub-pixel shows is not found; translucent layers and cuts by
//! alpha are not corrected.

use std::ops::Range;

use resample_core::simd::Vectors;

use crate::screen::{SPAN_HEIGHT, SPAN_WIDTH};
use crate::visibility::filter::{LatticeStep, PixelFilter};
use crate::visibility::runs::{changes, each_bit};

/// The share of an edge between two sub-pixels in each of them, as a part of the jump from the second to the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// The two sub-pixels of the tile.
    pub(crate) between: [u32; 2],
    /// Share of the jump that each gets.
    pub(crate) shares: [f32; 2],
}

/// All edges of a tile, by the cell of their first sub-pixel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    pub(crate) all: Vec<Edge>,
    /// By pixel of the span: where its edges begin; one more for the end.
    first: Vec<u32>,
    unsorted: Vec<Edge>,
    /// By pair of rows: where they differ.
    changes: Vec<u32>,
}

/// An edge on the way between two sub-pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// 0 at the first, 1 at the second.
    pub(crate) t: f32,
    /// Direction across the edge, in any length.
    pub(crate) across: [f32; 2],
}

/// Two neighbouring sub-pixels that show different things.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbours {
    /// Their triangles: places in the tile's list, or no triangle's number.
    pub(crate) ids: [u32; 2],
    /// Where they are, px from the corner of the tile's border.
    pub(crate) at: [[f32; 2]; 2],
}

impl Edges {
    /// Finds the edges between all sub-pixels; `crossing` gives the place of one, if there is a jump there.
    pub(crate) fn find(
        &mut self,
        (filter, simd): (&PixelFilter, Vectors),
        ids: &[u32],
        mut crossing: impl FnMut(&Neighbours) -> Option<Crossing>,
    ) {
        self.unsorted.clear();
        for direction in 0..2 {
            let step = &filter.steps[direction];
            changes(simd, ids, &step.pairs, &mut self.changes);
            each_pair(filter, ids, (step, &self.changes), |between, pair| {
                let Some(Crossing { t, across }) = crossing(&pair) else {
                    return;
                };
                let steepness = |step: &LatticeStep| {
                    (across[0] * step.vector_px[0] + across[1] * step.vector_px[1]).abs()
                };
                let [this, other] = [direction, 1 - direction].map(|d| steepness(&filter.steps[d]));
                if this > other || (this == other && direction == 0) {
                    self.unsorted.push(Edge {
                        between,
                        shares: shares(t),
                    });
                }
            });
        }
        self.sort(filter);
    }

    /// Forgets all edges.
    pub(crate) fn clear(&mut self) {
        self.all.clear();
        self.first.clear();
        self.first.resize(SPAN_WIDTH * SPAN_HEIGHT + 1, 0);
    }

    /// The edges whose first sub-pixel lies in a pixel of the span.
    pub(crate) fn of_cell(&self, cell: usize) -> &[Edge] {
        &self.all[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// The edges whose first sub-pixels lie in consecutive pixels of the span.
    pub(crate) fn of_cells(&self, cells: Range<usize>) -> &[Edge] {
        &self.all[self.first[cells.start] as usize..self.first[cells.end] as usize]
    }

    /// Sorts by cell, keeping the order within each.
    fn sort(&mut self, filter: &PixelFilter) {
        let cell = |edge: &Edge| {
            let at = edge.between[0] as usize;
            at / SPAN_WIDTH / filter.per_pixel * SPAN_WIDTH + at % SPAN_WIDTH
        };
        self.first.clear();
        self.first.resize(SPAN_WIDTH * SPAN_HEIGHT + 1, 0);
        self.unsorted
            .iter()
            .for_each(|edge| self.first[cell(edge) + 1] += 1);
        for i in 0..SPAN_WIDTH * SPAN_HEIGHT {
            self.first[i + 1] += self.first[i];
        }
        self.unsorted.sort_by_key(cell);
        std::mem::swap(&mut self.all, &mut self.unsorted);
    }
}

/// The shares of p and q in the jump at `t`.
fn shares(t: f32) -> [f32; 2] {
    let u = t.clamp(0.0, 1.0) - 0.5;
    let curved = 0.5 * u * u + 1.0 / 24.0;
    [0.5 * u - curved, 0.5 * u + curved]
}

/// Calls `changed` for all neighbours one lattice step apart that show different things.
fn each_pair(
    filter: &PixelFilter,
    ids: &[u32],
    (step, changes): (&LatticeStep, &[u32]),
    mut changed: impl FnMut([u32; 2], Neighbours),
) {
    for (pair, &bits) in step.pairs.iter().zip(changes) {
        for k in each_bit(bits) {
            let between = [pair.here + k, pair.there + k];
            // To the last bit where they were drawn: an edge may pass through one of them.
            let at = between.map(|at| filter.position_px(at % SPAN_WIDTH, at / SPAN_WIDTH));
            let ids = between.map(|at| ids[at]);
            changed(between.map(|at| at as u32), Neighbours { ids, at });
        }
    }
}
