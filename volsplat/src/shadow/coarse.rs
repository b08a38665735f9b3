//! Matter and light on a grid of fewer vertices, where the light of every voxel would take too much memory or time.
//!
//! Takes the matter of a field, all of it or some bricks at a time, and sums it over boxes: a vertex of the coarse grid stands at each
//! `step`-th voxel, and its box reaches half a step to each side. Extinction is averaged after classification, so that thin matter
//! darkens as it should; where an isosurface is drawn, scalars are averaged. The means are bricks again, which `tables` finds the light of as it
//! does that of voxels, and light at the field's own vertices is interpolated between those of the coarse grid.

use std::collections::{HashMap, VecDeque};

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::narrow::{byte, index32};

use crate::bricks::cells::{
    ByteTable, CELL_SIDE, CellBrick, CellField, FaceBytes, Scalars, ShownCells, TABLE_LEN, Table,
    VERTEX_SIDE, byte_at, faces_of, vertex,
};
use crate::grid::Bounds;
use crate::shadow::vertices::Vertices;

/// Light where there is no matter.
const FULL: u8 = u8::MAX;

/// A grid whose vertices are every so many voxels of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CoarseGrid {
    /// Voxels from one vertex to the next: 2, 4 or 8, so that bricks of the finer grid end at vertices.
    pub(crate) step: usize,
    /// Voxels of the finer grid along each axis.
    pub(crate) dims: [usize; 3],
}

/// Voxels along each axis, from the first to the last.
pub(crate) type Span = [[usize; 2]; 3];

/// The numbers that boxes sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Summed {
    /// Extinction, which is 0 where nothing is shown.
    Extinction,
    /// Scalars at the vertices, around a surface at this one. They are known only where something is shown.
    Scalars(f32),
}

/// Sums over the boxes of some vertices of a coarse grid.
pub(crate) struct BoxSums {
    grid: CoarseGrid,
    summed: Summed,
    /// The vertices along each axis, from the first to the last.
    within: Span,
    /// For each vertex, x fastest, the sum of the numbers in its box and the number of voxels among them.
    sums: Vec<[f32; 2]>,
}

/// The matter of a field, as bricks of a coarse grid.
#[derive(Clone, Debug)]
pub(crate) struct CoarseField {
    pub(crate) cells: CellField,
    grid: CoarseGrid,
    /// The numbers of the bricks by their first vertices.
    numbers: HashMap<[u32; 3], usize>,
}

impl CoarseGrid {
    /// All voxels of the finer grid.
    pub(crate) fn whole(&self) -> Span {
        self.dims.map(|voxels| [0, voxels - 1])
    }

    /// The world from the vertices of this grid, where it is given from the finer one's.
    pub(crate) fn world_from_index(&self, of_finer: &DAffine3) -> DAffine3 {
        *of_finer * DAffine3::from_scale(DVec3::splat(self.step as f64))
    }

    /// Vertices of this grid.
    pub(crate) fn len(&self) -> usize {
        self.dims
            .map(|voxels| self.last(voxels) + 1)
            .iter()
            .product()
    }

    /// The last vertex along an axis of so many voxels.
    fn last(&self, voxels: usize) -> usize {
        (voxels - 1).div_ceil(self.step)
    }

    /// Length of the part of a vertex' box along an axis that lies among the voxels.
    fn width(&self, axis: usize, vertex: usize) -> f32 {
        let (middle, half) = (vertex * self.step, self.step / 2);
        let end = (middle + half).min(self.dims[axis] - 1);
        end.saturating_sub(middle.saturating_sub(half)) as f32
    }

    /// The vertices whose boxes hold some of these voxels.
    fn around(&self, voxels: &Span) -> Span {
        let half = self.step / 2;
        voxels.map(|[first, last]| [(first + half) / self.step, (last + half) / self.step])
    }

    /// The parts of a voxel of `span` that two boxes take along an axis: the first of the two, and the share of both.
    fn parts(&self, voxel: usize, [first, last]: [usize; 2]) -> (usize, [f32; 2]) {
        let shifted = voxel + self.step / 2;
        let own = shifted / self.step;
        // Half of a voxel at an end lies outside.
        let share = if voxel == first || voxel == last {
            0.5
        } else {
            1.0
        };
        match shifted % self.step {
            0 if voxel == last => (own - 1, [share, 0.0]),
            0 => (own - 1, [0.5 * share; 2]),
            _ => (own, [share, 0.0]),
        }
    }
}

