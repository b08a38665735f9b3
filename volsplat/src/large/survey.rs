//! The survey of a stored volume: one reading that collects the facts used later.
//!
//! Counts of all values where the type has few, else their range and then one more reading for the histogram; and the
//! least and greatest scalar of every brick of cells. Its results equal those of a volume in memory.

use rayon::prelude::*;
use resample_volume::Watch;
use resample_volume::source::VoxelSource;
use resample_volume::volume::Grid;
use resample_volume::volume::histogram::Tally;
use resample_volume::volume::{VoxelType, Voxels, with_voxels};

use crate::Error;
use crate::bricks::cells::CELL_SIDE;
use crate::bricks::fill::least_and_greatest;
use crate::bricks::rescale::Narrowing;
use crate::large::blocks::{Block, Rows, blocks, bricks_along};
use crate::look::transfer::Histogram;

/// Share of the memory that a block of voxels may take: it is held twice while it is put together from its slices, and
/// the ranges of the bricks need room beside it.
const BLOCK_SHARE: u64 = 16;

/// Facts of the values.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    /// Least and greatest scalar.
    pub(crate) range: (f64, f64),
    pub(crate) histogram: Histogram,
    /// How often each value occurs, where the type has few.
    pub(crate) tally: Option<Tally>,
    /// The rescaling of its scalars.
    pub(crate) narrowing: Narrowing,
    /// Least and greatest scalar, as drawn, of each brick of cells, x fastest.
    pub(crate) bricks: Vec<[f32; 2]>,
}

impl Survey {
    pub(crate) fn new(
        stored: &dyn VoxelSource,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        check_room(stored, max_memory)?;
        let blocks = blocks(stored, max_memory / BLOCK_SHARE);
        let mut bricks = Vec::new();
        let mut tally = Tally::of_type(stored.voxel_type());
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        // Types of many values need another reading or more, which the progress counts as one.
        let share = if tally.is_some() { 1.0 } else { 0.5 };
        for (done, rows) in blocks.iter().enumerate() {
            let block = rows.read(stored, 0)?;
            bricks.extend(brick_ranges(&block, rows));
            match &mut tally {
                Some(tally) => tally.add(&own_voxels(&block, stored.dims())),
                // What two blocks share changes no range.
                None => range = union(range, block.volume.voxels.finite_range()),
            }
            watch(share * (done + 1) as f64 / blocks.len() as f64);
        }
        let histogram = match &tally {
            Some(tally) => {
                range = tally.range();
                tally.histogram()
            }
            None => Passes {
                stored,
                blocks: &blocks,
            }
            .histogram(range)?,
        };
        let narrowing = Narrowing::of(stored.voxel_type(), range);
        if narrowing != Narrowing::NONE {
            // The ranges of bricks need the range of all.
            bricks.clear();
            for rows in &blocks {
                let mut block = rows.read(stored, 0)?;
                block.volume = narrowing.volume(&block.volume);
                bricks.extend(brick_ranges(&block, rows));
            }
        }
        watch(1.0);
        Ok(Self {
            range,
            histogram,
            tally,
            narrowing,
            bricks,
        })
    }
}

/// Refuses memory that does not even hold the ranges of the bricks and one row of them.
fn check_room(stored: &dyn VoxelSource, max_memory: u64) -> Result<(), Error> {
    let [x, y, z] = bricks_along(stored.dims());
    let ranges = (x * y * z * size_of::<[f32; 2]>()) as u64;
    let row = (stored.dims()[0] * stored.voxel_type().bytes() * CELL_SIDE * (CELL_SIDE + 1)) as u64;
    let needed = (4 * ranges).max(BLOCK_SHARE * row);
    if needed <= max_memory {
        return Ok(());
    }
    Err(Error::Option(format!(
        "{max_memory} bytes of memory are too little: a volume of this size takes at least {needed} bytes to be looked through"
    )))
}

/// Readings of a volume whose type has many values.
struct Passes<'a> {
    stored: &'a dyn VoxelSource,
    blocks: &'a [Rows],
}

impl Passes<'_> {
    fn histogram(&self, range: (f64, f64)) -> Result<Histogram, Error> {
        let is_integer = !matches!(
            self.stored.voxel_type(),
            VoxelType::F32 | VoxelType::F64 | VoxelType::U64 | VoxelType::I64
        );
        Histogram::refined(
            range,
            |low, high| {
                let mut sum: Option<Histogram> = None;
                self.for_each(|voxels| {
                    let part = Histogram::over(voxels, low, high, is_integer);
                    match &mut sum {
                        None => sum = Some(part),
                        Some(sum) => sum.add(&part),
                    }
                })?;
                Ok(sum.unwrap_or_else(|| {
                    Histogram::over(&Voxels::U8(Vec::new()), low, high, is_integer)
                }))
            },
            |from, to| {
                let mut range = (f64::INFINITY, f64::NEG_INFINITY);
                self.for_each(|voxels| {
                    range = union(
                        range,
                        resample_volume::volume::histogram::range_within(voxels, from, to),
                    );
                })?;
                Ok(range)
            },
        )
    }

    /// Visits every voxel once.
    fn for_each(&self, mut visit: impl FnMut(&Voxels)) -> Result<(), Error> {
        for rows in self.blocks {
            let block = rows.read(self.stored, 0)?;
            visit(&own_voxels(&block, self.stored.dims()));
        }
        Ok(())
    }
}

/// The voxels of a block that no later block holds too.
fn own_voxels(block: &Block, dims: [usize; 3]) -> Voxels {
    let [columns, rows, slices] = block.region.size;
    let lines = (0..slices).flat_map(|z| (0..rows).map(move |y| [y, z]));
    let own: Vec<usize> = lines
        .filter(|&line| block.owns_line(dims, line))
        .map(|[y, z]| (y + rows * z) * columns)
        .collect();
    block.volume.voxels.pieces(&own, columns)
}

fn brick_ranges(block: &Block, rows: &Rows) -> Vec<[f32; 2]> {
    let bricks = bricks_along(block.region.size);
    (0..rows.rows.len() * bricks[0])
        .into_par_iter()
        .map(|i| {
            let corner =
                [i % bricks[0] * CELL_SIDE, i / bricks[0] * CELL_SIDE, 0].map(|c| c as u32);
            with_voxels!(&block.volume.voxels, slice => {
                least_and_greatest(&Grid { voxels: slice, dims: block.region.size }, corner)
            })
        })
        .collect()
}

fn union(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0.min(b.0), a.1.max(b.1))
}
