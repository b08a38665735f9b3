//! Charts: the parts of a texture that a mesh shows in one piece, and their borders.
//!
//! Beyond a line of a triangle the texture goes on if the triangle there has the same coordinates at its two ends; else
//! the line is a border: what lies across in the texture, another chart of the atlas, say, is not what lies across on
//! the surface. A triangle knows the borders at its corners, its own and those of its neighbours.
//!
//! Limits: a neighbour's border counts only where the whole triangle lies on its inner side;
//! corners that are stored twice within a chart hide their neighbours' borders.

use std::num::NonZeroU32;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::DVec2;
use rayon::prelude::*;
use resample_mesh::scene::Mesh;

use crate::screen::{Plane, narrow, value};

/// Most borders that a triangle knows: its own three, and two at each corner.
const MAX_BORDERS: usize = 9;

/// The borders of all charts of a mesh, by corner.
#[derive(Clone, Debug, Default)]
pub(crate) struct Charts {
    /// By vertex: where its borders begin; one more for the end.
    first: Vec<u32>,
    /// The vertices at the ends of a border, and a third on its inner side.
    borders: Vec<[u32; 3]>,
}

impl Charts {
    /// Finds the borders, given what lies beyond each line of each triangle, and the sets of coordinates in use.
    pub(crate) fn new(
        mesh: &Mesh,
        neighbours: &[[Option<Neighbour>; 3]],
        uvs: &[&[DVec2]],
    ) -> Self {
        let ends = |triangle: u32, corner: usize| {
            let corners = mesh.triangles[triangle as usize];
            [corners[(corner + 1) % 3], corners[(corner + 2) % 3]]
        };
        let same = |a: u32, b: u32| {
            uvs.iter()
                .all(|uv| uv.is_empty() || uv[a as usize] == uv[b as usize])
        };
        let is_border = |triangle: usize, corner: usize| {
            let Some(next) = neighbours[triangle][corner] else {
                return true;
            };
            let ([a, b], [c, d]) = (
                ends(triangle as u32, corner),
                ends(next.triangle, next.corner()),
            );
            // The ends are two positions, in either order.
            let turned = mesh.positions[a as usize] != mesh.positions[c as usize];
            if turned {
                !(same(a, d) && same(b, c))
            } else {
                !(same(a, c) && same(b, d))
            }
        };
        let mut found = Vec::new();
        if uvs.iter().any(|uv| !uv.is_empty()) {
            let lines = (0..mesh.triangles.len())
                .flat_map(|triangle| [0, 1, 2].map(|corner| (triangle, corner)));
            for (triangle, corner) in
                lines.filter(|&(triangle, corner)| is_border(triangle, corner))
            {
                let [a, b] = ends(triangle as u32, corner);
                found.push([a, b, mesh.triangles[triangle][corner]]);
            }
        }
        Self::by_vertex(mesh.positions.len(), &found)
    }

    fn by_vertex(vertices: usize, found: &[[u32; 3]]) -> Self {
        let mut first = vec![0u32; vertices + 1];
        let ends = || {
            found
                .iter()
                .flat_map(|border| [(border[0], border), (border[1], border)])
        };
        ends().for_each(|(vertex, _)| first[vertex as usize + 1] += 1);
        for vertex in 0..vertices {
            first[vertex + 1] += first[vertex];
        }
        let mut next = first.clone();
        let mut borders = vec![[0; 3]; 2 * found.len()];
        for (vertex, border) in ends() {
            let place = &mut next[vertex as usize];
            borders[*place as usize] = *border;
            *place += 1;
        }
        Self { first, borders }
    }

    /// The borders that a triangle knows, where `uv` gives the place of a vertex in the texture (texels).
    pub(crate) fn around(&self, corners: [usize; 3], uv: impl Fn(usize) -> DVec2) -> Borders {
        let mut borders = Borders::default();
        for corner in corners {
            for border in
                &self.borders[self.first[corner] as usize..self.first[corner + 1] as usize]
            {
                let [a, b, inner] = [0, 1, 2].map(|k| uv(border[k] as usize));
                borders.add([a, b], inner, corners.map(&uv));
            }
        }
        borders
    }
}

