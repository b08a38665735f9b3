//! Levels of a plane made smooth: borders between levels, places between borders, rounds of smoothing.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::SimdLevel;

/// Half of an interval, steps: numbers do not reach the place where the next code begins.
const HALF: f32 = 0.499;

/// Rounds of smoothing: a kink of a slope between runs of one and of two samples is gone after them.
const ROUNDS: usize = 16;

/// The level of an unknown number.
pub(super) const UNKNOWN: i32 = i32::MIN;

/// Bits of [`Codes::sides`]: with the sample before and behind along x, and along y.
const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const ABOVE: u8 = 4;
const BELOW: u8 = 8;
const BOTH_X: u8 = LEFT | RIGHT;
const BOTH_Y: u8 = ABOVE | BELOW;

/// The levels of a plane.
pub(super) struct Codes {
    pub(super) levels: Vec<i32>,
    width: usize,
    /// With which of its neighbours a sample is of one surface.
    sides: Vec<u8>,
}

/// The nearest borders towards lower and towards higher levels: how far they are, and the samples beside them, of the own level.
pub(super) struct Borders {
    distance_px: Vec<[f32; 2]>,
    beside: Vec<[u32; 2]>,
}

impl Codes {
    pub(super) fn new(levels: Vec<i32>, width: usize) -> Self {
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
        let mut sides = vec![0; levels.len()];
        let rows = sides.par_chunks_mut(width).enumerate();
        rows.for_each(|(y, row): (usize, &mut [u8])| {
            for x in 0..width {
                let i = y * width + x;
                row[x] |= u8::from(linked(i, y, height, width)) * BELOW;
                if linked(i, x, width, 1) {
                    row[x] |= RIGHT;
                    row[x + 1] |= LEFT;
                }
            }
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

    /// The nearest borders towards lower and higher levels of the same surface, by chamfer steps.
    pub(super) fn borders(&self) -> Borders {
        let count = self.levels.len();
        let at = |i: usize| {
            let (level, mut is_at) = (self.levels[i], [false; 2]);
            for j in self.beside(i) {
                is_at[0] |= self.levels[j] < level;
                is_at[1] |= self.levels[j] > level;
            }
            is_at.map(|is_at| if is_at { 0.5 } else { f32::INFINITY })
        };
        let mut borders = Borders {
            distance_px: (0..count).into_par_iter().map(at).collect(),
            beside: (0..count as u32).map(|i| [i; 2]).collect(),
        };
        let height = count / self.width;
        let mut moved = vec![false; height + 2];
        // The second pair of sweeps goes around corners. Upwards it has something to do only beside rows that have changed.
        for round in 0..2 {
            for y in 0..height {
                moved[y + 1] = self.relax::<false>(&mut borders, y) || round == 0;
            }
            for y in (0..height).rev() {
                if moved[y + 1] || moved[y + 2] {
                    moved[y + 1] |= self.relax::<true>(&mut borders, y);
                }
            }
        }
        borders
    }

    /// Takes over in row `y` what the samples of the rows before, and those before in the row itself, know; from the other side
    /// if `BACK`. Whether anything was taken over.
    fn relax<const BACK: bool>(&self, borders: &mut Borders, y: usize) -> bool {
        let (width, count) = (self.width, self.levels.len());
        let has_row = if BACK { (y + 1) * width < count } else { y > 0 };
        let mut any = false;
        for k in 0..width {
            let x = if BACK { width - 1 - k } else { k };
            let i = y * width + x;
            let (level, mut best) = (self.levels[i], borders.distance_px[i]);
            let mut from = [i; 2];
            let mut take = |is_there: bool, steps: isize, length: f32| {
                let j = i.wrapping_add_signed(if BACK { -steps } else { steps });
                if is_there && self.levels[j] == level {
                    for (k, known) in borders.distance_px[j].into_iter().enumerate() {
                        if known + length < best[k] {
                            (best[k], from[k]) = (known + length, j);
                        }
                    }
                }
            };
            let row = width as isize;
            let sides = [x > 0, x + 1 < width];
            take(sides[usize::from(BACK)], -1, 1.0);
            take(has_row, -row, 1.0);
            // From the left to the right either way: the first of two equals stays.
            let diagonal = if BACK { 1 } else { -1 };
            take(
                has_row && sides[0],
                -row + diagonal,
                std::f32::consts::SQRT_2,
            );
            take(
                has_row && sides[1],
                -row - diagonal,
                std::f32::consts::SQRT_2,
            );
            if from != [i; 2] {
                borders.distance_px[i] = best;
                borders.beside[i] = [0, 1].map(|k| borders.beside[from[k]][k]);
                any = true;
            }
        }
        any
    }

    /// Each sample between the borders of its level.
    pub(super) fn placed(&self, borders: &Borders) -> Vec<f32> {
        let width_of = |i: usize| borders.distance_px[i][1] + borders.distance_px[i][0];
        // How wide the level across the border is.
        let width_across = |i: usize, towards: i32| {
            let at = borders.beside[i][usize::from(towards > 0)] as usize;
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
            let [down, up] = borders.distance_px[i];
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
    pub(super) fn relaxed(&self, mut now: Vec<f32>) -> Vec<f32> {
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
