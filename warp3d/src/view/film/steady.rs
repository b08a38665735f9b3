//! Depth averaged over time, where pictures show the same thing.
//!
//! Takes inverse depth, the motion to the picture before, and grey pictures; gives inverse depth. Each pixel keeps a mean and how many pictures it holds. It
//! follows the motion; where the colour or the depth is another one it begins anew. Things that move keep few
//! pictures, and fewer where depth departs from the mean in one direction, so that depth does not lag behind.

use glam::Vec2;
use rayon::prelude::*;
use resample_core::narrow::cell;

use super::align::{Freedom, Line};
use super::around::boxes;
use super::flow::{Flow, between};

/// Pixels of which scale and offset are found.
const PAIRS: usize = 20_000;

/// Difference of encoded grey at which a pixel shows another thing, at least; in pictures with noise three times their median difference.
const LEAST_APART: f32 = 0.02;

/// Deviations of depth at which a pixel shows another thing.
const OTHER: f32 = 4.0;

/// The same relative to inverse depth, at least: surfaces are nearer each other than that.
const LEAST_OTHER: f32 = 0.02;

/// Motion below which a pixel rests, px of the picture.
const REST_PX: f32 = 0.1;

/// Pictures that a pixel in motion keeps, if its depth departs from the mean in one direction, and if it does not.
const FEW: f32 = 2.0;
const SOME: f32 = 8.0;

/// Half the side of the box in which a departure is looked for, px.
const BOX: usize = 4;

/// The means that are kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steady {
    /// Inverse depth, and the number of pictures that it is the mean of; 0 where nothing is known.
    means: Vec<f32>,
    counts: Vec<f32>,
    /// Encoded grey of the picture before.
    grey: Vec<f32>,
    /// Deviation of depth from picture to picture.
    deviation: f32,
}

/// One picture.
pub(crate) struct Present<'a> {
    pub(crate) width: usize,
    /// Inverse depth; NaN where it is unknown.
    pub(crate) nearness: &'a mut [f32],
    /// Encoded grey.
    pub(crate) grey: &'a [f32],
    /// Motion to the picture before, each pixel of which is `step` of this one.
    pub(crate) flow: &'a Flow,
    pub(crate) step: usize,
}

/// A pixel of the picture before, carried to this one.
#[derive(Clone, Copy, Debug, Default)]
struct Carried {
    mean: f32,
    count: f32,
    way: Vec2,
}

impl Steady {
    /// Begins anew.
    pub(crate) fn clear(&mut self) {
        self.means.clear();
    }

    /// Makes the depth of a picture steady, with a mean of at most `most` pictures.
    pub(crate) fn add(&mut self, now: &mut Present, freedom: Freedom, most: f32) {
        if self.means.len() != now.nearness.len() {
            self.means = now.nearness.to_vec();
            self.counts = now
                .nearness
                .iter()
                .map(|q| f32::from(u8::from(!q.is_nan())))
                .collect();
            self.grey = now.grey.to_vec();
            self.deviation = 0.0;
            return;
        }
        let carried = self.carried(now);
        self.align(now, &carried, freedom);
        let departures = self.departures(now, &carried);
        let (deviation, width) = (self.deviation, now.width);
        let rows = now.nearness.par_chunks_mut(width);
        let rows = rows.zip(self.means.par_chunks_mut(width));
        let rows = rows.zip(self.counts.par_chunks_mut(width)).enumerate();
        rows.for_each(|(y, ((own, means), counts))| {
            for x in 0..width {
                let index = y * width + x;
                let (carried, found) = (carried[index], own[x]);
                if found.is_nan() {
                    (means[x], counts[x]) = (f32::NAN, 0.0);
                    continue;
                }
                let other = OTHER * deviation + LEAST_OTHER * carried.mean.abs();
                let is_same = carried.count > 0.0 && (found - carried.mean).abs() <= other;
                let (mean, count) = match is_same {
                    true => (
                        carried.mean,
                        carried
                            .count
                            .min(kept(most, carried.way, departures[index])),
                    ),
                    false => (found, 0.0),
                };
                counts[x] = count + 1.0;
                means[x] = mean + (found - mean) / counts[x];
                own[x] = means[x];
            }
        });
        self.grey.clear();
        self.grey.extend_from_slice(now.grey);
    }

