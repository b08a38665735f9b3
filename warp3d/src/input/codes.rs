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

mod levels;

use rayon::prelude::*;

use resample_io::{Plane, Stored};

use levels::{Codes, UNKNOWN};

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
                        step = greatest_factor(step, value as u32);
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
    let level = |value: f32| match distance(value) {
        depth if depth.is_finite() && depth > 0.0 => scale.level(value),
        _ => UNKNOWN,
    };
    let levels: Vec<i32> = match scale {
        // A code has one level: each is asked for once.
        Scale::Whole(step) => {
            let most = plane.values.iter().copied().fold(0.0, f32::max);
            let codes = 0..=most as u32 / step;
            let codes: Vec<i32> = codes.map(|k| level((k * step) as f32)).collect();
            let of = |&value: &f32| match value.is_finite() {
                true => codes[(value as u32 / step) as usize],
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

#[cfg(test)]
mod tests;
