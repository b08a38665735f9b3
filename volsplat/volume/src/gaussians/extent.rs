//! The box of what a person means by a scene of Gaussians: nearly all of it, without those that float about.
//!
//! Takes the Gaussians, gives a box along the world's axes. Along each axis a weighted quantile of the lower ends of all Gaussians is
//! its low side, one of their upper ends its high side. A quantile is found by the bits of the numbers, in two rounds over them, so
//! that it is exact, takes a time in proportion to their number, and is the same on every machine.

use glam::{DVec3, Mat3, Vec3};

use crate::gaussians::Gaussians;

/// Share of the weight that lies outside each side of the box. A guess: floaters have less, and a scene loses no more than its
/// outermost fringe.
const OUTSIDE: f64 = 0.01;

/// The end of a Gaussian, standard deviations from its centre: an opaque one has faded to an eighth there.
const END: f32 = 2.0;

/// Bits of a number that are looked at in each of two rounds.
const HALF_BITS: u32 = 16;

impl Gaussians {
    /// The least and the greatest corner of a box in the world that holds nearly all of those that `is_counted` picks by their
    /// number; `None` where it picks none.
    ///
    /// ```
    /// use resample_volume::Gaussians;
    ///
    /// assert!(Gaussians::default().bounds_in_world(|_| true).is_none());
    /// ```
    pub fn bounds_in_world(&self, is_counted: impl Fn(usize) -> bool) -> Option<[DVec3; 2]> {
        let counted: Vec<usize> = (0..self.len()).filter(|&index| is_counted(index)).collect();
        if counted.is_empty() {
            return None;
        }
        let mut weights: Vec<f64> = counted.iter().map(|&index| self.weight(index)).collect();
        if weights.iter().sum::<f64>() <= 0.0 {
            weights.fill(1.0);
        }
        let halves: Vec<Vec3> = counted.iter().map(|&i| self.half_extent(i)).collect();
        let side = |axis: usize, sign: f32| {
            let ends = counted.iter().zip(&halves).map(|(&index, half)| {
                let end = sign * self.centres()[index][axis] - half[axis];
                end.clamp(f32::MIN, f32::MAX)
            });
            let ends: Vec<f32> = ends.collect();
            f64::from(sign * quantile(&ends, &weights, OUTSIDE))
        };
        let corner = |sign: f32| DVec3::new(side(0, sign), side(1, sign), side(2, sign));
        Some([1.0, -1.0].map(|sign| self.origin_in_world + corner(sign)))
    }

    /// How much of the scene it is: its opacity.
    fn weight(&self, index: usize) -> f64 {
        f64::from(self.get(index).opacity)
    }

    /// From its centre to its ends along the world's axes.
    fn half_extent(&self, index: usize) -> Vec3 {
        let gaussian = self.get(index);
        let axes = Mat3::from_quat(gaussian.rotation) * Mat3::from_diagonal(gaussian.scales);
        let rows = axes.transpose();
        END * Vec3::new(
            rows.x_axis.length(),
            rows.y_axis.length(),
            rows.z_axis.length(),
        )
    }
}

/// The least value below or at which a share of the weight lies.
fn quantile(values: &[f32], weights: &[f64], share: f64) -> f32 {
    let total: f64 = weights.iter().sum();
    let (upper, before) = bin(values, weights, share * total, |key| {
        Some(key >> HALF_BITS)
    });
    let (lower, _) = bin(values, weights, share * total - before, |key| {
        (key >> HALF_BITS == upper).then_some(key & ((1 << HALF_BITS) - 1))
    });
    value_of(upper << HALF_BITS | lower)
}

