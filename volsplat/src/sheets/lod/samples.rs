//! The post-classified field of one brick, sampled, and how far it strays from what may be drawn in its place.
//!
//! The trilinear scalar is taken at 2^3 places a cell and classified. From these samples come the blocks' means, and
//! per axis, column by column, the errors in optical depth that blocks and skipped sheets make.

use super::{LEVELS, STRIDES};
use crate::cells::{CELL_SIDE, CellBrick, VERTEX_SIDE};
use crate::sheets::classify::TransferTable;

/// Samples along a cell's side.
const FINE: usize = 2;

/// Samples along a brick's side.
const SIDE: usize = CELL_SIDE * FINE;

/// Length of a sample along its column, voxels.
const LENGTH: f32 = 1.0 / FINE as f32;

/// How much the spread falls where the step is halved, for a smooth field: the midpoint rule is of second order.
pub(super) const FALL: f32 = 4.0;

/// Places at which the greatest stride may begin.
const PHASES: usize = 1 << STRIDES;

/// Blocks along a brick's side at a level.
pub(crate) const SIDES: [usize; LEVELS] = [4, 2, 1];

/// How far the field strays from the blocks of a level; in optical depth, for opacity units of one voxel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stray {
    /// Root mean square over columns of the error, in parts of the mean.
    pub(crate) spread: f32,
    /// Mean over columns of the error up to the depth where it is greatest.
    pub(crate) drift: f32,
}

/// Colour times extinction, and extinction, at the samples of a brick.
pub(super) struct Samples {
    /// Samples first..end along each axis that lie in the box of the visible cells.
    range: [[usize; 2]; 3],
    values: Box<[[f32; 4]]>,
    /// Optical depth, over all columns, that samples may have missed: cells that show only at a corner.
    missed: f32,
}

/// A column of samples.
struct Column {
    axis: usize,
    across: [usize; 2],
    /// Its place along the other axes.
    place: [usize; 2],
}

impl Column {
    /// The sample at a depth.
    fn at(&self, depth: usize) -> [usize; 3] {
        let mut at = [0; 3];
        (at[self.axis], at[self.across[0]], at[self.across[1]]) =
            (depth, self.place[0], self.place[1]);
        at
    }
}

impl Samples {
    pub(super) fn new(brick: &CellBrick, table: &TransferTable) -> Self {
        let [least, greatest] = brick.bounds.range().map(|end| end.map(usize::from));
        let range = std::array::from_fn(|axis| [least[axis] * FINE, greatest[axis] * FINE]);
        let values = vec![[0.0; 4]; SIDE * SIDE * SIDE].into_boxed_slice();
        let mut samples = Self {
            range,
            values,
            missed: 0.0,
        };
        for z in least[2]..greatest[2] {
            for y in least[1]..greatest[1] {
                for x in least[0]..greatest[0] {
                    samples.fill_cell(brick, table, [x, y, z]);
                }
            }
        }
        samples
    }

    fn fill_cell(&mut self, brick: &CellBrick, table: &TransferTable, cell: [usize; 3]) {
        let corners = corners(brick, cell);
        let mix = |a: f32, b: f32, odd: usize| a + (b - a) * (0.25 + 0.5 * odd as f32);
        let mut seen = false;
        for i in 0..8 {
            let odd = [i & 1, i >> 1 & 1, i >> 2];
            let x = |k: usize| mix(corners[k], corners[k + 1], odd[0]);
            let scalar = mix(mix(x(0), x(2), odd[1]), mix(x(4), x(6), odd[1]), odd[2]);
            let [r, g, b, strength] = table.at(scalar);
            seen |= strength > 0.0;
            let at = std::array::from_fn(|axis| FINE * cell[axis] + odd[axis]);
            self.values[place(at)] = [r * strength, g * strength, b * strength, strength];
        }
        if !seen {
            // What a corner shows fills less than the eighth of the cell around it, of which a column meets a cell's
            // length.
            let most = corners
                .iter()
                .map(|&scalar| table.at(scalar)[3])
                .fold(0.0, f32::max);
            self.missed += most * (FINE * FINE) as f32 / 8.0;
        }
    }

    fn columns(&self, axis: usize) -> f32 {
        let len = |axis: usize| (self.range[axis][1] - self.range[axis][0]) as f32;
        len((axis + 1) % 3) * len((axis + 2) % 3)
    }

    /// Sum of the extinction over all samples.
    fn total(&self) -> f32 {
        self.values.iter().map(|value| value[3]).sum()
    }

    /// Mean optical depth through the brick along its longest axis, for opacity units of one voxel.
    pub(super) fn depth(&self) -> f32 {
        (0..3)
            .map(|axis| LENGTH * self.total() / self.columns(axis))
            .fold(0.0, f32::max)
    }

    /// The error over the mean: a root mean square over columns, with what samples may have missed.
    fn relative(&self, square_sum: f32, axis: usize) -> f32 {
        let columns = self.columns(axis);
        let error = (square_sum / columns).sqrt() + self.missed / columns;
        // A brick without extinction in its samples has a relative error only if something was missed.
        if error > 0.0 {
            error * columns / (LENGTH * self.total())
        } else {
            0.0
        }
    }

    /// All columns along an axis.
    fn columns_along(&self, axis: usize) -> impl Iterator<Item = Column> + use<> {
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        let [u, v] = across.map(|axis| self.range[axis]);
        (v[0]..v[1]).flat_map(move |v| {
            (u[0]..u[1]).map(move |u| Column {
                axis,
                across,
                place: [u, v],
            })
        })
    }

