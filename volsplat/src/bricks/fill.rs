//! From volumes to bricks of cells: which cells are kept, their scalars, gradients and masks.
//!
//! The options decide which cells are kept: those that a transfer function shows, all of them where a
//! statistic of the whole ray is wanted, those that hold the scalar of a surface. A viewer keeps all bricks of a scene of scalars: a brick's
//! scalars do not depend on the transfer function, so that another one only tests
//! which cells may be seen, and adds gradients to bricks that lack them. A brick that is
//! shown is the one that a preparation for this function alone would make.

use std::cmp::Ordering;

use glam::DMat3;
use rayon::prelude::*;
use resample_volume::volume::{Grid, Volume, Voxels, scalar, with_voxels};

use crate::Error;
use crate::bricks::cells::{
    BrickChannel, CELL_SIDE, CellBrick, CellField, Gradients, Scalars, ShownCells, TABLE_LEN,
    VERTEX_SIDE, WithGradients, differences, vectors, vertex,
};
use crate::bricks::smooth::Smoothing;
use crate::bricks::support::{CellRanges, Support, box_of, cells_of, take_in, unmasked};
use crate::grid::{Bounds, brick_corners, gradient_from_differences};
use crate::look::options::{Blend, GradientFilter, RenderOptions};
use crate::look::palette::Palette;
use crate::look::scene::{Channel, Look, Scene};
use crate::look::transfer::TransferFunction;
use crate::slabs::settings::ChannelSettings;

/// Returns the plan from which the bricks of a scene are made.
pub(crate) fn plan<'a>(scene: &Scene<'a>, options: &RenderOptions) -> Result<FieldPlan<'a>, Error> {
    Ok(FieldPlan {
        channels: scene
            .channels
            .iter()
            .map(|channel| {
                Ok(PlannedChannel {
                    volume: channel.volume,
                    shown: shown(channel, options)?,
                })
            })
            .collect::<Result<_, Error>>()?,
        mask: scene.mask,
        gradients: gradients(options, &scene.channels[0].volume.world_from_index.matrix3),
    })
}

impl FieldPlan<'_> {
    /// The plan for samples that are classified by the tables of these channels.
    pub(crate) fn tabulated(mut self, channels: &[ChannelSettings]) -> Self {
        for (planned, channel) in self.channels.iter_mut().zip(channels) {
            if let Shown::Scalars(support) = &mut planned.shown {
                *support = support.clone().tabulated(channel.table.step_of_entries());
            }
        }
        self
    }
}

/// The gradients that the bricks of a grid with these axes need.
pub(crate) fn gradients(options: &RenderOptions, axes: &DMat3) -> WithGradients {
    if !options.follows_gradient() {
        return WithGradients::No;
    }
    let smoothing = match options.used_gradient_filter() {
        GradientFilter::Smooth => Smoothing::new(axes),
        GradientFilter::Central => None,
    };
    smoothing.map_or(WithGradients::Central, WithGradients::Smooth)
}

/// The scalars that are seen.
pub(crate) fn support(transfer: &TransferFunction, options: &RenderOptions) -> Support {
    match options.blend() {
        Blend::Emission => Support::new(transfer),
        Blend::Isosurface(iso) => Support::of(iso.value as f32),
        Blend::Maximum | Blend::Minimum | Blend::Average => Support::everything(),
    }
}

fn shown(channel: &Channel, options: &RenderOptions) -> Result<Shown, Error> {
    Ok(match channel.look {
        Look::Labels(labels) => {
            let palette = Palette::new(channel.volume, labels)?;
            let strengths = palette
                .entries(options.opacity)
                .iter()
                .map(|entry| entry[3])
                .collect();
            Shown::Labels(palette, strengths)
        }
        Look::Transfer(transfer) => Shown::Scalars(support(transfer, options)),
        Look::Tint(_) => Shown::Scalars(Support::nothing()),
    })
}

/// A sample needs a cell around it.
pub(crate) fn check_dims(dims: [usize; 3]) -> Result<(), Error> {
    let Some(axis) = dims.iter().position(|&n| n < 2) else {
        return Ok(());
    };
    Err(Error::Option(format!(
        "the field renderer needs at least 2 voxels along each axis ({} has 1); use order every-sample",
        ["x", "y", "z"][axis]
    )))
}

