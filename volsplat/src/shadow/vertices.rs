//! The vertices of a field's bricks, each once: slices of the grid, rows of a slice, and in each row the runs of vertices that bricks show.
//!
//! Numbers at the vertices lie in one list, run after run. Memory follows what is visible, and a run is long enough for vector instructions,
//! which rows of a brick are not.

use std::ops::Range;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayon::prelude::*;
use resample_core::narrow::index32;

use crate::bricks::cells::{CELL_SIDE, CellBrick, CellField, TABLE_LEN, Table, VERTEX_SIDE};

/// From a vertex of a brick's table to the next along each axis.
const STRIDES: [usize; 3] = [1, VERTEX_SIDE, VERTEX_SIDE * VERTEX_SIDE];

/// Numbers of a vector.
pub(super) const LANES: usize = 16;

/// The numbers of a row of vertices, whole vectors of them, with as many before and after them that belong to no vertex.
pub(super) struct PaddedRow(pub(super) Vec<f32>);

impl PaddedRow {
    pub(super) fn new(width: usize) -> Self {
        Self(vec![f32::NAN; width.next_multiple_of(LANES) + 2 * LANES])
    }

    pub(super) fn inner(&mut self) -> &mut [f32] {
        let end = self.0.len() - LANES;
        &mut self.0[LANES..end]
    }
}

/// Sixteen numbers of a list, from a place on.
#[inline(always)]
pub(super) fn lanes<S: Simd>(simd: S, numbers: &[f32], at: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &numbers[at..][..LANES])
}

/// Numbers between others, at this share of the way.
#[inline(always)]
pub(super) fn mix<S: Simd>(from: f32x16<S>, to: f32x16<S>, share: f32) -> f32x16<S> {
    from + (to - from) * share
}

/// Where the vertices are.
pub(super) struct Vertices<'a> {
    pub(super) field: &'a CellField,
    /// Axes of the grid along a row, from row to row, and from slice to slice.
    pub(super) axes: [usize; 3],
    pub(super) within: VertexBox,
    /// For each row, the number of its first run; one more at the end.
    first_runs: Vec<usize>,
    /// One more at the end, where the list of numbers ends.
    runs: Vec<Run>,
}

/// Numbers at vertices.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub(super) vertices: &'a Vertices<'a>,
    /// Scalars or extinction.
    pub(super) numbers: &'a [f32],
    /// How far the matter around them is skin.
    pub(super) skins: &'a Skins,
    /// The layer around the isosurface, if one is drawn.
    pub(super) soft: Option<&'a Soft>,
}

/// The soft layer around an isosurface, at each vertex.
pub(super) struct Soft {
    /// Outward unit normals in the world: x, y and z.
    pub(super) normals: [Vec<f32>; 3],
    /// Optical depths of the layer in front of the vertices, in log2, and the depth at the surface.
    pub(super) depths: Vec<f32>,
    pub(super) at_surface: f32,
    /// Extinction far behind the surface, per opacity unit.
    pub(super) behind: f32,
}

impl Soft {
    /// Copies the normals and the depths of a row to their places in lines.
    pub(super) fn place(&self, (vertices, row): (&Vertices, usize), lines: [&mut [f32]; 4]) {
        let [x, y, z] = &self.normals;
        for (numbers, line) in [x, y, z, &self.depths].into_iter().zip(lines) {
            vertices.place(row, numbers, line);
        }
    }

    /// The same, in the order of other vertices.
    pub(super) fn moved(&self, from: &Vertices, to: &Vertices) -> Self {
        Self {
            normals: self.normals.each_ref().map(|along| from.moved(along, to)),
            depths: from.moved(&self.depths, to),
            at_surface: self.at_surface,
            behind: self.behind,
        }
    }
}

/// How far the matter around vertices is skin.
pub(super) struct Skins {
    /// 0 to 1, for each vertex.
    pub(super) shares: Vec<f32>,
    /// For each row, true if some of its vertices are skin.
    pub(super) in_rows: Vec<bool>,
}

impl Skins {
    /// Matter without skin.
    pub(super) fn none(vertices: &Vertices) -> Self {
        Self {
            shares: vec![0.0; vertices.count()],
            in_rows: vec![false; vertices.row_count()],
        }
    }

