//! Counts of a frame's bricks: what they were drawn from, and which were hidden.

use resample_core::tile::TileLists;

use crate::sheets::gather::PlacedBrick;
use crate::stats::FrameStats;
use crate::tiles::TileSlot;

/// Counts the bricks in view by what they were drawn from, and those that no tile looked at: each tile looked at the
/// first of its list. `columns` is the number of tiles in a row.
pub(crate) fn count_levels(
    bricks: &[PlacedBrick],
    lists: &TileLists,
    (slots, columns): (&[TileSlot], usize),
    stats: &mut FrameStats,
) {
    let mut looked_at = vec![false; bricks.len()];
    for (index, slot) in slots.iter().enumerate() {
        let list = lists.tile(index % columns, index / columns);
        list[..slot.counts.composited]
            .iter()
            .for_each(|&brick| looked_at[brick as usize] = true);
    }
    for (brick, looked_at) in bricks.iter().zip(looked_at) {
        let level = brick.detail.level();
        stats.bricks_by_level[level] += 1;
        stats.bricks_hidden_by_level[level] += u64::from(!looked_at);
        if level == 0 {
            stats.bricks_by_stride[brick.detail.log2_stride()] += 1;
        }
    }
    stats.bricks_hidden = stats.bricks_hidden_by_level.iter().sum();
}
