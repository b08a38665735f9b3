//! The soft layer around an isosurface.
//!
//! Takes the scalars at vertices; gives the extinction at each vertex, the normal, and the optical depth of the layer in front of it. The grid cannot
//! resolve the edge of an opaque surface: the light of its vertices would show rings. In the layer, extinction rises linearly over one step on each
//! side of the surface, which the grid resolves. Shadows and occlusion subtract the optical depth of a flat layer from that of each direction, so a
//! flat surface keeps all of its light. Occlusion counts only the directions above the surface.
//!
//! Distances start at the grid edges that the surface cuts, and continue from neighbour to neighbour by the Eikonal equation, |grad d| = 1 (J. A.
//! Sethian, "Level Set Methods and Fast Marching Methods", 1999, first order). Two methods were tried and not taken. Distances from the length of
//! the gradient differed between both ends of an edge and showed rings. Division by the light of a flat surface made convex surfaces half
//! as bright again as flat ones.
//! Limits: bodies thinner than the layer take less light. Surfaces closer together than two steps darken each other too much. The side of the
//! lower scalars is lit: where a clip opens a body, the inner side shows the light of the outer side.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::narrow::single;

use crate::shadow::sheet::{Line, part_above};
use crate::shadow::vertices::{LANES, PaddedRow, Soft, Vertices};

/// Half of the layer's width, steps. Layers of 1.5 steps darkened contacts: a ball on a plate had 22.9 dB, and has 26.0.
const HALF_WIDTH: f32 = 1.0;

/// Rise of the optical depth of a step, from one step to the next. Vertices resolve the light of such a ramp to 5 %.
const RISE: f32 = 1.5;

/// Optical depth of a step behind the layer.
const BEHIND: f32 = 2.0 * HALF_WIDTH * RISE;

/// Rounds of the Eikonal equation: each continues distances by one vertex along the axes. Three reach across the layer along diagonals.
const ROUNDS: usize = 3;

/// Where an isosurface lies.
pub(super) struct Surface<'a> {
    /// Rows lie along x.
    pub(super) vertices: &'a Vertices<'a>,
    pub(super) scalar: f32,
    /// At vertices, NaN where nothing is shown.
    pub(super) scalars: &'a [f32],
    /// Takes normals of planes from the grid to the world, where they are as long as planes lie close together in opacity units.
    pub(super) normals_from_grid: DMat3,
    /// From a vertex to the next along each axis, opacity units; along the world's axes, the part of each.
    pub(super) spacing: [f32; 3],
    pub(super) axes: DMat3,
}

/// The place of a vertex in the layer.
#[derive(Clone, Copy, Default)]
struct Depth {
    /// Extinction, per opacity unit.
    strength: f32,
    /// Optical depth of the layer in front of the vertex, along the normal.
    depth: f32,
    /// Outward unit normal in the world, or 0 where the distance is constant.
    normal: Vec3,
}

