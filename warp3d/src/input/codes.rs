//! Smooth depth from coarse codes.
//!
//! Takes the numbers of a depth file, gives them with what lies between two codes filled in, where the file's codes are so
//! coarse that one step would look like an edge. A code says that the depth lies within half a step of it. Inside a
//! surface the depth goes from the border towards the next lower code, where it is half a step below its own, to that
//! towards the next higher one, in proportion to the distances of both: a plane comes back as the plane it was. A few
//! rounds of smoothing then take the kinks out. No number leaves its code's interval, and codes that differ by two steps
//! or more, where the slope beside them does not lead there, stay apart.
//!
//! Limits: an edge of a single code becomes a slope; a sequence is smoothed frame by frame; references that stay in
//! their file are left as they are.

use rayon::prelude::*;

use resample_io::{Plane, Stored};

/// Whole numbers with more levels than this are fine enough. Codes of MPEG have 8 or 10 bits.
const MOST_LEVELS: u32 = 1023;

/// With fewer levels a common factor of the codes says nothing: layers that were painted by hand have some. A guess.
const FEWEST_LEVELS: usize = 8;

/// A step that changes inverse depth by less than this part nowhere tears a surface: half the tolerance of exact depth.
const LEAST_STEP: f64 = 0.002;

/// Half of an interval, steps: numbers do not reach the place where the next code begins.
const HALF: f32 = 0.499;

/// Rounds of smoothing: a kink of a slope between runs of one and of two samples is gone after them.
const ROUNDS: usize = 16;

/// The level of an unknown number.
const UNKNOWN: i32 = i32::MIN;

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
                    step = greatest_factor(step, value as u32);
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
    let used: std::collections::BTreeSet<u32> = values.map(|value| value as u32 / step).collect();
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
    let level = |&value: &f32| match distance(value) {
        depth if depth.is_finite() && depth > 0.0 => scale.level(value),
        _ => UNKNOWN,
    };
    let levels: Vec<i32> = plane.values.par_iter().map(level).collect();
    let is_coarse = |&level: &i32| {
        let [here, next] = [0.0, 1.0].map(|more| distance(scale.value(level as f32 + more)));
        level != UNKNOWN && (here / next - 1.0).abs() > LEAST_STEP
    };
    if !levels.par_iter().any(is_coarse) {
        return None;
    }
    let codes = Codes::new(levels, plane.width);
    let (above, below) = (codes.distances(1), codes.distances(-1));
    let placed = codes.placed(&above, &below);
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

/// The levels of a plane.
struct Codes {
    levels: Vec<i32>,
    width: usize,
    /// Bit 0: the sample is of one surface with the next along x; bit 1: along y.
    links: Vec<u8>,
}

/// The nearest border towards another level: how far it is, and the sample beside it, of the own level.
struct Border {
    distance_px: Vec<f32>,
    beside: Vec<u32>,
}

impl Codes {
    fn new(levels: Vec<i32>, width: usize) -> Self {
        let height = levels.len() / width;
        let linked = |i: usize, place: usize, count: usize, step: usize| {
            if place + 1 >= count || levels[i] == UNKNOWN || levels[i + step] == UNKNOWN {
                return false;
            }
            let rise = levels[i + step] - levels[i];
            let leads_on = |from: usize, to: usize| {
                let [from, to] = [levels[from], levels[to]];
                let beside = to.wrapping_sub(from);
                from != UNKNOWN
                    && to != UNKNOWN
                    && (rise > 0) == (beside > 0)
                    && beside != 0
                    && (rise - beside).abs() <= 1
            };
            rise.abs() <= 1
                || (place > 0 && leads_on(i - step, i))
                || (place + 2 < count && leads_on(i + step, i + 2 * step))
        };
        let both = |i: usize| {
            let right = linked(i, i % width, width, 1);
            let below = linked(i, i / width, height, width);
            u8::from(right) + 2 * u8::from(below)
        };
        let links = (0..levels.len()).into_par_iter().map(both).collect();
        Self {
            levels,
            width,
            links,
        }
    }

    /// The linked neighbours of a sample: before and behind along x, then along y.
    fn beside(&self, i: usize) -> [[Option<usize>; 2]; 2] {
        let (x, width) = (i % self.width, self.width);
        let before = |is_there: bool, step: usize, bit: u8| {
            (is_there && self.links[i - step] & bit != 0).then(|| i - step)
        };
        let behind = |step: usize, bit: u8| (self.links[i] & bit != 0).then_some(i + step);
        [
            [before(x > 0, 1, 1), behind(1, 1)],
            [before(i >= width, width, 2), behind(width, 2)],
        ]
    }

