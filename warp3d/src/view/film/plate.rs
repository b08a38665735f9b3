//! The background that pictures of a film show beside and behind what hides it now: a plate, as film makers call it.
//!
//! Takes each picture with its inverse depth and motion, gives the samples that it hides and another picture showed. A sample that is hidden moves with the
//! farther things around it. It knows its own place to a part of a pixel, so that being carried from picture to picture does not
//! let it wander.
//! Limits: one layer; what changes while it is hidden is shown as it was.

use glam::Vec2;
use rayon::prelude::*;
use resample_core::narrow::cell;

use super::around::around;
use super::ego::Ego;
use super::flow::{Flow, PATCH};

/// A surface hides another if its inverse depth is larger by this part: that of the least jump between surfaces.
const JUMP: f32 = 0.05;

/// Samples beside an edge, px, whose colours are mixed, or whose depth may be that of the other side.
const EDGE: usize = 2;

/// Largest distance of a sample from its pixel's centre, px: where samples lie a
/// pixel apart one comes to 0.71 of every centre, and where the motion spreads them to twice that.
const FAR_PX: f32 = 1.5;

/// How far the plate goes on beyond what is hidden, px: a mixed pixel and the edge that is left out.
const AROUND: usize = EDGE + 2;

/// Reach of a nearer thing's motion, blocks of the flow: where there is little to see beside it, four patches, since motion is found from coarse to fine.
const BESIDE: usize = 4 * PATCH;

/// Levels of the pyramid in which farther things are looked for.
const LEVELS: usize = 7;

/// A sample of the plate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) colour: [f32; 3],
    /// Inverse depth; NaN where nothing is known.
    pub(crate) nearness: f32,
    /// From the pixel's centre, px.
    offset: Vec2,
}

/// The background that a picture hides.
#[derive(Clone, Debug)]
pub(crate) struct Background {
    /// Of each pixel; the picture's own where nothing is known.
    pub(crate) colour: Vec<[f32; 3]>,
    /// Camera z; NaN where nothing is known.
    pub(crate) depth: Vec<f32>,
}

/// The plate of the present picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plate {
    samples: Vec<Sample>,
    /// True for each sample that the picture hides.
    covered: Vec<bool>,
}

impl Sample {
    const NONE: Self = Self {
        colour: [0.0; 3],
        nearness: f32::NAN,
        offset: Vec2::ZERO,
    };
}

/// One picture.
pub(crate) struct Shown<'a> {
    pub(crate) width: usize,
    pub(crate) colour: &'a [[f32; 3]],
    /// Inverse depth; NaN where it is unknown.
    pub(crate) nearness: &'a [f32],
    pub(crate) flow: &'a Flow,
    pub(crate) step: usize,
}

impl Plate {
    /// Begins anew.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
    }

    /// Adds a picture; gives the background that it hides, and what both show around that, if there is any.
    pub(crate) fn add(&mut self, now: &Shown) -> Option<Background> {
        let width = now.width;
        let height = now.nearness.len() / width;
        let edges = edges(now.nearness, width);
        if self.samples.len() != now.nearness.len() {
            self.samples = vec![Sample::NONE; now.nearness.len()];
        }
        let ways = far_ways(now);
        let before = std::mem::take(&mut self.samples);
        let least = least_around(&before, width);
        let mut hidden = vec![false; before.len()];
        self.samples = vec![Sample::NONE; before.len()];
        let rows = self
            .samples
            .par_chunks_mut(width)
            .zip(hidden.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, (samples, hidden))| {
            let ways = ways.row(y, now.step);
            for x in 0..width {
                let index = y * width + x;
                let own = Sample {
                    colour: now.colour[index],
                    nearness: now.nearness[index],
                    offset: Vec2::ZERO,
                };
                let from = Vec2::new(x as f32, y as f32) + ways.way(x);
                let Some([column, row]) = pixel_at(from, [width, height]) else {
                    if !edges[index] {
                        samples[x] = own;
                    }
                    continue;
                };
                // For the most part nothing around lies behind.
                let is_in_front = least[row * width + column] * (1.0 + JUMP) >= own.nearness;
                if is_in_front && !edges[index] {
                    samples[x] = own;
                    continue;
                }
                let carried = carried(&before, from, [column, row], [width, height]);
                let is_behind = carried.nearness * (1.0 + JUMP) < own.nearness
                    || (own.nearness.is_nan() && !carried.nearness.is_nan());
                if is_behind {
                    samples[x] = carried;
                    hidden[x] = true;
                } else if !edges[index] {
                    samples[x] = own;
                } else if !carried.nearness.is_nan() {
                    samples[x] = carried;
                }
            }
        });
        self.covered = hidden;
        let hidden = agreed(&self.covered, width);
        self.close_gaps(&hidden, width);
        // Where surfaces end, colours are mixed with those beside them: the plate goes on a little.
        let behind = |(&hidden, sample): (&bool, &Sample)| match hidden {
            true => sample.nearness,
            false => 0.0,
        };
        let behind: Vec<f32> = hidden.par_iter().zip(&self.samples).map(behind).collect();
        if !hidden.par_iter().any(|&hidden| hidden) {
            return None;
        }
        let around = largest_around(&behind, width, AROUND);
        let shown = |index: usize| {
            let sample = &self.samples[index];
            let goes_on = sample.nearness <= around[index] * (1.0 + JUMP);
            match hidden[index] || goes_on {
                true => (sample.colour, 1.0 / sample.nearness),
                false => (now.colour[index], f32::NAN),
            }
        };
        let (colour, depth) = (0..hidden.len()).into_par_iter().map(shown).unzip();
        Some(Background { colour, depth })
    }
}