impl Surface<'_> {
    /// The shortest way from a vertex to the next, opacity units.
    fn step(&self) -> f32 {
        let [x, y, z] = self.spacing;
        x.min(y).min(z)
    }

    /// The extinction at each vertex, per opacity unit, and the layer around the vertices.
    pub(super) fn soft(&self) -> (Vec<f32>, Soft) {
        let steps = self.spacing.map(|spacing| spacing / self.step());
        let heights: Vec<f32> = self.scalars.iter().map(|own| own - self.scalar).collect();
        let mut distances = self.change(&heights, |around| distance_from_edges(around, steps));
        for _ in 0..ROUNDS {
            distances = self.change(&distances, |around| distance_from_neighbours(around, steps));
        }
        let depths = self.change_at(&distances, |around, in_grid| {
            self.depth(around, in_grid, steps)
        });
        let soft = Soft {
            normals: [0, 1, 2]
                .map(|axis: usize| depths.iter().map(|own| own.normal[axis]).collect()),
            depths: depths
                .iter()
                .map(|own| own.depth * std::f32::consts::LOG2_E)
                .collect(),
            at_surface: optical_depth(0.0) * std::f32::consts::LOG2_E,
            behind: BEHIND / self.step(),
        };
        (depths.iter().map(|own| own.strength).collect(), soft)
    }

    /// Something new for each vertex, from its number and those of its neighbours.
    fn change<T: Copy + Default + Send>(
        &self,
        numbers: &[f32],
        of: impl Fn(&Cross) -> T + Sync + Send,
    ) -> Vec<T> {
        self.change_at(numbers, |around, _| of(around))
    }

    /// The same, from its place in the grid too.
    fn change_at<T: Copy + Default + Send>(
        &self,
        numbers: &[f32],
        of: impl Fn(&Cross, DVec3) -> T + Sync + Send,
    ) -> Vec<T> {
        let width = self.vertices.sides()[0];
        let lines = || [(); 5].map(|()| PaddedRow::new(width));
        let mut changed = vec![T::default(); numbers.len()];
        self.vertices
            .change_rows(&mut changed, lines, |lines, row, changed| {
                self.vertices.fill_around(row, numbers, lines);
                for run in self.vertices.runs(row) {
                    let mut in_grid = self.vertices.in_grid(row);
                    in_grid.x += run.first as f64;
                    for (changed, vertex) in changed[self.vertices.in_row(row, run)]
                        .iter_mut()
                        .zip(run.first..)
                    {
                        *changed = of(&Cross::new(lines, vertex), in_grid);
                        in_grid.x += 1.0;
                    }
                }
            });
        changed
    }

    /// The place of a vertex in the layer, from its distance and those of its neighbours.
    fn depth(&self, around: &Cross, in_grid: DVec3, steps: [f32; 3]) -> Depth {
        let distance = around.own;
        if distance > 0.0 {
            let (height, normal) = self.lowest_cut(in_grid);
            // Matter that is cut begins at the cut.
            if height < distance {
                let (strength, depth) = self.at(height, normal);
                return Depth {
                    strength,
                    depth: depth - optical_depth(0.0),
                    normal,
                };
            }
        }
        let normal = -self.in_world(around.slopes(steps));
        let (strength, depth) = self.at(distance, normal);
        Depth {
            strength,
            depth,
            normal,
        }
    }

    /// The extinction at a distance in shortest steps, and the optical depth in front of it. The layer is as wide as the spacing along the normal.
    fn at(&self, distance: f32, normal: Vec3) -> (f32, f32) {
        let step = (self.axes * normal.as_dvec3()).length();
        let step = single(step).max(self.step());
        let distance = distance * self.step() / step;
        // NaN where nothing is shown.
        (thickness(distance).max(0.0) / step, optical_depth(distance))
    }

    /// How far a vertex lies behind the nearest face of the box, steps, and the direction out of it.
    fn lowest_cut(&self, in_grid: DVec3) -> (f32, Vec3) {
        let [low, high] = self.vertices.within.ends();
        let of_box = (0..3).flat_map(|axis| {
            let normal = DVec3::AXES[axis];
            [
                (in_grid[axis] - low[axis], -normal),
                (high[axis] - in_grid[axis], normal),
            ]
        });
        let cuts = of_box.map(|(height, normal)| {
            let normal = self.normals_from_grid * normal;
            (height / normal.length(), normal)
        });
        let lowest = cuts.min_by(|a, b| a.0.total_cmp(&b.0));
        let (height, normal) = lowest.unwrap_or((f64::INFINITY, DVec3::Z));
        (
            single(height).max(0.0) / self.step(),
            normal.normalize_or_zero().as_vec3(),
        )
    }

    /// The direction of a gradient in the grid, per step along each axis, in the world.
    fn in_world(&self, slopes: [f32; 3]) -> Vec3 {
        let spacing = DVec3::from(self.spacing.map(f64::from));
        let in_grid = Vec3::from(slopes).as_dvec3() * spacing;
        (self.normals_from_grid * in_grid)
            .normalize_or_zero()
            .as_vec3()
    }
}

/// The number of a vertex, and those before and after it along each axis; NaN where nothing is shown.
struct Cross {
    own: f32,
    beside: [[f32; 2]; 3],
}

impl Cross {
    fn new([own, y_before, y_after, z_before, z_after]: &[PaddedRow; 5], vertex: usize) -> Self {
        let at = vertex + LANES;
        Self {
            own: own.0[at],
            beside: [
                [own.0[at - 1], own.0[at + 1]],
                [y_before.0[at], y_after.0[at]],
                [z_before.0[at], z_after.0[at]],
            ],
        }
    }

    /// Slopes along the axes; `steps` are the ways to the neighbours.
    fn slopes(&self, steps: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| {
            let ends = self.beside[axis];
            let known = ends.map(f32::is_finite);
            let [before, after] =
                [0, 1].map(|end: usize| if known[end] { ends[end] } else { self.own });
            let ways = f32::from(known[0]) + f32::from(known[1]);
            (after - before) / (steps[axis] * ways.max(1.0))
        })
    }
}

/// The distance from a surface that cuts edges to the neighbours, of heights above it; infinite where the surface cuts no edge.
fn distance_from_edges(around: &Cross, steps: [f32; 3]) -> f32 {
    let own = around.own;
    let mut sum = 0.0;
    for (ends, step) in around.beside.into_iter().zip(steps) {
        let cut = ends
            .into_iter()
            .filter(|end| own * end <= 0.0 && own != *end);
        let ways = cut.map(|end| own / (own - end) * step);
        let way = ways.fold(f32::INFINITY, f32::min);
        sum += 1.0 / (way * way).max(f32::MIN_POSITIVE);
    }
    // NaN stays.
    (1.0 / sum.sqrt()).copysign(own) + 0.0 * own
}