    pub(super) fn new(vertices: &Vertices, shares: Vec<f32>) -> Self {
        let rows = 0..vertices.row_count();
        let has_skin = |row| {
            shares[vertices.of_row(row)]
                .iter()
                .any(|share| *share > 0.0)
        };
        Self {
            in_rows: rows.map(has_skin).collect(),
            shares,
        }
    }
}

/// Vertices side by side in a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// In the row.
    pub(super) first: usize,
    pub(super) len: usize,
    /// Place of its first number in the list.
    start: usize,
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

    /// Least and greatest vertex, in the grid.
    pub(super) fn ends(&self) -> [DVec3; 2] {
        [self.low, self.high].map(|end| DVec3::from(end.map(|at| at as f64)))
    }
}

/// Least and greatest vertex of a brick in the grid.
fn brick_range(brick: &CellBrick) -> [[usize; 3]; 2] {
    brick.bounds.range().map(|end| {
        std::array::from_fn(|axis| brick.bounds.corner[axis] as usize + usize::from(end[axis]))
    })
}

/// A row of a brick's vertices.
#[derive(Clone, Copy)]
struct BrickRow {
    /// Row of its slice, and the first vertex in that row.
    row: usize,
    first: usize,
    /// Place of the first vertex in the brick's table, and the number of vertices.
    place: usize,
    count: usize,
}

/// The bricks of a field by the slices that they have vertices in.
struct Layers<'a> {
    field: &'a CellField,
    axes: [usize; 3],
    within: VertexBox,
    /// Bricks between the same two slices, by number.
    layers: Vec<Vec<usize>>,
}

impl<'a> Layers<'a> {
    fn new(field: &'a CellField, axes: [usize; 3], within: VertexBox) -> Self {
        let mut layers: Vec<Vec<usize>> = Vec::new();
        for (number, brick) in field.bricks.iter().enumerate() {
            let layer = brick.bounds.corner[axes[2]] as usize / CELL_SIDE;
            if layers.len() <= layer {
                layers.resize_with(layer + 1, Vec::new);
            }
            layers[layer].push(number);
        }
        Self {
            field,
            axes,
            within,
            layers,
        }
    }

    /// The bricks that have a slice among their vertices; slices count from the first of the box.
    fn of_slice(&self, slice: usize) -> impl Iterator<Item = usize> {
        let slice = slice + self.within.low[self.axes[2]];
        let own = slice / CELL_SIDE;
        // A slice between two layers belongs to both.
        let before = (slice.is_multiple_of(CELL_SIDE) && own > 0).then(|| own - 1);
        let layers = before.into_iter().chain([own]);
        layers
            .filter_map(|layer| self.layers.get(layer))
            .flatten()
            .copied()
    }

    /// The rows of a brick in a slice.
    fn rows(&self, brick: usize, slice: usize) -> impl Iterator<Item = BrickRow> {
        let [fast, across, along] = self.axes;
        let brick = &self.field.bricks[brick];
        let low = self.within.low;
        let corner = brick.bounds.corner.map(|first| first as usize);
        let [least, greatest] = brick.bounds.range().map(|end| end.map(usize::from));
        let slice = slice + low[along];
        let is_inside =
            (corner[along] + least[along]..=corner[along] + greatest[along]).contains(&slice);
        let rows = if is_inside {
            least[across]..greatest[across] + 1
        } else {
            0..0
        };
        let count = greatest[fast] - least[fast] + 1;
        let first = corner[fast] + least[fast] - low[fast];
        rows.map(move |row| BrickRow {
            row: corner[across] + row - low[across],
            first,
            place: least[fast] * STRIDES[fast]
                + row * STRIDES[across]
                + (slice - corner[along]) * STRIDES[along],
            count,
        })
    }
}

impl<'a> Vertices<'a> {
    /// Those of all bricks; `None` where there is no brick.
    pub(super) fn new(field: &'a CellField, axes: [usize; 3]) -> Option<Self> {
        Some(Self::within(field, axes, VertexBox::of(field)?, |_| true))
    }

