//! Soft depth edges made sharp: depth that was blurred, enlarged or packed with loss has ramps between surfaces.
//!
//! Along a row or column a ramp is a run of steps of inverse depth that are much larger than those before and behind it.
//! Exact depth steps from one surface to the other at once. So a map whose edges are ramps for the most part was
//! softened, and only then are its ramps cut: where the picture has an edge, else half way, in the numbers in which they
//! are symmetric; and each sample moves to the surface on its side. In a map whose edges are sharp nothing changes.
//!
//! Limits: a wall seen at a grazing angle looks like a ramp in a softened map, and a thing that is thinner than the
//! blur keeps the depth that is left of it.

use rayon::prelude::*;
use resample_core::Projection;

use crate::surfaces::sides::{Choice, SIDES_REACH, take_sides};
use crate::view::warp::disparity;

/// Most steps of a ramp to either side of its largest one: a Gaussian of 4 px, or an enlargement by 8 with a cubic.
const REACH: usize = 12;

/// A step belongs to a ramp if it is at least this part of the largest one. A blur of half a sample's sigma leaves 0.23
/// beside the largest step where the edge lies between two samples.
const BODY: f32 = 0.1;

/// The tails of a ramp of three steps or more go on down to this part of the largest step.
const TAIL: f32 = 0.04;

/// Steps of a tail fall off from one to the next at least by this factor.
const TAIL_DECAY: f32 = 0.9;

/// Least step at a ramp's middle, relative to the nearer end's disparity.
const LEAST_STEP: f32 = 0.005;

/// Least jump from surface to surface, relative to the nearer end's disparity.
const LEAST_JUMP: f32 = 0.03;

/// Samples beside a ramp in which a surface does not turn back, and by which part of the ramp at most in one step.
const FLAT: usize = 4;
const TURN: f32 = 0.01;

/// Rows around a sample on which its sharpened depth depends: both halves of a ramp, and the slopes beside it, of the samples
/// from which it hears.
const HALO: usize = 2 * REACH + 8 + SIDES_REACH;

/// Rows of a map that vote on how its edges are, at least: each has its say where a map has fewer.
const VOTERS: usize = 256;

/// How the edges of a depth map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edges {
    /// Most are steps: the map stays as it is.
    Sharp,
    /// Most are ramps, half way in camera z.
    SoftInDepth,
    /// Most are ramps, half way in inverse depth.
    SoftInDisparity,
}

impl Edges {
    /// How the edges along the rows of a depth map are.
    pub(crate) fn of(projection: Projection, depth: &[f32], width: usize) -> Self {
        let height = depth.len() / width.max(1);
        depth
            .par_chunks(width)
            .step_by((height / VOTERS).max(1))
            .map(|row| Votes::of_row(projection, row))
            .reduce(Votes::default, Votes::with)
            .edges()
    }
}

/// The votes of some edges.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Votes {
    sharp: u64,
    soft: u64,
    /// Ramps from surface to surface, in disparity and in depth, and the sum of how far they are from symmetric, samples.
    whole: [u64; 2],
    skew: [f64; 2],
}

/// A ramp: the last samples of the two surfaces, and what lies between them.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    first: usize,
    last: usize,
    /// The largest step, without sign, relative to the larger end.
    step: f32,
}

impl Votes {
    /// The edges along a row of camera z.
    pub(crate) fn of_row(projection: Projection, depth: &[f32]) -> Self {
        let mut votes = Self::default();
        for (numbers, edges) in [Edges::SoftInDisparity, Edges::SoftInDepth]
            .into_iter()
            .enumerate()
        {
            let line = numbers_of(projection, depth, edges);
            for ramp in ramps(&line) {
                if ramp.last - ramp.first < 2 {
                    votes.sharp += 1;
                } else {
                    votes.soft += 1;
                    // A bump that a blur has left of something thin is half way nowhere.
                    if is_flat_around(&line, &ramp) {
                        votes.whole[numbers] += 1;
                        votes.skew[numbers] += skew(&line[ramp.first..=ramp.last]);
                    }
                }
            }
        }
        votes
    }

