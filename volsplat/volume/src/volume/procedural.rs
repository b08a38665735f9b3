//! Volumes that are made from formulas: nothing to download, and every voxel is known.
//!
//! Takes a number of voxels per axis, gives a cubic volume that fills -1..1 along each axis of the world. Three
//! kinds: a test signal that is hard to reconstruct, a smooth cloud of blobs, and a box of opaque cells. The same
//! call gives the same voxels on every machine up to the rounding of sine and cosine.
//! Source of the test signal: Marschner and Lobb, "An Evaluation of Reconstruction Filters for Volume Rendering",
//! IEEE Visualization 1994, section 5.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::Error;
use crate::volume::{Volume, Voxels};

/// Ripples of the Marschner-Lobb signal along the radius: at 40 voxels per axis this is just below what sampling
/// can carry (the paper's fM).
const RIPPLE_FREQUENCY: f64 = 6.0;

/// Height of the ripples against the slope along z (the paper's alpha).
const RIPPLE_HEIGHT: f64 = 0.25;

/// Blobs in the cloud: enough for the closed curve below to look like a rope of beads.
const BLOBS: usize = 48;

/// Radius of a blob, where it has fallen to 0. Neighbours on the curve are 0.2 apart at most, so they melt together.
const BLOB_RADIUS: f64 = 0.3;

/// Value of the two kinds of cells in [`checker_box`]; both above 0, so that every voxel can be made visible.
pub const CHECKER_VALUES: [u8; 2] = [85, 170];

/// The Marschner-Lobb test signal, values 0..=1 as f32. The classical choice is 40 or 41 voxels per axis.
///
/// Refused: fewer than 2 voxels per axis.
///
/// ```
/// use resample_volume::procedural::marschner_lobb;
///
/// let (low, high) = marschner_lobb(16)?.value_range();
/// assert!(low >= 0.0 && high <= 1.0);
/// # Ok::<(), resample_volume::Error>(())
/// ```
pub fn marschner_lobb(voxels_per_axis: usize) -> Result<Volume, Error> {
    sampled(voxels_per_axis, |pos| {
        let radius = pos.truncate().length();
        let ripple = (TAU * RIPPLE_FREQUENCY * (0.5 * PI * radius).cos()).cos();
        (1.0 - (0.5 * PI * pos.z).sin() + RIPPLE_HEIGHT * (1.0 + ripple))
            / (2.0 * (1.0 + RIPPLE_HEIGHT))
    })
}

/// Soft blobs strung along a trefoil knot, values from 0 (outside) to about 3 as f32.
///
/// Each blob is (1 - (d/R)^2)^2 within its radius R. Refused: fewer than 2 voxels per axis.
///
/// ```
/// use resample_volume::procedural::blobs;
///
/// let volume = blobs(16)?;
/// assert_eq!(volume.dims, [16; 3]);
/// # Ok::<(), resample_volume::Error>(())
/// ```
pub fn blobs(voxels_per_axis: usize) -> Result<Volume, Error> {
    let centres = blob_centres();
    sampled(voxels_per_axis, |pos| {
        let inside = centres
            .iter()
            .map(|centre| 1.0 - pos.distance_squared(*centre) / BLOB_RADIUS.powi(2));
        inside.filter(|&x| x > 0.0).map(|x| x * x).sum()
    })
}

/// A box of cubic cells that alternate between the two [`CHECKER_VALUES`], as u8.
///
/// `cell_voxels` is the side of a cell. Refused: fewer than 2 voxels per axis, cells of 0 voxels.
///
/// ```
/// use resample_volume::procedural::checker_box;
///
/// let volume = checker_box(8, 2)?;
/// assert_ne!(volume.value(0), volume.value(2), "the next cell along x");
/// # Ok::<(), resample_volume::Error>(())
/// ```
pub fn checker_box(voxels_per_axis: usize, cell_voxels: usize) -> Result<Volume, Error> {
    if cell_voxels == 0 {
        return Err(Error::Option(
            "a checker box needs cells of at least 1 voxel".to_owned(),
        ));
    }
    let n = checked_side(voxels_per_axis)?;
    let value = |index: usize| {
        let cell = |i: usize| i / cell_voxels;
        let parity = (cell(index % n) + cell(index / n % n) + cell(index / (n * n))) % 2;
        CHECKER_VALUES[parity]
    };
    let voxels = (0..n * n * n).into_par_iter().map(value).collect();
    Volume::new([n; 3], Voxels::U8(voxels), unit_lattice(n))
}

