//! Cells of a volume that stays in its file: an index of the bricks that can be seen, and the bricks when they are needed.
//!
//! Takes a surveyed volume and a transfer function. The bricks whose range of scalars the function may show are read
//! once, for the box of their visible cells; what fits the memory stays, in the type of the file. A frame goes through
//! the layers of bricks from the eye away (`frame.rs`) and reads what it still lacks, unless it is hidden.
//! Limits: one channel of scalars and no mask.

use std::sync::Arc;

use rayon::prelude::*;
use resample_volume::Watch;
use resample_volume::volume::Described;

use crate::Error;
use crate::bricks::cells::{CellBrick, CellField, WithGradients};
use crate::bricks::plan::{gradients, support};
use crate::grid::bounds::Bounds;
use crate::large::LargeVolume;
use crate::large::blocks::bricks_along;
use crate::look::options::RenderOptions;
use crate::look::transfer::TransferFunction;
use crate::look::visible_values::VisibleValues;
use crate::slabs::table::TransferTable;

mod frame;
mod index;
mod load;

use index::{BrickIndex, IndexedBrick};
use load::{Packed, RowReader};

/// The visible bricks of a stored volume.
#[derive(Clone, Debug)]
pub(crate) struct StreamedCells {
    reader: RowReader,
    index: BrickIndex,
    /// For each row of bricks, what of it stays in memory.
    packed: Vec<Option<Packed>>,
    pub(crate) non_transparent: u64,
    pub(crate) voxels: u64,
    budget: Budget,
    /// Bytes that stay in memory from frame to frame.
    kept_bytes: u64,
}

/// Bytes that the parts of the work may take. The rest is for the picture, the lists of tiles, and the program itself.
#[derive(Clone, Copy, Debug)]
struct Budget {
    /// All of it.
    total: u64,
    /// Bricks that stay.
    packed: u64,
    /// Bricks that are drawn together.
    batch: u64,
    /// Tiles that are drawn together.
    tiles: u64,
}

impl Budget {
    /// Shares of the whole: guesses, but their sum leaves room. The index is checked to take at most a sixth.
    fn new(total: u64) -> Self {
        Self {
            total,
            packed: total / 4,
            batch: total / 8,
            tiles: total / 4,
        }
    }
}

/// A volume's cells, wherever they fit.
pub(crate) enum LargeCells {
    /// All visible bricks are in memory.
    Resident(CellField),
    /// They are read when they are needed.
    Streamed(Box<StreamedCells>),
}

impl LargeCells {
    /// Finds the visible bricks of a volume.
    pub(crate) fn new(
        volume: &LargeVolume,
        transfer: &TransferFunction,
        options: &RenderOptions,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        let (lattice, budget) = (volume.lattice(), Budget::new(volume.max_memory()));
        let reader = RowReader {
            stored: Arc::clone(volume.source()),
            support: support(transfer, options)
                .tabulated(TransferTable::step(transfer, volume.drawn_range()) as f32),
            gradients: gradients(options),
            world_from_index: lattice.world_from_index,
            narrowing: volume.narrowing(),
        };
        let meets = |range: &[f32; 2]| reader.support.meets(range[0], range[1]);
        let seen: Vec<bool> = volume.survey().bricks.par_iter().map(meets).collect();
        let count = seen.iter().filter(|seen| **seen).count() as u64;
        let bytes = count * reader.brick_bytes();
        let keep = if bytes <= budget.total / 2 {
            Keep::Whole
        } else {
            Keep::Packed
        };
        let values = VisibleValues::new(volume.voxel_type(), transfer);
        let tally = volume.survey().tally.as_ref();
        let finder = Finder {
            reader: &reader,
            counted: tally.is_none().then_some(&values),
            seen: &seen,
        };
        let mut found = Found::new(bricks_along(lattice.dims), budget.packed);
        found.non_transparent = tally.map_or(0, |tally| tally.count(|value| values.shows(value)));
        finder.find(&mut found, keep, watch)?;
        let (voxels, non_transparent) = (lattice.len() as u64, found.non_transparent);
        if keep == Keep::Whole {
            let all: usize = bricks_along(lattice.dims).iter().product();
            let empty = (all - found.whole.len()) as u64;
            let field = CellField::of_bricks(found.whole, non_transparent, voxels);
            return Ok(Self::Resident(CellField { empty, ..field }));
        }
        let Found { index, packed, .. } = found;
        check_index(&index, budget.total)?;
        let kept_bytes = index.bytes() + packed.iter().flatten().map(Packed::bytes).sum::<u64>();
        let cells = StreamedCells {
            reader,
            index,
            packed,
            non_transparent,
            voxels,
            budget,
            kept_bytes,
        };
        Ok(Self::Streamed(Box::new(cells)))
    }
}

