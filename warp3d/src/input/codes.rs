//! Smooth depth from coarse codes.
//!
//! Takes the numbers of a depth file, gives them with what lies between two codes filled in, where the file's codes are so
//! coarse that one step would look like an edge. A code says that the depth lies within half a step of it. Inside a
//! surface the depth goes from the border towards the next lower code, where it is half a step below its own, to that
//! towards the next higher one, in proportion to the distances of both: a plane comes back as the plane it was. A few
//! rounds of smoothing then take the kinks out. No number leaves its code's interval, and codes that differ by two steps
//! or more, where the slope beside them does not lead there, stay apart.
//!
//! Limits: an edge of a single code becomes a slope; a sequence is smoothed frame by frame.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::{cell, index32};
use resample_core::simd::SimdLevel;
use resample_io::{Plane, Stored};

mod borders;

use borders::{Borders, Levels};

/// Whole numbers with more levels than this are fine enough. Codes of MPEG have 8 or 10 bits.
const MOST_LEVELS: u32 = 1023;

/// With fewer levels a common factor of the codes says nothing: layers that were painted by hand have some. A guess.
const FEWEST_LEVELS: usize = 8;

/// A step that changes inverse depth by less than this part nowhere tears a surface: half the tolerance of exact depth.
const LEAST_STEP: f64 = 0.002;

/// The size of a step of the stored numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Whole numbers, multiples of this.
    Whole(u32),
    /// Floating point of 16 bits: 10 bits of fraction.
    Half,
}

impl Scale {
    /// That of a plane's numbers; `None` where they are fine.
    fn of(plane: &Plane) -> Option<Self> {
        let known = || {
            plane
                .values
                .iter()
                .copied()
                .filter(|value| value.is_finite())
        };
        match plane.stored {
            Stored::Code(largest) => {
                let mut step = 0;
                for value in known() {
                    if value.fract() != 0.0 || value < 0.0 {
                        return None;
                    }
                    if step != 1 {
                        step = greatest_factor(step, index32(cell(value)));
                    }
                    if step == 1 && largest > MOST_LEVELS {
                        return None;
                    }
                }
                // A few layers in codes far apart are no smooth map in few codes.
                let step = if step > 1 && is_dense(known(), step) {
                    step
                } else {
                    1
                };
                (largest / step <= MOST_LEVELS).then_some(Self::Whole(step))
            }
            Stored::Float => known().all(is_half).then_some(Self::Half),
        }
    }

    /// The number of a value among the codes.
    fn level(self, value: f32) -> i32 {
        match self {
            Self::Whole(step) => (value / step as f32).round() as i32,
            Self::Half => {
                let (exponent, fraction) = parts(value.abs());
                let level = (exponent << 10) + fraction;
                if value < 0.0 { -level } else { level }
            }
        }
    }

    /// The value of a number between codes.
    fn value(self, level: f32) -> f32 {
        match self {
            Self::Whole(step) => level * step as f32,
            Self::Half => {
                let whole = level.abs().floor();
                let (exponent, fraction) = (whole as i32 >> 10, whole as i32 & 1023);
                let fraction = fraction as f32 + (level.abs() - whole);
                let value = match exponent {
                    0 => fraction * 2f32.powi(-24),
                    _ => (1024.0 + fraction) * 2f32.powi(exponent - 25),
                };
                value.copysign(level)
            }
        }
    }
}

/// Returns true if a value is one of 16-bit floating point.
fn is_half(value: f32) -> bool {
    let (exponent, fraction) = parts(value.abs());
    exponent < 31 && Scale::Half.value(((exponent << 10) + fraction) as f32) == value.abs()
}

/// Exponent and fraction of the 16-bit number at or below `value`.
fn parts(value: f32) -> (i32, i32) {
    let bits = value.to_bits();
    let exponent = (bits >> 23) as i32 - 127 + 15;
    if exponent <= 0 {
        (0, (value * 2f32.powi(24)) as i32)
    } else {
        (exponent, (bits >> 13 & 1023) as i32)
    }
}

/// Returns true if multiples of `step` are numbers of a smooth map: many, and most of those from the least to the largest.
fn is_dense(values: impl Iterator<Item = f32>, step: u32) -> bool {
    let used: std::collections::BTreeSet<u32> =
        values.map(|value| index32(cell(value)) / step).collect();
    let (least, most) = (used.first(), used.last());
    let between = least
        .zip(most)
        .map_or(0, |(least, most)| (most - least) as usize);
    used.len() >= FEWEST_LEVELS && 2 * used.len() > between
}