/// The borders of a chart around a triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Borders {
    borders: [Border; MAX_BORDERS],
    count: usize,
}

/// A piece of a line in the texture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Border {
    /// Texels from the line, positive inside.
    line: Plane,
    /// Where the piece begins and ends along the line, texels.
    span: [f32; 2],
}

impl Border {
    /// `None` if it has no direction or parts the triangle.
    fn new(ends: [DVec2; 2], inner: DVec2, triangle: [DVec2; 3]) -> Option<Self> {
        let normal = (ends[1] - ends[0]).perp().normalize_or_zero();
        let side = normal.dot(inner - ends[0]);
        let normal = normal * side.signum();
        // A corner on the line itself may be rounded to its outer side.
        let rounding = 1e-9 * (1.0 + ends[0].length());
        let parted = triangle
            .iter()
            .any(|corner| normal.dot(*corner - ends[0]) < -rounding);
        if side == 0.0 || !side.is_finite() || parted {
            return None;
        }
        let line = narrow(normal.extend(-normal.dot(ends[0])));
        let [a, b] = ends.map(|end| normal.perp_dot(end) as f32);
        Some(Self {
            line,
            span: [a.min(b), a.max(b)],
        })
    }

    /// Where a place lies along the line.
    #[inline(always)]
    fn along(&self, [u, v]: [f32; 2]) -> f32 {
        self.line[0] * v - self.line[1] * u
    }

    #[inline(always)]
    fn spans(&self, along: f32, margin: f32) -> bool {
        along >= self.span[0] - margin && along <= self.span[1] + margin
    }

    /// How far each place must be moved inwards to be `margin` texels inside, if the way from `start` leads over the border.
    #[inline(always)]
    fn lacking<S: Simd>(
        &self,
        simd: S,
        start: [f32; 2],
        place: [f32x16<S>; 2],
        margin: f32,
    ) -> f32x16<S> {
        let splat = |x: f32| f32x16::splat(simd, x);
        let zero = splat(0.0);
        let before = splat(value(&self.line, start).max(0.0));
        let [a, b, c] = self.line.map(splat);
        let after = a * place[0] + b * place[1] + c;
        let share = after
            .simd_lt(zero)
            .select(before / (before - after), splat(1.0));
        let start = start.map(splat);
        let crossing_u = start[0] + share * (place[0] - start[0]);
        let crossing_v = start[1] + share * (place[1] - start[1]);
        let along = a * crossing_v - b * crossing_u;
        let led_over = after.simd_lt(splat(margin))
            & along.simd_ge(splat(self.span[0] - margin))
            & along.simd_le(splat(self.span[1] + margin));
        led_over.select(splat(margin) - after, zero)
    }
}

impl Borders {
    /// Adds the line between `ends` unless it is there, has no direction, or parts the triangle.
    fn add(&mut self, ends: [DVec2; 2], inner: DVec2, triangle: [DVec2; 3]) {
        let Some(border) = Border::new(ends, inner, triangle) else {
            return;
        };
        if self.count < MAX_BORDERS && !self.borders[..self.count].contains(&border) {
            self.borders[self.count] = border;
            self.count += 1;
        }
    }

    /// Returns true if there is any.
    #[inline(always)]
    pub(crate) fn any(&self) -> bool {
        self.count > 0
    }

    /// Returns true if a border is nearer than `reach` texels.
    #[inline(always)]
    pub(crate) fn within(&self, place: [f32; 2], reach: f32) -> bool {
        self.borders[..self.count].iter().any(|border| {
            value(&border.line, place) < reach && border.spans(border.along(place), reach)
        })
    }

