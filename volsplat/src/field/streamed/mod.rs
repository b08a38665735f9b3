//! Cells of a volume that stays in its file: an index of the bricks that can be seen, and the bricks when they are needed.
//!
//! Takes a surveyed volume and a transfer function. The bricks whose range of scalars the function may show are read
//! once, for the box of their visible cells; as many as fit the memory stay, in the type of the file. A frame goes through
//! the layers of bricks from the eye away (`frame.rs`) and reads those that it still lacks, a row of bricks at a time, unless they are hidden.
//! Limits: one channel of scalars and no mask.

mod frame;
mod light;

use std::sync::Arc;

use glam::DAffine3;
use rayon::prelude::*;
use resample_volume::Watch;
use resample_volume::volume::{Described, VoxelType, Voxels, scalar, with_voxels};

use crate::Error;
use crate::bricks::cells::{
    CELL_SIDE, CellBrick, CellField, Scalars, ShownCells, TABLE_LEN, WithGradients,
};
use crate::bricks::fill::{FieldPlan, PlannedChannel, Shown, gradients, support};
use crate::bricks::rescale::Narrowing;
use crate::bricks::support::Support;
use crate::grid::Bounds;
use crate::large::{Block, LargeVolume, Rows, VoxelSource, bricks_along};
use crate::look::options::RenderOptions;
use crate::look::scene::VisibleValues;
use crate::look::transfer::TransferFunction;
use crate::shadow::tables;
use crate::slabs::table::TransferTable;

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
    /// Matter on a coarse grid while light is found in it: before batches and tiles take theirs. A third of it stays.
    light: u64,
}

impl Budget {
    /// Shares of the whole: guesses, but their sum leaves room. The index is checked to take at most a sixth.
    fn new(total: u64) -> Self {
        Self {
            total,
            packed: total / 4,
            batch: total / 8,
            tiles: total / 4,
            light: total / 8 * 3,
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
            gradients: gradients(options, &lattice.world_from_index.matrix3),
            world_from_index: lattice.world_from_index,
            narrowing: volume.narrowing(),
        };
        let meets = |range: &[f32; 2]| reader.support.meets(range[0], range[1]);
        let seen: Vec<bool> = volume.survey().bricks.par_iter().map(meets).collect();
        let count = seen.iter().filter(|seen| **seen).count() as u64;
        let bytes = count * (reader.brick_bytes() + tables::brick_bytes(options));
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
            Some(Keep::Packed) if matches!(self.reader.gradients, WithGradients::No) => {
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
    /// Bricks of one row, by their places in it, and how many of them were read from the file.
    fn load_row(
        &self,
        at: [usize; 2],
        bricks: impl Iterator<Item = (usize, IndexedBrick)>,
    ) -> Result<(Vec<CellBrick>, u64), Error> {
        if let Some(packed) = &self.packed[self.index.row_number(at)] {
            let unpacked = bricks.map(|(place, brick)| packed.brick(place, &brick, at));
            return Ok((unpacked.collect(), 0));
        }
        let columns: Vec<u16> = bricks.map(|(_, brick)| brick.column).collect();
        let read = self.reader.read(at, &columns)?;
        let read = read.bricks.into_iter().flatten();
        Ok((read.collect(), columns.len() as u64))
    }

    /// The boxes of the visible cells of all bricks.
    pub(crate) fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.index.bounds()
    }
}

/// A brick in its row.
#[derive(Clone, Copy, Debug)]
struct IndexedBrick {
    /// Its number along x.
    column: u16,
    /// Least and greatest vertex of the visible cells along each axis.
    range: [[u8; 3]; 2],
}

/// The visible bricks, x fastest.
#[derive(Clone, Debug)]
struct BrickIndex {
    /// Bricks along each axis, seen or not.
    along: [usize; 3],
    bricks: Vec<IndexedBrick>,
    /// Where each row begins, and the end.
    starts: Vec<usize>,
}

impl IndexedBrick {
    fn of(bounds: &Bounds) -> Self {
        Self {
            column: (bounds.corner[0] as usize / CELL_SIDE) as u16,
            range: bounds.range(),
        }
    }

    /// Where its visible cells lie.
    fn bounds(&self, [layer, row]: [usize; 2]) -> Bounds {
        let corner = [usize::from(self.column), row, layer].map(|i| (i * CELL_SIDE) as u32);
        Bounds::of_range(corner, self.range)
    }
}

impl BrickIndex {
    fn new(along: [usize; 3]) -> Self {
        Self {
            along,
            bricks: Vec::new(),
            starts: vec![0],
        }
    }

    /// Adds the next row.
    fn push_row(&mut self, bricks: &[IndexedBrick]) {
        self.bricks.extend_from_slice(bricks);
        self.starts.push(self.bricks.len());
    }

    /// Number of layers, and of rows in each.
    fn layers_and_rows(&self) -> [usize; 2] {
        [self.along[2], self.along[1]]
    }

