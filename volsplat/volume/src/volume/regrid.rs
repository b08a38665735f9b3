//! A volume on the grid of another: PET over CT, labels of a coarser image.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{count, single, whole};

use super::voxels::map_voxels;
use super::{Lattice, Volume, Voxels};
use crate::Error;

/// How values between voxels are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// The value of the nearest voxel, in the stored type: labels and masks.
    Nearest,
    /// Trilinear, as f32.
    Linear,
}

/// Farthest that a corner of the grids may lie from that of the other where they count as one grid, voxels: half of one, as files
/// that count from corners instead of centres are off by.
const SAME_VOXELS: f64 = 0.5;

/// Words of a space's axes, by pairs of opposite sides.
const SIDES: [[&str; 2]; 3] = [
    ["left", "right"],
    ["posterior", "anterior"],
    ["superior", "inferior"],
];

impl Volume {
    /// Returns true if the voxels lie on this grid: as many, and where both name a patient's space, at the same places.
    pub fn lies_on(&self, grid: &Lattice) -> bool {
        if self.dims != grid.dims {
            return false;
        }
        let Some(other_from_own) = between_spaces(self.space.as_deref(), grid.space.as_deref())
        else {
            return true;
        };
        let grid_from_index =
            grid.world_from_index.inverse() * other_from_own * self.world_from_index;
        let last = DVec3::from_array(self.dims.map(|n| real(n) - 1.0));
        (0..8).all(|corner| {
            let at = DVec3::from_array([0, 1, 2].map(|axis| f64::from(corner >> axis & 1))) * last;
            grid_from_index
                .transform_point3(at)
                .abs_diff_eq(at, SAME_VOXELS)
        })
    }

    /// The values at the voxels of another grid; `outside` beyond the outermost voxels' cells. Patient's spaces whose axes point to
    /// other sides are turned into each other.
    ///
    /// # Errors
    /// [`Error::Option`] where no voxel of the grid lies inside.
    pub fn on_grid(&self, grid: &Lattice, between: Between, outside: f64) -> Result<Self, Error> {
        let turned = between_spaces(grid.space.as_deref(), self.space.as_deref());
        let index_from_grid = self.world_from_index.inverse()
            * turned.unwrap_or(DAffine3::IDENTITY)
            * grid.world_from_index;
        let [columns, rows, _] = grid.dims;
        let voxel_count = grid.dims.iter().product::<usize>();
        let place = |voxel: usize| {
            let at = [
                voxel % columns,
                voxel / columns % rows,
                voxel / (columns * rows),
            ];
            index_from_grid.transform_point3(DVec3::from_array(at.map(real)))
        };
        if !(0..voxel_count)
            .into_par_iter()
            .any(|voxel| self.holds(place(voxel)))
        {
            return Err(Error::Option(
                "it lies nowhere inside the other volume: check that both are in one space"
                    .to_owned(),
            ));
        }
        let voxels = match between {
            Between::Linear => Voxels::F32(
                (0..voxel_count)
                    .into_par_iter()
                    .map(|voxel| single(self.trilinear(place(voxel)).unwrap_or(outside)))
                    .collect(),
            ),
            Between::Nearest => map_voxels!(&self.voxels, values => {
                // A value of the stored type stands for the outside: the one that is nearest to it.
                let rim = values.iter().copied().min_by(|&a, &b| {
                    let far = |value| (super::scalar(value) - outside).abs();
                    far(a).total_cmp(&far(b))
                });
                let rim = rim.unwrap_or(values[0]);
                (0..voxel_count)
                    .into_par_iter()
                    .map(|voxel| self.nearest(place(voxel)).map_or(rim, |index| values[index]))
                    .collect()
            }),
        };
        Ok(Self {
            dims: grid.dims,
            voxels,
            world_from_index: grid.world_from_index,
            up_hint: grid.up_hint,
            space: grid.space.clone(),
            modality: self.modality,
            unit: grid.unit.clone(),
            window: self.window,
        })
    }

    fn holds(&self, at: DVec3) -> bool {
        let end = DVec3::from_array(self.dims.map(|n| real(n) - 0.5));
        at.cmpge(DVec3::splat(-0.5)).all() && at.cmple(end).all()
    }

    /// The linear index of the nearest voxel.
    fn nearest(&self, at: DVec3) -> Option<usize> {
        if !self.holds(at) {
            return None;
        }
        let [columns, rows, _] = self.dims;
        let last = DVec3::from_array(self.dims.map(|n| real(n) - 1.0));
        let [x, y, z] = at.round().clamp(DVec3::ZERO, last).to_array().map(index);
        Some(x + columns * (y + rows * z))
    }

    /// The trilinear value; that of the outermost voxels within half a voxel beyond them.
    fn trilinear(&self, at: DVec3) -> Option<f64> {
        if !self.holds(at) {
            return None;
        }
        let [columns, rows, _] = self.dims;
        let last = DVec3::from_array(self.dims.map(|n| real(n) - 1.0));
        let at = at.clamp(DVec3::ZERO, last);
        let first = at.floor().min((last - 1.0).max(DVec3::ZERO));
        let share = at - first;
        let corner = first.to_array().map(index);
        let mut sum = 0.0;
        for number in 0..8 {
            let step = [0, 1, 2].map(|axis| number >> axis & 1);
            let mut weight = 1.0;
            let mut voxel = corner;
            for axis in 0..3 {
                weight *= [1.0 - share[axis], share[axis]][step[axis]];
                voxel[axis] = (corner[axis] + step[axis]).min(self.dims[axis] - 1);
            }
            sum += weight * self.value(voxel[0] + columns * (voxel[1] + rows * voxel[2]));
        }
        Some(sum)
    }
}