impl BoxSums {
    /// Nothing, in the boxes that these voxels lie in.
    pub(crate) fn none((grid, summed): (CoarseGrid, Summed), voxels: &Span) -> Self {
        let within = grid.around(voxels);
        let count = within
            .iter()
            .map(|[first, last]| last - first + 1)
            .product();
        Self {
            grid,
            summed,
            within,
            sums: vec![[0.0; 2]; count],
        }
    }

    /// The scalars of bricks that lie within `span`, at its vertices. All cells that a surface crosses are in them.
    pub(super) fn of_scalars(of: (CoarseGrid, Summed), bricks: &[CellBrick], span: &Span) -> Self {
        let mut sums = Self::none(of, span);
        let step = of.0.step;
        let [columns, rows, _] = sums.sides();
        for brick in bricks {
            let corner = brick.bounds.corner.map(|at| at as usize);
            if (0..3).any(|axis| !(span[axis][0]..span[axis][1]).contains(&corner[axis])) {
                continue;
            }
            let first = [0, 1, 2].map(|axis| corner[axis] / step - sums.within[axis][0]);
            // Vertices behind the last voxel have its scalar.
            let place =
                |axis: usize, at: usize| (at * step).min(of.0.dims[axis] - 1 - corner[axis]);
            let along = |axis: usize| {
                let voxels = of.0.dims[axis] - 1 - corner[axis];
                0..=voxels.min(CELL_SIDE).div_ceil(step)
            };
            for z in along(2) {
                for y in along(1) {
                    for x in along(0) {
                        let voxel = vertex(place(0, x), place(1, y), place(2, z));
                        if brick.mask.as_ref().is_none_or(|mask| mask[voxel] != 0) {
                            let at =
                                first[0] + x + columns * (first[1] + y + rows * (first[2] + z));
                            sums.sums[at] = [brick.scalars.at(voxel), 1.0];
                        }
                    }
                }
            }
        }
        sums
    }

    /// The sums of numbers at those vertices, in rows along x, that lie within `span`.
    pub(super) fn of(
        of: (CoarseGrid, Summed),
        (vertices, numbers): (&Vertices, &[f32]),
        span: &Span,
    ) -> Self {
        let mut sums = Self::none(of, span);
        let [columns, ..] = sums.sides();
        let mut line = vec![[0.0f32; 2]; columns + 1];
        let [low, high] = [0, 1].map(|end| span.map(|ends| ends[end]));
        let inside = |axis: usize| {
            let first = low[axis].max(vertices.within.low[axis]);
            first..=high[axis].min(vertices.within.high[axis])
        };
        for z in inside(2) {
            for y in inside(1) {
                let row = vertices.row([y - vertices.within.low[1], z - vertices.within.low[2]]);
                if sums.add_to_line((vertices, numbers), row, span[0], &mut line) {
                    sums.add_line([y, z], span, &mut line);
                }
            }
        }
        sums
    }

    /// Adds the numbers of a row to a line of boxes; false where it has none.
    fn add_to_line(
        &self,
        (vertices, numbers): (&Vertices, &[f32]),
        row: usize,
        span: [usize; 2],
        line: &mut [[f32; 2]],
    ) -> bool {
        let numbers = &numbers[vertices.of_row(row)];
        for run in vertices.runs(row) {
            let first = run.first + vertices.within.low[0];
            for (number, voxel) in numbers[vertices.in_row(row, run)].iter().zip(first..) {
                if voxel < span[0] || voxel > span[1] {
                    continue;
                }
                let (own, shares) = self.grid.parts(voxel, span);
                for (sum, share) in line[own - self.within[0][0]..].iter_mut().zip(shares) {
                    sum[0] += share * number;
                    sum[1] += share;
                }
            }
        }
        !numbers.is_empty()
    }

    /// Adds a line of boxes to the rows that it belongs to, and empties it.
    fn add_line(&mut self, [y, z]: [usize; 2], span: &Span, line: &mut [[f32; 2]]) {
        let [columns, rows, _] = self.sides();
        let (own_y, shares_y) = self.grid.parts(y, span[1]);
        let (own_z, shares_z) = self.grid.parts(z, span[2]);
        for (z, share_z) in (own_z - self.within[2][0]..).zip(shares_z) {
            for (y, share_y) in (own_y - self.within[1][0]..).zip(shares_y) {
                let share = share_y * share_z;
                if share == 0.0 {
                    continue;
                }
                let first = columns * (y + rows * z);
                for (sum, more) in self.sums[first..][..columns].iter_mut().zip(&*line) {
                    sum[0] += share * more[0];
                    sum[1] += share * more[1];
                }
            }
        }
        line.fill([0.0; 2]);
    }

