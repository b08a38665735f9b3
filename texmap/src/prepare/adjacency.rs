//! The triangles of a mesh that share a line: found by the positions of its two ends, so that seams of texture coordinates
//! and of normals, where corners are stored twice, do not part a surface.
//!
//! Takes positions and triangles, once; sorts corners by position, then lines by their ends.
//!
//! Limits: positions must agree to the bit; a line of three and more triangles joins none of them.

use std::num::NonZeroU32;

use rayon::prelude::*;

/// A triangle beyond a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbour {
    /// Index into the mesh's triangles.
    pub(crate) triangle: u32,
    /// One more than the corner opposite the line.
    corner: NonZeroU32,
}

impl Neighbour {
    /// Its corner opposite the line.
    pub(crate) fn corner(self) -> usize {
        self.corner.get() as usize - 1
    }
}

/// One line of one triangle.
#[derive(Clone, Copy)]
struct Line {
    /// The first corner of each of its ends' positions, the smaller first.
    ends: [u32; 2],
    triangle: u32,
    /// Opposite the line.
    corner: u8,
}

/// By triangle and corner: what lies beyond the line opposite the corner.
pub(crate) fn neighbours(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
) -> Vec<[Option<Neighbour>; 3]> {
    let first = first_at_position(positions);
    let line = |triangle: usize, corner: usize| {
        let ends = [1, 2].map(|step| first[triangles[triangle][(corner + step) % 3] as usize]);
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        Line {
            ends,
            triangle: triangle as u32,
            corner: corner as u8,
        }
    };
    let mut lines: Vec<Line> = (0..3 * triangles.len())
        .into_par_iter()
        .map(|k| line(k / 3, k % 3))
        .collect();
    lines.par_sort_unstable_by_key(|line| (line.ends, line.triangle, line.corner));
    let mut found = vec![[None; 3]; triangles.len()];
    for group in lines.chunk_by(|a, b| a.ends == b.ends) {
        let [a, b] = group else { continue };
        for (from, to) in [(a, b), (b, a)] {
            let corner = NonZeroU32::new(u32::from(to.corner) + 1);
            found[from.triangle as usize][usize::from(from.corner)] =
                corner.map(|corner| Neighbour {
                    triangle: to.triangle,
                    corner,
                });
        }
    }
    found
}

/// By corner: the first corner at the same position.
fn first_at_position(positions: &[[f32; 3]]) -> Vec<u32> {
    // Adding zero makes one of the two zeros.
    let bits = |at: u32| positions[at as usize].map(|v| (v + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|&at| (bits(at), at));
    let mut first = vec![0; positions.len()];
    for group in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        group.iter().for_each(|&at| first[at as usize] = group[0]);
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_share_a_line_find_each_other_across_a_seam() {
        // A square of two triangles whose diagonal's corners are stored twice, once with the other zero.
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let found = neighbours(&positions, &[[0, 1, 2], [3, 4, 5]]);
        let beyond = |triangle: usize, corner: usize| {
            found[triangle][corner].map(|n| (n.triangle, n.corner()))
        };
        assert_eq!(
            beyond(0, 1),
            Some((1, 2)),
            "the second triangle lies beyond the line opposite corner 1"
        );
        assert_eq!(
            beyond(1, 2),
            Some((0, 1)),
            "and the first beyond the second's line opposite corner 2"
        );
        let borders = [(0, 0), (0, 2), (1, 0), (1, 1)];
        assert!(
            borders.iter().all(|&(t, c)| beyond(t, c).is_none()),
            "borders have no neighbour: {found:?}"
        );
    }

    #[test]
    fn a_line_of_three_triangles_joins_none() {
        let positions = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let found = neighbours(&positions, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert!(found.iter().flatten().all(Option::is_none), "{found:?}");
    }
}