    /// Both together.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            sharp: self.sharp + other.sharp,
            soft: self.soft + other.soft,
            whole: [
                self.whole[0] + other.whole[0],
                self.whole[1] + other.whole[1],
            ],
            skew: [self.skew[0] + other.skew[0], self.skew[1] + other.skew[1]],
        }
    }

    /// The majority.
    pub(crate) fn edges(self) -> Edges {
        let mean = |i: usize| self.skew[i] / self.whole[i].max(1) as f64;
        match self {
            _ if self.soft <= self.sharp => Edges::Sharp,
            _ if mean(1) < mean(0) => Edges::SoftInDepth,
            _ => Edges::SoftInDisparity,
        }
    }
}

/// Returns true if the surfaces beside a ramp go on without turning back.
fn is_flat_around(line: &[f32], ramp: &Ramp) -> bool {
    let rise = line[ramp.last] - line[ramp.first];
    let turns = |from: usize| {
        let step = line
            .get(from + 1)
            .zip(line.get(from))
            .map_or(0.0, |(b, a)| b - a);
        step * rise.signum() < -TURN * rise.abs()
    };
    let before = ramp.first.saturating_sub(FLAT)..ramp.first;
    !before.chain(ramp.last..ramp.last + FLAT).any(turns)
}

/// The farthest samples before and behind a ramp that belong to a surface so narrow that the next ramp begins at once; `None`
/// where it is not narrow.
fn turns(line: &[f32], ramp: &Ramp) -> [Option<usize>; 2] {
    let rise = line[ramp.last] - line[ramp.first];
    let falls = |rise: f32, from: Option<&f32>, to: Option<&f32>| {
        from.zip(to)
            .is_some_and(|(from, to)| (from - to) / rise > TURN)
    };
    let before = |k: usize| ramp.first.checked_sub(k).and_then(|at| line.get(at));
    let behind = |k: usize| line.get(ramp.last + k);
    [
        (0..FLAT)
            .find(|&k| falls(-rise, before(k), before(k + 1)))
            .map(|k| ramp.first - k),
        (0..FLAT)
            .find(|&k| falls(rise, behind(k), behind(k + 1)))
            .map(|k| ramp.last + k),
    ]
}

/// How far a ramp's centre of gravity lies from the place where it is half way, samples.
fn skew(ramp: &[f32]) -> f64 {
    let number = |i: usize| f64::from(ramp[i]);
    let (from, to) = (number(0), number(ramp.len() - 1));
    let half = 0.5 * (from + to);
    let (mut gravity, mut crossing) = (0.0, 0.0);
    for i in 0..ramp.len() - 1 {
        let (a, b) = (number(i), number(i + 1));
        gravity += (b - a) / (to - from) * (i as f64 + 0.5);
        if (a - half) * (b - half) <= 0.0 && a != b {
            crossing = i as f64 + (half - a) / (b - a);
        }
    }
    (gravity - crossing).abs()
}

/// Rows that are sharpened together: with [`HALO`] above and below, a twelfth more than without.
const BAND: usize = 1024;

/// As [`sharpened`], with the memory that it takes beside for a band of rows alone.
pub(crate) fn sharpened_in_bands(
    projection: Projection,
    (depth, colours): (&[f32], &[[f32; 3]]),
    width: usize,
    edges: Edges,
) -> Vec<f32> {
    let height = depth.len() / width;
    let mut sharp = Vec::with_capacity(depth.len());
    for first in (0..height).step_by(BAND) {
        let (from, end) = (first.saturating_sub(HALO), (first + BAND).min(height));
        let around = from * width..(end + HALO).min(height) * width;
        let given = (&depth[around.clone()], &colours[around]);
        let band = sharpened(projection, given, width, edges);
        sharp.extend_from_slice(&band[(first - from) * width..(end - from) * width]);
    }
    sharp
}