/// The index stays, and the shares of the other parts leave a sixth for it.
fn check_index(index: &BrickIndex, max_memory: u64) -> Result<(), Error> {
    let needed = 6 * index.bytes();
    if needed <= max_memory {
        return Ok(());
    }
    Err(Error::Option(format!(
        "{max_memory} bytes of memory are too little: what this transfer function shows takes at least {needed} bytes"
    )))
}

/// The part of found bricks that is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keep {
    /// Every one, ready to be drawn.
    Whole,
    /// As many as fit, in the type of the file.
    Packed,
}

/// The bricks found so far.
struct Found {
    index: BrickIndex,
    packed: Vec<Option<Packed>>,
    whole: Vec<CellBrick>,
    non_transparent: u64,
    /// Bytes that packed bricks may still take.
    room: u64,
    along: [usize; 3],
}

/// The result of one row of bricks.
struct RowFound {
    bricks: Vec<IndexedBrick>,
    packed: Option<Packed>,
    whole: Vec<CellBrick>,
    non_transparent: u64,
}

impl Found {
    fn new(along: [usize; 3], room: u64) -> Self {
        let index = BrickIndex::new(along);
        Self {
            index,
            packed: Vec::new(),
            whole: Vec::new(),
            non_transparent: 0,
            room,
            along,
        }
    }

    fn add(&mut self, row: RowFound) {
        self.index.push_row(&row.bricks);
        let packed = row.packed.filter(|packed| packed.bytes() <= self.room);
        self.room -= packed.as_ref().map_or(0, Packed::bytes);
        self.packed.push(packed);
        self.whole.extend(row.whole);
        self.non_transparent += row.non_transparent;
    }
}

/// A finder of visible bricks.
struct Finder<'a> {
    reader: &'a RowReader,
    /// Where visible voxels have to be counted: which are.
    counted: Option<&'a VisibleValues<'a>>,
    /// The bricks that may be visible, x fastest.
    seen: &'a [bool],
}

impl Finder<'_> {
    fn find(&self, found: &mut Found, keep: Keep, watch: &mut Watch) -> Result<(), Error> {
        let [columns, rows, layers] = found.along;
        for (layer, seen) in self.seen.chunks(columns * rows).enumerate() {
            let rows = seen.par_chunks(columns).enumerate();
            // Rows without room are not packed in vain.
            let keep = (keep == Keep::Whole || found.room > 0).then_some(keep);
            let rows = rows.map(|(row, seen)| self.row([layer, row], seen, keep));
            let rows = rows.collect::<Result<Vec<RowFound>, Error>>()?;
            rows.into_iter().for_each(|row| found.add(row));
            watch((layer + 1) as f64 / layers as f64);
        }
        Ok(())
    }

    fn row(&self, at: [usize; 2], seen: &[bool], keep: Option<Keep>) -> Result<RowFound, Error> {
        let columns: Vec<u16> = (0..seen.len())
            .filter(|&i| seen[i])
            .map(|i| i as u16)
            .collect();
        let stored = &self.reader.stored;
        let read = self.reader.read(at, &columns)?;
        let count = |values: &VisibleValues| -> u64 {
            let Some(block) = &read.block else { return 0 };
            let corner = |&column: &u16| block.corner([column.into(), at[1], at[0]]);
            columns
                .iter()
                .map(|column| block.count_own(stored.dims(), corner(column), values))
                .sum()
        };
        let non_transparent = self.counted.map_or(0, count);
        let kept: Vec<CellBrick> = read.bricks.into_iter().flatten().collect();
        let bricks = kept
            .iter()
            .map(|brick| IndexedBrick::of(&brick.bounds))
            .collect();
        let (packed, whole) = match keep {
            Some(Keep::Whole) => (None, kept),
            Some(Keep::Packed) if self.reader.gradients == WithGradients::No => {
                (Some(Packed::new(stored.voxel_type(), &kept)), Vec::new())
            }
            _ => (None, Vec::new()),
        };
        Ok(RowFound {
            bricks,
            packed,
            whole,
            non_transparent,
        })
    }
}

impl StreamedCells {
    /// The boxes of the visible cells of all bricks.
    pub(crate) fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.index.bounds()
    }
}