    /// The means that were kept, carried along the motion; a count of 0 where the colour is another.
    fn carried(&self, now: &Present) -> Vec<Carried> {
        let width = now.width;
        let height = now.grey.len() / width;
        let mut carried = vec![Carried::default(); now.grey.len()];
        let mut apart = vec![0.0; now.grey.len()];
        let rows = carried
            .par_chunks_mut(width)
            .zip(apart.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, (carried, apart))| {
            let ways = now.flow.row(y, now.step);
            for (x, (carried, apart)) in carried.iter_mut().zip(apart).enumerate() {
                let way = ways.way(x);
                let pos = Vec2::new(x as f32, y as f32) + way;
                *apart = f32::INFINITY;
                let inside = pos.x > -0.5
                    && pos.y > -0.5
                    && pos.x < width as f32 - 0.5
                    && pos.y < height as f32 - 0.5;
                if !inside {
                    continue;
                }
                let (mean, count) = self.kept_at(pos, width, height);
                *carried = Carried { mean, count, way };
                *apart = (now.grey[y * width + x] - between(&self.grey, width, pos)).abs();
            }
        });
        // The mean of three by three, so that grain does not tell things apart.
        let apart = boxes(&apart, width, 1);
        let step = (apart.len() / PAIRS).max(1);
        let mut sample: Vec<f32> = apart.iter().copied().step_by(step).collect();
        let middle = sample.len() / 2;
        let median = *sample.select_nth_unstable_by(middle, f32::total_cmp).1;
        let limit = match median.is_finite() {
            true => LEAST_APART.max(3.0 * median),
            false => LEAST_APART,
        };
        carried
            .par_iter_mut()
            .zip(&apart)
            .for_each(|(carried, &apart)| {
                if !(apart <= limit) {
                    carried.count = 0.0;
                }
            });
        carried
    }

    /// Mean and count at a place: between four pixels of one surface, else of the nearest.
    fn kept_at(&self, pos: Vec2, width: usize, height: usize) -> (f32, f32) {
        let (x, y) = (
            pos.x.clamp(0.0, (width - 1) as f32),
            pos.y.clamp(0.0, (height - 1) as f32),
        );
        let nearest = cell(y + 0.5) * width + cell(x + 0.5);
        let (mean, count) = (self.means[nearest], self.counts[nearest]);
        if x.fract() == 0.0 && y.fract() == 0.0 {
            return (mean, count);
        }
        let (left, top) = (cell(x), cell(y));
        let (right, below) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let corners = [[left, top], [right, top], [left, below], [right, below]]
            .map(|[x, y]| self.means[y * width + x]);
        let reach = OTHER * self.deviation + LEAST_OTHER * mean.abs();
        if corners.iter().all(|corner| (corner - mean).abs() <= reach) {
            return (between(&self.means, width, Vec2::new(x, y)), count);
        }
        (mean, count)
    }

    /// Scales and shifts the depth of a picture to what was kept.
    fn align(&mut self, now: &mut Present, carried: &[Carried], freedom: Freedom) {
        let step = (carried.len() / PAIRS).max(1);
        let pairs: Vec<[f32; 2]> = (0..carried.len())
            .step_by(step)
            .filter(|&index| carried[index].count > 0.0)
            .map(|index| [now.nearness[index], carried[index].mean])
            .filter(|[from, to]| from.is_finite() && to.is_finite())
            .collect();
        let Some(line) = Line::through(&pairs, freedom) else {
            return;
        };
        self.deviation = line.left;
        if freedom != Freedom::None {
            // Compared, since the larger of NaN and 0 is 0.
            let moved = |q: f32| if q < 0.0 { 0.0 } else { q };
            let nearness = now.nearness.par_iter_mut();
            nearness.for_each(|q| *q = moved(line.of(*q)));
        }
    }

    /// How far depth departs from the mean in one direction, in deviations of a pixel.
    fn departures(&self, now: &Present, carried: &[Carried]) -> Vec<f32> {
        let scale = 1.0 / self.deviation.max(f32::MIN_POSITIVE);
        let signed: Vec<f32> = now
            .nearness
            .par_iter()
            .zip(carried)
            .map(|(&found, carried)| {
                let departure = scale * (found - carried.mean);
                match carried.count > 0.0 && departure.is_finite() {
                    true => departure.clamp(-OTHER, OTHER),
                    false => 0.0,
                }
            })
            .collect();
        boxes(&signed, now.width, BOX)
    }
}

/// How many pictures a pixel keeps.
fn kept(most: f32, way: Vec2, departure: f32) -> f32 {
    let px = way.length();
    if px < REST_PX {
        return most;
    }
    // A mean of so many pixels departs by a ninth of a deviation by chance; a half is none.
    let steady = (1.5 - 2.0 * departure.abs()).clamp(0.0, 1.0);
    (FEW + (SOME - FEW) * steady).min(most)
}