/// The distance of a vertex that is not known from those of its neighbours on the same side.
fn distance_from_neighbours(around: &Cross, steps: [f32; 3]) -> f32 {
    let own = around.own;
    if own.is_finite() || own.is_nan() {
        return own;
    }
    let mut known: [(f32, f32); 3] = [0, 1, 2].map(|axis: usize| {
        let same = around.beside[axis]
            .into_iter()
            .filter(|end| end * own > 0.0);
        (
            same.map(f32::abs).fold(f32::INFINITY, f32::min),
            steps[axis],
        )
    });
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    // (d - a)^2 / x^2 + (d - b)^2 / y^2 + ... = 1, with as many terms as lie below d.
    let (mut distance, [mut a, mut b, mut c]) = (f32::INFINITY, [0.0, 0.0, -1.0]);
    for (from, step) in known {
        if !(from < distance) {
            break;
        }
        let weight = 1.0 / (step * step);
        (a, b, c) = (a + weight, b + weight * from, c + weight * from * from);
        distance = (b + (b * b - a * c).max(0.0).sqrt()) / a;
    }
    distance.copysign(own)
}

/// Divides the light that vertices see by the part of the sky above a flat surface, of which half is free.
pub(super) fn divide(shares: &mut [f32], soft: &Soft, lines: &[Line]) {
    let shares = shares.par_iter_mut().enumerate().with_min_len(4096);
    shares.for_each(|(vertex, share)| {
        let normal = Vec3::from(soft.normals.each_ref().map(|along| along[vertex]));
        let above = |line: &Line| line.weight * part_above(normal.dot(line.direction).abs());
        let above: f32 = lines.iter().map(above).sum();
        if above > 0.0 {
            *share *= 0.5 / above;
        }
    });
}

/// Optical depth of a step at a distance from the surface, steps, above 0 behind it.
fn thickness(distance: f32) -> f32 {
    (RISE * (distance + HALF_WIDTH)).clamp(0.0, BEHIND)
}

/// Optical depth of the layer in front of a distance from the surface, along the normal.
fn optical_depth(distance: f32) -> f32 {
    let inside = (distance + HALF_WIDTH).max(0.0);
    let soft = inside.min(2.0 * HALF_WIDTH);
    0.5 * RISE * soft * soft + BEHIND * (inside - soft)
}

#[cfg(test)]
mod tests {
    use super::{
        BEHIND, Cross, HALF_WIDTH, distance_from_edges, distance_from_neighbours, optical_depth,
        thickness,
    };

    /// The numbers around a vertex of a linear field, at a height, with these slopes along the axes.
    fn linear(own: f32, slopes: [f32; 3], steps: [f32; 3]) -> Cross {
        Cross {
            own,
            beside: [0, 1, 2]
                .map(|axis: usize| [-1.0, 1.0].map(|side| own + side * slopes[axis] * steps[axis])),
        }
    }

    #[test]
    fn edges_give_the_distance_of_a_plane() {
        // A field that is twice as steep as distances are, of a plane askew, on cells of three lengths.
        let (normal, steps) = ([2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0], [1.0, 2.5, 1.5]);
        let slopes = normal.map(|along| 2.0 * along);
        for distance in [0.6, 0.1, -0.1, -0.6] {
            let found = distance_from_edges(&linear(2.0 * distance, slopes, steps), steps);
            assert!((found - distance).abs() < 1e-6, "{found} for {distance}");
        }
        // The edges along y and z are cut, 2.4 and 1.2 away.
        let found = distance_from_edges(&linear(1.6, slopes, steps), steps);
        let expected = 1.0 / f32::hypot(1.0 / 2.4, 1.0 / 1.2);
        assert!((found - expected).abs() < 1e-6, "{found}");
        assert!(distance_from_edges(&linear(9.0, slopes, steps), steps).is_infinite());
        assert!(distance_from_edges(&linear(f32::NAN, slopes, steps), steps).is_nan());
    }

    #[test]
    fn neighbours_give_the_distance_of_a_plane() {
        let (normal, steps) = ([2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0], [1.0, 1.0, 1.5]);
        for distance in [2.5, -2.5_f32] {
            let mut around = linear(distance, normal, steps);
            around.own = f32::INFINITY.copysign(distance);
            let found = distance_from_neighbours(&around, steps);
            assert!((found - distance).abs() < 1e-5, "{found} for {distance}");
        }
        // One neighbour is known: the surface may face it.
        let around = Cross {
            own: f32::INFINITY,
            beside: [[f32::INFINITY; 2], [0.25, f32::NAN], [f32::INFINITY, -0.5]],
        };
        assert_eq!(distance_from_neighbours(&around, [1.0, 2.0, 1.0]), 2.25);
        let known = linear(0.5, normal, steps);
        assert_eq!(distance_from_neighbours(&known, steps), 0.5);
    }

    #[test]
    fn depths_are_the_integral_of_the_soft_matter() {
        let mut sum = 0.0;
        let step = 1e-3;
        for number in 0..4000 {
            let distance = -HALF_WIDTH - 0.5 + step * number as f32;
            assert!(
                (optical_depth(distance) - sum).abs() < 2e-3,
                "at {distance}"
            );
            sum += step * thickness(distance + 0.5 * step);
        }
        assert_eq!(
            [thickness(-2.0), thickness(0.0), thickness(2.0)],
            [0.0, 0.5 * BEHIND, BEHIND]
        );
    }
}