    /// Adds sums over boxes that are all among these.
    pub(crate) fn add(&mut self, more: &Self) {
        let [columns, rows, _] = self.sides();
        let [width, height, _] = more.sides();
        let low = [0, 1, 2].map(|axis| more.within[axis][0] - self.within[axis][0]);
        for (number, line) in more.sums.chunks_exact(width).enumerate() {
            let (y, z) = (number % height + low[1], number / height + low[2]);
            let own = &mut self.sums[low[0] + columns * (y + rows * z)..][..width];
            for (sum, more) in own.iter_mut().zip(line) {
                sum[0] += more[0];
                sum[1] += more[1];
            }
        }
    }

    /// Vertices along each axis.
    fn sides(&self) -> [usize; 3] {
        self.within.map(|[first, last]| last - first + 1)
    }

    /// The bricks of the means. The sums are those over all of the grid.
    pub(crate) fn field(mut self) -> CoarseField {
        if let Summed::Scalars(scalar) = self.summed {
            self.fill(scalar);
        }
        let bricks = self
            .sides()
            .map(|side| (side - 1).div_ceil(CELL_SIDE).max(1));
        let all = 0..bricks.iter().product();
        let made: Vec<CellBrick> = all
            .into_par_iter()
            .filter_map(|number: usize| {
                let across = number / bricks[0];
                let place = [number % bricks[0], across % bricks[1], across / bricks[1]];
                self.brick(place.map(|at| at * CELL_SIDE))
            })
            .collect();
        let numbered = made.iter().enumerate();
        CoarseField {
            numbers: numbered
                .map(|(number, brick)| (brick.bounds.corner, number))
                .collect(),
            cells: CellField::of_bricks(made, 0, 0),
            grid: self.grid,
        }
    }

    /// Gives vertices without a scalar one on the same side of the surface at `scalar` as their neighbours have: it does not lie between them, because
    /// all cells that it crosses are shown.
    fn fill(&mut self, scalar: f32) {
        let unknown: Vec<usize> = (0..self.sums.len())
            .filter(|at| self.sums[*at][1] == 0.0)
            .collect();
        for sum in &mut self.sums {
            // A vertex without a scalar gets NaN.
            sum[0] /= sum[1];
        }
        let mut known: VecDeque<usize> = (0..self.sums.len())
            .filter(|at| self.sums[*at][1] > 0.0 && self.sums[*at][0] != scalar)
            .collect();
        self.spread(&mut known);
        // What only vertices on the surface reach lies on the other side of it than the vertex before these.
        for at in unknown {
            if !self.sums[at][0].is_nan() {
                continue;
            }
            for step in self.beside(at) {
                let [own, before] = [1, 2].map(|times| self.scalar_at(at, step, times));
                if own == scalar && before != scalar && !before.is_nan() {
                    self.sums[at][0] = 2.0 * own - before;
                    known.push_back(at);
                    break;
                }
            }
            self.spread(&mut known);
        }
    }

    /// Spreads the scalars of these vertices to all that have none.
    fn spread(&mut self, known: &mut VecDeque<usize>) {
        while let Some(from) = known.pop_front() {
            for step in self.beside(from) {
                let to = from.strict_add_signed(step);
                if self.sums[to][0].is_nan() {
                    self.sums[to][0] = self.sums[from][0];
                    known.push_back(to);
                }
            }
        }
    }

    /// The scalar so many steps away; NaN beyond the grid and at vertices without one.
    fn scalar_at(&self, at: usize, step: isize, times: isize) -> f32 {
        let mut at = at;
        for _ in 0..times {
            if !self.beside(at).any(|other| other == step) {
                return f32::NAN;
            }
            at = at.strict_add_signed(step);
        }
        self.sums[at][0]
    }

    /// From a vertex to its neighbours.
    fn beside(&self, at: usize) -> impl Iterator<Item = isize> + use<> {
        let [columns, rows, layers] = self.sides();
        let (x, across) = (at % columns, at / columns);
        let (y, z) = (across % rows, across / rows);
        let steps = [1, columns as isize, (columns * rows) as isize];
        let ends = [(x, columns), (y, rows), (z, layers)];
        steps
            .into_iter()
            .zip(ends)
            .flat_map(|(step, (at, count))| {
                [(at > 0).then_some(-step), (at + 1 < count).then_some(step)]
            })
            .flatten()
    }

