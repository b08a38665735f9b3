//! Volumes that are larger than memory: surveyed once, and read in blocks of bricks.
//!
//! Takes a source of voxels, reads it once from end to end, and keeps its place in the world, the counts of its values (of all values where
//! the type has few, else their range and then one more reading for the histogram),
//! and the least and greatest scalar of every brick of cells; they equal those of a volume in memory. A transfer function then decides
//! which bricks can be seen without another look at the source.
//! A brick of cells shares its last vertices with the next, so neighbouring blocks overlap by one voxel. Blocks are whole rows of bricks
//! along x, as the file is ordered: a row of bricks is read in pieces as long as a line of voxels.

use std::ops::Range;
use std::sync::Arc;

use glam::DAffine3;
use rayon::prelude::*;
use resample_volume::Watch;
use resample_volume::volume::histogram::Tally;
use resample_volume::volume::{
    Described, Grid, Lattice, Volume, VoxelType, Voxels, scalar, with_voxels,
};

use crate::Error;
use crate::bricks::cells::{CELL_SIDE, CellBrick};
use crate::bricks::fill::{gradients, least_and_greatest};
use crate::bricks::rescale::Narrowing;
use crate::look::options::RenderOptions;
use crate::look::scene::VisibleValues;
use crate::look::transfer::Histogram;
use crate::shadow::tables;

pub use resample_volume::source::{Region, VoxelSource};

/// Rows of bricks of one layer, to be read together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Rows {
    /// Bricks along z before this layer.
    pub(crate) layer: usize,
    /// Rows of bricks along y.
    pub(crate) rows: Range<usize>,
}

/// Voxels of some rows of bricks, read.
pub(crate) struct Block {
    pub(crate) region: Region,
    /// The voxels as a volume of their own, with the axes of the whole.
    pub(crate) volume: Volume,
}

/// Bricks of cells along each axis.
pub(crate) fn bricks_along(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| (n - 1).div_ceil(CELL_SIDE))
}

/// All rows in the order of the file, cut so that one block of voxels takes at most `max_bytes`, but never less than a row.
pub(crate) fn blocks(stored: &dyn VoxelSource, max_bytes: u64) -> Vec<Rows> {
    let dims = stored.dims();
    let [_, rows, layers] = bricks_along(dims);
    let line_bytes = (dims[0] * stored.voxel_type().bytes()) as u64;
    let row_bytes = line_bytes * (CELL_SIDE * (CELL_SIDE + 1)) as u64;
    let rows_each = ((max_bytes / row_bytes.max(1)) as usize).clamp(1, rows.max(1));
    let cut = move |layer| {
        (0..rows).step_by(rows_each).map(move |first| Rows {
            layer,
            rows: first..(first + rows_each).min(rows),
        })
    };
    (0..layers).flat_map(cut).collect()
}

impl Rows {
    /// The voxels of the bricks `columns` of these rows, and `margin` more along each axis on either side, where the volume goes on.
    pub(crate) fn region(
        &self,
        dims: [usize; 3],
        columns: &Range<usize>,
        margin: [usize; 3],
    ) -> Region {
        let spans = [
            columns.clone(),
            self.rows.clone(),
            self.layer..self.layer + 1,
        ];
        let first: [usize; 3] = std::array::from_fn(|axis| {
            (spans[axis].start * CELL_SIDE).saturating_sub(margin[axis])
        });
        let end = |axis: usize| (spans[axis].end * CELL_SIDE + 1 + margin[axis]).min(dims[axis]);
        Region {
            first,
            size: std::array::from_fn(|axis| end(axis) - first[axis]),
        }
    }

    /// Reads these rows from end to end.
    pub(crate) fn read(&self, stored: &dyn VoxelSource, margin: usize) -> Result<Block, Error> {
        let dims = stored.dims();
        Block::read(
            stored,
            self.region(dims, &(0..bricks_along(dims)[0]), [margin; 3]),
            DAffine3::IDENTITY,
        )
    }
}

impl Block {
    /// Reads a box of voxels of a volume with these axes.
    pub(crate) fn read(
        stored: &dyn VoxelSource,
        region: Region,
        world_from_index: DAffine3,
    ) -> Result<Self, Error> {
        let voxels = stored.read(&region)?;
        let volume = Volume {
            dims: region.size,
            voxels,
            world_from_index,
            up_hint: None,
            space: None,
            modality: None,
            unit: None,
            window: None,
        };
        Ok(Self { region, volume })
    }

    /// The place in this block of a vertex of the volume, given as the number of its brick along each axis.
    pub(crate) fn corner(&self, brick: [usize; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| (brick[axis] * CELL_SIDE - self.region.first[axis]) as u32)
    }