fn greatest_factor(mut a: u32, mut b: u32) -> u32 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The numbers of `plane` made smooth where they are coarse; `None` where they are not. `distance` is the depth of a
/// stored number, not finite where that is unknown.
pub(super) fn smoothed(plane: &Plane, distance: &(dyn Fn(f32) -> f64 + Sync)) -> Option<Plane> {
    let scale = Scale::of(plane)?;
    let level = |value: f32| match distance(value) {
        depth if depth.is_finite() && depth > 0.0 => scale.level(value),
        _ => UNKNOWN,
    };
    let levels: Vec<i32> = match scale {
        // A code has one level: each is asked for once.
        Scale::Whole(step) => {
            let most = plane.values.iter().copied().fold(0.0, f32::max);
            let codes = 0..=index32(cell(most)) / step;
            let codes: Vec<i32> = codes.map(|k| level((k * step) as f32)).collect();
            let of = |&value: &f32| match value.is_finite() {
                true => codes[cell(value) / step as usize],
                false => UNKNOWN,
            };
            plane.values.par_iter().map(of).collect()
        }
        Scale::Half => plane.values.par_iter().map(|&value| level(value)).collect(),
    };
    let is_coarse = |&level: &i32| {
        let [here, next] = [0.0, 1.0].map(|more| distance(scale.value(level as f32 + more)));
        level != UNKNOWN && (here / next - 1.0).abs() > LEAST_STEP
    };
    if !levels.par_iter().any(is_coarse) {
        return None;
    }
    let codes = Codes::new(levels, plane.width);
    let placed = codes.placed(&codes.borders());
    let smooth = codes.relaxed(placed);
    // A number with a meaning of its own, 0 or the largest, is left where it is.
    let value = |(i, &smooth): (usize, &f32)| {
        let value = scale.value(smooth);
        let is_kept = codes.levels[i] == UNKNOWN || smooth == codes.levels[i] as f32;
        if is_kept || !distance(value).is_finite() {
            plane.values[i]
        } else {
            value
        }
    };
    Some(Plane {
        values: smooth.par_iter().enumerate().map(value).collect(),
        ..*plane
    })
}

// Levels of a plane made smooth: borders between levels, places between borders, rounds of smoothing.

/// Half of an interval, steps: numbers do not reach the place where the next code begins.
const HALF: f32 = 0.499;

/// Rounds of smoothing: a kink of a slope between runs of one and of two samples is gone after them.
const ROUNDS: usize = 16;

/// The level of an unknown number.
const UNKNOWN: i32 = i32::MIN;

/// Bits of [`Codes::sides`]: with the sample before and behind along x, and along y.
const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const ABOVE: u8 = 4;
const BELOW: u8 = 8;
const BOTH_X: u8 = LEFT | RIGHT;
const BOTH_Y: u8 = ABOVE | BELOW;

/// The levels of a plane.
struct Codes {
    levels: Vec<i32>,
    width: usize,
    /// With which of its neighbours a sample is of one surface.
    sides: Vec<u8>,
}

impl Codes {
    fn new(levels: Vec<i32>, width: usize) -> Self {
        let height = levels.len() / width;
        let mut sides = vec![0; levels.len()];
        let vectors = SimdLevel::Auto.resolve();
        let rows = sides.par_chunks_mut(width).enumerate();
        rows.for_each(|(y, row)| {
            let line = |y: usize| &levels[y * width..(y + 1) * width];
            // Rows beyond the picture are unknown, so that nothing leads there.
            let line = |y: Option<usize>| y.filter(|&y| y < height).map(line);
            let lines = [y.checked_sub(1), Some(y), Some(y + 1), Some(y + 2)].map(line);
            dispatch!(vectors, simd => link_row(simd, row, lines));
        });
        for i in width..sides.len() {
            sides[i] |= (sides[i - width] & BELOW) / BELOW * ABOVE;
        }
        Self {
            levels,
            width,
            sides,
        }
    }

