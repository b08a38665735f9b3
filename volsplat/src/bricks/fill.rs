//! From volumes to bricks of cells: which cells are kept, their scalars, gradients and masks.

use rayon::prelude::*;
use resample_volume::volume::grid::Grid;
use resample_volume::volume::{Volume, Voxels, with_voxels};

use super::cells::{
    BrickChannel, CELL_SIDE, CellBrick, CellField, FaceBytes, GradientTable, Gradients, TABLE_LEN,
    Table, VERTEX_SIDE,
};
use crate::bricks::cells::ShownCells;
use crate::bricks::faces::face_bytes;
use crate::bricks::gradients::{gradients, vertex};
use crate::bricks::shown::{CellRanges, box_of, cells_of, take_in, unmasked};
use crate::bricks::support::Support;
use crate::grid::bounds::{Bounds, brick_corners};
use crate::grid::units::gradient_from_differences;
use crate::look::palette::Palette;

/// The input of a field.
pub(crate) struct FieldPlan<'a> {
    /// At least one; all of one size.
    pub(crate) channels: Vec<PlannedChannel<'a>>,
    pub(crate) mask: Option<&'a Volume>,
    pub(crate) gradients: Gradients,
}

/// A volume and what of it is seen.
pub(crate) struct PlannedChannel<'a> {
    pub(crate) volume: &'a Volume,
    pub(crate) shown: Shown,
}

/// The visible part of a channel.
pub(crate) enum Shown {
    /// Interpolated scalars.
    Scalars(Support),
    /// The labels of a palette, with their strengths by number.
    Labels(Palette, Vec<f32>),
}

impl CellField {
    /// The bricks of a plan. `non_transparent` is counted by the caller.
    pub(crate) fn new(plan: &FieldPlan, non_transparent: u64) -> Self {
        let first = plan.channels[0].volume;
        let cells = first.dims.map(|n| n - 1);
        let corners = brick_corners(cells, CELL_SIDE);
        let count = corners.len();
        let bricks: Vec<CellBrick> = corners
            .into_par_iter()
            .filter_map(|corner| plan.brick(&Block::new(first.dims, corner)))
            .collect();
        let empty = (count - bricks.len()) as u64;
        Self {
            empty,
            ..Self::of_bricks(bricks, non_transparent, first.len() as u64)
        }
    }

    /// A field of these bricks, with the number of its visible voxels and of all.
    pub(crate) fn of_bricks(bricks: Vec<CellBrick>, non_transparent: u64, voxels: u64) -> Self {
        Self {
            bricks,
            spare: Vec::new(),
            empty: 0,
            non_transparent,
            voxels,
        }
    }
}

/// Where a brick lies in its volume.
pub(super) struct Block {
    pub(super) corner: [u32; 3],
    /// Cells along each axis.
    pub(super) size: [usize; 3],
}

impl Block {
    pub(super) fn new(dims: [usize; 3], corner: [u32; 3]) -> Self {
        let size =
            std::array::from_fn(|axis| CELL_SIDE.min(dims[axis] - 1 - corner[axis] as usize));
        Self { corner, size }
    }

    /// A value for each vertex, made from its voxel, and their range.
    fn filled<T: Copy + Into<f64>>(
        &self,
        grid: &Grid<T>,
        value: impl Fn(f64) -> f32,
    ) -> (Box<Table>, [f32; 2]) {
        let mut table = Box::new([0.0; TABLE_LEN]);
        let (mut least, mut greatest) =
            ([f32::INFINITY; VERTEX_SIDE], [-f32::INFINITY; VERTEX_SIDE]);
        self.for_each_row(grid, |place, row| {
            let entries = &mut table[place..place + VERTEX_SIDE];
            match row.first_chunk::<VERTEX_SIDE>() {
                Some(row) => {
                    for x in 0..VERTEX_SIDE {
                        entries[x] = value(row[x].into());
                    }
                    take_in(&mut least, &mut greatest, entries);
                }
                None => {
                    for (entry, &voxel) in entries.iter_mut().zip(row) {
                        *entry = value(voxel.into());
                    }
                    take_in(
                        &mut least[..row.len()],
                        &mut greatest[..row.len()],
                        &entries[..row.len()],
                    );
                }
            }
        });
        let range = [
            least.into_iter().fold(f32::INFINITY, f32::min),
            greatest.into_iter().fold(f32::NEG_INFINITY, f32::max),
        ];
        (table, range)
    }

