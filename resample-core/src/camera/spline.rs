//! Smooth motion through keys: numbers and orientations as functions of time, passing through every key.
//!
//! Between two keys a number follows the cubic with the keys' values and slopes; the slope at a key is the weighted
//! mean of the slopes on either side (Catmull and Rom 1974, for times that are not equally spaced), so that speed
//! does not jump. An orientation does the same with angular velocities, by a Bezier curve of great arcs (Shoemake
//! 1985). At the first and the last key the slope is that of the neighbouring pair: two keys give a straight line.

use glam::DQuat;

/// The place of a moment between two keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The key before it; the next one is after it.
    pub segment: usize,
    /// How far between the two, 0..=1.
    pub share: f64,
}

/// Where `time` lies among ascending `times`, of which there are at least two; times beyond the ends are the ends.
///
/// # Panics
/// With fewer than two times.
pub fn moment(times: &[f64], time: f64) -> Moment {
    let segment = times
        .partition_point(|&t| t <= time)
        .saturating_sub(1)
        .min(times.len() - 2);
    let share = (time - times[segment]) / (times[segment + 1] - times[segment]);
    Moment {
        segment,
        share: share.clamp(0.0, 1.0),
    }
}

/// The value at a moment of a number that has `values` at `times`.
///
/// # Panics
/// Where there are fewer values than times, or the moment is of other times.
pub fn number(times: &[f64], values: &[f64], at: Moment) -> f64 {
    let i = at.segment;
    let length = times[i + 1] - times[i];
    let rate = |k: usize| (values[k + 1] - values[k]) / (times[k + 1] - times[k]);
    let slope = |key: usize| mean_at_key(times, key, rate, |a, b, t| a + t * (b - a));
    let (t, u) = (at.share, 1.0 - at.share);
    // Hermite's cubic: the first two terms are the values, the others the slopes.
    values[i] * (1.0 + 2.0 * t) * u * u
        + values[i + 1] * (3.0 - 2.0 * t) * t * t
        + length * (slope(i) * t * u * u - slope(i + 1) * t * t * u)
}

/// The orientation at a moment of a body that has `orientations` at `times`, turning the short way between keys.
///
/// # Panics
/// Where there are fewer orientations than times, or the moment is of other times.
pub fn orientation(times: &[f64], orientations: &[DQuat], at: Moment) -> DQuat {
    let i = at.segment;
    let length = times[i + 1] - times[i];
    let turn = |k: usize| {
        let (from, to) = (orientations[k], orientations[k + 1]);
        // The short way: q and -q are the same orientation.
        let to = if from.dot(to) < 0.0 { -to } else { to };
        (to * from.inverse()).to_scaled_axis() / (times[k + 1] - times[k])
    };
    let velocity = |key: usize| mean_at_key(times, key, turn, |a, b, t| a.lerp(b, t));
    let turned = |key: usize, by: f64| {
        (DQuat::from_scaled_axis(velocity(key) * (by * length / 3.0)) * orientations[key])
            .normalize()
    };
    let controls = [
        orientations[i],
        turned(i, 1.0),
        turned(i + 1, -1.0),
        orientations[i + 1],
    ];
    let step = |a: DQuat, b: DQuat| a.slerp(b, at.share);
    let [a, b, c] = [0, 1, 2].map(|k| step(controls[k], controls[k + 1]));
    step(step(a, b), step(b, c)).normalize()
}

/// The rate at a key from the rates between keys: the nearer side counts more.
fn mean_at_key<T>(
    times: &[f64],
    key: usize,
    rate: impl Fn(usize) -> T,
    mix: impl Fn(T, T, f64) -> T,
) -> T {
    if key == 0 {
        return rate(0);
    }
    if key == times.len() - 1 {
        return rate(key - 1);
    }
    let (before, after) = (times[key] - times[key - 1], times[key + 1] - times[key]);
    mix(rate(key - 1), rate(key), before / (before + after))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const TIMES: [f64; 4] = [0.0, 1.0, 1.5, 4.0];

    #[test]
    fn keys_are_met_and_speed_does_not_jump() {
        let values = [2.0, -1.0, 0.5, 3.0];
        let at = |time: f64| number(&TIMES, &values, moment(&TIMES, time));
        for (time, value) in TIMES.iter().zip(values) {
            assert!((at(*time) - value).abs() < 1e-12, "key at {time}");
        }
        for time in [1.0, 1.5] {
            let h = 1e-6;
            let (before, after) = ((at(time) - at(time - h)) / h, (at(time + h) - at(time)) / h);
            assert!(
                (before - after).abs() < 1e-4,
                "speed {before} before {time} and {after} after"
            );
        }
    }

    #[test]
    fn a_straight_motion_stays_straight() {
        let values = TIMES.map(|t| 3.0 - 2.0 * t);
        for k in 0..=40 {
            let time = 0.1 * f64::from(k);
            let got = number(&TIMES, &values, moment(&TIMES, time));
            assert!((got - (3.0 - 2.0 * time)).abs() < 1e-12, "at {time}: {got}");
        }
    }

    #[test]
    fn a_steady_turn_stays_steady() {
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        let turned = |time: f64| DQuat::from_axis_angle(axis, 0.7 * time);
        // The sign of a key must not matter.
        let keys = [turned(0.0), -turned(1.0), turned(1.5), -turned(4.0)];
        for k in 0..=40 {
            let time = 0.1 * f64::from(k);
            let got = orientation(&TIMES, &keys, moment(&TIMES, time));
            let off = got.angle_between(turned(time));
            assert!(off < 1e-6, "at {time}: off by {off} rad");
        }
    }

    #[test]
    fn moments_beyond_the_ends_are_the_ends() {
        assert_eq!(
            moment(&TIMES, -1.0),
            Moment {
                segment: 0,
                share: 0.0
            }
        );
        assert_eq!(
            moment(&TIMES, 9.0),
            Moment {
                segment: 2,
                share: 1.0
            }
        );
        assert_eq!(
            moment(&TIMES, 1.5),
            Moment {
                segment: 2,
                share: 0.0
            }
        );
    }
}
