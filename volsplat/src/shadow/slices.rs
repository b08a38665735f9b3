//! From bricks to slices of the grid: the number at each vertex of a slice, or NaN where no brick is shown.

use glam::DVec3;
use rayon::prelude::*;

use crate::bricks::cells::{
    CELL_SIDE, CellBrick, CellField, FromDifferences, TABLE_LEN, Table, VERTEX_SIDE,
};
use crate::light::GradientRamp;
use crate::slabs::settings::{ChannelSettings, Reading, Role};

/// The grid along two axes of its slices, and along the third.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    pub(super) across: [usize; 2],
    pub(super) along: usize,
}

impl Axes {
    /// Those of slices across an axis.
    pub(super) fn across(along: usize) -> Self {
        let across = match along {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        Self { across, along }
    }
}

/// The box of the vertices of all bricks.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexBox {
    pub(super) low: [usize; 3],
    /// The last, inclusive.
    pub(super) high: [usize; 3],
}

impl VertexBox {
    /// `None` where there is no brick.
    pub(super) fn of(field: &CellField) -> Option<Self> {
        let mut all: Option<Self> = None;
        for brick in &field.bricks {
            let [least, greatest] = brick_range(brick);
            let all = all.get_or_insert(Self {
                low: least,
                high: greatest,
            });
            for axis in 0..3 {
                all.low[axis] = all.low[axis].min(least[axis]);
                all.high[axis] = all.high[axis].max(greatest[axis]);
            }
        }
        all
    }

    /// Vertices along an axis.
    pub(super) fn len(&self, axis: usize) -> usize {
        self.high[axis] - self.low[axis] + 1
    }
}

/// Least and greatest vertex of a brick in the grid.
fn brick_range(brick: &CellBrick) -> [[usize; 3]; 2] {
    brick.bounds.range().map(|end| {
        std::array::from_fn(|axis| brick.bounds.corner[axis] as usize + usize::from(end[axis]))
    })
}

/// The slices of a field along an axis, and the bricks that have vertices in each.
pub(super) struct Stack<'a> {
    field: &'a CellField,
    pub(super) axes: Axes,
    pub(super) within: VertexBox,
    /// Bricks between the same two slices, by number.
    layers: Vec<Vec<usize>>,
}

/// A number for each vertex of the bricks, by layer.
pub(super) struct LayerTables(Vec<Vec<Table>>);

impl<'a> Stack<'a> {
    /// `None` where there is no brick.
    pub(super) fn new(field: &'a CellField, axes: Axes) -> Option<Self> {
        let mut layers: Vec<Vec<usize>> = Vec::new();
        for (number, brick) in field.bricks.iter().enumerate() {
            let layer = brick.bounds.corner[axes.along] as usize / CELL_SIDE;
            if layers.len() <= layer {
                layers.resize_with(layer + 1, Vec::new);
            }
            layers[layer].push(number);
        }
        Some(Self {
            field,
            axes,
            within: VertexBox::of(field)?,
            layers,
        })
    }

    /// Least and greatest vertex, in the grid.
    pub(super) fn ends(&self) -> [DVec3; 2] {
        let VertexBox { low, high } = self.within;
        [low, high].map(|end| DVec3::from(end.map(|at| at as f64)))
    }

    /// Number of slices.
    pub(super) fn len(&self) -> usize {
        self.within.len(self.axes.along)
    }

    /// Vertices along the sides of a slice.
    pub(super) fn sides(&self) -> [usize; 2] {
        self.axes.across.map(|axis| self.within.len(axis))
    }

    /// Vertices of a slice.
    pub(super) fn area(&self) -> usize {
        let [width, height] = self.sides();
        width * height
    }

    /// The layers that have a slice among their vertices.
    fn layers_of(&self, slice: usize) -> impl Iterator<Item = usize> {
        let slice = slice + self.within.low[self.axes.along];
        let own = slice / CELL_SIDE;
        // A slice between two layers belongs to both.
        let before = (slice.is_multiple_of(CELL_SIDE) && own > 0).then(|| own - 1);
        let end = self.layers.len();
        before
            .into_iter()
            .chain([own])
            .filter(move |layer| *layer < end)
    }

    /// The bricks that have a slice among their vertices.
    pub(super) fn bricks_of(&self, slice: usize) -> impl Iterator<Item = usize> {
        self.layers_of(slice)
            .flat_map(|layer| self.layers[layer].iter().copied())
    }

    /// The first vertex of a row in the grid.
    pub(super) fn in_grid(&self, row: VertexRow, slice: usize) -> DVec3 {
        let mut at = [0; 3];
        at[self.axes.along] = slice;
        for side in 0..2 {
            at[self.axes.across[side]] = row.first[side];
        }
        DVec3::from([0, 1, 2].map(|axis| (at[axis] + self.within.low[axis]) as f64))
    }

    /// The rows of a brick in a slice; places count from the first vertex of the slice.
    pub(super) fn rows(&self, brick: usize, slice: usize) -> impl Iterator<Item = VertexRow> {
        let low = self.axes.across.map(|axis| self.within.low[axis]);
        let slice = slice + self.within.low[self.axes.along];
        rows(&self.field.bricks[brick], slice, self.axes).map(move |row| VertexRow {
            first: [row.first[0] - low[0], row.first[1] - low[1]],
            ..row
        })
    }