/// Samples a function of the world position at every voxel.
fn sampled(voxels_per_axis: usize, value: impl Fn(DVec3) -> f64 + Sync) -> Result<Volume, Error> {
    let n = checked_side(voxels_per_axis)?;
    let world_from_index = unit_lattice(n);
    let voxel = |index: usize| {
        let at = DVec3::new(
            (index % n) as f64,
            (index / n % n) as f64,
            (index / (n * n)) as f64,
        );
        value(world_from_index.transform_point3(at)) as f32
    };
    let voxels = (0..n * n * n).into_par_iter().map(voxel).collect();
    Volume::new([n; 3], Voxels::F32(voxels), world_from_index)
}

/// Largest side: 2048^3 voxels are 34 GB as f32, more than a demonstration should ask for.
const MAX_SIDE: usize = 2048;

fn checked_side(voxels_per_axis: usize) -> Result<usize, Error> {
    match voxels_per_axis {
        2..=MAX_SIDE => Ok(voxels_per_axis),
        n => Err(Error::Option(format!(
            "a built-in volume has 2 to {MAX_SIDE} voxels per axis, not {n}"
        ))),
    }
}

/// The lattice of `n` voxels per axis whose outermost voxels lie at -1 and 1.
fn unit_lattice(n: usize) -> DAffine3 {
    let spacing = 2.0 / (n - 1) as f64;
    DAffine3::from_scale_rotation_translation(
        DVec3::splat(spacing),
        glam::DQuat::IDENTITY,
        DVec3::NEG_ONE,
    )
}

/// Points on a trefoil knot that fits into the unit box together with its blobs.
fn blob_centres() -> Vec<DVec3> {
    let at = |i: usize| {
        let turn = TAU * i as f64 / BLOBS as f64;
        let ring = 2.0 + (3.0 * turn).cos();
        let knot = DVec3::new(
            ring * (2.0 * turn).cos(),
            ring * (2.0 * turn).sin(),
            (3.0 * turn).sin(),
        );
        // The knot reaches 3 from the axis; 0.68 and the blob's radius of 0.3 stay inside 1.
        knot * (0.68 / 3.0)
    };
    (0..BLOBS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marschner_lobb_has_its_known_values() {
        let volume = marschner_lobb(41).expect("a good size");
        let at = |i: usize, j: usize, k: usize| volume.value((k * 41 + j) * 41 + i);
        // On the axis the ripple is cos(12 pi) = 1, so z alone decides.
        assert!(
            (at(20, 20, 20) - 1.5 / 2.5).abs() < 1e-6,
            "centre: {}",
            at(20, 20, 20)
        );
        assert!(
            (at(20, 20, 0) - 2.5 / 2.5).abs() < 1e-6,
            "z = -1: {}",
            at(20, 20, 0)
        );
        assert!(
            (at(20, 20, 40) - 0.5 / 2.5).abs() < 1e-6,
            "z = 1: {}",
            at(20, 20, 40)
        );
        let (low, high) = volume.value_range();
        assert!(low >= 0.0 && high <= 1.0, "values {low} to {high}");
    }

    #[test]
    fn blobs_stay_inside_their_box() {
        let n = 33;
        let volume = blobs(n).expect("a good size");
        let on_face = |index: usize| {
            [index % n, index / n % n, index / (n * n)]
                .iter()
                .any(|&i| i == 0 || i == n - 1)
        };
        let leak = (0..volume.len())
            .filter(|&i| on_face(i))
            .map(|i| volume.value(i))
            .fold(0.0, f64::max);
        assert_eq!(leak, 0.0, "nothing may be cut off at the faces");
        let (low, high) = volume.value_range();
        assert!(
            low == 0.0 && high > 1.0 && high < 4.0,
            "values {low} to {high}"
        );
    }

    #[test]
    fn checker_box_has_as_many_cells_of_either_kind() {
        let volume = checker_box(100, 10).expect("a good size");
        let Voxels::U8(voxels) = &volume.voxels else {
            panic!("a checker box holds u8")
        };
        let low = voxels.iter().filter(|&&v| v == CHECKER_VALUES[0]).count();
        assert_eq!(
            (low, voxels.len()),
            (500_000, 1_000_000),
            "half of the voxels"
        );
        assert_eq!(
            (voxels[0], voxels[10], voxels[1000]),
            (85, 170, 170),
            "neighbouring cells differ"
        );
    }

    #[test]
    fn senseless_sizes_are_refused() {
        assert!(marschner_lobb(1).is_err(), "one voxel has no spacing");
        assert!(blobs(1 << 40).is_err(), "too large");
        assert!(checker_box(8, 0).is_err(), "cells without voxels");
    }
}