impl Plate {
    /// Gives each sample that most of its neighbours hide and it does not their mean, so that the motion leaves no gaps.
    fn close_gaps(&mut self, hidden: &[bool], width: usize) {
        let samples = &self.samples;
        let gap = |index: usize| {
            if !hidden[index] || self.covered[index] {
                return None;
            }
            let (x, y) = (index % width, index / width);
            let (mut sum, mut nearness, mut count) = ([0.0; 3], 0.0, 0.0);
            for row in y.saturating_sub(1)..(y + 2).min(samples.len() / width) {
                for column in x.saturating_sub(1)..(x + 2).min(width) {
                    let other = row * width + column;
                    if self.covered[other] {
                        let colour = samples[other].colour;
                        sum = std::array::from_fn(|c| sum[c] + colour[c]);
                        nearness += samples[other].nearness;
                        count += 1.0;
                    }
                }
            }
            let sample = Sample {
                colour: sum.map(|channel| channel / count),
                nearness: nearness / count,
                offset: Vec2::ZERO,
            };
            Some((index, sample))
        };
        let gaps: Vec<(usize, Sample)> =
            (0..samples.len()).into_par_iter().filter_map(gap).collect();
        for (index, sample) in gaps {
            self.samples[index] = sample;
        }
    }
}

/// The pixel that holds a place, px from the first one's centre.
fn pixel_at(place: Vec2, [width, height]: [usize; 2]) -> Option<[usize; 2]> {
    let corner = place + 0.5;
    let is_inside =
        corner.x >= 0.0 && corner.y >= 0.0 && corner.x < width as f32 && corner.y < height as f32;
    is_inside.then(|| [cell(corner.x), cell(corner.y)])
}

/// The sample that comes to a pixel from a place in the pixel `column`, `row`.
fn carried(
    before: &[Sample],
    from: Vec2,
    [column, row]: [usize; 2],
    [width, height]: [usize; 2],
) -> Sample {
    // The sample that comes nearest to the pixel's centre stood in this pixel or in one beside it.
    let (mut best, mut least) = (Sample::NONE, f32::INFINITY);
    for row in row.saturating_sub(1)..(row + 2).min(height) {
        for column in column.saturating_sub(1)..(column + 2).min(width) {
            let sample = before[row * width + column];
            let offset = Vec2::new(column as f32, row as f32) + sample.offset - from;
            let apart = offset.length_squared();
            if apart < least && !sample.nearness.is_nan() {
                (best, least) = (Sample { offset, ..sample }, apart);
            }
        }
    }
    // One that comes farther off belongs to another pixel.
    match least <= FAR_PX * FAR_PX {
        true => best,
        false => Sample::NONE,
    }
}

/// The least inverse depth within a pixel of each; infinite where nothing is known.
fn least_around(samples: &[Sample], width: usize) -> Vec<f32> {
    let known = |sample: &Sample| match sample.nearness.is_nan() {
        true => f32::INFINITY,
        false => sample.nearness,
    };
    let known: Vec<f32> = samples.par_iter().map(known).collect();
    around(&known, width, 1, |least, value| {
        if value < *least {
            *least = value
        }
    })
}

/// Pixels within [`EDGE`] of a jump of depth.
fn edges(nearness: &[f32], width: usize) -> Vec<bool> {
    let height = nearness.len() / width;
    let jumps = |a: f32, b: f32| !((a - b).abs() <= JUMP * a.max(b));
    let mut own = vec![false; nearness.len()];
    own.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let line = &nearness[y * width..][..width];
        let below = &nearness[(y + 1).min(height - 1) * width..][..width];
        for ((to, &here), &below) in row.iter_mut().zip(line).zip(below) {
            *to = jumps(here, below);
        }
        for ((to, &here), &right) in row.iter_mut().zip(line).zip(&line[1..]) {
            *to |= jumps(here, right);
        }
    });
    around(&own, width, EDGE, |any, mark| *any |= mark)
}

