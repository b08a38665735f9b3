//! The background that pictures of a film show beside and behind what hides it now: a plate, as film makers call it.
//!
//! Takes each picture with its inverse depth and motion, gives the samples that it hides and another picture showed. A sample that is hidden moves with the
//! farther things around it. It knows its own place to a part of a pixel, so that being carried from picture to picture does not
//! let it wander.
//! Limits: one layer; what changes while it is hidden is shown as it was.

use glam::Vec2;
use rayon::prelude::*;

use super::flow::Flow;

/// A surface hides another if its inverse depth is larger by this part: that of the least jump between surfaces.
const JUMP: f32 = 0.05;

/// Samples beside an edge, px, whose colours are mixed, or whose depth may be that of the other side.
const EDGE: usize = 2;

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

/// The plate of the present picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plate {
    samples: Vec<Sample>,
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

    /// Adds a picture; gives the sample that each pixel hides.
    pub(crate) fn add(&mut self, now: &Shown) -> Vec<Option<Sample>> {
        let width = now.width;
        let height = now.nearness.len() / width;
        let edges = edges(now.nearness, width);
        if self.samples.len() != now.nearness.len() {
            self.samples = vec![Sample::NONE; now.nearness.len()];
        }
        let ways = far_ways(now);
        let before = std::mem::take(&mut self.samples);
        let mut hidden = vec![None; before.len()];
        self.samples = vec![Sample::NONE; before.len()];
        let rows = self.samples.par_chunks_mut(width).zip(hidden.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, (samples, hidden))| {
            for x in 0..width {
                let index = y * width + x;
                let own = Sample {
                    colour: now.colour[index],
                    nearness: now.nearness[index],
                    offset: Vec2::ZERO,
                };
                let carried = carried(&before, [x, y], ways.way(x, y, now.step), [width, height]);
                let is_behind = carried.nearness * (1.0 + JUMP) < own.nearness
                    || (own.nearness.is_nan() && !carried.nearness.is_nan());
                if is_behind {
                    samples[x] = carried;
                    hidden[x] = Some(carried);
                } else if !edges[index] {
                    samples[x] = own;
                } else if !carried.nearness.is_nan() {
                    samples[x] = carried;
                }
            }
        });
        hidden
    }
}

/// The sample that comes to a pixel along a way.
fn carried(before: &[Sample], [x, y]: [usize; 2], way: Vec2, [width, height]: [usize; 2]) -> Sample {
    let here = Vec2::new(x as f32, y as f32);
    let from = here + way;
    let nearest = from.round();
    if nearest.x < 0.0
        || nearest.y < 0.0
        || nearest.x >= width as f32
        || nearest.y >= height as f32
    {
        return Sample::NONE;
    }
    let at = |x: usize, y: usize| before[y * width + x];
    let (column, row) = (nearest.x as usize, nearest.y as usize);
    let first = at(column, row);
    if first.nearness.is_nan() {
        return Sample::NONE;
    }
    // The sample stood at its pixel's centre and its offset; a way that ends elsewhere leaves the rest as the new offset.
    let offset = nearest + first.offset - from;
    Sample {
        offset: offset.clamp(Vec2::splat(-1.0), Vec2::splat(1.0)),
        ..first
    }
}

/// Pixels within [`EDGE`] of a jump of depth.
fn edges(nearness: &[f32], width: usize) -> Vec<bool> {
    let height = nearness.len() / width;
    let jumps = |a: f32, b: f32| !((a - b).abs() <= JUMP * a.max(b));
    let mut own = vec![false; nearness.len()];
    own.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let line = &nearness[y * width..][..width];
        let below = &nearness[(y + 1).min(height - 1) * width..][..width];
        for x in 0..width {
            let right = line[(x + 1).min(width - 1)];
            row[x] = jumps(line[x], right) || jumps(line[x], below[x]);
        }
    });
    widened(&own, width, EDGE)
}

/// Marks all pixels within `reach` of a marked one, along rows and then columns.
fn widened(marks: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let height = marks.len() / width;
    let mut along = vec![false; marks.len()];
    along.par_chunks_mut(width).zip(marks.par_chunks(width)).for_each(|(to, row)| {
        for (x, to) in to.iter_mut().enumerate() {
            *to = row[x.saturating_sub(reach)..(x + reach + 1).min(width)].contains(&true);
        }
    });
    let mut all = vec![false; marks.len()];
    all.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
        for other in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            let row = &along[other * width..][..width];
            to.iter_mut().zip(row).for_each(|(to, &mark)| *to |= mark);
        }
    });
    all
}

/// A level of the pyramid: inverse depth and motion of the farther things in each block.
struct Level {
    width: usize,
    height: usize,
    nearness: Vec<f32>,
    ways: Vec<Vec2>,
}

/// The motion of what lies behind each pixel: of the nearest farther thing around it, else its own.
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
    let mut levels = vec![Level {
        width,
        height,
        nearness: (0..width * height).map(at).collect(),
        ways: flow.ways.clone(),
    }];
    while let Some(last) = levels.last()
        && levels.len() < LEVELS
        && last.width.min(last.height) > 1
    {
        levels.push(last.coarser());
    }
    let finest = &levels[0];
    let way = |index: usize| {
        let own = finest.nearness[index];
        let (x, y) = (index % width, index / width);
        for (number, level) in levels.iter().enumerate().skip(1) {
            let (x, y) = ((x >> number).min(level.width - 1), (y >> number).min(level.height - 1));
            // The blocks around it, too: an edge lies anywhere in its block.
            let around = level.farthest_around(x, y);
            if level.nearness[around] * (1.0 + JUMP) < own {
                return level.ways[around];
            }
        }
        finest.ways[index]
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
            let parts = [[x, y], [right, y], [x, below], [right, below]]
                .map(|[x, y]| y * self.width + x);
            let farthest = parts.iter().map(|&part| self.nearness[part]).fold(f32::INFINITY, f32::min);
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
