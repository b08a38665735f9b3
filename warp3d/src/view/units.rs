//! Scenes in a very small or very large unit of length are counted in another one.
//!
//! Depths are f32, and what is made of them (disparities, their steps, their products) may lie at the end of f32 where
//! the depths do not. A power of two changes no digit of them.

use rayon::prelude::*;

use crate::Reference;

/// Binary exponents up to this are left as they are.
const USUAL: i32 = 40;

/// Exponents of f32.
const EXPONENTS: usize = 256;

/// The length, world units, in which references are best counted: 1, or a power of two near the median of their depths.
pub(crate) fn length_of(references: &[Reference]) -> f64 {
    let counts = references
        .iter()
        .map(|reference| exponents(&reference.depth))
        .fold([0; EXPONENTS], added);
    let known: usize = counts.iter().sum();
    let mut before = 0;
    let is_median = |count: &usize| {
        before += count;
        2 * before > known
    };
    let median = counts.iter().position(is_median).unwrap_or(127) as i32 - 127;
    if median.abs() <= USUAL {
        1.0
    } else {
        2f64.powi(median)
    }
}

/// A reference counted in another length.
pub(crate) fn counted_in(mut reference: Reference, length: f64) -> Reference {
    reference.camera = reference.camera.in_unit(length);
    scaled(&mut reference.depth, 1.0 / length);
    reference
}

/// Multiplies depths by a power of two.
pub(crate) fn scaled(depths: &mut [f32], factor: f64) {
    depths
        .par_iter_mut()
        .for_each(|depth| *depth = (f64::from(*depth) * factor) as f32);
}

/// How many depths have each binary exponent, of those that are known.
fn exponents(depth: &[f32]) -> [usize; EXPONENTS] {
    let of_part = |part: &[f32]| {
        let mut counts = [0; EXPONENTS];
        for depth in part {
            let is_known = depth.is_normal() && *depth > 0.0;
            counts[(depth.to_bits() >> 23) as usize % EXPONENTS] += usize::from(is_known);
        }
        counts
    };
    depth
        .par_chunks(1 << 16)
        .map(of_part)
        .reduce(|| [0; EXPONENTS], added)
}

fn added(mut a: [usize; EXPONENTS], b: [usize; EXPONENTS]) -> [usize; EXPONENTS] {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}