fn real(index: usize) -> f64 {
    index as f64
}

/// The index of a place that is not below 0.
fn index(place: f64) -> usize {
    count(whole(place))
}

/// The map from one patient's space to another, whose axes may point to other sides; `None` where either is no such space.
fn between_spaces(from: Option<&str>, to: Option<&str>) -> Option<DAffine3> {
    let (from, to) = (axes(from?)?, axes(to?)?);
    Some(DAffine3::from_mat3(to.transpose() * from))
}

/// The axes of a patient's space such as "left-posterior-superior", as columns along left, posterior and superior.
fn axes(space: &str) -> Option<DMat3> {
    let space = space.to_lowercase();
    let words: Vec<&str> = space.split('-').take(3).collect();
    let column = |word: &&str| {
        let mut pairs = SIDES.iter().enumerate();
        let found =
            pairs.find_map(|(axis, pair)| Some((axis, pair.iter().position(|side| side == word)?)));
        found.map(|(axis, side)| DVec3::AXES[axis] * [1.0, -1.0][side])
    };
    let columns: Vec<DVec3> = words.iter().filter_map(column).collect();
    let axes = DMat3::from_cols(*columns.first()?, *columns.get(1)?, *columns.get(2)?);
    (axes.determinant().abs() > 0.5).then_some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(dims: [usize; 3], spacing: f64, origin: DVec3, space: &str) -> Lattice {
        let axes = DMat3::from_diagonal(DVec3::splat(spacing));
        let mut lattice = Lattice::unnamed(dims, DAffine3::from_mat3_translation(axes, origin));
        lattice.space = Some(space.to_owned());
        lattice
    }

    /// A volume whose value is a linear function of the place in left, posterior and superior.
    fn ramp(grid: &Lattice, sign: DVec3) -> Volume {
        let [nx, ny, nz] = grid.dims;
        let value = |at: DVec3| 1.0 + at.dot(DVec3::new(1.0, 2.0, 3.0));
        let mut values = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let at = DVec3::new(real(x), real(y), real(z));
                    values.push(single(value(
                        sign * grid.world_from_index.transform_point3(at),
                    )));
                }
            }
        }
        let mut volume =
            Volume::new(grid.dims, Voxels::F32(values), grid.world_from_index).expect("a volume");
        volume.space.clone_from(&grid.space);
        volume
    }

    #[test]
    fn a_linear_field_is_kept_between_patients_spaces() {
        let lps = "left-posterior-superior";
        let ct = lattice([9, 8, 7], 1.0, DVec3::new(-4.0, 2.0, 1.0), lps);
        // The same place counted along right and anterior, coarser and larger.
        let pet = lattice(
            [9, 8, 7],
            2.0,
            DVec3::new(-8.0, -14.0, -2.0),
            "right-anterior-superior",
        );
        let sign = DVec3::new(-1.0, -1.0, 1.0);
        let (own, coarse) = (ramp(&ct, DVec3::ONE), ramp(&pet, sign));
        assert!(own.lies_on(&ct) && !coarse.lies_on(&ct));
        let found = coarse
            .on_grid(&ct, Between::Linear, -99.0)
            .expect("they overlap");
        assert_eq!((found.dims, &found.space), (ct.dims, &ct.space));
        for voxel in 0..found.len() {
            let error = found.value(voxel) - own.value(voxel);
            assert!(error.abs() < 1e-4, "voxel {voxel}: {error}");
        }
        let nearest = coarse
            .on_grid(&ct, Between::Nearest, 0.0)
            .expect("they overlap");
        // Half a voxel of 2 along each axis.
        let most = 1.0 + 2.0 + 3.0 + 1e-4;
        for voxel in 0..nearest.len() {
            assert!((nearest.value(voxel) - own.value(voxel)).abs() <= most);
        }
    }

    #[test]
    fn what_lies_outside_has_its_value_and_nothing_in_common_is_refused() {
        let lps = "left-posterior-superior";
        let grid = lattice([6, 4, 4], 1.0, DVec3::ZERO, lps);
        let part = lattice([2, 4, 4], 1.0, DVec3::ZERO, lps);
        let labels = Volume::new(part.dims, Voxels::U8(vec![7; 32]), part.world_from_index);
        let mut labels = labels.expect("a volume");
        labels.space = part.space;
        let found = labels
            .on_grid(&grid, Between::Nearest, 0.0)
            .expect("a part");
        assert!(matches!(found.voxels, Voxels::U8(_)), "in the stored type");
        let found = labels
            .on_grid(&grid, Between::Linear, -5.0)
            .expect("a part");
        assert_eq!((found.value(1), found.value(2)), (7.0, -5.0));
        let far = lattice([6, 4, 4], 1.0, DVec3::splat(100.0), lps);
        assert!(labels.on_grid(&far, Between::Linear, 0.0).is_err());
    }

    #[test]
    fn grids_without_a_patients_space_are_one_where_they_have_as_many_voxels() {
        let grid = lattice([3, 3, 3], 1.0, DVec3::ZERO, "left-posterior-superior");
        let plain = Volume::new(
            [3, 3, 3],
            Voxels::U8(vec![1; 27]),
            DAffine3::from_translation(DVec3::splat(50.0)),
        );
        assert!(plain.expect("a volume").lies_on(&grid));
        let other = lattice([3, 3, 3], 1.0, DVec3::splat(0.4), "left-posterior-superior");
        assert!(
            ramp(&other, DVec3::ONE).lies_on(&grid),
            "less than half a voxel"
        );
        let other = lattice([3, 3, 3], 1.0, DVec3::splat(0.8), "left-posterior-superior");
        assert!(!ramp(&other, DVec3::ONE).lies_on(&grid));
    }
}