    /// Those of some of the bricks, in the same rows.
    pub(super) fn of(&self, is_among: impl Fn(&CellBrick) -> bool) -> Self {
        Self::within(self.field, self.axes, self.within, is_among)
    }

    /// The same vertices in rows along the axis that goes from row to row.
    pub(super) fn turned(&self) -> Self {
        let [fast, across, along] = self.axes;
        Self::within(self.field, [across, along, fast], self.within, |_| true)
    }

    fn within(
        field: &'a CellField,
        axes: [usize; 3],
        within: VertexBox,
        is_among: impl Fn(&CellBrick) -> bool,
    ) -> Self {
        let layers = Layers::new(field, axes, within);
        let [width, height, slices] = axes.map(|axis| within.len(axis));
        let words = width.div_ceil(64);
        let mut shown = vec![0u64; words * height];
        let mut found = Self {
            field,
            axes,
            within,
            first_runs: Vec::with_capacity(height * slices + 1),
            runs: Vec::new(),
        };
        let mut start = 0;
        for slice in 0..slices {
            shown.fill(0);
            let bricks = layers.of_slice(slice);
            for brick in bricks.filter(|brick| is_among(&field.bricks[*brick])) {
                for row in layers.rows(brick, slice) {
                    show(&mut shown[words * row.row..][..words], row.first, row.count);
                }
            }
            for row in shown.chunks_exact(words) {
                found.first_runs.push(found.runs.len());
                let mut end = 0;
                while let Some(first) = next_bit(row, end, true) {
                    end = next_bit(row, first, false).unwrap_or(64 * words);
                    let len = end - first;
                    found.runs.push(Run { first, len, start });
                    start += len;
                }
            }
        }
        found.first_runs.push(found.runs.len());
        found.runs.push(Run {
            first: 0,
            len: 0,
            start,
        });
        found
    }

    /// Vertices along a row, rows of a slice, and slices.
    pub(super) fn sides(&self) -> [usize; 3] {
        self.axes.map(|axis| self.within.len(axis))
    }

    /// Number of rows of all slices.
    pub(super) fn row_count(&self) -> usize {
        self.first_runs.len() - 1
    }

    /// Number of vertices.
    pub(super) fn count(&self) -> usize {
        self.runs[self.runs.len() - 1].start
    }

    /// The runs of a row; rows count through all slices.
    pub(super) fn runs(&self, row: usize) -> &[Run] {
        &self.runs[self.first_runs[row]..self.first_runs[row + 1]]
    }

    /// Where the numbers of a row lie in the list.
    pub(super) fn of_row(&self, row: usize) -> Range<usize> {
        let [first, end] = [row, row + 1].map(|row| self.runs[self.first_runs[row]].start);
        first..end
    }

    /// Where the numbers of a run lie among those of its row.
    pub(super) fn in_row(&self, row: usize, run: &Run) -> Range<usize> {
        let start = run.start - self.runs[self.first_runs[row]].start;
        start..start + run.len
    }

    /// Copies the numbers of a row to their places in a line; the rest stays.
    #[inline(always)]
    pub(super) fn place(&self, row: usize, numbers: &[f32], line: &mut [f32]) {
        for run in self.runs(row) {
            line[run.first..][..run.len].copy_from_slice(&numbers[run.start..][..run.len]);
        }
    }

    /// The same, NaN where nothing is shown; `row` is `None` beyond the ends.
    pub(super) fn fill(&self, row: Option<usize>, numbers: &[f32], line: &mut [f32]) {
        line.fill(f32::NAN);
        if let Some(row) = row {
            self.place(row, numbers, line);
        }
    }

