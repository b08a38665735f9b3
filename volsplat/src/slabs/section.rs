//! Slab sections: where the plane through the middle of a slab cuts a kernel.
//!
//! Slabs are parallel to the image plane, so every kernel of the grid is cut in the same way, whatever the
//! perspective: the section depends only on the offset of the plane from the kernel's centre. Its extent along camera
//! x and y is tabulated over that offset; the weights themselves are evaluated from the position in the grid.

use glam::{DMat3, DVec3};

/// Entries over the offsets at which a plane meets the kernel. Each holds the bounds over its whole interval, so a
/// table that is too coarse costs pixels, never a hole: with 64 the boxes are 2 % too wide.
const ENTRIES: usize = 64;

/// Extents of the sections of a box -1..1 in some grid: the trilinear kernel, or a brick of cells.
#[derive(Clone, Debug)]
pub(crate) struct SectionTable {
    /// Least and greatest camera x and y, world units relative to the kernel's centre.
    entries: Vec<SectionBox>,
    /// The box of all sections.
    pub(crate) whole: SectionBox,
    /// Half the extent of the kernel along camera z, world units.
    pub(crate) reach_z: f32,
    entries_per_unit: f32,
}

/// The box of a section, world units relative to the kernel's centre. Laid out for one vector of four.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectionBox {
    /// Least x and y, greatest x and y.
    pub(crate) ends: [f32; 4],
}

impl SectionTable {
    /// The sections of the box -1..1 of a grid whose axes are the columns of `camera_from_grid`.
    pub(crate) fn of_cube(camera_from_grid: DMat3) -> Self {
        let corner = |i: usize| {
            let sign = |axis: usize| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
            camera_from_grid * DVec3::new(sign(0), sign(1), sign(2))
        };
        let edges: Vec<[DVec3; 2]> = (0..8)
            .flat_map(|i| {
                (0..3)
                    .filter(move |axis| i >> axis & 1 == 0)
                    .map(move |axis| [i, i | 1 << axis])
            })
            .map(|ends| ends.map(corner))
            .collect();
        let reach_z = (0..8).map(|i| corner(i).z).fold(0.0, f64::max);
        let step = 2.0 * reach_z / ENTRIES as f64;
        let entry = |i: usize| bounds_between(&edges, -reach_z + i as f64 * step, step);
        Self::of_entries((0..ENTRIES).map(entry).collect(), reach_z)
    }

    /// The sections of the ball of this radius of such a grid by slabs of this thickness, at their middle planes.
    pub(crate) fn of_ball(camera_from_grid: DMat3, radius: f64, thickness: f64) -> Self {
        let ball = Ball {
            rows: [0, 1, 2].map(|k| radius * camera_from_grid.row(k)),
        };
        let reach_z = ball.rows[2].length() + 0.5 * thickness;
        let step = 2.0 * reach_z / ENTRIES as f64;
        let entry = |i: usize| {
            let low = -reach_z + i as f64 * step;
            ball.bounds(low - 0.5 * thickness, low + step + 0.5 * thickness)
        };
        Self::of_entries((0..ENTRIES).map(entry).collect(), reach_z)
    }

    fn of_entries(entries: Vec<SectionBox>, reach_z: f64) -> Self {
        let whole = entries
            .iter()
            .fold(SectionBox::EMPTY, |sum, entry| sum.union(*entry));
        let entries_per_unit = (ENTRIES as f64 / (2.0 * reach_z)) as f32;
        Self {
            entries,
            whole,
            reach_z: reach_z as f32,
            entries_per_unit,
        }
    }

    /// The box of the section by a plane at this camera z from the centre; `None` where the plane lies behind the
    /// kernel. One that lies before it, as rounding may put the first, gets the first box.
    #[inline(always)]
    pub(crate) fn at(&self, offset_z: f32) -> Option<SectionBox> {
        let position = (offset_z + self.reach_z) * self.entries_per_unit;
        self.entries.get(position as usize).copied()
    }
}

impl SectionBox {
    const EMPTY: Self = Self {
        ends: [
            f32::INFINITY,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NEG_INFINITY,
        ],
    };

    fn union(self, other: Self) -> Self {
        let (a, b) = (self.ends, other.ends);
        Self {
            ends: [
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[2].max(b[2]),
                a[3].max(b[3]),
            ],
        }
    }
}

/// A ball of the grid in camera space: the rows of the map times the radius.
struct Ball {
    rows: [DVec3; 3],
}

