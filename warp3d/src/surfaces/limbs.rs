//! Where a round body curves out of sight, and its disparity there.
//!
//! Near its limb disparity goes like a square root, w = end + k sqrt(d) + m d, d samples from the limb, whichever way the limb
//! runs. The ratio of the second differences of four samples then tells d of the last one, then the end, k and m. Of
//! three samples, without m, the squares of their heights above the end grow by the same k^2 from each to the next, which is
//! linear in the end.
//!
//! So a last sample goes on to where its surface ends, however far that is, and the outline of the body is as smooth
//! from aside as it is from the reference.
//!
//! Limits: a row that meets the limb at less than some 20 degrees is not a square root of d; there three samples and four
//! disagree, and colours decide.

use resample_core::Projection;

use crate::surfaces::surface::Surfaces;

/// Where a surface ends beyond its last sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limb {
    /// From the last sample, samples: 0 to 1.
    pub(crate) distance: f32,
    /// Deviation of that, samples.
    pub(crate) deviation: f32,
    /// By how much disparity changes from the last sample to the end.
    change: f32,
}

/// Least step of disparity between the samples from which a limb is recognised, in tolerances. With 1, rough depth has limbs where
/// it has none (livingroom loses 0.03 dB in its edge band); with 2, far balls have none, and stereo gains 0.04 dB instead of 0.2.
const LEAST_STEP: f32 = 1.5;

/// Deviation of a distance of which three samples tell the same as four, samples.
const SHARPEST: f32 = 0.03;

/// Deviation of the distance for each sample by which three and four differ: with balls of 10 to 160 px it is 0.2 to 0.4.
const BY_DIFFERENCE: f32 = 0.3;

/// Deviation of what three samples alone tell, samples: with balls of 40 px.
const OF_THREE: f32 = 0.2;

/// Least distance over which disparity falls to its end, samples: where the edge's place leaves less, the slope stays finite.
const LEAST_REACH: f32 = 0.05;

/// An edge found this little before the end of a surface is at the end, samples: the deviation of the best places. With 0, seen
/// from aside, a ball has teeth of three pixels; with 0.1 stereo loses 0.3 dB.
const AT_END: f32 = 0.04;

impl Surfaces {
    /// The limb after the sample `index` along an axis, forwards or backwards, if there is one.
    pub(crate) fn limb(&self, index: usize, axis: usize, forwards: bool) -> Option<Limb> {
        let count = self.size[axis];
        let place = [index % self.size[0], index / self.size[0]][axis];
        let (inwards, outwards) = if forwards {
            (place, count - 1 - place)
        } else {
            (count - 1 - place, place)
        };
        let goes_on = outwards > 0 && self.linked_beside(index, axis, forwards);
        if inwards < 2 || goes_on || !self.linked_beside(index, axis, !forwards) {
            return None;
        }
        let next = self.beside(index, axis, !forwards);
        if !self.linked_beside(next, axis, !forwards) {
            return None;
        }
        let after = self.beside(next, axis, !forwards);
        let rise = |sample: usize| self.disparity[sample] - self.disparity[index];
        let [first, second] = [rise(next), rise(after)];
        let away = match self.projection {
            Projection::Perspective => first > 0.0,
            Projection::Orthographic => first < 0.0,
        };
        let least = LEAST_STEP * self.tolerance * self.disparity[index].abs();
        if !away || (second - first).abs() <= least {
            return None;
        }
        let limb = of_three([first, second])?;
        if inwards >= 3 && self.linked_beside(after, axis, !forwards) {
            let third = rise(self.beside(after, axis, !forwards));
            let finer = of_four([first, second, third]);
            return finer.map(|finer| finer.beside(&limb));
        }
        Some(limb)
    }

    /// Returns true if a sample is linked with the one beside it.
    fn linked_beside(&self, index: usize, axis: usize, forwards: bool) -> bool {
        let first = if forwards {
            index
        } else {
            self.beside(index, axis, false)
        };
        self.linked_on(first, axis)
    }

    /// The sample beside another one.
    fn beside(&self, index: usize, axis: usize, forwards: bool) -> usize {
        let step = [1, self.size[0]][axis];
        if forwards { index + step } else { index - step }
    }

    /// Slopes of a sample along each axis, backwards and forwards: on the side of a limb, down to its end. `reach(index, axis,
    /// towards)` says how far the sample reaches there, `None` where it is linked.
    pub(crate) fn slopes_by_side(
        &self,
        reach: impl Fn(usize, usize, i32) -> Option<f64>,
        index: usize,
    ) -> [[f32; 2]; 2] {
        let plain = self.slope(index);
        [0, 1].map(|axis| {
            let limb = |forwards| Some((forwards, self.limb(index, axis, forwards)?));
            let Some((forwards, limb)) = limb(false).or_else(|| limb(true)) else {
                return [plain[axis]; 2];
            };
            let sign = if forwards { 1.0 } else { -1.0 };
            let reach = reach(index, axis, sign as i32);
            let reach = reach.map_or(1.0, |reach| reach as f32).max(LEAST_REACH);
            let outwards = sign * limb.change_over(reach) / reach;
            let next = self.beside(index, axis, !forwards);
            let inwards = sign * (self.disparity[index] - self.disparity[next]);
            if forwards {
                [inwards, outwards]
            } else {
                [outwards, inwards]
            }
        })
    }
}

