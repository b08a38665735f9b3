//! Motion between two pictures: for each pixel of the present one, its way to the same thing in the one before.
//!
//! Takes grey pictures, gives displacements at their size. Patches are aligned by inverse search from a coarse level to the finest, and
//! pixels mix the patches that cover them, weighted by how well each fits. The motion of a patch that fits as well at rest is
//! exactly zero, so that means over time do not blur.
//! Source: T. Kroeger, R. Timofte, D. Dai, L. Van Gool, "Fast Optical Flow using Dense Inverse Search", ECCV 2016, sections 2.1 to 2.3, without its
//! last, variational step.
//! Limits: a thing that moves farther than its own size between two pictures is missed; brightness may change evenly.

use glam::Vec2;
use rayon::prelude::*;
use resample_core::narrow::cell;

/// Side of a patch, px, and the distance from one to the next.
pub(crate) const PATCH: usize = 8;
const STRIDE: usize = 4;

/// Least side of the coarsest level, px: two patches.
const LEAST_SIDE: usize = 16;

/// Most steps of the search of a patch on a level; most end sooner.
const STEPS: usize = 8;

/// A step shorter than this ends the search, px.
const SHORT_PX: f32 = 0.02;

/// A patch at rest is taken if the sum of its squared differences is at most so many times that of the best place.
const REST: f32 = 1.3;

/// A patch rests only if the coarser level has found so little motion around it, px: a patch without texture fits everywhere.
const RESTING_PX: f32 = 0.3;

/// The squared difference of a pixel that noise of 8 bits leaves, (1/255)^2.
const NOISE: f32 = 1.5e-5;

/// A grey picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Grey {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) values: Vec<f32>,
}

impl Grey {
    /// A picture of `width` and `height`, each pixel the mean of a block of `step` by `step` numbers of a picture that is `from_width` wide.
    pub(crate) fn reduced(from: &[f32], from_width: usize, step: usize) -> Self {
        let from_height = from.len() / from_width.max(1);
        let (width, height) = (from_width / step, from_height / step);
        let mut values = vec![0.0; width * height];
        let scale = 1.0 / (step * step) as f32;
        values
            .par_chunks_mut(width.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                for below in 0..step {
                    let first = (y * step + below) * from_width;
                    let line = &from[first..first + width * step];
                    for (value, block) in row.iter_mut().zip(line.chunks_exact(step)) {
                        *value += block.iter().sum::<f32>();
                    }
                }
                row.iter_mut().for_each(|value| *value *= scale);
            });
        Self {
            width,
            height,
            values,
        }
    }

    fn half(&self) -> Self {
        Self::reduced(&self.values, self.width, 2)
    }

    /// The value between four pixels, those of the border beyond it.
    fn at(&self, x: f32, y: f32) -> f32 {
        between(&self.values, self.width, Vec2::new(x, y))
    }
}

/// The value between four numbers of a plane that is `width` wide, those of the border beyond it.
#[inline(always)]
pub(super) fn between(values: &[f32], width: usize, pos: Vec2) -> f32 {
    let height = values.len() / width;
    let x = pos.x.clamp(0.0, (width - 1) as f32);
    let y = pos.y.clamp(0.0, (height - 1) as f32);
    let (left, top) = (cell(x), cell(y));
    let (right, below) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
    let (u, v) = (x - left as f32, y - top as f32);
    let row = |y: usize| {
        let line = &values[y * width..];
        line[left] + u * (line[right] - line[left])
    };
    let above = row(top);
    above + v * (row(below) - above)
}

/// Displacements along a row of a picture, px of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ways {
    /// At every `step`-th pixel; empty where nothing moves.
    ways: Vec<Vec2>,
    step: usize,
}

impl Ways {
    /// The way at pixel `x`.
    #[inline(always)]
    pub(crate) fn way(&self, x: usize) -> Vec2 {
        if self.ways.is_empty() {
            return Vec2::ZERO;
        }
        let (left, right, u) = between_two(x, self.step, self.ways.len());
        self.ways[left].lerp(self.ways[right], u)
    }
}

/// The ones of `count` pixels before and behind a pixel of a line that is `step` times as fine, and its place between them.
#[inline(always)]
fn between_two(at: usize, step: usize, count: usize) -> (usize, usize, f32) {
    let place = ((at as f32 + 0.5) / step as f32 - 0.5).clamp(0.0, (count - 1) as f32);
    let first = cell(place);
    (first, (first + 1).min(count - 1), place - first as f32)
}

/// Displacements from a picture to the one before, px of the picture in which they were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Flow {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) ways: Vec<Vec2>,
}