/// Camera z with its soft edges made sharp, where the picture's `colours` have edges.
fn sharpened(
    projection: Projection,
    (depth, colours): (&[f32], &[[f32; 3]]),
    width: usize,
    edges: Edges,
) -> Vec<f32> {
    let height = depth.len() / width;
    let mut surfaces = numbers_of(projection, depth, Edges::SoftInDisparity);
    let numbers = numbers_of(projection, depth, edges);
    // The better one so far: that of the ramp with the largest step.
    let mut choices = vec![Choice::default(); depth.len()];
    choices
        .par_chunks_mut(width)
        .zip(numbers.par_chunks(width))
        .zip(surfaces.par_chunks(width))
        .for_each(|((to, numbers), line)| {
            choose(numbers, line, |at, choice| {
                to[at] = to[at].or_steeper(choice)
            });
        });
    let columns: Vec<Vec<(usize, Choice)>> = (0..width)
        .into_par_iter()
        .map(|x| {
            let column =
                |of: &[f32]| -> Vec<f32> { (0..height).map(|y| of[y * width + x]).collect() };
            let mut found = Vec::new();
            choose(&column(&numbers), &column(&surfaces), |y, choice| {
                found.push((y * width + x, choice))
            });
            found
        })
        .collect();
    for (at, choice) in columns.into_iter().flatten() {
        choices[at] = choices[at].or_steeper(choice);
    }
    take_sides(&mut surfaces, &choices, colours, width);
    let sharp = |((&z, choice), &d): ((&f32, &Choice), &f32)| match projection {
        _ if choice.step == 0.0 => z,
        Projection::Perspective => 1.0 / d,
        Projection::Orthographic => d,
    };
    let choices = choices.par_iter();
    depth
        .par_iter()
        .zip(choices)
        .zip(&surfaces)
        .map(sharp)
        .collect()
}

/// Calls `to(sample, what it may be)` for the samples inside the ramps of a line of `numbers`, whose disparities are `line`.
fn choose(numbers: &[f32], line: &[f32], mut to: impl FnMut(usize, Choice)) {
    for ramp in ramps(numbers).filter(|ramp| ramp.last - ramp.first >= 2) {
        let (first, last) = (line[ramp.first], line[ramp.last]);
        let half = 0.5 * (numbers[ramp.first] + numbers[ramp.last]);
        let largest = (ramp.first..ramp.last)
            .map(|i| (line[i + 1] - line[i]).abs())
            .fold(0.0, f32::max);
        let before = slope(line, ramp.first, -1, largest);
        let behind = slope(line, ramp.last, 1, largest);
        let turns = turns(line, &ramp);
        let from = turns[0].unwrap_or(ramp.first + 1);
        let end = turns[1].unwrap_or(ramp.last - 1);
        for at in from..=end {
            // A surface goes on in front of its horizon.
            let on = |value: f32, end: f32| if value > 0.0 { value } else { end };
            let from_first = on(first + before * (at as f32 - ramp.first as f32), first);
            let from_last = on(last - behind * (ramp.last as f32 - at as f32), last);
            // From -1 at the first sample to 1 at the last one.
            let lean = match at {
                _ if at <= ramp.first => -1.0,
                _ if at >= ramp.last => 1.0,
                _ => (numbers[at] - half) / (numbers[ramp.last] - half),
            };
            let choice = Choice {
                step: ramp.step,
                sides: [from_first, from_last],
                lean: lean.clamp(-1.0, 1.0),
                turns: turns.map(|turn| turn.is_some()),
            };
            to(at, choice.ordered());
        }
    }
}