    /// The places, moved to where they are `margin` texels inside each border that the way from `start` leads over.
    #[inline(always)]
    pub(crate) fn moved_inside<S: Simd>(
        &self,
        simd: S,
        start: [f32; 2],
        mut place: [f32x16<S>; 2],
        margin: f32,
    ) -> [f32x16<S>; 2] {
        // Beyond a corner, the way to what one border has moved may lead over the other one: hence twice.
        for _ in 0..2 {
            for border in &self.borders[..self.count] {
                let lacking = border.lacking(simd, start, place, margin);
                for (place, normal) in place.iter_mut().zip(border.line) {
                    *place += lacking * f32x16::splat(simd, normal);
                }
            }
        }
        place
    }
}

// The triangles of a mesh that share a line: found by the positions of its two ends, so that seams of texture coordinates
// and of normals, where corners are stored twice, do not part a surface.
//
// Takes positions and triangles, once; sorts corners by position, then lines by their ends.
//
// Limits: positions must agree to the bit; a line of three and more triangles joins none of them.

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
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;
    use crate::screen::LANES;

    /// How far one place must be moved, in f64.
    fn lacking(border: &Border, start: [f64; 2], place: [f64; 2], margin: f64) -> f64 {
        let [a, b, c] = border.line.map(f64::from);
        let from_line = |at: [f64; 2]| a * at[0] + b * at[1] + c;
        let (before, after) = (from_line(start).max(0.0), from_line(place));
        if after >= margin {
            return 0.0;
        }
        let share = if after < 0.0 {
            before / (before - after)
        } else {
            1.0
        };
        let crossing = [0, 1].map(|k| start[k] + share * (place[k] - start[k]));
        let along = a * crossing[1] - b * crossing[0];
        let [first, last] = border.span.map(f64::from);
        if along >= first - margin && along <= last + margin {
            margin - after
        } else {
            0.0
        }
    }

    fn moved_inside(borders: &Borders, start: [f64; 2], place: [f64; 2], margin: f64) -> [f64; 2] {
        let mut place = place;
        for _ in 0..2 {
            for border in &borders.borders[..borders.count] {
                let by = lacking(border, start, place, margin);
                place = [0, 1].map(|k| place[k] + by * f64::from(border.line[k]));
            }
        }
        place
    }

    #[test]
    fn places_are_moved_as_each_is_alone() {
        // Two borders of a triangle that meet in a corner.
        let corners = [[10.0, 10.0], [30.0, 12.0], [14.0, 40.0]].map(DVec2::from);
        let mut borders = Borders::default();
        borders.add([corners[0], corners[1]], corners[2], corners);
        borders.add([corners[0], corners[2]], corners[1], corners);
        assert_eq!(borders.count, 2);
        let start = [12.0, 13.0];
        let mut moved = 0;
        for k in 0..100 {
            let number = |n: usize| ((k * 16 + n) as f32 * 0.618_034).fract();
            let place: [[f32; LANES]; 2] = [
                std::array::from_fn(|n| 8.0 + 10.0 * number(n)),
                std::array::from_fn(|n| 7.0 + 14.0 * number(n + 7)),
            ];
            let margin = 0.25 * (k % 5) as f32;
            for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
                let mut found = [[0.0; LANES]; 2];
                dispatch!(simd, simd => {
                    let place = [0, 1].map(|axis: usize| f32x16::from_slice(simd, &place[axis]));
                    let inside = borders.moved_inside(simd, start, place, margin);
                    inside[0].store_slice(&mut found[0]);
                    inside[1].store_slice(&mut found[1]);
                });
                for n in 0..LANES {
                    let at = [0, 1].map(|axis: usize| f64::from(place[axis][n]));
                    let wanted = moved_inside(&borders, start.map(f64::from), at, margin.into());
                    moved += usize::from(wanted != at);
                    for axis in 0..2 {
                        let off = (f64::from(found[axis][n]) - wanted[axis]).abs();
                        assert!(off < 1e-4, "{at:?}, {margin}: {off} texels off");
                    }
                }
            }
        }
        assert!(moved > 1000, "only {moved} places were moved");
    }

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
