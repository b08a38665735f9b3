//! Slices along the axes of the grid, as people read them: one voxel a pixel; and grids on planes in any direction.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use resample_core::narrow::{count, single, whole};

use super::{Lattice, Volume};

/// Most pixels along a side of a grid on a plane.
const MOST_PX: f64 = 4096.0;

/// The part of a plane that lies between the voxels of a volume, and a grid of one layer on it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneGrid {
    /// The grid; on a plane of voxels its pixels lie at the voxels and between them, where those are cubes.
    pub grid: Lattice,
    /// The corners of the polygon in which the plane cuts the box of the voxels' centres, in the world, one after another around it.
    pub corners: Vec<DVec3>,
}

/// The scalars of a plane of voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Width and height, voxels.
    pub size: [usize; 2],
    /// Row by row from the top.
    pub values: Vec<f64>,
}

impl Volume {
    /// The voxels whose index along `axis` (0 to 2) is `index`, both clamped.
    ///
    /// Across z, x goes to the right and y down, as files store their slices. Across y, x goes to the right, and across x
    /// y does; z goes up in both.
    pub fn slice(&self, axis: usize, index: usize) -> Slice {
        let axis = axis.min(2);
        let index = index.min(self.dims[axis] - 1);
        let [across, down] = [[1, 2], [0, 2], [0, 1]][axis];
        let size = [self.dims[across], self.dims[down]];
        let mut values = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            let mut voxel = [index; 3];
            voxel[down] = if axis == 2 { row } else { size[1] - 1 - row };
            for column in 0..size[0] {
                voxel[across] = column;
                let [x, y, z] = voxel;
                values.push(self.value(x + self.dims[0] * (y + self.dims[1] * z)));
            }
        }
        Slice { size, values }
    }
}

impl Lattice {
    /// The plane of the voxels whose index along `axis` (0 to 2) is `index`: its normal in the world, and the normal's dot product with its points.
    pub fn plane_of(&self, axis: usize, index: usize) -> (DVec3, f64) {
        let axis = axis.min(2);
        let normal = self
            .world_from_index
            .matrix3
            .inverse()
            .row(axis)
            .normalize();
        let on_it = DVec3::AXES[axis] * index as f64;
        (
            normal,
            normal.dot(self.world_from_index.transform_point3(on_it)),
        )
    }

    /// The grid on the plane of all points whose dot product with `normal` is `offset`, with `per_voxel` pixels, above 0, in the least distance of voxels;
    /// `None` where the plane lies beside all voxels.
    pub fn on_plane(&self, (normal, offset): (DVec3, f64), per_voxel: u32) -> Option<PlaneGrid> {
        let (offset, normal) = (offset / normal.length(), normal.try_normalize()?);
        // Along the axis of the grid that lies best in the plane.
        let in_plane = |axis: DVec3| axis.reject_from_normalized(normal);
        let axes = [0, 1, 2].map(|axis| self.world_from_index.matrix3.col(axis).normalize());
        let better = |a: DVec3, b: DVec3| {
            // The first of two that lie in it alike.
            if b.length() > a.length() + 1e-9 { b } else { a }
        };
        let across = axes.map(in_plane).into_iter().reduce(better)?.normalize();
        let down = normal.cross(across);
        let mut corners = self.cut_edges(normal, offset);
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let in_grid = |at: DVec3| DVec2::new(across.dot(at), down.dot(at));
        let around = |at: &DVec3| (in_grid(*at) - in_grid(middle)).to_angle();
        corners.sort_by(|a, b| around(a).total_cmp(&around(b)));
        if corners.len() < 3 {
            return None;
        }
        let places = || corners.iter().map(|&at| in_grid(at));
        let low = places().reduce(DVec2::min)?;
        let size = places().reduce(DVec2::max)? - low;
        let step = self.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let step = (step / f64::from(per_voxel)).max(size.max_element() / (MOST_PX - 2.0));
        // A pixel more than intervals; one that the rounding of a whole number would lose does not matter.
        let pixels = |length: f64| count(whole((length / step - 1e-6).ceil())) + 1;
        let origin = offset * normal + low.x * across + low.y * down;
        let matrix = DMat3::from_cols(step * across, step * down, step * normal);
        let grid = Self {
            dims: [pixels(size.x), pixels(size.y), 1],
            world_from_index: DAffine3::from_mat3_translation(matrix, origin),
            ..self.clone()
        };
        Some(PlaneGrid { grid, corners })
    }

    /// Where a plane cuts the edges of the box of the voxels' centres, each place once.
    fn cut_edges(&self, normal: DVec3, offset: f64) -> Vec<DVec3> {
        // A layer of a single voxel has its thickness.
        let ends = self.dims.map(|n| {
            if n > 1 {
                [0.0, n as f64 - 1.0]
            } else {
                [-0.5, 0.5]
            }
        });
        let corner = |number: usize| {
            let at = [0, 1, 2].map(|axis| ends[axis][number >> axis & 1]);
            self.world_from_index
                .transform_point3(DVec3::from_array(at))
        };
        let size = corner(0).distance(corner(7));
        let mut places: Vec<DVec3> = Vec::new();
        for (from, axis) in (0..8).flat_map(|from| [0, 1, 2].map(|axis| (from, axis))) {
            let to = from | 1 << axis;
            if to == from {
                continue;
            }
            let [a, b] = [corner(from), corner(to)];
            let [before, after] = [a, b].map(|at| normal.dot(at) - offset);
            // The plane of the outermost voxels may lie beside them by rounding.
            let slack = 1e-9 * size;
            if before.min(after) > slack || before.max(after) < -slack {
                continue;
            }
            let found = match (before - after).abs() > slack {
                true => vec![a.lerp(b, (before / (before - after)).clamp(0.0, 1.0))],
                false => vec![a, b],
            };
            for at in found {
                if places.iter().all(|known| known.distance(at) > 1e-6 * size) {
                    places.push(at);
                }
            }
        }
        places
    }
}