impl Ball {
    /// The box of the part between two camera z from the centre.
    fn bounds(&self, low: f64, high: f64) -> SectionBox {
        let [x, y] = [0, 1].map(|axis| {
            let greatest = self.greatest(axis, low, high);
            // The ball is symmetric: the least is the greatest of the mirrored part.
            [-self.greatest(axis, -high, -low), greatest]
        });
        // One step of f32 outwards: rounding never cuts the box.
        let out = |end: f64, up: bool| {
            if up {
                (end as f32).next_up()
            } else {
                (end as f32).next_down()
            }
        };
        SectionBox {
            ends: [
                out(x[0], false),
                out(y[0], false),
                out(x[1], true),
                out(y[1], true),
            ],
        }
    }

    /// The greatest camera x or y between two camera z. Over z it is concave, so the nearest z to the peak has it.
    fn greatest(&self, axis: usize, low: f64, high: f64) -> f64 {
        let (row, z) = (self.rows[axis], self.rows[2]);
        let (depth2, along) = (z.length_squared(), row.dot(z));
        let peak = along / row.length().max(f64::MIN_POSITIVE);
        let at = peak.clamp(low, high);
        let across = (row - along / depth2 * z).length();
        along / depth2 * at + (1.0 - at * at / depth2).max(0.0).sqrt() * across
    }
}

/// The box of the part of a convex body between two planes z = low and z = low + step, from its edges: the extremes
/// of a convex slice lie on edges.
fn bounds_between(edges: &[[DVec3; 2]], low: f64, step: f64) -> SectionBox {
    let high = low + step;
    let mut bounds = SectionBox::EMPTY;
    for [a, b] in edges {
        if a.z.max(b.z) < low || a.z.min(b.z) > high {
            continue;
        }
        let along = b.z - a.z;
        let share = |z: f64| {
            if along == 0.0 {
                0.0
            } else {
                ((z - a.z) / along).clamp(0.0, 1.0)
            }
        };
        let ends = if along == 0.0 {
            [0.0, 1.0]
        } else {
            [share(low), share(high)]
        };
        for t in ends {
            let p = *a + t * (*b - *a);
            // One step of f32 outwards: rounding never cuts the box.
            let (x, y) = (p.x as f32, p.y as f32);
            let point = SectionBox {
                ends: [x.next_down(), y.next_down(), x.next_up(), y.next_up()],
            };
            bounds = bounds.union(point);
        }
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_the_ball_lies_in_the_box_of_its_slab() {
        let map = DMat3::from_cols(
            DVec3::new(1.0, 0.2, -0.3),
            DVec3::new(-0.4, 0.7, 0.9),
            DVec3::new(0.1, -0.5, 2.0),
        );
        let (radius, thickness) = (1.8, 0.5);
        let table = SectionTable::of_ball(map, radius, thickness);
        for i in 0..20_000 {
            // A spiral over the sphere.
            let height = 1.0 - 2.0 * (f64::from(i) + 0.5) / 20_000.0;
            let angle = f64::from(i) * 2.4;
            let across = (1.0 - height * height).sqrt();
            let p = map
                * (radius * 0.999 * DVec3::new(across * angle.cos(), across * angle.sin(), height));
            for offset in [-0.249, 0.0, 0.249] {
                let [x0, y0, x1, y1] = table
                    .at((p.z + offset) as f32)
                    .expect("a slab that holds it")
                    .ends;
                let (x, y) = (p.x as f32, p.y as f32);
                assert!(
                    x >= x0 && x <= x1 && y >= y0 && y <= y1,
                    "{p} outside its box"
                );
            }
        }
        assert!(
            table.at(table.reach_z * 1.01).is_none(),
            "a slab behind the ball"
        );
    }

    #[test]
    fn every_point_of_the_cube_lies_in_the_box_of_its_section() {
        let map = DMat3::from_cols(
            DVec3::new(1.0, 0.2, -0.3),
            DVec3::new(-0.4, 0.7, 0.9),
            DVec3::new(0.1, -0.5, 2.0),
        );
        let table = SectionTable::of_cube(map);
        let steps = 40;
        let coordinate = |i: i32| f64::from(i) / f64::from(steps);
        for i in 0..(2 * steps + 1i32).pow(3) {
            let n = 2 * steps + 1;
            let at = DVec3::new(
                coordinate(i % n - steps),
                coordinate(i / n % n - steps),
                coordinate(i / (n * n) - steps),
            );
            let p = map * at * 0.999_999;
            let section = table.at(p.z as f32).expect("the plane meets the cube");
            let [x0, y0, x1, y1] = section.ends;
            let (x, y) = (p.x as f32, p.y as f32);
            assert!(
                x >= x0 && x <= x1 && y >= y0 && y <= y1,
                "{p} outside {section:?}"
            );
        }
        assert!(
            table.at(table.reach_z * 1.01).is_none(),
            "a plane behind the cube"
        );
        assert!(
            table.at(-table.reach_z * 1.0001).is_some(),
            "rounding before the cube"
        );
    }
}