impl Flow {
    /// The motion from `now` back to `before`, pictures of one size.
    pub(crate) fn between(now: &Grey, before: &Grey) -> Self {
        let mut levels = vec![(now.clone(), before.clone())];
        while let Some((now, before)) = levels.last()
            && now.width.min(now.height) >= 2 * LEAST_SIDE
        {
            levels.push((now.half(), before.half()));
        }
        let mut flow = Self::default();
        for (number, (now, before)) in levels.iter().enumerate().rev() {
            flow = flow.finer(now, before, number == 0);
        }
        flow
    }

    /// No motion.
    pub(crate) fn none(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            ways: vec![Vec2::ZERO; width * height],
        }
    }

    /// The ways along row `y` of a picture that is `step` times as fine.
    pub(crate) fn row(&self, y: usize, step: usize) -> Ways {
        let (top, below, v) = match self.ways.is_empty() {
            true => return Ways::default(),
            false => between_two(y, step, self.height),
        };
        let line = |y: usize| &self.ways[y * self.width..][..self.width];
        let between = |(&a, &b): (&Vec2, &Vec2)| step as f32 * a.lerp(b, v);
        Ways {
            ways: line(top).iter().zip(line(below)).map(between).collect(),
            step,
        }
    }

    /// The motion on a level that is twice as fine; on the `finest` one, things may be found at rest.
    fn finer(&self, now: &Grey, before: &Grey, finest: bool) -> Self {
        let (width, height) = (now.width, now.height);
        if width < PATCH || height < PATCH {
            return Self::none(width, height);
        }
        let places = |side: usize| {
            let last = side - PATCH;
            let mut places: Vec<usize> = (0..=last).step_by(STRIDE).collect();
            if places.last() != Some(&last) {
                places.push(last);
            }
            places
        };
        let (columns, rows) = (places(width), places(height));
        let patches: Vec<Vec<Vec2>> = rows
            .par_iter()
            .map(|&y| {
                let of = |&x: &usize| {
                    let guess = self.guess(x + PATCH / 2, y + PATCH / 2);
                    aligned(now, before, [x, y], (guess, finest))
                };
                columns.iter().map(of).collect()
            })
            .collect();
        let mut ways = vec![Vec2::ZERO; width * height];
        ways.par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, line)| {
                let covering_rows: Vec<usize> = covering(&rows, y);
                for (x, way) in line.iter_mut().enumerate() {
                    let (mut sum, mut total) = (Vec2::ZERO, 0.0);
                    for column in covering(&columns, x) {
                        for &row in &covering_rows {
                            let patch = patches[row][column];
                            let there = before.at(x as f32 + patch.x, y as f32 + patch.y);
                            let apart = (now.values[y * width + x] - there).abs();
                            // A hundredth of the range weighs as much as any smaller difference.
                            let weight = 1.0 / apart.max(0.01);
                            sum += weight * patch;
                            total += weight;
                        }
                    }
                    *way = sum / total;
                }
            });
        Self {
            width,
            height,
            ways,
        }
    }

    /// The motion that a coarser level finds at a pixel of the next one.
    fn guess(&self, x: usize, y: usize) -> Vec2 {
        if self.ways.is_empty() {
            return Vec2::ZERO;
        }
        let (x, y) = ((x / 2).min(self.width - 1), (y / 2).min(self.height - 1));
        2.0 * self.ways[y * self.width + x]
    }
}

/// Numbers of the patches that cover a pixel: two, or three beside the last.
fn covering(places: &[usize], pixel: usize) -> Vec<usize> {
    let near = pixel / STRIDE;
    let first = near.saturating_sub(PATCH / STRIDE);
    let covers = |&number: &usize| {
        places
            .get(number)
            .is_some_and(|&place| place <= pixel && pixel < place + PATCH)
    };
    (first..near + 2).filter(covers).collect()
}

