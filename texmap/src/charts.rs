//! Charts: the parts of a texture that a mesh shows in one piece, and their borders.
//!
//! Beyond a line of a triangle the texture goes on if the triangle there has the same coordinates at its two ends; else
//! the line is a border: what lies across in the texture, another chart of the atlas, say, is not what lies across on
//! the surface. A triangle knows the borders at its corners, its own and those of its neighbours.
//!
//! Limits: a neighbour's border counts only where the whole triangle lies on its inner side;
//! corners that are stored twice within a chart hide their neighbours' borders.

use glam::DVec2;

use crate::adjacency::Neighbour;
use crate::plane::{Plane, narrow, value};
use crate::scene::Mesh;

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
        uvs: &[&Vec<DVec2>],
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

    /// How far `place` must be moved inwards to be `margin` texels inside, if the way from `start` leads over the border.
    #[inline(always)]
    fn lacking(&self, start: [f32; 2], place: [f32; 2], margin: f32) -> f32 {
        let (before, after) = (value(&self.line, start).max(0.0), value(&self.line, place));
        if after >= margin {
            return 0.0;
        }
        let share = if after < 0.0 {
            before / (before - after)
        } else {
            1.0
        };
        let crossing = [0, 1].map(|k| start[k] + share * (place[k] - start[k]));
        if self.spans(self.along(crossing), margin) {
            margin - after
        } else {
            0.0
        }
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

    /// Whether there is any.
    #[inline(always)]
    pub(crate) fn any(&self) -> bool {
        self.count > 0
    }

    /// Whether a border is nearer than `reach` texels.
    #[inline(always)]
    pub(crate) fn within(&self, place: [f32; 2], reach: f32) -> bool {
        self.borders[..self.count].iter().any(|border| {
            value(&border.line, place) < reach && border.spans(border.along(place), reach)
        })
    }

    /// The place, moved to where it is `margin` texels inside each border that the way from `start` leads over.
    #[inline(always)]
    pub(crate) fn moved_inside(
        &self,
        start: [f32; 2],
        mut place: [f32; 2],
        margin: f32,
    ) -> [f32; 2] {
        // Beyond a corner, the way to what one border has moved may lead over the other one: hence twice.
        for _ in 0..2 {
            for border in &self.borders[..self.count] {
                let lacking = border.lacking(start, place, margin);
                place = [
                    place[0] + lacking * border.line[0],
                    place[1] + lacking * border.line[1],
                ];
            }
        }
        place
    }
}