    /// Copies the numbers of the bricks' vertices to a slice, NaN where no brick is.
    pub(super) fn fill(&self, slice: usize, tables: &[Table], numbers: &mut [f32]) {
        numbers.fill(f32::NAN);
        let width = self.sides()[0];
        self.place(slice, tables, (numbers, width), [0, 0]);
    }

    /// Copies the numbers of the bricks' vertices to a plane of rows of this width, in which the slice begins at `first`. The rest stays.
    pub(super) fn place(
        &self,
        slice: usize,
        tables: &[Table],
        (plane, width): (&mut [f32], usize),
        first: [usize; 2],
    ) {
        for brick in self.bricks_of(slice) {
            for row in self.rows(brick, slice) {
                let [x, y] = [0, 1].map(|side| row.first[side] + first[side]);
                let line = &mut plane[x + width * y..][..row.count];
                if row.stride == 1 {
                    line.copy_from_slice(&tables[brick][row.place..][..row.count]);
                    continue;
                }
                for (number, to) in line.iter_mut().enumerate() {
                    *to = tables[brick][row.place + number * row.stride];
                }
            }
        }
    }

    /// Zeros at the vertices of all bricks.
    pub(super) fn tables(&self) -> LayerTables {
        let zeros = |layer: &Vec<usize>| vec![[0.0; TABLE_LEN]; layer.len()];
        LayerTables(self.layers.iter().map(zeros).collect())
    }

    /// Calls a function with the number and the table of each brick that has vertices in a slice.
    pub(super) fn change(
        &self,
        slice: usize,
        tables: &mut LayerTables,
        change: impl Fn(usize, &mut Table) + Sync,
    ) {
        for layer in self.layers_of(slice) {
            let tables = tables.0[layer].par_iter_mut().zip(&self.layers[layer]);
            tables.for_each(|(table, &brick)| change(brick, table));
        }
    }

    /// Adds the tables of the layers to those of the bricks.
    pub(super) fn add_to_bricks(&self, tables: &LayerTables, sums: &mut [Table]) {
        for (bricks, tables) in self.layers.iter().zip(&tables.0) {
            for (brick, values) in bricks.iter().zip(tables) {
                for (sum, value) in sums[*brick].iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
    }
}

/// Vertices of a brick in a slice, side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexRow {
    /// Place of the first in the brick's table, and from one to the next.
    pub(super) place: usize,
    pub(super) stride: usize,
    pub(super) count: usize,
    /// Place of the first in the slice, vertices of the grid.
    pub(super) first: [usize; 2],
}

/// The vertices of a brick in a slice that lie in the box of its visible cells.
fn rows(brick: &CellBrick, slice: usize, axes: Axes) -> impl Iterator<Item = VertexRow> {
    /// From a vertex to the next along each axis.
    const STRIDES: [usize; 3] = [1, VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE];
    let corner = brick.bounds.corner.map(|first| first as usize);
    let [least, greatest] = brick.bounds.range().map(|end| end.map(usize::from));
    let local = slice - corner[axes.along];
    let is_inside = local >= least[axes.along] && local <= greatest[axes.along];
    let [b, c] = axes.across;
    let lines = if is_inside {
        least[c]..greatest[c] + 1
    } else {
        0..0
    };
    lines.map(move |y| VertexRow {
        place: least[b] * STRIDES[b] + y * STRIDES[c] + local * STRIDES[axes.along],
        stride: STRIDES[b],
        count: greatest[b] - least[b] + 1,
        first: [corner[b] + least[b], corner[c] + y],
    })
}

/// How the numbers at vertices are made.
pub(super) struct Numbers<'a> {
    pub(super) channels: &'a [ChannelSettings],
    pub(super) ramp: Option<GradientRamp>,
    pub(super) from_differences: &'a FromDifferences,
    /// True if the number is the scalar of the first channel, else it is extinction.
    pub(super) are_scalars: bool,
}

impl Numbers<'_> {
    /// The numbers of all bricks.
    pub(super) fn of_bricks(&self, bricks: &[CellBrick]) -> Vec<[f32; TABLE_LEN]> {
        let of_brick = |brick: &CellBrick| std::array::from_fn(|vertex| self.at(brick, vertex));
        bricks.par_iter().map(of_brick).collect()
    }

    /// The number at a vertex; NaN where the mask hides it.
    #[inline(always)]
    fn at(&self, brick: &CellBrick, vertex: usize) -> f32 {
        if brick.mask.as_ref().is_some_and(|mask| mask[vertex] == 0) {
            return f32::NAN;
        }
        if self.are_scalars {
            return brick.scalars.at(vertex);
        }
        self.extinction(brick, vertex)
    }

    /// The sum over the channels.
    fn extinction(&self, brick: &CellBrick, vertex: usize) -> f32 {
        let mut sum = 0.0;
        for (number, channel) in self.channels.iter().enumerate() {
            if channel.role != Role::Extinction {
                continue;
            }
            let cells = brick.channel(number);
            let strength = channel.table.at(cells.scalars.at(vertex))[3];
            let factor = match (&self.ramp, cells.gradients, channel.reading) {
                (Some(ramp), Some(gradients), Reading::Trilinear) => {
                    ramp.of_gradient(gradients.at(vertex, self.from_differences))
                }
                _ => 1.0,
            };
            sum += strength * factor;
        }
        sum
    }
}
