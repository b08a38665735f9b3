//! Runs of neighbouring discs, which are listed and projected together.
//!
//! Takes discs in the order of their tree, returns runs of at most sixteen with a ball around each. A run ends early where the next disc
//! lies far off: the order of a tree jumps, and a run that did as well would be listed all over the screen.

use glam::Vec3;
use rayon::prelude::*;

use crate::discs::prepare::Disc;
use crate::draw::sizes::BLOCK_DISCS;
use crate::lanes::LANES;

/// Longest side of the box around a run, largest spacings of its discs. Sixteen points of a surface lie within four spacings, or eight
/// where the tree cuts them into a strip. A guess.
const MOST_SIDE_SPACINGS: f32 = 12.0;

/// A run of discs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// The middle of the box around the discs' middles, relative to the origin of the discs.
    pub(crate) middle: [f32; 3],
    /// Distance of the farthest disc's middle from there.
    pub(crate) reach: f32,
    /// Largest radius of a disc.
    pub(crate) radius: f32,
    /// Largest spacing of a disc.
    pub(crate) spacing: f32,
    /// The number of the first disc.
    pub(crate) first: u32,
    /// How many discs there are.
    pub(crate) count: u32,
}

/// All runs of one disc of so many.
#[derive(Clone, Debug, Default)]
pub(crate) struct Groups {
    /// One disc of so many is drawn.
    pub(crate) every: usize,
    pub(crate) groups: Vec<Group>,
}

impl Groups {
    /// Finds the runs. Each lies in one block of the view.
    pub(crate) fn new(discs: &[Disc], every: usize) -> Self {
        let blocks = discs.par_chunks(BLOCK_DISCS * every).enumerate();
        let runs = |(block, discs)| runs(discs, block * BLOCK_DISCS * every, every);
        Self {
            every,
            groups: blocks.flat_map_iter(runs).collect(),
        }
    }

    /// The discs of a group with their numbers.
    #[inline(always)]
    pub(crate) fn discs<'a>(
        &self,
        discs: &'a [Disc],
        group: &Group,
    ) -> impl Iterator<Item = &'a Disc> {
        let drawn = discs[group.first as usize..].iter().step_by(self.every);
        drawn.take(group.count as usize)
    }
}

/// The runs of a block, whose first disc has this number.
fn runs(discs: &[Disc], first: usize, every: usize) -> Vec<Group> {
    let mut runs = Vec::with_capacity(discs.len().div_ceil(every * LANES));
    let drawn: Vec<&Disc> = discs.iter().step_by(every).collect();
    let mut start = 0;
    while start < drawn.len() {
        let run = &drawn[start..(start + LANES).min(drawn.len())];
        let number = first + start * every;
        let group = group(run, number as u32);
        start += group.count as usize;
        runs.push(group);
    }
    runs
}

/// The longest run from the first of these discs on.
fn group(discs: &[&Disc], first: u32) -> Group {
    let at = Vec3::from(discs[0].position);
    let (mut low, mut high) = (at, at);
    let (mut radius, mut spacing) = (0.0f32, 0.0f32);
    let mut count = 0u32;
    for disc in discs {
        let at = Vec3::from(disc.position);
        let corners = [low.min(at), high.max(at)];
        let largest = spacing.max(disc.spacing);
        let side = (corners[1] - corners[0]).max_element();
        if side > MOST_SIDE_SPACINGS * largest && count > 0 {
            break;
        }
        [low, high] = corners;
        spacing = largest;
        radius = radius.max(disc.radius);
        count += 1;
    }
    let middle = 0.5 * (low + high);
    let run = discs.iter().take(count as usize);
    let distances = run.map(|disc| middle.distance(disc.position.into()));
    // Distances are rounded.
    let reach = 1.0001 * distances.fold(0.0, f32::max);
    Group {
        middle: middle.to_array(),
        reach,
        radius,
        spacing,
        first,
        count,
    }
}