    /// The nearest border towards higher (1) or lower (-1) levels of the same surface, by chamfer steps.
    fn distances(&self, towards: i32) -> Border {
        let count = self.levels.len();
        let is_at = |i: usize| {
            let beside = self.beside(i).into_iter().flatten().flatten();
            beside
                .into_iter()
                .any(|j| (self.levels[j] - self.levels[i]) * towards > 0)
        };
        let distance_px: Vec<f32> = (0..count)
            .into_par_iter()
            .map(|i| if is_at(i) { 0.5 } else { f32::INFINITY })
            .collect();
        let mut border = Border {
            distance_px,
            beside: (0..count as u32).collect(),
        };
        // The second pair of sweeps goes around corners.
        for _ in 0..2 {
            (0..count).for_each(|i| self.relax(&mut border, i, -1));
            (0..count).rev().for_each(|i| self.relax(&mut border, i, 1));
        }
        border
    }

    /// Takes over what the neighbours of the rows and columns on one side know.
    #[inline(always)]
    fn relax(&self, border: &mut Border, i: usize, side: isize) {
        let (x, width) = (i % self.width, self.width as isize);
        let row = i as isize + side * width;
        let has_row = (0..self.levels.len() as isize).contains(&row);
        let [has_left, has_right] = [x > 0, x + 1 < self.width];
        let has_side = if side < 0 { has_left } else { has_right };
        let mut take = |is_there: bool, j: isize, length: f32| {
            if !is_there {
                return;
            }
            let j = j as usize;
            let distance_px = border.distance_px[j] + length;
            if distance_px < border.distance_px[i] && self.levels[j] == self.levels[i] {
                border.distance_px[i] = distance_px;
                border.beside[i] = border.beside[j];
            }
        };
        take(has_side, i as isize + side, 1.0);
        take(has_row, row, 1.0);
        take(has_row && has_left, row - 1, std::f32::consts::SQRT_2);
        take(has_row && has_right, row + 1, std::f32::consts::SQRT_2);
    }

    /// Each sample between the borders of its level.
    fn placed(&self, above: &Border, below: &Border) -> Vec<f32> {
        let width_of = |i: usize| above.distance_px[i] + below.distance_px[i];
        // How wide the level across the border is.
        let width_across = |border: &Border, i: usize, towards: i32| {
            let at = border.beside[i] as usize;
            let beside = self.beside(at).into_iter().flatten().flatten();
            let across = beside.filter(|&j| (self.levels[j] - self.levels[at]) * towards > 0);
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
            let (up, down) = (above.distance_px[i], below.distance_px[i]);
            level
                + match (up.is_finite(), down.is_finite()) {
                    (true, true) => 0.5 * (down - up) / (down + up),
                    (true, false) => 0.5 - risen(up, width_across(above, i, 1)),
                    (false, true) => risen(down, width_across(below, i, -1)) - 0.5,
                    (false, false) => 0.0,
                }
        };
        (0..self.levels.len()).into_par_iter().map(place).collect()
    }

    /// Takes out the kinks: each sample goes towards the middle of its neighbours on either side, within its interval.
    fn relaxed(&self, mut now: Vec<f32>) -> Vec<f32> {
        // Whether a sample has linked neighbours on both sides along x (bit 0) and along y (bit 1).
        let between = |i: usize| {
            let [across, along] = self.beside(i).map(|pair| pair.iter().all(Option::is_some));
            u8::from(across) + 2 * u8::from(along)
        };
        let between: Vec<u8> = (0..now.len()).into_par_iter().map(between).collect();
        for _ in 0..ROUNDS {
            let next = |i: usize| {
                let middle = |step: usize| 0.5 * (now[i - step] + now[i + step]);
                let mean = match between[i] {
                    0 => return now[i],
                    1 => middle(1),
                    2 => middle(self.width),
                    _ => 0.5 * (middle(1) + middle(self.width)),
                };
                let level = self.levels[i] as f32;
                // Half way: an undamped round turns a chequerboard over.
                (0.5 * (now[i] + mean)).clamp(level - HALF, level + HALF)
            };
            now = (0..now.len()).into_par_iter().map(next).collect();
        }
        now
    }
}

#[cfg(test)]
mod tests;
