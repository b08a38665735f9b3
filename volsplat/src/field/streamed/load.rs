//! Bricks out of the file, a row of them at a time; and bricks packed in the type of the file.

use std::sync::Arc;

use glam::DAffine3;
use resample_volume::volume::{VoxelType, Voxels, scalar, with_voxels};

use crate::Error;
use crate::bricks::cells::{CellBrick, ShownCells, TABLE_LEN, WithGradients};
use crate::bricks::fill::{FieldPlan, PlannedChannel, Shown};
use crate::bricks::rescale::Narrowing;
use crate::bricks::scalars::Scalars;
use crate::bricks::support::Support;
use crate::field::streamed::index::IndexedBrick;
use crate::large::VoxelSource;
use crate::large::blocks::{Block, Rows};

/// A reader of rows of bricks.
#[derive(Clone, Debug)]
pub(super) struct RowReader {
    pub(super) stored: Arc<dyn VoxelSource>,
    /// The visible scalars.
    pub(super) support: Support,
    pub(super) gradients: WithGradients,
    pub(super) world_from_index: DAffine3,
    /// From the scalars of the file to those that are drawn.
    pub(super) narrowing: Narrowing,
}

/// The scalars of some bricks, [`TABLE_LEN`] for each, in the type of the file where that is small.
#[derive(Clone, Debug)]
pub(super) struct Packed {
    values: Voxels,
    /// The range of each brick.
    ranges: Vec<[f32; 2]>,
}

/// Bricks of a row, and the voxels that they were made from.
pub(super) struct RowRead {
    /// For each column that was asked for; `None` where no cell is seen.
    pub(super) bricks: Vec<Option<CellBrick>>,
    /// `None` where no column was asked for.
    pub(super) block: Option<Block>,
}

impl RowReader {
    /// Bytes of memory of a brick.
    pub(super) fn brick_bytes(&self) -> u64 {
        CellBrick::bytes(self.stored.voxel_type(), self.gradients)
    }

    /// Reads what the bricks `columns` of a row need, and makes them.
    pub(super) fn read(&self, [layer, row]: [usize; 2], columns: &[u16]) -> Result<RowRead, Error> {
        let (Some(&first), Some(&last)) = (columns.first(), columns.last()) else {
            return Ok(RowRead {
                bricks: Vec::new(),
                block: None,
            });
        };
        // Central differences look at one voxel more.
        let margin = usize::from(self.gradients == WithGradients::Yes);
        let rows = Rows {
            layer,
            rows: row..row + 1,
        };
        let region = rows.region(
            self.stored.dims(),
            &(first.into()..usize::from(last) + 1),
            margin,
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
            gradients: self.gradients,
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
    pub(super) fn new(voxel_type: VoxelType, bricks: &[CellBrick]) -> Self {
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
    pub(super) fn brick(&self, place: usize, brick: &IndexedBrick, at: [usize; 2]) -> CellBrick {
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

    pub(super) fn bytes(&self) -> u64 {
        let values = with_voxels!(&self.values, slice => size_of_val(slice.as_slice()));
        (values + size_of_val(self.ranges.as_slice())) as u64
    }
}
