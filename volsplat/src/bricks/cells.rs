//! Cells: the space between eight voxels each, in bricks that hold at least one visible scalar.
//!
//! The other way to keep a field: where a sheet's sum is gathered, sample by sample, a brick stores the scalars at all
//! its vertices side by side, so that the eight that a sample needs are a few cache lines apart. Bricks whose cells
//! hold no visible scalar are dropped, and the others know the box of their visible cells. Further channels and a mask go
//! with the brick, in tables of the same layout.

use crate::bricks::gradients::Gradients;
pub(crate) use crate::bricks::layout::{
    CELL_CORNERS, CELL_ROWS, CELL_SIDE, CELLS, FACES, FaceBytes, LAST_CELL, TABLE_LEN, Table,
    VERTEX_SIDE,
};
use crate::bricks::scalars::Scalars;
use crate::grid::bounds::Bounds;
use resample_volume::volume::VoxelType;

/// The bricks of a volume that hold visible cells.
#[derive(Clone, Debug)]
pub(crate) struct CellField {
    /// Those that are shown, in Morton order.
    pub(crate) bricks: Vec<CellBrick>,
    /// The others in the same order, where all are kept so that other functions may show them; else none.
    pub(crate) spare: Vec<CellBrick>,
    /// Bricks that are not shown.
    pub(crate) empty: u64,
    pub(crate) non_transparent: u64,
    pub(crate) voxels: u64,
}

/// A brick of cells.
#[derive(Clone, Debug)]
pub(crate) struct CellBrick {
    /// The box of the visible cells: the brick's first voxel, and the least and greatest vertex.
    pub(crate) bounds: Bounds,
    /// Scalars at the vertices. Of labels, their numbers in a palette.
    pub(crate) scalars: Scalars,
    /// The scalar's gradient at the vertices; only where it was asked for.
    pub(crate) gradients: Option<Gradients>,
    /// Least and greatest scalar at the vertices.
    pub(crate) range: [f32; 2],
    /// The channels after the first.
    pub(crate) more: Vec<BrickChannel>,
    /// The cells of the box that may be visible.
    pub(crate) shown: ShownCells,
    /// 1 at vertices that the mask shows, 0 at others; `None` where it shows all of them.
    pub(crate) mask: Option<Box<[u8; TABLE_LEN]>>,
}

/// A bit for each cell of a brick: a byte for each row of cells along x, rows along y first.
#[derive(Clone, Debug)]
pub(crate) struct ShownCells {
    rows: [u8; CELL_ROWS],
}

impl ShownCells {
    /// The cells of these rows.
    pub(crate) fn of_rows(rows: [u8; CELL_ROWS]) -> Self {
        Self { rows }
    }

    /// No cell.
    pub(crate) fn none() -> Self {
        Self::of_rows([0; CELL_ROWS])
    }

    /// Every cell.
    pub(crate) fn all() -> Self {
        Self {
            rows: [u8::MAX; CELL_ROWS],
        }
    }

    /// Every cell between the least and the greatest vertex.
    pub(crate) fn between(bounds: &Bounds) -> Self {
        let [least, greatest] = bounds.range().map(|end| end.map(usize::from));
        let along_x = (least[0]..greatest[0]).fold(0, |cells, x| cells | 1 << x);
        let mut rows = [0; CELL_ROWS];
        for z in least[2]..greatest[2] {
            rows[z * CELL_SIDE..][least[1]..greatest[1]].fill(along_x);
        }
        Self { rows }
    }

    /// Those that are in either.
    pub(crate) fn or(mut self, other: &Self) -> Self {
        for (row, more) in self.rows.iter_mut().zip(other.rows) {
            *row |= more;
        }
        self
    }

    /// Those that are in both.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        for (row, less) in self.rows.iter_mut().zip(other.rows) {
            *row &= less;
        }
        self
    }

    /// Returns true if there is one.
    pub(crate) fn any(&self) -> bool {
        self.rows != [0; CELL_ROWS]
    }

    /// The rows, a bit for each cell.
    #[inline(always)]
    pub(crate) fn rows(&self) -> &[u8; CELL_ROWS] {
        &self.rows
    }
}

/// One channel of a brick; the fields are those of [`CellBrick`].
#[derive(Clone, Debug)]
pub(crate) struct BrickChannel {
    pub(super) scalars: Scalars,
    pub(super) gradients: Option<Gradients>,
    pub(super) range: [f32; 2],
}

/// One channel of a brick, lent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChannelCells<'a> {
    pub(crate) scalars: &'a Scalars,
    pub(crate) gradients: Option<&'a Gradients>,
    pub(crate) range: [f32; 2],
}

/// Returns true if bricks carry gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WithGradients {
    No,
    Yes,
}

impl CellBrick {
    /// Bytes that a brick of one channel of scalars of this type takes.
    pub(crate) fn bytes(voxel_type: VoxelType, gradients: WithGradients) -> u64 {
        let are_bytes = voxel_type == VoxelType::U8;
        let vectors = match gradients {
            WithGradients::No => 0,
            WithGradients::Yes => Gradients::size(are_bytes),
        };
        (size_of::<Self>() + Scalars::size(are_bytes) + vectors) as u64
    }

    /// A channel by its number.
    #[inline(always)]
    pub(crate) fn channel(&self, number: usize) -> ChannelCells<'_> {
        match number.checked_sub(1) {
            None => ChannelCells {
                scalars: &self.scalars,
                gradients: self.gradients.as_ref(),
                range: self.range,
            },
            Some(place) => {
                let channel = &self.more[place];
                ChannelCells {
                    scalars: &channel.scalars,
                    gradients: channel.gradients.as_ref(),
                    range: channel.range,
                }
            }
        }
    }
}

/// Least and greatest scalar of a cell's corners; `first` is the place of its first vertex.
pub(crate) fn cell_range(scalars: &Scalars, first: usize) -> [f32; 2] {
    let corners = scalars.corners(first).into_iter();
    corners.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}