    /// The brick with this first vertex; `None` where nothing is shown.
    fn brick(&self, corner: [usize; 3]) -> Option<CellBrick> {
        let sides = self.sides();
        let mut bounds = Bounds::nothing(corner.map(index32));
        let mut table: Box<Table> = Box::new([0.0; TABLE_LEN]);
        let along = |axis: usize| 0..VERTEX_SIDE.min(sides[axis] - corner[axis]);
        for z in along(2) {
            for y in along(1) {
                let row = sides[0] * (corner[1] + y + sides[1] * (corner[2] + z));
                let width = self.grid.width(1, corner[1] + y) * self.grid.width(2, corner[2] + z);
                for x in along(0) {
                    let [sum, count] = self.sums[row + corner[0] + x];
                    if count > 0.0 {
                        bounds.add([x, y, z]);
                    }
                    table[vertex(x, y, z)] = match self.summed {
                        Summed::Scalars(_) => sum,
                        Summed::Extinction if count > 0.0 => {
                            sum / (width * self.grid.width(0, corner[0] + x))
                        }
                        Summed::Extinction => 0.0,
                    };
                }
            }
        }
        let [least, greatest] = bounds.range();
        if least[0] > greatest[0] {
            return None;
        }
        if self.summed == Summed::Extinction {
            // What lies in a box may lie in the cells on both sides of its vertex.
            let end = |axis: usize| along(axis).end as u8 - 1;
            bounds = Bounds::of_range(
                bounds.corner,
                [
                    least.map(|at| at.saturating_sub(1)),
                    [0, 1, 2].map(|axis| (greatest[axis] + 1).min(end(axis))),
                ],
            );
        }
        Some(CellBrick {
            shown: ShownCells::between(&bounds),
            bounds,
            scalars: Scalars::Numbers(table),
            gradients: None,
            range: [f32::NEG_INFINITY, f32::INFINITY],
            more: Vec::new(),
            mask: None,
        })
    }
}

impl CoarseField {
    /// The grid.
    pub(crate) fn grid(&self) -> CoarseGrid {
        self.grid
    }

    /// Bytes of the bricks.
    pub(crate) fn bytes(&self) -> u64 {
        (self.cells.bricks.len() * (size_of::<CellBrick>() + size_of::<Table>())) as u64
    }

    /// Light at the vertices of a brick of the finer grid with this first vertex, from that at the bricks of this one.
    pub(crate) fn light_in(&self, light: &[FaceBytes], corner: [u32; 3]) -> FaceBytes {
        let step = index32(self.grid.step);
        let side = index32(CELL_SIDE);
        let first = corner.map(|at| at / step);
        let own = self.numbers.get(&first.map(|at| at / side * side));
        let Some(&number) = own else {
            return *faces_of(&[FULL; TABLE_LEN]);
        };
        let within = first.map(|at| (at % side) as usize);
        let cells = CELL_SIDE / self.grid.step;
        let mut known: Table = [0.0; TABLE_LEN];
        for z in 0..=cells {
            for y in 0..=cells {
                for x in 0..=cells {
                    let at = vertex(within[0] + x, within[1] + y, within[2] + z);
                    known[vertex(x, y, z)] = f32::from(byte_at(&light[number], at));
                }
            }
        }
        *faces_of(&self.between(&known))
    }

    /// Bytes at all vertices of a brick, between those at every `step`-th vertex, which come first along each axis.
    fn between(&self, known: &Table) -> ByteTable {
        let step = self.grid.step;
        let cells = CELL_SIDE / step;
        let parts = |at: usize| (at / step, (at / step + 1).min(cells));
        let share = |at: usize| (at % step) as f32 / step as f32;
        let mix = |from: f32, to: f32, share: f32| (to - from).mul_add(share, from);
        let mut table = [FULL; TABLE_LEN];
        for z in 0..VERTEX_SIDE {
            let (near_z, far_z) = parts(z);
            for y in 0..VERTEX_SIDE {
                let (near_y, far_y) = parts(y);
                let mut row = [0.0f32; VERTEX_SIDE];
                for (x, along) in row[..=cells].iter_mut().enumerate() {
                    let of_layer = |z: usize| {
                        mix(
                            known[vertex(x, near_y, z)],
                            known[vertex(x, far_y, z)],
                            share(y),
                        )
                    };
                    *along = mix(of_layer(near_z), of_layer(far_z), share(z));
                }
                for x in 0..VERTEX_SIDE {
                    let (near, far) = parts(x);
                    table[vertex(x, y, z)] = byte(mix(row[near], row[far], share(x)));
                }
            }
        }
        table
    }
}