/// The marks that most of the nine pixels around have: without single ones, and without single gaps.
fn agreed(marks: &[bool], width: usize) -> Vec<bool> {
    let marks: Vec<u8> = marks.par_iter().map(|&mark| u8::from(mark)).collect();
    let counts = around(&marks, width, 1, |count, mark| *count += mark);
    counts.par_iter().map(|&count| count >= 5).collect()
}

/// The largest of the numbers within `reach` of each, those that are known, or 0.
fn largest_around(values: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let known: Vec<f32> = values.par_iter().map(|&value| value.max(0.0)).collect();
    around(&known, width, reach, |most, value| *most = most.max(value))
}

/// A level of the pyramid: inverse depth and motion of the farther things in each block.
struct Level {
    width: usize,
    height: usize,
    nearness: Vec<f32>,
    ways: Vec<Vec2>,
}

/// The motion of what lies behind each pixel: of the nearest farther thing around it, else its own.
///
/// Motion beside a nearer thing may be that thing's: such places ask those farther off.
fn far_ways(now: &Shown) -> Flow {
    let flow = now.flow;
    let (width, height) = (flow.width, flow.height);
    if width == 0 || height == 0 {
        return flow.clone();
    }
    let rows = now.nearness.len() / now.width;
    let at = |index: usize| {
        let (x, y) = (index % width * now.step, index / width * now.step);
        let half = now.step / 2;
        let (x, y) = ((x + half).min(now.width - 1), (y + half).min(rows - 1));
        now.nearness[y * now.width + x]
    };
    let own: Vec<f32> = (0..width * height).map(at).collect();
    let largest = largest_around(&own, width, BESIDE);
    let usable = |(&own, &largest): (&f32, &f32)| match largest > own * (1.0 + JUMP) {
        true => f32::INFINITY,
        false => own,
    };
    let mut levels = vec![Level {
        width,
        height,
        nearness: own.iter().zip(&largest).map(usable).collect(),
        ways: flow.ways.clone(),
    }];
    while let Some(last) = levels.last()
        && levels.len() < LEVELS
        && last.width.min(last.height) > 1
    {
        levels.push(last.coarser());
    }
    let at_rest: Vec<_> = (0..own.len())
        .filter(|&index| levels[0].nearness[index].is_finite())
        .map(|index| ([index % width, index / width], own[index], flow.ways[index]))
        .collect();
    let ego = Ego::of(&at_rest, [width, height]);
    let way = |index: usize| {
        let limit = [own[index] / (1.0 + JUMP), own[index] * (1.0 + JUMP)];
        let (x, y) = (index % width, index / width);
        let found = |limit: f32| {
            levels
                .iter()
                .enumerate()
                .skip(1)
                .find_map(|(number, level)| {
                    let column = (x >> number).min(level.width - 1);
                    let row = (y >> number).min(level.height - 1);
                    // The blocks around it, too: an edge lies anywhere in its block.
                    let around = level.farthest_around(column, row);
                    let nearness = level.nearness[around];
                    let way = match &ego {
                        Some(ego) => ego.way([x, y], nearness),
                        None => level.ways[around],
                    };
                    (nearness < limit).then_some(way)
                })
        };
        let behind = found(limit[0]);
        let beside = || match levels[0].nearness[index].is_finite() {
            true => None,
            false => found(limit[1]),
        };
        behind.or_else(beside).unwrap_or(flow.ways[index])
    };
    Flow {
        width,
        height,
        ways: (0..width * height).into_par_iter().map(way).collect(),
    }
}

impl Level {
    /// Blocks of two by two: the mean motion of those of its parts that are as far as the farthest.
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let block = |index: usize| {
            let (x, y) = (2 * (index % width), 2 * (index / width));
            let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            let parts =
                [[x, y], [right, y], [x, below], [right, below]].map(|[x, y]| y * self.width + x);
            let farthest = parts
                .iter()
                .map(|&part| self.nearness[part])
                .fold(f32::INFINITY, f32::min);
            let (mut sum, mut count) = (Vec2::ZERO, 0.0);
            for part in parts {
                if self.nearness[part] <= farthest * (1.0 + JUMP) {
                    sum += self.ways[part];
                    count += 1.0;
                }
            }
            match count > 0.0 {
                true => (farthest, sum / count),
                false => (f32::INFINITY, self.ways[parts[0]]),
            }
        };
        let (nearness, ways) = (0..width * height).map(block).unzip();
        Self {
            width,
            height,
            nearness,
            ways,
        }
    }

    /// The farthest of a block and the eight around it.
    fn farthest_around(&self, x: usize, y: usize) -> usize {
        let mut best = y * self.width + x;
        for row in y.saturating_sub(1)..(y + 2).min(self.height) {
            for column in x.saturating_sub(1)..(x + 2).min(self.width) {
                let other = row * self.width + column;
                if self.nearness[other] < self.nearness[best] {
                    best = other;
                }
            }
        }
        best
    }
}