    /// Calls `visit` with each row of vertices: the place of its first in the tables, and its voxels.
    fn for_each_row<T: Copy + Into<f64>>(
        &self,
        grid: &Grid<T>,
        mut visit: impl FnMut(usize, &[T]),
    ) {
        let [first_x, first_y, first_z] = self.corner.map(|c| c as usize);
        for z in 0..=self.size[2] {
            for y in 0..=self.size[1] {
                visit(
                    vertex(0, y, z),
                    grid.row([first_x, first_y + y, first_z + z], self.size[0] + 1),
                );
            }
        }
    }

    /// Calls `visit` with each vertex's place in the tables and its index in the volume.
    fn for_each_vertex(&self, mut visit: impl FnMut(usize, [isize; 3])) {
        for z in 0..=self.size[2] {
            for y in 0..=self.size[1] {
                for x in 0..=self.size[0] {
                    let place = [x, y, z];
                    let index = std::array::from_fn(|axis| {
                        (self.corner[axis] as usize + place[axis]) as isize
                    });
                    visit(vertex(x, y, z), index);
                }
            }
        }
    }
}

impl FieldPlan<'_> {
    /// The brick whose first vertex is `corner`; `None` where nothing of it is seen.
    pub(crate) fn brick_at(&self, corner: [u32; 3]) -> Option<CellBrick> {
        self.brick(&Block::new(self.channels[0].volume.dims, corner))
    }

    /// A brick; `None` where nothing of it is seen.
    fn brick(&self, block: &Block) -> Option<CellBrick> {
        if self.channels.iter().all(|c| c.is_surely_empty(block)) {
            return None;
        }
        let tables: Vec<(Box<Table>, [f32; 2])> =
            self.channels.iter().map(|c| c.scalars(block)).collect();
        let seen =
            |(channel, table): (&PlannedChannel, &(_, [f32; 2]))| channel.shown.meets(table.1);
        if !self.channels.iter().zip(&tables).any(seen) {
            return None;
        }
        let mask = match self.mask.map(|mask| mask_table(mask, block)) {
            Some(Masked::All) => return None,
            Some(Masked::Part(table)) => Some(table),
            Some(Masked::None) | None => None,
        };
        let cells = tables.iter().map(|(table, range)| (&**table, *range));
        let (bounds, shown) = self.shown_cells(block, cells, mask.as_deref())?;
        let with_gradients =
            |(channel, (scalars, range)): (&PlannedChannel, (Box<Table>, [f32; 2]))| {
                let gradients = match self.gradients {
                    Gradients::Without => None,
                    Gradients::With => Some(channel.gradients(&bounds)),
                };
                BrickChannel {
                    scalars,
                    gradients,
                    range,
                }
            };
        let mut channels = self.channels.iter().zip(tables).map(with_gradients);
        let BrickChannel {
            scalars,
            gradients,
            range,
        } = channels.next()?;
        Some(CellBrick {
            bounds,
            faces: self.channels[0].face_bytes(&scalars),
            scalars,
            gradients,
            range,
            more: channels.collect(),
            shown,
            mask,
        })
    }

    /// The box of the cells that are seen, and the cells that samples may be seen in; `None` where there are none.
    pub(super) fn shown_cells<'a>(
        &self,
        block: &Block,
        tables: impl Iterator<Item = (&'a Table, [f32; 2])>,
        mask: Option<&[u8; TABLE_LEN]>,
    ) -> Option<(Bounds, ShownCells)> {
        let mut all = cells_of(block.size);
        if let Some(mask) = mask {
            all = all.and(&unmasked(mask));
        }
        let (mut kept, mut near) = (ShownCells::none(), ShownCells::none());
        for (channel, (table, range)) in self.channels.iter().zip(tables) {
            let [of_kept, of_near] = channel.shown.cells(table, range);
            (kept, near) = (kept.or(&of_kept), near.or(&of_near));
        }
        let bounds = box_of(block.corner, &kept.and(&all))?;
        Some((bounds, near.and(&all).and(&ShownCells::between(&bounds))))
    }
}