/// The input of a field.
pub(crate) struct FieldPlan<'a> {
    /// At least one; all of one size.
    pub(crate) channels: Vec<PlannedChannel<'a>>,
    pub(crate) mask: Option<&'a Volume>,
    pub(crate) gradients: WithGradients,
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

    /// A value for each vertex, made from its voxel, and their range; `least` and `greatest` stand for no value.
    fn filled<T: Copy, V: Copy + Default + PartialOrd>(
        &self,
        grid: &Grid<T>,
        value: impl Fn(T) -> V,
        [least, greatest]: [V; 2],
    ) -> ([V; TABLE_LEN], [V; 2]) {
        let mut table = [V::default(); TABLE_LEN];
        let (mut lows, mut highs) = ([least; VERTEX_SIDE], [greatest; VERTEX_SIDE]);
        self.for_each_row(grid, |place, row| {
            let entries = &mut table[place..place + VERTEX_SIDE];
            // A row of a whole brick has a known length, and is compared at once.
            match row.first_chunk::<VERTEX_SIDE>() {
                Some(row) => {
                    for x in 0..VERTEX_SIDE {
                        entries[x] = value(row[x]);
                    }
                    take_in(&mut lows, &mut highs, entries);
                }
                None => {
                    for (entry, &voxel) in entries.iter_mut().zip(row) {
                        *entry = value(voxel);
                    }
                    take_in(
                        &mut lows[..row.len()],
                        &mut highs[..row.len()],
                        &entries[..row.len()],
                    );
                }
            }
        });
        let low = lows
            .into_iter()
            .fold(least, |a, b| if b < a { b } else { a });
        let high = highs
            .into_iter()
            .fold(greatest, |a, b| if b > a { b } else { a });
        (table, [low, high])
    }

    /// Calls `visit` with each row of vertices: the place of its first in the tables, and its voxels.
    fn for_each_row<T: Copy>(&self, grid: &Grid<T>, mut visit: impl FnMut(usize, &[T])) {
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
        let tables: Vec<(Scalars, [f32; 2])> =
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
        let cells = tables.iter().map(|(table, range)| (table, *range));
        let (bounds, shown) = self.shown_cells(block, cells, mask.as_deref())?;
        let with_gradients =
            |(channel, (scalars, range)): (&PlannedChannel, (Scalars, [f32; 2]))| {
                let gradients = self.gradients_of(channel, &bounds);
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
            scalars,
            gradients,
            range,
            more: channels.collect(),
            shown,
            mask,
        })
    }

    /// The box of the cells that are seen, and the cells that samples may be seen in; `None` where there are none.
    fn shown_cells<'a>(
        &self,
        block: &Block,
        tables: impl Iterator<Item = (&'a Scalars, [f32; 2])>,
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

/// Bytes that are compared at once: a row of a block and some beside it.
const WIDE: usize = 16;

impl PlannedChannel<'_> {
    /// Returns true if nothing of a block is seen: of bytes, without a table of them.
    fn is_surely_empty(&self, block: &Block) -> bool {
        let (Voxels::U8(voxels), Shown::Scalars(support)) = (&self.volume.voxels, &self.shown)
        else {
            return false;
        };
        let [columns, rows, _] = self.volume.dims;
        let [first_x, first_y, first_z] = block.corner.map(|c| c as usize);
        let (mut lows, mut highs) = ([u8::MAX; WIDE], [0u8; WIDE]);
        for z in first_z..=first_z + block.size[2] {
            for y in first_y..=first_y + block.size[1] {
                let row = &voxels[first_x + columns * (y + rows * z)..];
                match row.first_chunk::<WIDE>() {
                    Some(row) => take_in(&mut lows, &mut highs, row),
                    None => take_in(&mut lows, &mut highs, row),
                }
            }
        }
        // What lies beside the block was taken in beside it.
        let own = 0..=block.size[0];
        let least = lows[own.clone()].iter().fold(u8::MAX, |a, &b| a.min(b));
        let greatest = highs[own].iter().fold(0, |a, &b| a.max(b));
        !support.meets(f32::from(least), f32::from(greatest))
    }

    /// The scalars of a block, or the numbers of its labels, and their range.
    fn scalars(&self, block: &Block) -> (Scalars, [f32; 2]) {
        let dims = self.volume.dims;
        if let Some(voxels) = self.bytes() {
            let grid = Grid { voxels, dims };
            let (bytes, range) = block.filled(&grid, |byte| byte, [u8::MAX, 0]);
            return (Scalars::of_bytes(&bytes), range.map(f32::from));
        }
        let none = [f32::INFINITY, f32::NEG_INFINITY];
        let (table, range) = with_voxels!(&self.volume.voxels, slice => {
            let grid = Grid { voxels: slice, dims };
            match &self.shown {
                Shown::Scalars(_) => block.filled(&grid, |voxel| scalar(voxel) as f32, none),
                Shown::Labels(palette, _) => {
                    block.filled(&grid, |voxel| palette.number(scalar(voxel)), none)
                }
            }
        });
        (Scalars::Numbers(Box::new(table)), range)
    }

    /// The voxels, where they are bytes that stand for themselves.
    fn bytes(&self) -> Option<&[u8]> {
        match (&self.volume.voxels, &self.shown) {
            (Voxels::U8(voxels), Shown::Scalars(_)) => Some(voxels),
            _ => None,
        }
    }
}