    /// Fills lines with the numbers of a row, of those before and after it in its slice, and of those in the slices beside it.
    pub(super) fn fill_around(&self, row: usize, numbers: &[f32], lines: &mut [PaddedRow; 5]) {
        let places = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]];
        for (line, place) in lines.iter_mut().zip(places) {
            self.fill(self.beside(row, place), numbers, line.inner());
        }
    }

    /// A row, by its place in its slice and its slice.
    pub(super) fn row(&self, [across, along]: [usize; 2]) -> usize {
        across + self.sides()[1] * along
    }

    /// The row so many rows and slices away; `None` beyond the ends.
    pub(super) fn beside(&self, row: usize, [across, along]: [isize; 2]) -> Option<usize> {
        let [_, height, slices] = self.sides();
        let y = (row % height).checked_add_signed(across)?;
        let z = (row / height).checked_add_signed(along)?;
        (y < height && z < slices).then(|| y + height * z)
    }

    /// The first vertex of a row, in the grid.
    pub(super) fn in_grid(&self, row: usize) -> DVec3 {
        let height = self.sides()[1];
        let mut at = self.within.low;
        at[self.axes[1]] += row % height;
        at[self.axes[2]] += row / height;
        DVec3::from(at.map(|at| at as f64))
    }

    /// The number of the vertex at a place of the grid; `None` where nothing is shown.
    pub(super) fn find(&self, at: [usize; 3]) -> Option<usize> {
        let mut place = [0; 3];
        for (side, axis) in self.axes.into_iter().enumerate() {
            place[side] = at[axis].checked_sub(self.within.low[axis])?;
        }
        let [x, y, z] = place;
        let [_, height, slices] = self.sides();
        if y >= height || z >= slices {
            return None;
        }
        let runs = self.runs(y + height * z);
        let run = runs.iter().find(|run| x < run.first + run.len)?;
        Some(run.start + x.checked_sub(run.first)?)
    }

    /// Calls a function with the number of each row and its part of a list of numbers.
    pub(super) fn change_rows<S, T: Send>(
        &self,
        numbers: &mut [T],
        scratch: impl Fn() -> S + Sync + Send,
        change: impl Fn(&mut S, usize, &mut [T]) + Sync + Send,
    ) {
        let rows = self.split(numbers);
        let rows = rows.into_par_iter().enumerate().with_min_len(16);
        rows.for_each_init(scratch, |scratch, (row, numbers)| {
            if !numbers.is_empty() {
                change(scratch, row, numbers);
            }
        });
    }

    /// The parts of a list of numbers that belong to each row.
    pub(super) fn split<'n, T>(&self, numbers: &'n mut [T]) -> Vec<&'n mut [T]> {
        let mut rest = numbers;
        let mut rows = Vec::with_capacity(self.row_count());
        for row in 0..self.row_count() {
            let (own, after) = std::mem::take(&mut rest).split_at_mut(self.of_row(row).len());
            rest = after;
            rows.push(own);
        }
        rows
    }

    /// Something for each vertex: `of_row` finds those of a row of a brick, by the place of its first vertex. Rows lie along x.
    pub(super) fn of_bricks<T: Clone + Default + Send>(
        &self,
        of_row: impl Fn(&CellBrick, usize, &mut [T]) + Sync,
    ) -> Vec<T> {
        let layers = Layers::new(self.field, self.axes, self.within);
        let mut numbers = vec![T::default(); self.count()];
        let height = self.sides()[1];
        let mut rows = self.split(&mut numbers);
        let slices = rows.par_chunks_mut(height).enumerate();
        slices.for_each(|(slice, rows)| {
            for brick in layers.of_slice(slice) {
                for line in layers.rows(brick, slice) {
                    let at = self.place_in_row(line.row + height * slice, line.first);
                    let to = &mut rows[line.row][at..][..line.count];
                    of_row(&self.field.bricks[brick], line.place, to);
                }
            }
        });
        drop(rows);
        numbers
    }

    /// The place of a vertex that is shown among the numbers of its row.
    fn place_in_row(&self, row: usize, at: usize) -> usize {
        let runs = self.runs(row);
        let own = runs.partition_point(|run| run.first <= at) - 1;
        self.in_row(row, &runs[own]).start + at - runs[own].first
    }

    /// The numbers at the vertices of a brick, 0 where they are not shown. Rows lie along x.
    pub(super) fn of_brick(&self, brick: usize, numbers: &[f32]) -> Table {
        let mut table = [0.0; TABLE_LEN];
        let bounds = &self.field.bricks[brick].bounds;
        let [least, greatest] = bounds.range().map(|end| end.map(usize::from));
        let corner = bounds.corner.map(|first| first as usize);
        let low = self.within.low;
        let count = greatest[0] - least[0] + 1;
        for at_z in least[2]..=greatest[2] {
            for at_y in least[1]..=greatest[1] {
                let row = self.row([corner[1] + at_y - low[1], corner[2] + at_z - low[2]]);
                let first = corner[0] + least[0] - low[0];
                let at = self.of_row(row).start + self.place_in_row(row, first);
                let place = least[0] + STRIDES[1] * at_y + STRIDES[2] * at_z;
                table[place..][..count].copy_from_slice(&numbers[at..][..count]);
            }
        }
        table
    }

    /// The numbers at vertices in the order of others, whose rows run from row to row of these or along their slices' steps.
    pub(super) fn moved(&self, numbers: &[f32], to: &Vertices) -> Vec<f32> {
        // Rows of both lie in the planes across the third axis.
        let across = 3 - self.axes[0] - to.axes[0];
        let [width, other, planes] =
            [self.axes[0], to.axes[0], across].map(|axis| self.within.len(axis));
        let mut moved = vec![0.0; self.count()];
        let mut of_planes: Vec<Vec<(usize, &mut [f32])>> =
            (0..planes).map(|_| Vec::new()).collect();
        for (row, numbers) in to.split(&mut moved).into_iter().enumerate() {
            let [plane, _] = to.place_of_row(row, across);
            of_planes[plane].push((row, numbers));
        }
        let none = || vec![0.0; width * other];
        of_planes
            .into_par_iter()
            .enumerate()
            .for_each_init(none, |tile, (plane, rows)| {
                for at in 0..other {
                    self.place(
                        self.row_at(across, [plane, at]),
                        numbers,
                        &mut tile[width * at..][..width],
                    );
                }
                for (row, line) in rows {
                    let [_, at] = to.place_of_row(row, across);
                    for run in to.runs(row) {
                        let line = &mut line[to.in_row(row, run)];
                        for (number, to) in line.iter_mut().enumerate() {
                            *to = tile[at + width * (run.first + number)];
                        }
                    }
                }
            });
        moved
    }

    /// A row's place along an axis across it, and along the other one.
    pub(super) fn place_of_row(&self, row: usize, axis: usize) -> [usize; 2] {
        let height = self.sides()[1];
        let place = [row % height, row / height];
        match axis == self.axes[1] {
            true => place,
            false => [place[1], place[0]],
        }
    }

    /// The row at a place along an axis across it, and along the other one.
    pub(super) fn row_at(&self, axis: usize, [place, other]: [usize; 2]) -> usize {
        match axis == self.axes[1] {
            true => self.row([place, other]),
            false => self.row([other, place]),
        }
    }
}