    /// The place of a row among all rows.
    fn row_number(&self, [layer, row]: [usize; 2]) -> usize {
        layer * self.along[1] + row
    }

    /// The bricks of a row.
    fn row(&self, at: [usize; 2]) -> &[IndexedBrick] {
        let number = self.row_number(at);
        &self.bricks[self.starts[number]..self.starts[number + 1]]
    }

    fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        let rows =
            (0..self.along[2]).flat_map(|layer| (0..self.along[1]).map(move |row| [layer, row]));
        rows.flat_map(|at| self.row(at).iter().map(move |brick| brick.bounds(at)))
    }

    fn bytes(&self) -> u64 {
        (size_of_val(self.bricks.as_slice()) + size_of_val(self.starts.as_slice())) as u64
    }
}

/// A reader of rows of bricks.
#[derive(Clone, Debug)]
struct RowReader {
    stored: Arc<dyn VoxelSource>,
    /// The visible scalars.
    support: Support,
    gradients: WithGradients,
    world_from_index: DAffine3,
    /// From the scalars of the file to those that are drawn.
    narrowing: Narrowing,
}

/// The scalars of some bricks, [`TABLE_LEN`] for each, in the type of the file where that is small.
#[derive(Clone, Debug)]
struct Packed {
    values: Voxels,
    /// The range of each brick.
    ranges: Vec<[f32; 2]>,
}

/// Bricks of a row, and the voxels that they were made from.
struct RowRead {
    /// For each column that was asked for; `None` where no cell is seen.
    bricks: Vec<Option<CellBrick>>,
    /// `None` where no column was asked for.
    block: Option<Block>,
}

impl RowReader {
    /// Bytes of memory of a brick.
    fn brick_bytes(&self) -> u64 {
        CellBrick::bytes(self.stored.voxel_type(), &self.gradients)
    }

    /// Reads what the bricks `columns` of a row need, and makes them.
    fn read(&self, [layer, row]: [usize; 2], columns: &[u16]) -> Result<RowRead, Error> {
        let (Some(&first), Some(&last)) = (columns.first(), columns.last()) else {
            return Ok(RowRead {
                bricks: Vec::new(),
                block: None,
            });
        };
        let rows = Rows {
            layer,
            rows: row..row + 1,
        };
        let region = rows.region(
            self.stored.dims(),
            &(first.into()..usize::from(last) + 1),
            self.gradients.margin(),
        );
        let mut block = Block::read(self.stored.as_ref(), region, self.world_from_index)?;
        if self.narrowing != Narrowing::NONE {
            block.volume = self.narrowing.volume(&block.volume);
        }
        let plan = FieldPlan {
            channels: vec![PlannedChannel {
                volume: &block.volume,
                shown: Shown::Scalars(self.support.clone()),
            }],
            mask: None,
            gradients: self.gradients.clone(),
        };
        let brick = |&column: &u16| {
            let mut brick = plan.brick_at(block.corner([column.into(), row, layer]))?;
            for (corner, first) in brick.bounds.corner.iter_mut().zip(region.first) {
                *corner += first as u32;
            }
            Some(brick)
        };
        Ok(RowRead {
            bricks: columns.iter().map(brick).collect(),
            block: Some(block),
        })
    }
}

impl Packed {
    /// Packs the scalars of bricks that came from voxels of this type, which gives them back unchanged.
    fn new(voxel_type: VoxelType, bricks: &[CellBrick]) -> Self {
        let scalars = || bricks.iter().flat_map(|brick| brick.scalars.numbers());
        let values = match voxel_type {
            VoxelType::U8 => Voxels::U8(scalars().map(|v| v as u8).collect()),
            VoxelType::I8 => Voxels::I8(scalars().map(|v| v as i8).collect()),
            VoxelType::U16 => Voxels::U16(scalars().map(|v| v as u16).collect()),
            VoxelType::I16 => Voxels::I16(scalars().map(|v| v as i16).collect()),
            // Bricks hold f32, whatever the file does.
            _ => Voxels::F32(scalars().collect()),
        };
        Self {
            values,
            ranges: bricks.iter().map(|brick| brick.range).collect(),
        }
    }

    /// One of the bricks, by its place.
    fn brick(&self, place: usize, brick: &IndexedBrick, at: [usize; 2]) -> CellBrick {
        let mut scalars = Box::new([0.0; TABLE_LEN]);
        with_voxels!(&self.values, slice => {
            for (entry, &value) in scalars.iter_mut().zip(&slice[place * TABLE_LEN..]) {
                *entry = scalar(value) as f32;
            }
        });
        let bounds = brick.bounds(at);
        CellBrick {
            shown: ShownCells::between(&bounds),
            bounds,
            scalars: Scalars::Numbers(scalars),
            gradients: None,
            range: self.ranges[place],
            more: Vec::new(),
            mask: None,
        }
    }

    fn bytes(&self) -> u64 {
        let values = with_voxels!(&self.values, slice => size_of_val(slice.as_slice()));
        (values + size_of_val(self.ranges.as_slice())) as u64
    }
}
