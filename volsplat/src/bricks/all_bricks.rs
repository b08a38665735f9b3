//! All bricks of a scene of scalars: those that are shown, and the others, kept for when they are.
//!
//! A brick's scalars do not depend on what is shown of them. Where all bricks are kept, another transfer function only asks
//! each of them again which of its cells may be seen, and gives gradients to those that lack them. A brick that is
//! shown is the one that a preparation for this function alone would give.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::cells::{CellBrick, CellField, ShownCells, WithGradients};
use super::fill::{Block, FieldPlan, PlannedChannel, Shown};
use super::support::Support;
use crate::grid::bounds::Bounds;

impl CellField {
    /// All bricks of a plan of scalars, those that it does not show as spare ones. `non_transparent` is counted by the
    /// caller.
    pub(crate) fn whole(plan: &FieldPlan, non_transparent: u64) -> Self {
        let channels = plan.channels.iter().map(|channel| PlannedChannel {
            volume: channel.volume,
            shown: Shown::Scalars(Support::everything()),
        });
        let all = FieldPlan {
            channels: channels.collect(),
            mask: plan.mask,
            gradients: WithGradients::No,
        };
        let mut field = Self::new(&all, non_transparent);
        field.show(plan);
        field
    }

    /// Shows what another plan of the same volumes and the same mask shows; all bricks are kept.
    pub(crate) fn show(&mut self, plan: &FieldPlan) {
        let count = self.empty + self.bricks.len() as u64;
        let mut all = std::mem::take(&mut self.bricks);
        all.append(&mut self.spare);
        all.par_iter_mut().for_each(|brick| plan.show(brick));
        // Two runs, each in order: sorting merges them.
        all.sort_by(|a, b| morton_order(a.bounds.corner, b.bounds.corner));
        (self.bricks, self.spare) = all.into_iter().partition(|brick| brick.shown.any());
        self.empty = count - self.bricks.len() as u64;
    }
}

impl FieldPlan<'_> {
    /// Finds what is shown of a brick.
    fn show(&self, brick: &mut CellBrick) {
        let block = Block::new(self.channels[0].volume.dims, brick.bounds.corner);
        let numbers = 0..self.channels.len();
        let tables = numbers
            .map(|number| brick.channel(number))
            .map(|cells| (cells.scalars, cells.range));
        let seen = self
            .channels
            .iter()
            .zip(tables.clone())
            .any(|(channel, (_, range))| channel.shown.meets(range));
        let shown = seen
            .then(|| self.shown_cells(&block, tables, brick.mask.as_deref()))
            .flatten();
        let Some((bounds, shown)) = shown else {
            brick.bounds = Bounds::nothing(block.corner);
            brick.shown = ShownCells::none();
            return;
        };
        (brick.bounds, brick.shown) = (bounds, shown);
        if self.gradients == WithGradients::Yes {
            self.add_gradients(brick, &block);
        }
    }

    /// Gradients at all vertices of a brick that has none.
    fn add_gradients(&self, brick: &mut CellBrick, block: &Block) {
        let whole = Bounds::of_range(block.corner, [[0; 3], block.size.map(|cells| cells as u8)]);
        let tables = std::iter::once(&mut brick.gradients)
            .chain(brick.more.iter_mut().map(|channel| &mut channel.gradients));
        for (channel, table) in self.channels.iter().zip(tables) {
            table.get_or_insert_with(|| self.gradients_of(channel, &whole));
        }
    }
}

/// The order of two bricks by their corners: that of the list that bricks are made from. The highest bit in which they
/// differ decides, that of z before those of y and of x.
fn morton_order(a: [u32; 3], b: [u32; 3]) -> Ordering {
    let differing = |axis: usize| a[axis] ^ b[axis];
    // One number's highest bit is above another's where taking the other out leaves more than the other.
    let is_above = |more: u32, than: u32| than < more && than < more ^ than;
    let first = |axis: usize, lower: usize| {
        if is_above(differing(lower), differing(axis)) {
            lower
        } else {
            axis
        }
    };
    let axis = first(first(2, 1), 0);
    a[axis].cmp(&b[axis])
}