/// The slope of the surface that ends at `end`, along the line: the least of three steps away from the ramp.
fn slope(line: &[f32], end: usize, away: isize, largest: f32) -> f32 {
    let step = |k: isize| {
        let from = end.checked_add_signed(k)?;
        Some(line.get(from + 1)? - line[from])
    };
    let mut least: Option<f32> = None;
    for k in 0..3 {
        let place = if away < 0 { -k - 1 } else { k };
        let Some(found) = step(place).filter(|s| s.abs() < BODY * largest) else {
            return 0.0;
        };
        least = Some(match least {
            None => found,
            Some(least) if least * found <= 0.0 => return 0.0,
            Some(least) if least.abs() <= found.abs() => least,
            Some(_) => found,
        });
    }
    least.unwrap_or(0.0)
}

/// The edges of a line of disparities, ramps and steps.
fn ramps(line: &[f32]) -> impl Iterator<Item = Ramp> + '_ {
    (0..line.len().saturating_sub(1)).filter_map(|at| ramp_at(line, at))
}

/// The ramp whose largest step leads from the sample `at` to the next.
fn ramp_at(line: &[f32], at: usize) -> Option<Ramp> {
    // Relative to the larger end a jump is as large in depth as in inverse depth.
    let step = line[at + 1] - line[at];
    let nearer = line[at].max(line[at + 1]);
    if !(step.abs() >= LEAST_STEP * nearer) {
        return None;
    }
    // The steps outwards, in the direction of the ramp: below 0 or NaN is none of it.
    let sign = step.signum();
    let before = |k: usize| {
        let i = at.checked_sub(k)?;
        Some(sign * (line[i + 1] - line[i]))
    };
    let behind = |k: usize| Some(sign * (line.get(at + k + 1)? - line[at + k]));
    let left = extent(step.abs(), true, before)?;
    let right = extent(step.abs(), false, behind)?;
    let (mut first, mut last) = (at - left, at + 1 + right);
    if last - first >= 3 {
        first -= tail(step.abs(), left, before);
        last += tail(step.abs(), right, behind);
    }
    let jump = (line[last] - line[first]).abs();
    let nearer = line[first].max(line[last]);
    (jump >= LEAST_JUMP * nearer).then_some(Ramp {
        first,
        last,
        step: step.abs() / nearer,
    })
}

/// Steps of a ramp's body to one side of its largest; `None` if there is a larger one, or the ramp does not end before the
/// known depths do.
fn extent(largest: f32, ties: bool, step: impl Fn(usize) -> Option<f32>) -> Option<usize> {
    for k in 1..=REACH {
        match step(k) {
            // The steepest step beside unknown depth is the limb of something round: nothing says that it falls off again.
            found if k == 1 && found.is_none_or(f32::is_nan) => return None,
            Some(found) if found > largest || (ties && found == largest) => return None,
            Some(found) if found >= BODY * largest => {}
            _ => return Some(k - 1),
        }
    }
    None
}

/// Steps of a ramp's tail behind the `body` steps to one side.
fn tail(largest: f32, body: usize, step: impl Fn(usize) -> Option<f32>) -> usize {
    let mut before = step(body).unwrap_or(largest);
    for k in 1..=REACH - body.min(REACH) {
        match step(body + k) {
            Some(found) if found >= TAIL * largest && found <= TAIL_DECAY * before => {
                before = found
            }
            _ => return k - 1,
        }
    }
    REACH - body.min(REACH)
}