impl FieldPlan<'_> {
    /// The gradients of a channel at the vertices of a block up to the greatest that is seen; `None` where they change nothing.
    fn gradients_of(&self, channel: &PlannedChannel, bounds: &Bounds) -> Option<Gradients> {
        let smoothing = match &self.gradients {
            WithGradients::No => return None,
            WithGradients::Central => None,
            WithGradients::Smooth(smoothing) => Some(smoothing),
        };
        let dims = channel.volume.dims;
        let axes = |volume: &Volume| volume.world_from_index.matrix3;
        let own_axes = axes(channel.volume);
        // A frame makes gradients of differences by the axes of the first channel.
        if let (None, Some(voxels), true) = (
            smoothing,
            channel.bytes(),
            own_axes == axes(self.channels[0].volume),
        ) {
            return Some(differences(&Grid { voxels, dims }, bounds));
        }
        let to_world = gradient_from_differences(&own_axes);
        Some(with_voxels!(&channel.volume.voxels, slice => {
            let grid = Grid { voxels: slice, dims };
            match &channel.shown {
                Shown::Scalars(_) => {
                    vectors(&grid, |value| value as f32, bounds, (&to_world, smoothing))
                }
                // Labels rise and fall with their visible part.
                Shown::Labels(palette, strengths) => {
                    let strength = |value| strengths[palette.number(value) as usize];
                    vectors(&grid, strength, bounds, (&to_world, smoothing))
                }
            }
        }))
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
    fn cells(&self, scalars: &Scalars, range: [f32; 2]) -> [ShownCells; 2] {
        match self {
            Self::Scalars(support) => support.cells(scalars, range),
            Self::Labels(..) => {
                let drawn = CellRanges::new(scalars).select(|_, greatest| greatest > 0.0);
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

    /// Drops all gradients, so that the next plan makes its own.
    pub(crate) fn forget_gradients(&mut self) {
        for brick in self.bricks.iter_mut().chain(&mut self.spare) {
            brick.gradients = None;
            brick
                .more
                .iter_mut()
                .for_each(|channel| channel.gradients = None);
        }
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
        self.add_gradients(brick, &block);
    }

    /// Gradients at all vertices of a brick that has none.
    fn add_gradients(&self, brick: &mut CellBrick, block: &Block) {
        let whole = Bounds::of_range(block.corner, [[0; 3], block.size.map(|cells| cells as u8)]);
        let tables = std::iter::once(&mut brick.gradients)
            .chain(brick.more.iter_mut().map(|channel| &mut channel.gradients));
        for (channel, table) in self.channels.iter().zip(tables) {
            if table.is_none() {
                *table = self.gradients_of(channel, &whole);
            }
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