impl Limb {
    /// By how much disparity changes on the way to an edge this far: to the end, or along the root if the edge is found before.
    fn change_over(&self, reach: f32) -> f32 {
        let reach = reach + AT_END;
        let left = 1.0 - (reach / self.distance.max(reach)).min(1.0);
        self.change * (1.0 - left.sqrt())
    }

    /// With the deviation that the difference from another estimate shows.
    fn beside(self, other: &Self) -> Self {
        let apart = (self.distance - other.distance).abs();
        Self {
            deviation: SHARPEST + BY_DIFFERENCE * apart,
            ..self
        }
    }
}

/// The limb beyond a sample, from how much farther up the next two samples inside are; `None` where these do not curve as
/// at a limb within a sample.
fn of_three([first, second]: [f32; 2]) -> Option<Limb> {
    let (inner, bend) = (second - first, 2.0 * first - second);
    if !(first * inner > 0.0 && first * bend > 0.0) {
        return None;
    }
    let fall = (second * second - 2.0 * first * first) / (2.0 * bend);
    let fall = if fall * first > 0.0 { fall } else { 0.0 };
    // k^2 is the step of the squares.
    let distance = fall * fall / (first * first + 2.0 * first * fall);
    (distance <= 1.0).then_some(Limb {
        distance,
        deviation: OF_THREE,
        change: -fall,
    })
}

/// As [`of_three`] from one sample more; `None` where these do not bend as at a limb.
fn of_four(rises: [f32; 3]) -> Option<Limb> {
    let [first, second, third] = rises.map(f64::from);
    let (outer, inner) = (2.0 * first - second, 2.0 * second - first - third);
    if !(outer * inner > 0.0) {
        return None;
    }
    // The bend of a square root falls off from the limb on, by 6.1 at 0 and by 1.9 at 1.
    let bend = |d: f64| 2.0 * (d + 1.0).sqrt() - d.sqrt() - (d + 2.0).sqrt();
    let ratio = outer / inner;
    if ratio < bend(1.0) / bend(2.0) {
        return None;
    }
    let [mut low, mut high] = [0.0, 1.0];
    // To 2^-16 of a sample.
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if bend(middle) > ratio * bend(middle + 1.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let distance = 0.5 * (low + high);
    let k = outer / bend(distance);
    let m = first - k * ((distance + 1.0).sqrt() - distance.sqrt());
    Some(Limb {
        distance: distance as f32,
        deviation: SHARPEST,
        change: -(k * distance.sqrt() + m * distance) as f32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_square_root_is_found() {
        for (i, k) in (0..20).flat_map(|i| [0.3, -2.0].map(|k: f64| (i, k))) {
            let distance = 0.05 * f64::from(i);
            for m in [0.0, 0.1 * k, -0.1 * k] {
                let height = |d: f64| k * d.sqrt() + m * d;
                let rise = |steps: f64| (height(distance + steps) - height(distance)) as f32;
                let found = of_four([1.0, 2.0, 3.0].map(rise)).expect("a bend");
                let told = |limb: Limb, what: &str| {
                    let away = (f64::from(limb.distance) - distance).abs();
                    let off = (f64::from(limb.change) + height(distance)).abs();
                    assert!(away < 1e-3, "{what}: {distance}, {m}: {limb:?}");
                    assert!(off < 5e-3 * k.abs(), "{what}: {distance}, {m}: {limb:?}");
                };
                told(found, "four");
                if m == 0.0 {
                    let found = of_three([1.0, 2.0].map(rise)).expect("a limb");
                    told(found, "three");
                    let half = f64::from(found.change_over(0.5 * distance as f32 - AT_END));
                    let expected = height(0.5 * distance) - height(distance);
                    assert!(
                        (half - expected).abs() < 5e-3 * k.abs(),
                        "{distance}: {half}"
                    );
                }
            }
        }
        // A plane, a hollow, a step back, and what bends less than a limb does.
        for rises in [[1.0, 2.0], [1.0, 2.5], [1.0, 0.5], [1.0, 1.8]] {
            assert_eq!(of_three(rises), None, "{rises:?}");
        }
        assert_eq!(of_four([1.0, 2.0, 3.0]), None, "a plane");
        assert_eq!(
            of_four([1.0, 1.5, 1.5]),
            None,
            "a bend that grows the other way"
        );
    }
}
