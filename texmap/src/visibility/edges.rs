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

use crate::screen::{SPAN_HEIGHT, SPAN_WIDTH, value};
use crate::visibility::RasterTriangle;
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

// Where the edge lies between two sub-pixels that show different triangles.
//
// From each of the two, a walk over the mesh goes towards the other: out of a triangle over the line that is left
// first, into the neighbour beyond, until no neighbour continues in this direction: there the surface's outline lies.
// If one walk ends before it reaches the other sub-pixel, its outline is the edge; if both surfaces go on, one behind
// the other, the edge is where their depths cross; if one walk arrives at the other's triangle, both are one surface,
// which jumps at most where triangles do not share their corners (a seam of texture coordinates, a crease).
//
// Limits: between two sub-pixels only their two surfaces are examined; walks have at most [`MAX_STEPS`] steps.

/// Triangles that a walk may enter. Where more lie between two sub-pixels nothing is corrected: a guess that bounds the
/// time, since the more there are the smaller is the step from one sub-pixel's colour to the next.
const MAX_STEPS: usize = 12;

/// The tile's triangles for a walk, by their places in its list.
pub(crate) trait Mesh {
    /// The triangle; `None` if it is translucent or nowhere near the tile.
    fn triangle(&self, id: u32) -> Option<&RasterTriangle>;

    /// Returns true if both triangles are of one surface, seen from one side, have a corner in common, and jump nowhere there.
    fn meet(&self, ids: [u32; 2]) -> bool;

    /// The triangle beyond the line opposite `corner`; likely it is `expected`.
    fn beyond(&self, id: u32, corner: usize, expected: u32) -> Option<NextTriangle>;
}

/// A neighbour over a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NextTriangle {
    pub(crate) id: u32,
    /// The corner of it that is opposite the line.
    pub(crate) corner: usize,
    /// True if colour may jump there.
    pub(crate) jumps: bool,
}

/// How a walk ended.
enum Walk {
    /// At once: nothing is shown where it began.
    Nothing,
    /// At an outline, or within reach of the other sub-pixel.
    End(End),
    /// At the other sub-pixel's triangle; where colour jumped on the way.
    Met(Option<Crossing>),
    /// After too many steps.
    Lost,
}

/// Where a surface ends on the way between two sub-pixels.
#[derive(Clone, Copy)]
struct End {
    /// The place on the way, 0 where the walk began; 1 if the surface goes on beyond the other sub-pixel.
    t: f32,
    /// Direction across the outline; `None` if the surface goes on.
    across: Option<[f32; 2]>,
    /// The last triangle before.
    last: u32,
}

/// The edge between two sub-pixels; `None` where colour does not jump or the place of the jump is unknown.
#[inline(always)]
pub(crate) fn crossing(mesh: &impl Mesh, pair: &Neighbours) -> Option<Crossing> {
    let ([p, q], [a, b]) = (pair.at, pair.ids);
    if mesh.meet([a, b]) {
        return None;
    }
    let there = walk(mesh, [a, b], [p, q]);
    if let Walk::Met(jump) = there {
        return jump;
    }
    match (there, walk(mesh, [b, a], [q, p])) {
        (_, Walk::Met(jump)) => jump.map(|edge| Crossing {
            t: 1.0 - edge.t,
            ..edge
        }),
        (Walk::End(out), Walk::Nothing) => Some(Crossing {
            t: out.t,
            across: out.across?,
        }),
        (Walk::Nothing, Walk::End(into)) => Some(Crossing {
            t: 1.0 - into.t,
            across: into.across?,
        }),
        (Walk::End(out), Walk::End(into)) => between(
            mesh,
            pair,
            [
                out,
                End {
                    t: 1.0 - into.t,
                    ..into
                },
            ],
        ),
        _ => None,
    }
}

/// The edge between a surface that ends at `out` and one that begins at `into`: where the nearer one ends, or where
/// their depths cross.
fn between(mesh: &impl Mesh, pair: &Neighbours, [out, into]: [End; 2]) -> Option<Crossing> {
    if out.t <= into.t {
        // Neither goes on behind the other: what lies between is not known.
        return Some(Crossing {
            t: 0.5 * (out.t + into.t),
            across: out.across?,
        });
    }
    let [p, q] = pair.at;
    // By how much the first surface is nearer than the second.
    let nearer = |ids: [u32; 2], t: f32| {
        let [one, two] = [mesh.triangle(ids[0])?.key(), mesh.triangle(ids[1])?.key()];
        let difference = [0, 1, 2].map(|k| one[k] - two[k]);
        Some((
            value(
                &difference,
                [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])],
            ),
            difference,
        ))
    };
    let (at_into, difference) = nearer([pair.ids[0], into.last], into.t)?;
    let (at_out, _) = nearer([out.last, pair.ids[1]], out.t)?;
    if let (true, Some(across)) = (at_into <= 0.0, into.across) {
        return Some(Crossing { t: into.t, across });
    }
    if let (true, Some(across)) = (at_out >= 0.0, out.across) {
        return Some(Crossing { t: out.t, across });
    }
    let share = at_into / (at_into - at_out);
    // Otherwise the change has another cause, such as a cut by alpha.
    (at_into >= 0.0 && at_out <= 0.0 && share.is_finite()).then_some(Crossing {
        t: into.t + share * (out.t - into.t),
        across: [difference[0], difference[1]],
    })
}

/// Walks from the first place, within the first triangle, towards the second.
fn walk(mesh: &impl Mesh, [from, to]: [u32; 2], [p, q]: [[f32; 2]; 2]) -> Walk {
    let Some(mut triangle) = mesh.triangle(from) else {
        return Walk::Nothing;
    };
    let mut id = from;
    let mut jump = None;
    for _ in 0..MAX_STEPS {
        let Some((edge, corner)) = triangle.leaves(p, q) else {
            return Walk::End(End {
                t: 1.0,
                across: None,
                last: id,
            });
        };
        let beyond = mesh
            .beyond(id, corner, to)
            .and_then(|beyond| Some((beyond, mesh.triangle(beyond.id)?)));
        let Some((beyond, next)) = beyond.filter(|(beyond, next)| next.opens(beyond.corner, p, q))
        else {
            return Walk::End(End {
                t: edge.t,
                across: Some(edge.across),
                last: id,
            });
        };
        if beyond.jumps {
            jump.get_or_insert(edge);
        }
        if beyond.id == to {
            return Walk::Met(jump);
        }
        (id, triangle) = (beyond.id, next);
    }
    Walk::Lost
}