    /// The linked neighbours of a sample.
    fn beside(&self, i: usize) -> impl Iterator<Item = usize> {
        let (sides, width) = (self.sides[i], self.width);
        let is_linked = move |bit: u8| sides & bit != 0;
        let [left, above] =
            [(LEFT, 1), (ABOVE, width)].map(|(bit, step)| is_linked(bit).then(|| i - step));
        let [right, below] =
            [(RIGHT, 1), (BELOW, width)].map(|(bit, step)| is_linked(bit).then(|| i + step));
        [left, right, above, below].into_iter().flatten()
    }

    /// The nearest borders towards lower and higher levels.
    fn borders(&self) -> Borders {
        let of = Levels {
            levels: &self.levels,
            width: self.width,
        };
        Borders::new(of, |i| {
            let level = self.levels[i];
            let is_beside = |towards: fn(&i32, &i32) -> bool| {
                self.beside(i).any(|j| towards(&self.levels[j], &level))
            };
            [is_beside(i32::lt), is_beside(i32::gt)]
        })
    }

    /// Each sample between the borders of its level.
    fn placed(&self, borders: &Borders) -> Vec<f32> {
        let (to_lower, to_higher) = (&borders.lower.distance_px, &borders.higher.distance_px);
        let width_of = |i: usize| to_higher[i] + to_lower[i];
        // How wide the level across the border is.
        let width_across = |i: usize, towards: i32| {
            let border = if towards > 0 {
                &borders.higher
            } else {
                &borders.lower
            };
            let at = border.beside[i] as usize;
            let across = self
                .beside(at)
                .filter(|&j| (self.levels[j] - self.levels[at]) * towards > 0);
            across.map(width_of).fold(f32::INFINITY, f32::min)
        };
        // With one border alone the slope goes on from there, and flattens out at the code itself.
        let risen = |distance_px: f32, width_px: f32| {
            let share = distance_px / width_px;
            if width_px.is_finite() {
                share / (1.0 + 2.0 * share)
            } else {
                0.5
            }
        };
        let place = |i: usize| {
            let level = self.levels[i] as f32;
            let (down, up) = (to_lower[i], to_higher[i]);
            level
                + match (up.is_finite(), down.is_finite()) {
                    (true, true) => 0.5 * (down - up) / (down + up),
                    (true, false) => 0.5 - risen(up, width_across(i, 1)),
                    (false, true) => risen(down, width_across(i, -1)) - 0.5,
                    (false, false) => 0.0,
                }
        };
        (0..self.levels.len()).into_par_iter().map(place).collect()
    }

    /// Takes out the kinks: each sample goes towards the middle of its neighbours on either side, within its interval.
    fn relaxed(&self, mut now: Vec<f32>) -> Vec<f32> {
        let width = self.width;
        let levels: Vec<f32> = self.levels.par_iter().map(|&level| level as f32).collect();
        let mut next = now.clone();
        let level = SimdLevel::Auto.resolve();
        for _ in 0..ROUNDS {
            let row = |(y, to): (usize, &mut [f32])| {
                let rows = [y.saturating_sub(1), y, y + 1].map(|y| {
                    // Rows without one beside have no neighbours there.
                    let first = y.min(now.len() / width - 1) * width;
                    &now[first..first + width]
                });
                let own = y * width..(y + 1) * width;
                let (levels, sides) = (&levels[own.clone()], &self.sides[own]);
                dispatch!(level, simd => relax_row(simd, to, rows, levels, sides));
            };
            next.par_chunks_mut(width).enumerate().for_each(row);
            std::mem::swap(&mut now, &mut next);
        }
        now
    }
}

/// Returns true if two neighbours of levels `a` and `b` are of one surface, between `before` and `behind` on their line.
#[inline(always)]
fn is_linked(before: i32, a: i32, b: i32, behind: i32) -> bool {
    let rise = b.wrapping_sub(a);
    let leads_on = |from: i32, to: i32| {
        let beside = to.wrapping_sub(from);
        let is_known = (from != UNKNOWN) & (to != UNKNOWN);
        let is_same_way = ((rise > 0) == (beside > 0)) & (beside != 0);
        is_known & is_same_way & (rise.wrapping_sub(beside).wrapping_add(1) as u32 <= 2)
    };
    let is_known = (a != UNKNOWN) & (b != UNKNOWN);
    is_known & ((rise.wrapping_add(1) as u32 <= 2) | leads_on(before, a) | leads_on(b, behind))
}

