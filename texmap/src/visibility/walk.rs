//! Where the edge lies between two sub-pixels that show different triangles.
//!
//! From each of the two, a walk over the mesh goes towards the other: out of a triangle over the line that is left
//! first, into the neighbour beyond, until no neighbour continues in this direction: there the surface's outline lies.
//! If one walk ends before it reaches the other sub-pixel, its outline is the edge; if both surfaces go on, one behind
//! the other, the edge is where their depths cross; if one walk arrives at the other's triangle, both are one surface,
//! which jumps at most where triangles do not share their corners (a seam of texture coordinates, a crease).
//!
//! Limits: between two sub-pixels only their two surfaces are examined; walks have at most [`MAX_STEPS`] steps.

use crate::screen::value;
use crate::visibility::RasterTriangle;
use crate::visibility::edges::{Crossing, Neighbours};

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
