//! The box of the subject of a scene of Gaussians: nearly all of it, without those that float about and without a far background.
//!
//! Takes the Gaussians, gives a box along the world's axes. Detail tells where the subject is: training leaves small Gaussians where
//! cameras were near, and large ones far off. So the subject is a ball around the median of opacity over size, and the box has
//! nearly all of the opacity in it: along each axis a weighted quantile of the lower ends of its Gaussians is the low side, one of
//! their upper ends the high side. A quantile is found by the bits of the numbers, in two rounds over them, so that it is exact, takes
//! a time in proportion to their number, and is the same on every machine.
//! Limits: things without detail, far from all others, are taken for background.

use glam::{DVec3, Mat3, Vec3};
use resample_core::narrow::single;

use crate::gaussians::Gaussians;

/// Share of the opacity that lies outside each side of the box. A guess: floaters have less, and a scene loses no more than its
/// outermost fringe.
const OUTSIDE: f64 = 0.01;

/// Share of the detail that a ball around its median holds, and how many times that ball's radius the subject reaches. Guesses: a ball, a
/// rod and a plane are whole (1.1, 1.3 and 1.2 times), two things of which one has a quarter of the detail are both kept, and a sky dome of
/// a thousand times the size of what stands below it is not.
const INNER: f64 = 0.75;
const REACH: f64 = 3.0;

/// Share of the opacity in Gaussians whose size does not count, however small they are: a few tiny ones are not the subject. A guess.
const FINE: f64 = 0.1;

/// The end of a Gaussian, standard deviations from its centre: an opaque one has faded to an eighth there.
const END: f32 = 2.0;

/// Bits of a number that are looked at in each of two rounds.
const HALF_BITS: u32 = 16;

/// Some Gaussians, and the weight of each.
struct Weighted {
    indices: Vec<usize>,
    weights: Vec<f64>,
}

impl Weighted {
    /// Equal weights where all are 0.
    fn new(indices: Vec<usize>, weight: impl Fn(usize) -> f64) -> Self {
        let mut weights: Vec<f64> = indices.iter().map(|&index| weight(index)).collect();
        if weights.iter().sum::<f64>() <= 0.0 {
            weights.fill(1.0);
        }
        Self { indices, weights }
    }

    /// The least number below or at which a share of the weight lies.
    fn quantile(&self, share: f64, number: impl Fn(usize) -> f32) -> f32 {
        let numbers = self.indices.iter().map(|&index| number(index));
        let finite: Vec<f32> = numbers.map(|n| n.clamp(f32::MIN, f32::MAX)).collect();
        quantile(&finite, &self.weights, share)
    }
}

impl Gaussians {
    /// The least and the greatest corner of a box in the world that holds nearly all of the subject among those that `is_counted`
    /// picks by their number; `None` where it picks none.
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
        let subject = self.subject(counted);
        let side = |axis: usize, sign: f32| {
            let end =
                |index: usize| sign * self.centres()[index][axis] - self.half_extent(index)[axis];
            f64::from(sign * subject.quantile(OUTSIDE, end))
        };
        let corner = |sign: f32| DVec3::new(side(0, sign), side(1, sign), side(2, sign));
        Some([1.0, -1.0].map(|sign| self.origin_in_world + corner(sign)))
    }

    /// Those near most of the detail, weighted by their opacity.
    fn subject(&self, counted: Vec<usize>) -> Weighted {
        let opacity = |index: usize| f64::from(self.get(index).opacity);
        let all = Weighted::new(counted, opacity);
        let fine = f64::from(all.quantile(FINE, |index| single(self.size(index))));
        let detail = Weighted::new(all.indices.clone(), |index| {
            let size = self.size(index).max(fine);
            opacity(index) * fine / size.max(f64::MIN_POSITIVE)
        });
        let middle = |axis: usize| detail.quantile(0.5, |index| self.centres()[index][axis]);
        let middle = Vec3::new(middle(0), middle(1), middle(2)).as_dvec3();
        let distance = |index: usize| self.centres()[index].as_dvec3().distance(middle);
        let inner = f64::from(detail.quantile(INNER, |index| single(distance(index))));
        let near = all.indices.into_iter();
        let near = near.filter(|&index| distance(index) <= REACH * inner);
        Weighted::new(near.collect(), opacity)
    }

    /// The side of a square that is as large as its largest outline, up to a factor.
    fn size(&self, index: usize) -> f64 {
        let [x, y, z] = self.get(index).scales.as_dvec3().to_array();
        (x * y).max(y * z).max(z * x).sqrt()
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
    let (upper, before) = bin(values, weights, share * total, |key| Some(key >> HALF_BITS));
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
    if bits >> 31 == 1 {
        !bits
    } else {
        bits | 1 << 31
    }
}

fn value_of(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 {
        key & !(1 << 31)
    } else {
        !key
    })
}

#[cfg(test)]
mod tests {
    use glam::Quat;

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
        assert!(
            low.distance(DVec3::new(1e7 - 1.0, -4.0, 2.0)) < 1e-5,
            "{low}"
        );
        assert!(
            high.distance(DVec3::new(1e7 + 3.0, 8.0, 4.0)) < 1e-5,
            "{high}"
        );
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
        let far = all
            .bounds_in_world(|index| index >= 1000)
            .expect("floaters");
        assert!(far[1].x < -9e5, "{far:?}");
    }

    #[test]
    fn a_far_background_is_left_out_and_a_second_thing_is_not() {
        let mut all = Gaussians::with_capacity(0, 4000);
        let mut add = |number: usize, count: usize, middle: Vec3, radius: f32, size: f32| {
            for at in number..number + count {
                let [turn, rise] = [
                    at as f32 * 2.4,
                    2.0 * (at - number) as f32 / count as f32 - 1.0,
                ];
                let level = (1.0 - rise * rise).sqrt();
                let on_ball = Vec3::new(level * turn.cos(), rise, level * turn.sin());
                let round = ball(middle + radius * on_ball, size);
                all.push(&round, &[]).expect("taken");
            }
        };
        add(0, 1000, Vec3::ZERO, 1.0, 0.05);
        add(1000, 1000, Vec3::new(0.0, 0.0, 10.0), 1.0, 0.05);
        add(2000, 2000, Vec3::ZERO, 500.0, 50.0);
        let both = all.bounds_in_world(|_| true).expect("some");
        assert!(both[0].z < -0.9 && both[1].z > 10.9, "{both:?}");
        assert!(both[0].z > -2.0 && both[1].z < 12.0, "{both:?}");
        let one = all.bounds_in_world(|index| !(1000..2000).contains(&index));
        let one = one.expect("some");
        assert!(one[0].z > -1.5 && one[1].z < 1.5, "{one:?}");
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
        all.push(&ball(Vec3::splat(3e38), 3e38), &[])
            .expect("taken");
        let [low, high] = all.bounds_in_world(|_| true).expect("one");
        assert!(low.is_finite() && high.is_finite(), "{low} {high}");
    }
}