/// The links of the samples of a row with those beside and below, from the rows before, itself and two behind; `None` for one beyond the
/// picture.
#[simd]
fn link_row<S: Simd>(_simd: S, sides: &mut [u8], lines: [Option<&[i32]>; 4]) {
    let [above, Some(own), below, second] = lines else {
        return;
    };
    let width = own.len();
    if let Some(below) = below {
        // A line that stands for one beyond leads nowhere: no step leads on from an equal one.
        let (above, second) = (above.unwrap_or(own), second.unwrap_or(below));
        let lines = above.iter().zip(own).zip(below.iter().zip(second));
        for (to, ((&above, &own), (&below, &second))) in sides.iter_mut().zip(lines) {
            *to = u8::from(is_linked(above, own, below, second)) * BELOW;
        }
    } else {
        sides.fill(0);
    }
    if width < 2 {
        return;
    }
    let last = width - 2;
    // Those at the ends have nothing before or behind them.
    for x in [0, last] {
        let before = own[x.saturating_sub(1)];
        let behind = own[(x + 2).min(width - 1)];
        sides[x] |= u8::from(is_linked(before, own[x], own[x + 1], behind)) * RIGHT;
    }
    if let Some(count) = last.checked_sub(1) {
        let [before, here, next, behind] = [0, 1, 2, 3].map(|first| &own[first..first + count]);
        let to = &mut sides[1..1 + count];
        for x in 0..count {
            to[x] |= u8::from(is_linked(before[x], here[x], next[x], behind[x])) * RIGHT;
        }
    }
    for x in 1..width {
        sides[x] |= (sides[x - 1] & RIGHT) / RIGHT * LEFT;
    }
}