/// The first bin at which the weights reach `wanted`, and the weight before it.
fn bin(
    values: &[f32],
    weights: &[f64],
    wanted: f64,
    place: impl Fn(u32) -> Option<u32>,
) -> (u32, f64) {
    let mut bins = vec![0.0; 1 << HALF_BITS];
    for (value, weight) in values.iter().zip(weights) {
        if let Some(place) = place(key_of(*value)) {
            bins[place as usize] += weight;
        }
    }
    let mut before = 0.0;
    let mut last = (0, 0.0);
    for (place, weight) in (0u32..).zip(bins) {
        if weight > 0.0 {
            last = (place, before);
            before += weight;
            if before >= wanted {
                break;
            }
        }
    }
    last
}

/// A whole number with the order of the value.
fn key_of(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

fn value_of(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key })
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use resample_core::narrow::single;

    use super::*;
    use crate::gaussians::Gaussian;

    fn ball(centre: Vec3, size: f32) -> Gaussian {
        Gaussian {
            centre,
            rotation: Quat::from_rotation_y(0.7),
            scales: Vec3::splat(size),
            opacity: 0.5,
            colour: Vec3::ONE,
        }
    }

    #[test]
    fn one_gaussian_has_its_own_extent() {
        let mut all = Gaussians::with_capacity(0, 1);
        all.origin_in_world = DVec3::new(1e7, 0.0, 0.0);
        let long = Gaussian {
            rotation: Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
            scales: Vec3::new(3.0, 1.0, 0.5),
            ..ball(Vec3::new(1.0, 2.0, 3.0), 1.0)
        };
        all.push(&long, &[]).expect("taken");
        let [low, high] = all.bounds_in_world(|_| true).expect("one");
        assert!(low.distance(DVec3::new(1e7 - 1.0, -4.0, 2.0)) < 1e-5, "{low}");
        assert!(high.distance(DVec3::new(1e7 + 3.0, 8.0, 4.0)) < 1e-5, "{high}");
    }

    #[test]
    fn floaters_are_left_out() {
        let mut all = Gaussians::with_capacity(0, 1010);
        for number in 0..1000 {
            let at = number as f32 / 1000.0;
            let centre = Vec3::new(at, -at, 0.5 * at);
            all.push(&ball(centre, 0.01), &[]).expect("taken");
        }
        for number in 0..8 {
            let far = ball(Vec3::splat(-1e6 - number as f32), 100.0);
            all.push(&far, &[]).expect("taken");
        }
        let [low, high] = all.bounds_in_world(|_| true).expect("some");
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 0.1, "{a}, expected {b}");
        near(low, DVec3::new(0.0, -1.0, 0.0));
        near(high, DVec3::new(1.0, 0.0, 0.5));
        let far = all.bounds_in_world(|index| index >= 1000).expect("floaters");
        assert!(far[1].x < -9e5, "{far:?}");
    }

    #[test]
    fn quantiles_are_those_of_a_sorted_list() {
        let mut dice = 7u64;
        let mut roll = || {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            single((dice >> 40) as f64 / f64::from(1 << 24) - 0.5)
        };
        let values: Vec<f32> = (0..500).map(|_| roll().powi(5) * 1e4).collect();
        let weights: Vec<f64> = (0..500).map(|_| f64::from(roll().abs())).collect();
        let mut sorted: Vec<usize> = (0..500).collect();
        sorted.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let total: f64 = weights.iter().sum();
        for share in [0.0, 0.02, 0.31, 0.5, 0.97] {
            let mut sum = 0.0;
            let reached = sorted.iter().find(|index| {
                sum += weights[**index];
                sum >= share * total
            });
            let expected = values[*reached.expect("below 1")];
            assert_eq!(quantile(&values, &weights, share), expected, "{share}");
        }
    }

    #[test]
    fn the_largest_numbers_stay_finite() {
        let mut all = Gaussians::with_capacity(0, 1);
        all.push(&ball(Vec3::splat(3e38), 3e38), &[]).expect("taken");
        let [low, high] = all.bounds_in_world(|_| true).expect("one");
        assert!(low.is_finite() && high.is_finite(), "{low} {high}");
    }
}
