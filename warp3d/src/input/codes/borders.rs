//! The nearest borders between levels, by chamfer steps.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::narrow::index32;
use resample_core::simd::{SimdLevel, Vectors};

/// The nearest borders of each sample towards lower and towards higher levels of its surface.
pub(super) struct Borders {
    pub(super) lower: Nearest,
    pub(super) higher: Nearest,
}

/// The nearest borders towards one side: how far they are, and the samples beside them, of the own level.
pub(super) struct Nearest {
    pub(super) distance_px: Vec<f32>,
    pub(super) beside: Vec<u32>,
}

/// The borders of one side along a row.
struct Line<'a> {
    distance_px: &'a mut [f32],
    beside: &'a mut [u32],
}

/// A row that is finished.
struct Known<'a> {
    levels: &'a [i32],
    distance_px: &'a [f32],
    beside: &'a [u32],
}

/// The way in which a sweep goes: rows and samples from the first, or from the last.
#[derive(Clone, Copy, PartialEq)]
enum Sweep {
    Down,
    Up,
}

const DIAGONAL: f32 = std::f32::consts::SQRT_2;

/// Levels whose borders are looked for.
#[derive(Clone, Copy)]
pub(super) struct Levels<'a> {
    pub(super) levels: &'a [i32],
    pub(super) width: usize,
}

impl Borders {
    /// Finds the borders; `is_at` tells for a sample whether a lower level lies beside it, and whether a higher one does.
    pub(super) fn new(of: Levels<'_>, is_at: impl Fn(usize) -> [bool; 2] + Sync) -> Self {
        let at = |i: usize| is_at(i).map(|is_at| if is_at { 0.5 } else { f32::INFINITY });
        let samples = (0..of.levels.len()).into_par_iter();
        let (lower, higher) = samples.map(at).map(<(f32, f32)>::from).unzip();
        let spread = |distance_px: Vec<f32>| Nearest::spread(of, distance_px);
        let (lower, higher) = rayon::join(|| spread(lower), || spread(higher));
        Self { lower, higher }
    }
}

impl Nearest {
    /// Spreads borders from the samples beside them to all samples of their level.
    fn spread(of: Levels<'_>, distance_px: Vec<f32>) -> Self {
        let mut nearest = Self {
            beside: (0..index32(distance_px.len())).collect(),
            distance_px,
        };
        let vectors = SimdLevel::Auto.resolve();
        let height = of.levels.len() / of.width;
        let mut moved = vec![false; height + 2];
        // The second pair of sweeps goes around corners. Upwards it has something to do only beside rows that have changed.
        for round in 0..2 {
            for y in 0..height {
                moved[y + 1] = nearest.update(of, (y, Sweep::Down), vectors) || round == 0;
            }
            for y in (0..height).rev() {
                if moved[y + 1] || moved[y + 2] {
                    moved[y + 1] |= nearest.update(of, (y, Sweep::Up), vectors);
                }
            }
        }
        nearest
    }

    /// Updates the borders of row `y` from the row before it, and then from sample to sample along the row. Returns true if any became nearer.
    fn update(&mut self, of: Levels<'_>, (y, sweep): (usize, Sweep), vectors: Vectors) -> bool {
        let width = of.width;
        let at = y * width;
        let (distances, besides) = (&mut self.distance_px, &mut self.beside);
        let row = |y: usize| y * width..(y + 1) * width;
        let levels = &of.levels[row(y)];
        let (before, own) = match sweep {
            Sweep::Down => {
                let (before, own) = distances.split_at_mut(at);
                let (beside_before, beside) = besides.split_at_mut(at);
                let before = y.checked_sub(1).map(|above| Known {
                    levels: &of.levels[row(above)],
                    distance_px: &before[row(above)],
                    beside: &beside_before[row(above)],
                });
                (
                    before,
                    Line {
                        distance_px: &mut own[..width],
                        beside: &mut beside[..width],
                    },
                )
            }
            Sweep::Up => {
                let (own, behind) = distances.split_at_mut(at + width);
                let (beside, beside_behind) = besides.split_at_mut(at + width);
                let before = (!behind.is_empty()).then(|| Known {
                    levels: &of.levels[row(y + 1)],
                    distance_px: &behind[..width],
                    beside: &beside_behind[..width],
                });
                (
                    before,
                    Line {
                        distance_px: &mut own[at..],
                        beside: &mut beside[at..],
                    },
                )
            }
        };
        let Line {
            distance_px,
            beside,
        } = own;
        let mut any = false;
        if let Some(before) = &before {
            any |= dispatch!(vectors, simd => update_from_row(simd, levels, distance_px, beside, before));
        }
        any | update_along(levels, distance_px, beside, sweep)
    }
}

/// Updates each sample of a row from the three samples nearest to it in the row before. Returns true if any border became nearer.
#[simd]
fn update_from_row<S: Simd>(
    _simd: S,
    levels: &[i32],
    distance_px: &mut [f32],
    beside: &mut [u32],
    before: &Known<'_>,
) -> bool {
    let width = levels.len();
    let mut any = 0;
    for (shift, length) in [(1, 1.0), (0, DIAGONAL), (2, DIAGONAL)] {
        // The sample `shift - 1` to the right in the row before, where there is one.
        let (from, to) = match shift {
            0 => (0..width - 1, 1..width),
            1 => (0..width, 0..width),
            _ => (1..width, 0..width - 1),
        };
        let (known_levels, known) = (
            &before.levels[from.clone()],
            &before.distance_px[from.clone()],
        );
        let known_beside = &before.beside[from];
        let (levels, distance_px, beside) = (
            &levels[to.clone()],
            &mut distance_px[to.clone()],
            &mut beside[to],
        );
        let count = levels.len();
        let (known_levels, known, known_beside) = (
            &known_levels[..count],
            &known[..count],
            &known_beside[..count],
        );
        let (distance_px, beside) = (&mut distance_px[..count], &mut beside[..count]);
        for x in 0..count {
            let there = known[x] + length;
            let is_nearer = (known_levels[x] == levels[x]) & (there < distance_px[x]);
            distance_px[x] = if is_nearer { there } else { distance_px[x] };
            beside[x] = if is_nearer {
                known_beside[x]
            } else {
                beside[x]
            };
            any |= u32::from(is_nearer);
        }
    }
    any != 0
}

/// Updates each sample of a row from the sample before it. Returns true if any border became nearer.
fn update_along(levels: &[i32], distance_px: &mut [f32], beside: &mut [u32], sweep: Sweep) -> bool {
    let samples = levels.iter().zip(distance_px).zip(beside);
    match sweep {
        Sweep::Down => update_in_order(samples),
        Sweep::Up => update_in_order(samples.rev()),
    }
}

/// Updates each sample from the one before it. The loop keeps the sample before in registers, and has no branches.
#[inline(always)]
fn update_in_order<'a>(
    samples: impl Iterator<Item = ((&'a i32, &'a mut f32), &'a mut u32)>,
) -> bool {
    let mut any = false;
    let (mut level_before, mut nearest, mut from) = (0, f32::INFINITY, 0);
    for ((&level, distance_px), beside) in samples {
        // Before the first sample the distance is infinite, so that it keeps its own.
        let there = nearest + 1.0;
        let is_nearer = (level == level_before) & (there < *distance_px);
        nearest = if is_nearer { there } else { *distance_px };
        from = if is_nearer { from } else { *beside };
        (*distance_px, *beside) = (nearest, from);
        level_before = level;
        any |= is_nearer;
    }
    any
}