    /// Mean of each block of a level (0 is the finest) over its part in the box.
    pub(super) fn means(&self, level: usize) -> Vec<[f32; 4]> {
        let mut sums = vec![([0.0f32; 4], 0.0f32); SIDES[level].pow(3)];
        for column in self.columns_along(0) {
            for depth in self.range[0][0]..self.range[0][1] {
                let at = column.at(depth);
                let (sum, count) = &mut sums[block(level, at)];
                for (sum, value) in sum.iter_mut().zip(self.values[place(at)]) {
                    *sum += value;
                }
                *count += 1.0;
            }
        }
        sums.into_iter()
            .map(|(sum, count)| sum.map(|s| s / f32::max(count, 1.0)))
            .collect()
    }

    /// How far the field strays from the blocks of a level; `None` as soon as that is not `useful`.
    pub(super) fn stray(&self, level: usize, useful: impl Fn(Stray) -> bool) -> Option<Stray> {
        let means = self.means(level);
        (0..3).try_fold(Stray::default(), |worst, axis| {
            let along = self.stray_along(axis, level, &means);
            let worst = Stray {
                spread: worst.spread.max(along.spread),
                drift: worst.drift.max(along.drift),
            };
            useful(worst).then_some(worst)
        })
    }

    fn stray_along(&self, axis: usize, level: usize, means: &[[f32; 4]]) -> Stray {
        let [first, end] = self.range[axis];
        let mut by_depth = [[0.0f32; 4]; SIDE];
        let mut squares = [0.0f32; 4];
        for column in self.columns_along(axis) {
            let mut error = [0.0f32; 4];
            for (depth, sums) in (first..end).zip(&mut by_depth) {
                let at = column.at(depth);
                let (value, mean) = (self.values[place(at)], means[block(level, at)]);
                for channel in 0..4 {
                    error[channel] += LENGTH * (value[channel] - mean[channel]);
                    sums[channel] += error[channel];
                }
            }
            for (square, error) in squares.iter_mut().zip(error) {
                *square += error * error;
            }
        }
        let drift = by_depth
            .iter()
            .flatten()
            .fold(0.0, |worst, d| f32::max(worst, d.abs()));
        let worst = squares.into_iter().fold(0.0, f32::max);
        Stray {
            spread: self.relative(worst, axis),
            drift: drift / self.columns(axis),
        }
    }

    /// Root mean square, over columns and over where the sheets begin, of the error that taking only every 2nd, 4th
    /// and 8th sample makes, in parts of the mean; `None` as soon as the first of them is not `useful`.
    pub(super) fn skip_spreads(&self, useful: impl Fn(Stray) -> bool) -> Option<[f32; STRIDES]> {
        let mut worst = [0.0f32; STRIDES];
        for axis in 0..3 {
            let along = self.skip_spreads_along(axis);
            worst = std::array::from_fn(|i| worst[i].max(along[i]));
            if !useful(Stray {
                spread: worst[0],
                drift: 0.0,
            }) {
                return None;
            }
        }
        // What is symmetric about the samples shows no error at a stride that it shows at others: the error falls no
        // faster than that of a smooth field.
        for i in (1..STRIDES).rev() {
            worst[i - 1] = worst[i - 1].max(worst[i] / FALL);
        }
        Some(worst)
    }

    fn skip_spreads_along(&self, axis: usize) -> [f32; STRIDES] {
        let mut squares = [[0.0f32; 4]; STRIDES];
        let [first, end] = self.range[axis];
        for column in self.columns_along(axis) {
            let mut phases = [[0.0f32; 4]; PHASES];
            for depth in first..end {
                let value = self.values[place(column.at(depth))];
                for (sum, value) in phases[depth % PHASES].iter_mut().zip(value) {
                    *sum += LENGTH * value;
                }
            }
            add_phase_errors(&phases, &mut squares);
        }
        squares.map(|squares| self.relative(squares.into_iter().fold(0.0, f32::max), axis))
    }
}

/// The scalars at the corners of a cell, x fastest.
fn corners(brick: &CellBrick, [x, y, z]: [usize; 3]) -> [f32; 8] {
    let (row, layer) = (VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE);
    let first = x + row * y + layer * z;
    [
        0,
        1,
        row,
        row + 1,
        layer,
        layer + 1,
        layer + row,
        layer + row + 1,
    ]
    .map(|offset| brick.scalars[first + offset])
}

/// Adds, per stride and channel, the mean square over the phases of stride * (sum of a phase) - (sum of all).
#[inline(always)]
fn add_phase_errors(eight: &[[f32; 4]; PHASES], squares: &mut [[f32; 4]; STRIDES]) {
    let plus = |a: [f32; 4], b: [f32; 4]| [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]];
    let mut four = [[0.0f32; 4]; PHASES / 2];
    for (i, sum) in four.iter_mut().enumerate() {
        *sum = plus(eight[i], eight[i + PHASES / 2]);
    }
    let two = [plus(four[0], four[2]), plus(four[1], four[3])];
    let all = plus(two[0], two[1]);
    for (sums, squares) in [&two[..], &four[..], &eight[..]].into_iter().zip(squares) {
        let stride = sums.len() as f32;
        for sum in sums {
            for channel in 0..4 {
                let error = stride * sum[channel] - all[channel];
                squares[channel] += error * error / stride;
            }
        }
    }
}

/// Place of a sample in its brick.
fn place([x, y, z]: [usize; 3]) -> usize {
    x + SIDE * (y + SIDE * z)
}

/// The block of a level that a sample lies in.
fn block(level: usize, at: [usize; 3]) -> usize {
    let (samples, side) = (FINE << (level + 1), SIDES[level]);
    at[0] / samples + side * (at[1] / samples + side * (at[2] / samples))
}