    /// Counts the visible voxels that are a brick's own, not the next one's. `corner` is its first vertex in the block.
    pub(crate) fn count_own(
        &self,
        dims: [usize; 3],
        corner: [u32; 3],
        values: &VisibleValues,
    ) -> u64 {
        let spans: [Range<usize>; 3] = std::array::from_fn(|axis| {
            let first = corner[axis] as usize;
            let last = self.region.first[axis] + first + CELL_SIDE + 1 >= dims[axis];
            first..if last {
                dims[axis] - self.region.first[axis]
            } else {
                first + CELL_SIDE
            }
        });
        let [columns, rows, _] = self.region.size;
        let [x, y, z] = spans;
        let lines = z.flat_map(|z| y.clone().map(move |y| columns * (y + rows * z)));
        with_voxels!(&self.volume.voxels, slice => lines
            .map(|line| {
                let part = &slice[line + x.start..line + x.end];
                part.iter().filter(|&&value| values.shows(scalar(value))).count() as u64
            })
            .sum())
    }

    /// Returns true if a voxel, counted in the block, is this block's own: the last ones along y and z are the next block's,
    /// except at the end of the volume. Made without a margin.
    fn owns_line(&self, dims: [usize; 3], [y, z]: [usize; 2]) -> bool {
        let own = |axis: usize, at: usize| {
            let Region { first, size } = self.region;
            at + 1 < size[axis] || first[axis] + size[axis] == dims[axis]
        };
        own(1, y) && own(2, z)
    }
}

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

/// A volume whose voxels stay in their file.
#[derive(Debug)]
pub struct LargeVolume {
    lattice: Lattice,
    source: Arc<dyn VoxelSource>,
    survey: Survey,
    max_memory: u64,
}

impl LargeVolume {
    /// Reads a source once, holding at most about `max_memory` bytes.
    ///
    /// [`Error::Option`] where `max_memory` is too little for any brick-wise work, or the lattice is degenerate.
    pub fn new(
        lattice: Lattice,
        source: Arc<dyn VoxelSource>,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        lattice.check()?;
        let survey = Survey::new(source.as_ref(), max_memory, watch)?;
        Ok(Self {
            lattice,
            source,
            survey,
            max_memory,
        })
    }

    /// Reads a volume file once, holding at most about `max_memory` bytes.
    ///
    /// `None` for a file that has to be unpacked as a whole, which [`crate::load`] does. Errors are those of
    /// [`crate::load`]; [`Error::Option`] also where `max_memory` is too little for any brick-wise work, and where the
    /// temporary file of a Zarr array has no room.
    #[cfg(feature = "input")]
    pub fn open(
        path: &std::path::Path,
        options: &crate::LoadOptions,
        max_memory: u64,
        watch: &mut Watch,
    ) -> Result<Option<Self>, Error> {
        // Unpacking, where there is any, is the first half of the work.
        let mut begun = 0.0;
        let mut unpacking = |share: f64| {
            begun = 0.5;
            watch(begun * share);
        };
        let opened =
            resample_volume::input::open_unread(path, options, max_memory, &mut unpacking)?;
        let Some(unread) = opened else {
            return Ok(None);
        };
        let mut reading = |share| watch(begun + (1.0 - begun) * share);
        Self::new(unread.lattice, unread.source, max_memory, &mut reading).map(Some)
    }

    /// Bytes that the voxels take in the file.
    pub fn bytes(&self) -> u64 {
        self.lattice.len() as u64 * self.source.voxel_type().bytes() as u64
    }

    /// The memory that was allowed, bytes.
    pub fn max_memory(&self) -> u64 {
        self.max_memory
    }

    pub(crate) fn source(&self) -> &Arc<dyn VoxelSource> {
        &self.source
    }

    /// The rescaling of its scalars.
    pub(crate) fn narrowing(&self) -> Narrowing {
        self.survey.narrowing
    }

    /// Least and greatest scalar, as they are drawn.
    pub(crate) fn drawn_range(&self) -> (f64, f64) {
        self.survey.narrowing.range(self.survey.range)
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey
    }
}

impl Described for LargeVolume {
    fn lattice(&self) -> Lattice {
        self.lattice.clone()
    }

    fn voxel_type(&self) -> VoxelType {
        match self.source.voxel_type() {
            VoxelType::U64 | VoxelType::I64 => VoxelType::F64,
            held => held,
        }
    }

    fn value_range(&self) -> (f64, f64) {
        self.survey.range
    }

    fn histogram(&self) -> Histogram {
        self.survey.histogram.clone()
    }
}

/// Most memory that image sheets take beside the voxels, bytes: the bricks of a volume that is visible everywhere, and the light in them.
pub fn most_brick_bytes(lattice: &Lattice, voxel_type: VoxelType, options: &RenderOptions) -> u64 {
    // A forged size may be beyond all counting; no memory is as large.
    let along = bricks_along(lattice.dims).into_iter();
    let bricks = along.fold(1u64, |count, bricks| count.saturating_mul(bricks as u64));
    let gradients = gradients(options, &lattice.world_from_index.matrix3);
    let of_brick = CellBrick::bytes(voxel_type, &gradients) + tables::brick_bytes(options);
    bricks.saturating_mul(of_brick)
}
