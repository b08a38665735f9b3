//! A reference's own colours and depths, exactly as they were given, in few bytes.
//!
//! Colours of a file of 8 or 16 bits have at most that many values, and are kept as the numbers of these. A depth follows from
//! the sample's disparity up to a unit in its last place, and which it is takes three bits beside the sample's links; those that were
//! changed while surfaces were found are listed.

mod colours;

use rayon::prelude::*;
use resample_core::Projection;

use crate::surfaces::surface::{DEPTH, Surfaces};
pub(crate) use colours::TakenColours;

/// How a depth follows from the disparity: as its inverse, a unit in the last place above or below it, or not at all.
const INVERSE: u8 = 0;
const ABOVE: u8 = DEPTH;
const BELOW: u8 = 2 * DEPTH;
const UNKNOWN: u8 = 3 * DEPTH;
const LISTED: u8 = 4 * DEPTH;

/// All of these bits.
const BITS: u8 = 7 * DEPTH;

/// Samples that one task looks at.
const PART: usize = 1 << 16;

/// The depths of a reference.
#[derive(Clone, Debug)]
pub(crate) struct TakenDepths {
    projection: Projection,
    /// Depths that do not follow from disparities, by sample.
    listed: Vec<(u32, f32)>,
}

/// Camera z of a disparity.
fn inverse(projection: Projection, disparity: f32) -> f32 {
    match projection {
        Projection::Perspective => 1.0 / disparity,
        Projection::Orthographic => disparity,
    }
}

/// How a depth follows from its `inverse`.
fn relation(depth: f32, inverse: f32) -> u8 {
    let [wanted, found] = [depth, inverse].map(f32::to_bits);
    match wanted.wrapping_sub(found) {
        _ if depth.is_nan() => UNKNOWN,
        0 => INVERSE,
        1 => ABOVE,
        u32::MAX => BELOW,
        _ => LISTED,
    }
}

impl TakenDepths {
    /// Keeps the `depths` that were given. The links of `surfaces` get the bits that tell a depth from its disparity.
    pub(crate) fn new(projection: Projection, depths: &[f32], surfaces: &mut Surfaces) -> Self {
        let links = surfaces.links.par_chunks_mut(PART);
        let disparities = surfaces.disparity.par_chunks(PART);
        let parts = links
            .zip(disparities)
            .zip(depths.par_chunks(PART))
            .enumerate();
        let listed = parts.flat_map_iter(|(part, ((links, disparities), depths))| {
            let mut listed = Vec::new();
            for (i, (links, depth)) in links.iter_mut().zip(depths).enumerate() {
                let relation = relation(*depth, inverse(projection, disparities[i]));
                *links = *links & !BITS | relation;
                if relation == LISTED {
                    listed.push(((part * PART + i) as u32, *depth));
                }
            }
            listed
        });
        Self {
            projection,
            listed: listed.collect(),
        }
    }

    /// Camera z of a sample, as it was given.
    pub(crate) fn get(&self, surfaces: &Surfaces, index: usize) -> f32 {
        let inverse = inverse(self.projection, surfaces.disparity[index]);
        match surfaces.links[index] & BITS {
            INVERSE => inverse,
            ABOVE => f32::from_bits(inverse.to_bits() + 1),
            BELOW => f32::from_bits(inverse.to_bits() - 1),
            LISTED => self.listed(index),
            _ => f32::NAN,
        }
    }

    fn listed(&self, index: usize) -> f32 {
        let place = self
            .listed
            .binary_search_by_key(&(index as u32), |&(index, _)| index);
        place.map_or(f32::NAN, |place| self.listed[place].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::SurfaceTolerance;
    use resample_core::{Camera, LookAt};

    #[test]
    fn depths_come_back_bit_by_bit() {
        let pose = LookAt {
            position: [0.0, 0.0, 0.0].into(),
            target: [0.0, 0.0, 1.0].into(),
            up: [0.0, -1.0, 0.0].into(),
        };
        let camera = Camera::perspective(&pose, 0.8, [300, 200]).expect("a camera");
        let odd = [f32::INFINITY, 0.0, -1.0, 1e-42, 1e-39, 3e38, f32::MAX];
        let mut state = 1u32;
        let mut depths: Vec<f32> = (0..300 * 200)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                1.0 + (state >> 8) as f32 / 1e6
            })
            .collect();
        depths.iter_mut().step_by(97).for_each(|z| *z = f32::NAN);
        depths[1000..1000 + odd.len()].copy_from_slice(&odd);
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let camera = Camera {
                projection,
                ..camera
            };
            let tolerance = SurfaceTolerance::Relative(0.9);
            let mut surfaces = Surfaces::new(&camera, depths.clone(), tolerance);
            let links = surfaces.links.clone();
            let taken = TakenDepths::new(projection, &depths, &mut surfaces);
            for (index, &z) in depths.iter().enumerate() {
                let found = taken.get(&surfaces, index);
                assert!(
                    found.to_bits() == z.to_bits() || (z.is_nan() && found.is_nan()),
                    "sample {index}: {found} for {z}"
                );
                assert_eq!(
                    surfaces.links[index] & !BITS,
                    links[index],
                    "other bits stay"
                );
            }
            assert!(
                taken.listed.len() <= odd.len(),
                "{} are listed",
                taken.listed.len()
            );
        }
    }
}