/// The way of the patch at a corner.
fn aligned(now: &Grey, before: &Grey, [x, y]: [usize; 2], (guess, may_rest): (Vec2, bool)) -> Vec2 {
    const COUNT: usize = PATCH * PATCH;
    let mut own = [0.0; COUNT];
    let mut slopes = [Vec2::ZERO; COUNT];
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (index, (own, slope)) in own.iter_mut().zip(&mut slopes).enumerate() {
        let (px, py) = (x + index % PATCH, y + index / PATCH);
        let value = |x: usize, y: usize| now.values[y * now.width + x];
        *own = value(px, py);
        let (left, right) = (px.saturating_sub(1), (px + 1).min(now.width - 1));
        let (above, below) = (py.saturating_sub(1), (py + 1).min(now.height - 1));
        slope.x = (value(right, py) - value(left, py)) / (right - left) as f32;
        slope.y = (value(px, below) - value(px, above)) / (below - above) as f32;
        xx += slope.x * slope.x;
        xy += slope.x * slope.y;
        yy += slope.y * slope.y;
    }
    let mean = own.iter().sum::<f32>() / COUNT as f32;
    // Differences without their mean: brightness may change evenly.
    let differences = |way: Vec2| {
        let mut found = [0.0; COUNT];
        let mut sum = 0.0;
        for (index, found) in found.iter_mut().enumerate() {
            let (px, py) = (x + index % PATCH, y + index / PATCH);
            *found = before.at(px as f32 + way.x, py as f32 + way.y);
            sum += *found;
        }
        let shift = mean - sum / COUNT as f32;
        for (found, own) in found.iter_mut().zip(&own) {
            *found += shift - own;
        }
        found
    };
    let squares = |found: &[f32; COUNT]| found.iter().map(|d| d * d).sum::<f32>();
    let rest = squares(&differences(Vec2::ZERO));
    let floor = NOISE * COUNT as f32;
    // A patch without texture in one direction stays where it was guessed in that direction.
    let damping = 0.001 * (xx + yy) + 0.1 * floor;
    let (xx, yy) = (xx + damping, yy + damping);
    let determinant = xx * yy - xy * xy;
    let (mut best, mut least) = (guess, f32::INFINITY);
    let mut way = guess;
    for _ in 0..STEPS {
        let found = differences(way);
        let error = squares(&found);
        if error >= least {
            break;
        }
        (best, least) = (way, error);
        let mut pull = Vec2::ZERO;
        for (slope, &difference) in slopes.iter().zip(&found) {
            pull += difference * *slope;
        }
        let step = Vec2::new(yy * pull.x - xy * pull.y, xx * pull.y - xy * pull.x) / determinant;
        if step.length() < SHORT_PX {
            break;
        }
        // A patch is not followed farther than itself from its guess.
        way = guess + (way - step - guess).clamp_length_max(PATCH as f32);
    }
    let rests = may_rest && guess.length() < RESTING_PX && rest <= REST * least + floor;
    if rests { Vec2::ZERO } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(x: f32, y: f32) -> f32 {
        0.5 + 0.15 * (0.31 * x + 0.11 * y).sin()
            + 0.15 * (0.17 * y - 0.07 * x).cos()
            + 0.1 * (0.05 * x * 0.9).sin() * (0.06 * y).sin()
    }

    fn picture(place: impl Fn(f32, f32) -> [f32; 2]) -> Grey {
        let (width, height) = (160, 120);
        let values = (0..width * height).map(|i| {
            let [x, y] = place((i % width) as f32, (i / width) as f32);
            texture(x, y)
        });
        Grey {
            width,
            height,
            values: values.collect(),
        }
    }

    #[test]
    fn a_shift_is_found_to_a_tenth_of_a_pixel() {
        let before = picture(|x, y| [x, y]);
        for shift in [[0.4, -0.3], [3.0, 1.5], [-9.0, 6.0]] {
            // What stands at x now stood at x + shift before.
            let now = picture(|x, y| [x + shift[0], y + shift[1]]);
            let flow = Flow::between(&now, &before);
            let (mut worst, mut squares) = (0f32, 0.0);
            for y in 20..100 {
                for x in 20..140 {
                    let apart = (flow.ways[y * 160 + x] - Vec2::from(shift)).length();
                    worst = worst.max(apart);
                    squares += apart * apart;
                }
            }
            // Where the texture runs one way alone, a patch may slide along it.
            let mean = (squares / (80.0 * 120.0)).sqrt();
            assert!(
                mean < 0.1 && worst < 0.3,
                "{shift:?}: {mean}, at most {worst} px"
            );
        }
    }

    #[test]
    fn rest_is_exact_in_noise() {
        let before = picture(|x, y| [x, y]);
        let mut now = before.clone();
        for (index, value) in now.values.iter_mut().enumerate() {
            *value += 0.004 * ((index * 2_654_435_761) % 1_000) as f32 / 1_000.0;
        }
        let flow = Flow::between(&now, &before);
        assert!(flow.ways.iter().all(|&way| way == Vec2::ZERO));
    }

    #[test]
    fn small_pictures_rest() {
        for (width, height) in [(1, 1), (7, 90), (9, 8)] {
            let grey = Grey {
                width,
                height,
                values: vec![0.5; width * height],
            };
            let flow = Flow::between(&grey, &grey);
            assert!(flow.ways.iter().all(|&way| way == Vec2::ZERO));
            assert_eq!(flow.row(0, 4).way(0), Vec2::ZERO);
        }
    }
}