impl PlannedChannel<'_> {
    /// Returns true if nothing of a block is seen: of bytes, without a table of them.
    fn is_surely_empty(&self, block: &Block) -> bool {
        let (Voxels::U8(voxels), Shown::Scalars(support)) = (&self.volume.voxels, &self.shown)
        else {
            return false;
        };
        let grid = Grid {
            voxels: voxels.as_slice(),
            dims: self.volume.dims,
        };
        let (mut least, mut greatest) = ([u8::MAX; VERTEX_SIDE], [0u8; VERTEX_SIDE]);
        block.for_each_row(&grid, |_, row| {
            // A row of a whole brick has a known length, and is compared at once.
            match row.first_chunk::<VERTEX_SIDE>() {
                Some(row) => take_in(&mut least, &mut greatest, row),
                None => take_in(&mut least[..row.len()], &mut greatest[..row.len()], row),
            }
        });
        let (least, greatest) = least
            .iter()
            .zip(greatest)
            .fold((u8::MAX, 0), |(low, high), (&l, g)| {
                (low.min(l), high.max(g))
            });
        !support.meets(f32::from(least), f32::from(greatest))
    }

    /// The bytes at the corners of each cell; `None` where voxels are more than bytes.
    fn face_bytes(&self, scalars: &Table) -> Option<Box<FaceBytes>> {
        if !matches!(
            (&self.volume.voxels, &self.shown),
            (Voxels::U8(_), Shown::Scalars(_))
        ) {
            return None;
        }
        Some(face_bytes(scalars))
    }

    /// The scalars of a block, or the numbers of its labels, and their range.
    fn scalars(&self, block: &Block) -> (Box<Table>, [f32; 2]) {
        let dims = self.volume.dims;
        with_voxels!(&self.volume.voxels, slice => {
            let grid = Grid { voxels: slice, dims };
            match &self.shown {
                Shown::Scalars(_) => block.filled(&grid, |value| value as f32),
                Shown::Labels(palette, _) => block.filled(&grid, |value| palette.number(value)),
            }
        })
    }

    /// The gradients at the vertices of a block up to the greatest that is seen.
    pub(super) fn gradients(&self, bounds: &Bounds) -> Box<GradientTable> {
        let dims = self.volume.dims;
        let to_world = gradient_from_differences(&self.volume.world_from_index.matrix3);
        with_voxels!(&self.volume.voxels, slice => {
            let grid = Grid { voxels: slice, dims };
            match &self.shown {
                Shown::Scalars(_) => gradients(&grid, |value| value as f32, bounds, &to_world),
                // Labels rise and fall with their visible part.
                Shown::Labels(palette, strengths) => {
                    let strength = |value| strengths[palette.number(value) as usize];
                    gradients(&grid, strength, bounds, &to_world)
                }
            }
        })
    }
}

impl Shown {
    /// Returns true if any of the values, from the least to the greatest, may be seen.
    #[inline(always)]
    pub(crate) fn meets(&self, range: [f32; 2]) -> bool {
        match self {
            Self::Scalars(support) => support.meets(range[0], range[1]),
            // Number 0 stands for all that is not drawn.
            Self::Labels(..) => range[1] > 0.0,
        }
    }

    /// The cells of a table with this range that are kept, and those in which samples may be seen.
    fn cells(&self, table: &Table, range: [f32; 2]) -> [ShownCells; 2] {
        match self {
            Self::Scalars(support) => support.cells(table, range),
            Self::Labels(..) => {
                let drawn = CellRanges::new(table).select(|_, greatest| greatest > 0.0);
                [drawn.clone(), drawn]
            }
        }
    }
}

/// The part of a brick that a mask hides.
enum Masked {
    None,
    All,
    Part(Box<[u8; TABLE_LEN]>),
}

fn mask_table(mask: &Volume, block: &Block) -> Masked {
    let mut table = Box::new([0; TABLE_LEN]);
    let (mut shown, mut hidden) = (false, false);
    with_voxels!(&mask.voxels, slice => {
        let grid = Grid { voxels: slice, dims: mask.dims };
        block.for_each_vertex(|place, index| {
            let is_shown = grid.stored(index) != 0.0;
            table[place] = u8::from(is_shown);
            shown |= is_shown;
            hidden |= !is_shown;
        });
    });
    match (shown, hidden) {
        (false, _) => Masked::All,
        (true, false) => Masked::None,
        (true, true) => Masked::Part(table),
    }
}

/// Least and greatest scalar at the vertices of the brick whose first vertex is `corner`.
pub(crate) fn least_and_greatest<T: Copy + Into<f64>>(
    grid: &Grid<T>,
    corner: [u32; 3],
) -> [f32; 2] {
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    Block::new(grid.dims, corner).for_each_row(grid, |_, row| {
        for &voxel in row {
            let value = voxel.into() as f32;
            range = [range[0].min(value), range[1].max(value)];
        }
    });
    range
}
