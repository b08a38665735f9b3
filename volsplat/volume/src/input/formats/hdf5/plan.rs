//! The part of a file that makes a volume, as the layouts describe it.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use resample_core::narrow;

use crate::input::decode::rescale::Rescale;
use crate::input::formats::hdf5::slab::Taken;
use crate::volume::{Lattice, Voxels, map_voxels, scalar, with_voxels};

/// The arrays to read, and the meaning of their elements.
pub(crate) struct Plan {
    /// Of each component.
    pub(crate) slabs: Vec<Slab>,
    pub(crate) lattice: Lattice,
    pub(crate) values: Values,
}

/// A part of an array: three axes of many elements at most, x the last.
pub(crate) struct Slab {
    pub(crate) path: String,
    pub(crate) taken: Vec<Taken>,
}

/// From stored numbers to real ones.
#[derive(Default)]
pub(crate) struct Values {
    /// Signed integers stand for unsigned ones.
    pub(crate) is_unsigned: bool,
    /// Stored numbers that mark a voxel without a value.
    pub(crate) missing: Vec<f64>,
    pub(crate) scaling: Scaling,
}

/// Slope and intercept of each stored number.
#[derive(Default)]
pub(crate) enum Scaling {
    #[default]
    None,
    Whole([f64; 2]),
    /// One pair for each slice along z.
    Slices(Vec<[f64; 2]>),
}

/// A step in the world along each axis of the voxels, and the place of the first voxel.
pub(crate) fn placed(steps: [DVec3; 3], first: DVec3) -> DAffine3 {
    DAffine3::from_mat3_translation(
        DMat3::from_cols_array_2d(&steps.map(|s| s.to_array())),
        first,
    )
}

impl Values {
    /// Real numbers from stored ones, and how many of them are missing.
    pub(crate) fn real(&self, stored: Voxels, dims: [usize; 3]) -> Result<(Voxels, usize), String> {
        let expected = dims.iter().product::<usize>();
        if stored.len() != expected {
            return Err(format!("{} elements instead of {expected}", stored.len()));
        }
        let mut missing = 0;
        let stored = if self.missing.is_empty() {
            stored
        } else {
            map_voxels!(stored, values => self.without_missing(values, &mut missing))
        };
        let real = match &self.scaling {
            Scaling::None => stored,
            Scaling::Whole([slope, intercept]) => Rescale {
                slope: *slope,
                intercept: *intercept,
            }
            .apply(stored),
            Scaling::Slices(pairs) => {
                let slice = dims[0] * dims[1];
                Voxels::F32(with_voxels!(&stored, values => {
                    let slices = values.par_chunks(slice.max(1)).zip(pairs);
                    let real = |&value: &_, [slope, intercept]: &[f64; 2]| {
                        narrow::single(scalar(value) * slope + intercept)
                    };
                    let all = slices.flat_map_iter(|(slice, pair)| slice.iter().map(move |value| real(value, pair)));
                    all.collect()
                }))
            }
        };
        Ok((real, missing))
    }

    /// Gives elements without a value the least of the others, which most transfer functions hide.
    fn without_missing<T>(&self, mut values: Vec<T>, missing: &mut usize) -> Vec<T>
    where
        T: Copy + PartialOrd + Into<f64> + Send + Sync,
    {
        let is_missing = |value: f64| {
            let marks = self.missing.iter();
            { marks }.any(|&mark| value == mark || (mark.is_nan() && value.is_nan()))
        };
        let present = values.par_iter().copied();
        let least = present
            .filter(|&value| !is_missing(scalar(value)))
            .reduce_with(|a, b| if b < a { b } else { a });
        let Some(least) = least else {
            return values;
        };
        *missing = values
            .par_iter_mut()
            .filter(|value| is_missing(scalar(**value)))
            .map(|value| *value = least)
            .count();
        values
    }
}