/// A round of smoothing of a row: `above`, itself and `below` before, its levels and which neighbours are linked.
#[simd]
fn relax_row<S: Simd>(
    _simd: S,
    to: &mut [f32],
    [above, own, below]: [&[f32]; 3],
    levels: &[f32],
    sides: &[u8],
) {
    let width = to.len();
    // Selected, not branched on, so that a row is taken by vectors.
    let moved = |own: f32, across: f32, along: f32, level: f32, sides: u8| {
        let (on_x, on_y) = (sides & BOTH_X == BOTH_X, sides & BOTH_Y == BOTH_Y);
        let either = if on_x { across } else { along };
        let mean = if on_x & on_y {
            0.5 * (across + along)
        } else {
            either
        };
        // Half way: an undamped round turns a chequerboard over.
        let moved = (0.5 * (own + mean)).max(level - HALF).min(level + HALF);
        if on_x | on_y { moved } else { own }
    };
    let along = |x: usize| 0.5 * (above[x] + below[x]);
    // The first and the last have no neighbours on both sides along the row.
    for x in [0, width - 1] {
        to[x] = moved(own[x], own[x], along(x), levels[x], sides[x]);
    }
    if width < 3 {
        return;
    }
    let count = width - 2;
    let [before, here, behind] = [0, 1, 2].map(|first| &own[first..first + count]);
    let [above, below, levels] = [above, below, levels].map(|row| &row[1..1 + count]);
    let (to, sides) = (&mut to[1..1 + count], &sides[1..1 + count]);
    for x in 0..count {
        let across = 0.5 * (before[x] + behind[x]);
        let along = 0.5 * (above[x] + below[x]);
        to[x] = moved(here[x], across, along, levels[x], sides[x]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [160, 120];

    /// A slanted plane with a bump, in codes of one step.
    fn slanted(slope: [f32; 2], x: usize, y: usize) -> f32 {
        let [dx, dy] = [x as f32 - 90.0, y as f32 - 50.0];
        60.0 + slope[0] * x as f32
            + slope[1] * y as f32
            + 9.0 * (-(dx * dx + dy * dy) / 500.0).exp()
    }

    fn plane(stored: Stored, value: impl Fn(usize, usize) -> f32) -> Plane {
        let pixels = (0..SIZE[0] * SIZE[1]).map(|i| value(i % SIZE[0], i / SIZE[0]));
        Plane {
            width: SIZE[0],
            height: SIZE[1],
            values: pixels.collect(),
            stored,
        }
    }

    fn inverse(value: f32) -> f64 {
        if value > 0.0 {
            1.0 / f64::from(value)
        } else {
            f64::NAN
        }
    }

    /// Largest second difference along x and y, and the root mean square error, steps.
    fn roughness(found: &[f32], truth: impl Fn(usize, usize) -> f32) -> [f32; 2] {
        let at = |x: usize, y: usize| found[y * SIZE[0] + x];
        let (mut bend, mut squares) = (0f32, 0.0);
        for y in 1..SIZE[1] - 1 {
            for x in 1..SIZE[0] - 1 {
                let here = at(x, y);
                bend = bend.max((at(x - 1, y) - 2.0 * here + at(x + 1, y)).abs());
                bend = bend.max((at(x, y - 1) - 2.0 * here + at(x, y + 1)).abs());
                squares += (here - truth(x, y)).powi(2);
            }
        }
        [bend, (squares / found.len() as f32).sqrt()]
    }

    #[test]
    fn a_smooth_map_in_codes_comes_back_smooth() {
        let slopes = [
            [0.03, 0.01],
            [0.1, 0.05],
            [0.4, -0.15],
            [0.6, 0.5],
            [1.3, 0.3],
        ];
        for slope in slopes {
            let truth = |x: usize, y: usize| slanted(slope, x, y);
            let codes = plane(Stored::Code(255), |x, y| truth(x, y).round());
            let [bend, error] = roughness(&codes.values, truth);
            // Rounding has a deviation of 1 / sqrt(12).
            assert!(bend >= 1.0 && (error - 0.29).abs() < 0.01, "{slope:?}");
            let smooth = smoothed(&codes, &inverse).expect("coarse");
            let [bend, error] = roughness(&smooth.values, truth);
            assert!(bend < 0.26 && error < 0.1, "{slope:?}: {bend} {error}");
            let leaves = |(a, b): (&f32, &f32)| (a - b).abs() >= 0.5;
            assert!(
                !codes.values.iter().zip(&smooth.values).any(leaves),
                "intervals"
            );
            // The same numbers in wider codes.
            let wide = plane(Stored::Code(65_535), |x, y| 257.0 * truth(x, y).round());
            let wide = smoothed(&wide, &inverse).expect("coarse").values;
            let agrees = |(a, b): (&f32, &f32)| (a / 257.0 - b).abs() < 1e-3;
            assert!(wide.iter().zip(&smooth.values).all(agrees));
        }
    }

    #[test]
    fn edges_and_unknown_numbers_stay() {
        let step = plane(Stored::Code(255), |x, _| if x < 80 { 40.0 } else { 42.0 });
        assert_eq!(
            smoothed(&step, &inverse).expect("coarse").values,
            step.values
        );
        let holes = plane(Stored::Code(255), |x, y| match (x / 7 + y / 5) % 4 {
            0 => 0.0,
            _ => slanted([0.1, 0.0], x, y).round(),
        });
        let smooth = smoothed(&holes, &inverse).expect("coarse");
        let stays = |(a, b): (&f32, &f32)| (*a == 0.0) == (*b == 0.0);
        assert!(holes.values.iter().zip(&smooth.values).all(stays));
    }

    #[test]
    fn fine_numbers_are_left_alone() {
        let fine = plane(Stored::Code(65_535), |x, y| {
            (100.0 * slanted([0.1, 0.0], x, y)).round()
        });
        assert!(smoothed(&fine, &inverse).is_none(), "16 bits");
        let floats = plane(Stored::Float, |x, y| slanted([0.1, 0.0], x, y));
        assert!(smoothed(&floats, &inverse).is_none(), "32-bit floats");
        let camera_z = plane(Stored::Float, |x, y| {
            (4.0 + (x * y % 1024) as f32 / 256.0).floor()
        });
        assert!(
            smoothed(&camera_z, &f64::from).is_none(),
            "no step of a half float is an edge in z"
        );
    }

    #[test]
    fn half_floats_have_their_place_among_each_other() {
        let cases = [
            (0.0, 0),
            (2f32.powi(-24), 1),
            (2f32.powi(-14), 1024),
            (1.0, 15 << 10),
            (65_504.0, 0x7bff),
        ];
        for (value, level) in cases {
            assert!(
                is_half(value) && Scale::Half.level(value) == level,
                "{value}"
            );
            assert_eq!(Scale::Half.value(level as f32), value);
            assert_eq!(Scale::Half.value(-(level as f32)), -value);
        }
        assert!(!is_half(1.0 + 2f32.powi(-11)) && !is_half(65_536.0) && !is_half(1e-9));
        // Half way between two of them.
        assert_eq!(
            Scale::Half.value((15 << 10) as f32 + 0.5),
            1.0 + 2f32.powi(-11)
        );
    }
}