/// The numbers in which ramps are looked for: camera z, or disparity; NaN where unknown.
fn numbers_of(projection: Projection, depth: &[f32], edges: Edges) -> Vec<f32> {
    depth
        .iter()
        .map(|&z| match edges {
            Edges::SoftInDepth => z,
            Edges::Sharp | Edges::SoftInDisparity => disparity(projection, z).unwrap_or(f32::NAN),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERSPECTIVE: Projection = Projection::Perspective;

    /// Two slanted walls with the edge between samples 20 and 21, in disparity.
    fn walls(x: f64) -> f64 {
        if x < 20.5 {
            0.5 + 0.001 * x
        } else {
            0.2 - 0.0005 * x
        }
    }

    /// Rows of camera z, blurred in disparity or in depth by a Gaussian of this sigma.
    fn blurred(sigma: f64, is_depth: bool) -> Vec<f32> {
        let number = |x: f64| if is_depth { 1.0 / walls(x) } else { walls(x) };
        let row: Vec<f32> = (0..41)
            .map(|x| {
                let taps = (-200..=200).map(|i| f64::from(i) * 0.05 * sigma);
                let (mut sum, mut total) = (0.0, 0.0);
                for offset in taps {
                    let weight = (-0.5 * (offset / sigma).powi(2)).exp();
                    sum += weight * number(f64::from(x) + offset);
                    total += weight;
                }
                let mean = sum / total;
                (if is_depth { mean } else { 1.0 / mean }) as f32
            })
            .collect();
        row.repeat(9)
    }

    #[test]
    fn the_edges_of_exact_depth_are_sharp_and_stay_as_they_are() {
        let step: Vec<f32> = (0..41)
            .map(|x| (1.0 / walls(f64::from(x))) as f32)
            .collect();
        assert_eq!(Edges::of(PERSPECTIVE, &step, 41), Edges::Sharp, "a step");
        // A ball of 15 samples' radius before a wall, and a plane at a grazing angle.
        let ball = |x: i32| 4.0 - (1.0 - (f64::from(x - 20) / 15.0).powi(2)).max(0.0).sqrt();
        let ball: Vec<f32> = (0..41)
            .map(|x| {
                if (6..35).contains(&x) {
                    ball(x) as f32
                } else {
                    6.0
                }
            })
            .collect();
        assert_eq!(Edges::of(PERSPECTIVE, &ball, 41), Edges::Sharp, "a ball");
        let alone = |&z: &f32| if z < 6.0 { z } else { f32::NAN };
        let alone: Vec<f32> = ball.iter().map(alone).collect();
        assert_eq!(
            Edges::of(PERSPECTIVE, &alone, 41),
            Edges::Sharp,
            "a ball before nothing"
        );
        let plane: Vec<f32> = (0..41).map(|x| 1.0 / (0.5 - 0.01 * x as f32)).collect();
        assert_eq!(Edges::of(PERSPECTIVE, &plane, 41), Edges::Sharp, "a plane");
    }

    #[test]
    fn a_ramp_becomes_the_two_walls_that_were_blurred() {
        for sigma in [0.6, 1.2, 2.0, 3.0] {
            for (is_depth, expected) in
                [(false, Edges::SoftInDisparity), (true, Edges::SoftInDepth)]
            {
                let depth = blurred(sigma, is_depth);
                let edges = Edges::of(PERSPECTIVE, &depth, 41);
                assert_eq!(edges, expected, "sigma {sigma}");
                let sharp = sharpened(PERSPECTIVE, (&depth, &grey(&depth)), 41, edges);
                for (at, z) in sharp.iter().enumerate() {
                    let wall = walls((at % 41) as f64);
                    let error = (1.0 / f64::from(*z) - wall).abs() / wall;
                    // What is left of the tails, of a jump of 2.7 to 1.
                    assert!(error < 0.05, "sigma {sigma}, sample {}: {error}", at % 41);
                }
            }
        }
    }

    #[test]
    fn unknown_samples_end_a_ramp() {
        let mut depth = blurred(1.2, false);
        depth
            .iter_mut()
            .skip(20)
            .step_by(41)
            .for_each(|z| *z = f32::NAN);
        let sharp = sharpened(
            PERSPECTIVE,
            (&depth, &grey(&depth)),
            41,
            Edges::SoftInDisparity,
        );
        for (before, after) in depth.iter().zip(&sharp) {
            assert_eq!(before.is_nan(), after.is_nan());
        }
    }

    /// A picture without an edge.
    fn grey(depth: &[f32]) -> Vec<[f32; 3]> {
        vec![[0.5; 3]; depth.len()]
    }
}