impl PlaneGrid {
    /// Where a place of the plane lies in a picture of the grid, 0 to 1 from its left and from its top.
    pub fn uv(&self, pos_in_world: DVec3) -> [f32; 2] {
        let index = self
            .grid
            .world_from_index
            .inverse()
            .transform_point3(pos_in_world);
        let [width, height, _] = self.grid.dims;
        [
            (index.x + 0.5) / width as f64,
            (index.y + 0.5) / height as f64,
        ]
        .map(single)
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::volume::{Between, Described, Voxels};

    /// A volume whose scalar at x, y, z is 100 x + 10 y + z.
    fn counted() -> Volume {
        let mut values = Vec::new();
        for z in 0..4 {
            for y in 0..3 {
                for x in 0..2 {
                    values.push((100 * x + 10 * y + z) as f32);
                }
            }
        }
        Volume::new([2, 3, 4], Voxels::F32(values), DAffine3::IDENTITY).expect("as many as voxels")
    }

    #[test]
    fn rows_go_down_along_y_and_up_along_z() {
        let volume = counted();
        let slice = volume.slice(2, 3);
        assert_eq!(
            (slice.size, &slice.values[..]),
            ([2, 3], &[3.0, 103.0, 13.0, 113.0, 23.0, 123.0][..])
        );
        let slice = volume.slice(1, 2);
        assert_eq!(slice.size, [2, 4]);
        assert_eq!(slice.values[..4], [23.0, 123.0, 22.0, 122.0]);
        let slice = volume.slice(0, 1);
        assert_eq!(slice.size, [3, 4]);
        assert_eq!(slice.values[..4], [103.0, 113.0, 123.0, 102.0]);
        assert_eq!(volume.slice(0, 99), volume.slice(0, 1), "clamped");
    }

    #[test]
    fn a_plane_of_voxels_has_their_values() {
        let mut volume = counted();
        volume.world_from_index = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.5),
            glam::DQuat::from_rotation_x(0.3),
            DVec3::new(3.0, -1.0, 2.0),
        );
        let lattice = volume.lattice();
        for axis in 0..3 {
            for index in 0..volume.dims[axis] {
                let (normal, offset) = lattice.plane_of(axis, index);
                let PlaneGrid { grid, corners } = lattice
                    .on_plane((7.0 * normal, 7.0 * offset), 1)
                    .expect("inside");
                assert_eq!(corners.len(), 4, "axis {axis}, index {index}");
                let cut = volume
                    .on_grid(&grid, Between::Linear, f64::NAN)
                    .expect("inside");
                let (mut found, mut expected) =
                    (cut.slice(2, 0).values, volume.slice(axis, index).values);
                found.sort_by(f64::total_cmp);
                expected.sort_by(f64::total_cmp);
                assert_eq!(found.len(), expected.len());
                for (a, b) in found.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-4, "axis {axis}, index {index}: {a}, {b}");
                }
            }
        }
    }

    #[test]
    fn an_oblique_plane_cuts_a_polygon_whose_values_are_those_of_its_places() {
        let volume = counted();
        let lattice = volume.lattice();
        let normal = DVec3::new(1.0, 2.0, 1.5);
        let offset = normal.dot(DVec3::new(0.5, 1.0, 1.5));
        let plane = lattice.on_plane((normal, offset), 1).expect("inside");
        assert!((3..=6).contains(&plane.corners.len()));
        for &corner in &plane.corners {
            assert!((normal.dot(corner) - offset).abs() < 1e-9);
            let [u, v] = plane.uv(corner);
            assert!(
                (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v),
                "{u}, {v}"
            );
        }
        let cut = volume
            .on_grid(&plane.grid, Between::Linear, f64::NAN)
            .expect("inside");
        let [width, height, _] = plane.grid.dims;
        let mut inside = 0;
        for (number, value) in cut.slice(2, 0).values.iter().enumerate() {
            let index = DVec3::new((number % width) as f64, (number / width) as f64, 0.0);
            let at = plane.grid.world_from_index.transform_point3(index);
            let last = DVec3::new(1.0, 2.0, 3.0);
            if at.cmpge(DVec3::ZERO).all() && at.cmple(last).all() {
                let expected = 100.0 * at.x + 10.0 * at.y + at.z;
                assert!((value - expected).abs() < 1e-3, "{at}: {value}, {expected}");
                inside += 1;
            }
        }
        assert!(inside >= 3 && height > 1, "{inside} pixels inside");
        assert_eq!(lattice.on_plane((normal, offset + 100.0), 1), None);
        assert_eq!(lattice.on_plane((DVec3::ZERO, 0.0), 1), None);
    }
}
