//! Blocks: whole rows of bricks of cells, as many as are read from a file at once.
//!
//! A brick of cells shares its last vertices with the next, so neighbouring blocks overlap by one voxel. Rows go all
//! along x, as the file does: a row of bricks is read in pieces as long as a line of voxels.

use std::ops::Range;

use glam::DAffine3;
use resample_volume::source::{Region, VoxelSource};
use resample_volume::volume::{Volume, scalar, with_voxels};

use crate::Error;
use crate::bricks::cells::CELL_SIDE;
use crate::look::visible_values::VisibleValues;

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
    /// The voxels of the bricks `columns` of these rows, and `margin` more on each side where the volume goes on.
    pub(crate) fn region(&self, dims: [usize; 3], columns: &Range<usize>, margin: usize) -> Region {
        let spans = [
            columns.clone(),
            self.rows.clone(),
            self.layer..self.layer + 1,
        ];
        let first: [usize; 3] =
            std::array::from_fn(|axis| (spans[axis].start * CELL_SIDE).saturating_sub(margin));
        let end = |axis: usize| (spans[axis].end * CELL_SIDE + 1 + margin).min(dims[axis]);
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
            self.region(dims, &(0..bricks_along(dims)[0]), margin),
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
    pub(crate) fn owns_line(&self, dims: [usize; 3], [y, z]: [usize; 2]) -> bool {
        let own = |axis: usize, at: usize| {
            let Region { first, size } = self.region;
            at + 1 < size[axis] || first[axis] + size[axis] == dims[axis]
        };
        own(1, y) && own(2, z)
    }
}