/// Sets bits, from a first one.
fn show(words: &mut [u64], first: usize, count: usize) {
    let end = first + count;
    let words = words.iter_mut().enumerate();
    for (number, word) in words.take(end.div_ceil(64)).skip(first / 64) {
        let [from, to] = [first, end].map(|at| at.saturating_sub(64 * number).min(64));
        let below = |bits: usize| u64::MAX.checked_shr(64 - index32(bits)).unwrap_or(0);
        *word |= below(to) & !below(from);
    }
}

/// The first bit from a place on that is set, or is not.
fn next_bit(words: &[u64], from: usize, is_set: bool) -> Option<usize> {
    let mut place = from;
    while place < 64 * words.len() {
        let word = words[place / 64] ^ if is_set { 0 } else { u64::MAX };
        let rest = word >> (place % 64);
        if rest != 0 {
            return Some(place + rest.trailing_zeros() as usize);
        }
        place = 64 * (place / 64 + 1);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{next_bit, show};

    #[test]
    fn runs_of_bits_are_found_across_words() {
        let mut words = [0; 3];
        show(&mut words, 5, 3);
        show(&mut words, 60, 70);
        assert_eq!(next_bit(&words, 0, true), Some(5));
        assert_eq!(next_bit(&words, 5, false), Some(8));
        assert_eq!(next_bit(&words, 8, true), Some(60));
        assert_eq!(next_bit(&words, 60, false), Some(130));
        assert_eq!(next_bit(&words, 130, true), None);
        show(&mut words, 64, 128);
        assert_eq!(next_bit(&words, 60, false), None);
    }
}
