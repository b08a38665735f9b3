//! The support of a transfer function: the scalars that it shows, and the cells of a brick in which they occur.
//!
//! Cells and voxels are dropped when their scalars miss the support; the test may keep cells that it could drop, and never
//! drops a visible one. The range of a cell is that of its corners; ranges are found along one axis after another, all cells side by side:
//! loops that become vector instructions.

use std::ops::RangeInclusive;

use resample_core::dispatch;
use resample_core::simd::SimdLevel;

use crate::bricks::cells::{
    CELL_ROWS, CELL_SIDE, CELLS, FACES as FACES_ACROSS_Z, FaceBytes, Scalars, ShownCells,
    TABLE_LEN, VERTEX_SIDE,
};
use crate::grid::Bounds;
use crate::look::transfer::TransferFunction;

/// Vertices of a brick with cells along x, and of those with cells along y too.
const EDGES: usize = CELL_SIDE * VERTEX_SIDE * VERTEX_SIDE;
const FACES: usize = CELL_ROWS * VERTEX_SIDE;

/// The least and the greatest value at the corners of each cell.
pub(super) struct CellRanges {
    least: [f32; CELLS],
    greatest: [f32; CELLS],
}

impl CellRanges {
    #[inline(always)]
    pub(super) fn new(scalars: &Scalars) -> Self {
        match scalars {
            Scalars::Numbers(table) => Self {
                least: over_corners(table, f32::min),
                greatest: over_corners(table, f32::max),
            },
            Scalars::Bytes(faces) => Self {
                least: over_bytes(faces, u32::min),
                greatest: over_bytes(faces, u32::max),
            },
        }
    }

    /// The cells of which this holds, for the least and the greatest value.
    #[inline(always)]
    pub(super) fn select(&self, holds: impl Fn(f32, f32) -> bool) -> ShownCells {
        let mut held = [0; CELLS];
        for (cell, held) in held.iter_mut().enumerate() {
            *held = u8::from(holds(self.least[cell], self.greatest[cell]));
        }
        let (eights, _) = held.as_chunks::<CELL_SIDE>();
        let mut rows = [0; CELL_ROWS];
        for (row, eight) in rows.iter_mut().zip(eights) {
            *row = bits_of(*eight);
        }
        ShownCells::of_rows(rows)
    }
}

/// Eight bytes of 0 or 1 as bits, the first lowest: the product has each of them once in its highest byte.
#[inline(always)]
fn bits_of(eight: [u8; CELL_SIDE]) -> u8 {
    (u64::from_le_bytes(eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// Combines the bytes at the eight corners of each cell.
#[inline(always)]
fn over_bytes(faces: &FaceBytes, combine: impl Fn(u32, u32) -> u32) -> [f32; CELLS] {
    let mut of_faces = [0u32; FACES_ACROSS_Z];
    for (of_face, &face) in of_faces.iter_mut().zip(faces) {
        let [a, b, c, d] = [0, 8, 16, 24].map(|shift| face >> shift & 0xff);
        *of_face = combine(combine(a, b), combine(c, d));
    }
    let mut cells = [0.0; CELLS];
    for (at, cell) in cells.iter_mut().enumerate() {
        *cell = combine(of_faces[at], of_faces[at + CELL_ROWS]) as f32;
    }
    cells
}

/// Combines the values at the eight corners of each cell.
#[inline(always)]
fn over_corners<T: Copy + Default>(
    table: &[T; TABLE_LEN],
    combine: impl Fn(T, T) -> T,
) -> [T; CELLS] {
    let mut edges = [T::default(); EDGES];
    for (row, vertices) in edges
        .chunks_exact_mut(CELL_SIDE)
        .zip(table.chunks_exact(VERTEX_SIDE))
    {
        for x in 0..CELL_SIDE {
            row[x] = combine(vertices[x], vertices[x + 1]);
        }
    }
    let mut faces = [T::default(); FACES];
    for (layer, rows) in faces
        .chunks_exact_mut(CELL_ROWS)
        .zip(edges.chunks_exact(CELL_SIDE * VERTEX_SIDE))
    {
        for at in 0..CELL_ROWS {
            layer[at] = combine(rows[at], rows[at + CELL_SIDE]);
        }
    }
    let mut cells = [T::default(); CELLS];
    for (at, cell) in cells.iter_mut().enumerate() {
        *cell = combine(faces[at], faces[at + CELL_ROWS]);
    }
    cells
}

/// The cells with a corner that the mask shows.
pub(super) fn unmasked(mask: &[u8; TABLE_LEN]) -> ShownCells {
    let shown = over_corners(mask, |a, b| a | b);
    let mut rows = [0; CELL_ROWS];
    for (cell, &shown) in shown.iter().enumerate() {
        rows[cell / CELL_SIDE] |= u8::from(shown != 0) << (cell % CELL_SIDE);
    }
    ShownCells::of_rows(rows)
}

/// The cells of a block of this size.
pub(super) fn cells_of(size: [usize; 3]) -> ShownCells {
    let mut rows = [0; CELL_ROWS];
    for (number, row) in rows.iter_mut().enumerate() {
        if number % CELL_SIDE < size[1] && number / CELL_SIDE < size[2] {
            *row = (0xff_u32 >> (CELL_SIDE - size[0])) as u8;
        }
    }
    ShownCells::of_rows(rows)
}

/// The box around cells; `None` where there are none.
pub(super) fn box_of(corner: [u32; 3], cells: &ShownCells) -> Option<Bounds> {
    let (mut along_x, mut along_y, mut along_z) = (0u8, 0u8, 0u8);
    for (number, &row) in cells.rows().iter().enumerate() {
        along_x |= row;
        let any = u8::from(row != 0);
        along_y |= any << (number % CELL_SIDE);
        along_z |= any << (number / CELL_SIDE);
    }
    if along_x == 0 {
        return None;
    }
    let least = [along_x, along_y, along_z].map(|bits| bits.trailing_zeros() as u8);
    let greatest = [along_x, along_y, along_z].map(|bits| (u8::BITS - bits.leading_zeros()) as u8);
    Some(Bounds::of_range(corner, [least, greatest]))
}

/// Takes values into the least and the greatest so far.
#[inline(always)]
pub(super) fn take_in<T: Copy + PartialOrd>(least: &mut [T], greatest: &mut [T], values: &[T]) {
    for ((least, greatest), &value) in least.iter_mut().zip(greatest).zip(values) {
        *least = if value < *least { value } else { *least };
        *greatest = if value > *greatest { value } else { *greatest };
    }
}

/// The scalars whose opacity is above 0.
#[derive(Clone, Debug)]
pub(crate) struct Support {
    /// Ascending, apart from one another.
    intervals: Vec<RangeInclusive<f32>>,
    /// How far beyond them the rounding to an entry of the transfer function's table may show a scalar.
    reach: f32,
}

impl Support {
    pub(crate) fn new(transfer: &TransferFunction) -> Self {
        let knots = transfer.opacity_knots();
        let visible = |i: usize| knots[i].opacity > 0.0;
        let at = |i: usize| knots[i].value as f32;
        let mut intervals = Vec::new();
        if visible(0) {
            intervals.push(f32::NEG_INFINITY..=at(0));
        }
        for i in 1..knots.len() {
            if visible(i - 1) || visible(i) {
                // A ramp that starts from 0 is visible only past its knot. Two knots at one scalar are a step: the
                // upper one holds from there on.
                let rises = !visible(i - 1) && at(i) > at(i - 1);
                let falls = !visible(i) && at(i) > at(i - 1);
                let low = if rises {
                    at(i - 1).next_up()
                } else {
                    at(i - 1)
                };
                let high = if falls { at(i).next_down() } else { at(i) };
                intervals.push(low..=high);
            }
        }
        if visible(knots.len() - 1) {
            intervals.push(at(knots.len() - 1)..=f32::INFINITY);
        }
        Self {
            intervals: joined(intervals),
            reach: 0.0,
        }
    }

    /// All scalars.
    pub(crate) fn everything() -> Self {
        Self {
            intervals: vec![f32::NEG_INFINITY..=f32::INFINITY],
            reach: 0.0,
        }
    }

    /// No scalar.
    pub(crate) fn nothing() -> Self {
        Self {
            intervals: Vec::new(),
            reach: 0.0,
        }
    }

    /// One scalar.
    pub(crate) fn of(value: f32) -> Self {
        Self {
            intervals: vec![value..=value],
            reach: 0.0,
        }
    }

    /// The support for a table whose entries are this far apart.
    pub(crate) fn tabulated(self, step: f32) -> Self {
        Self {
            reach: step,
            ..self
        }
    }

    /// Returns true if all scalars of another support are in this one.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        let holds = |part: &RangeInclusive<f32>| {
            self.intervals
                .iter()
                .any(|whole| whole.start() <= part.start() && part.end() <= whole.end())
        };
        other.intervals.iter().all(holds)
    }

    /// Returns true if any scalar from `low` to `high` may be visible.
    #[inline(always)]
    pub(crate) fn meets(&self, low: f32, high: f32) -> bool {
        self.intervals
            .iter()
            .any(|s| high >= *s.start() && low <= *s.end())
    }

    /// Returns true if one interval holds all scalars from the least to the greatest.
    pub(crate) fn holds(&self, [least, greatest]: [f32; 2]) -> bool {
        self.intervals
            .iter()
            .any(|s| *s.start() <= least && greatest <= *s.end())
    }

    /// The cells of a table with this range that it meets, and those that it meets with its reach.
    pub(super) fn cells(&self, scalars: &Scalars, range: [f32; 2]) -> [ShownCells; 2] {
        if self.holds(range) {
            return [ShownCells::all(), ShownCells::all()];
        }
        let level = SimdLevel::Auto.resolve();
        dispatch!(level, simd => self.met_cells(scalars))
    }

    #[inline(always)]
    fn met_cells(&self, scalars: &Scalars) -> [ShownCells; 2] {
        let ranges = CellRanges::new(scalars);
        let (mut met, mut reached) = (ShownCells::none(), ShownCells::none());
        for interval in &self.intervals {
            let (start, end) = (*interval.start(), *interval.end());
            met = met.or(&ranges.select(|low, high| high >= start && low <= end));
            reached = reached
                .or(&ranges
                    .select(|low, high| high + self.reach >= start && low - self.reach <= end));
        }
        [met, reached]
    }
}

/// The same scalars in as few intervals as there can be: those that touch or overlap are one.
fn joined(mut intervals: Vec<RangeInclusive<f32>>) -> Vec<RangeInclusive<f32>> {
    intervals.retain(|interval| !interval.is_empty());
    intervals.sort_by(|a, b| a.start().total_cmp(b.start()));
    let mut joined: Vec<RangeInclusive<f32>> = Vec::new();
    for interval in intervals {
        match joined.last_mut() {
            Some(last) if *interval.start() <= last.end().next_up() => {
                *last = *last.start()..=last.end().max(*interval.end());
            }
            _ => joined.push(interval),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look::transfer::{ColourKnot, OpacityKnot};

    fn support(knots: &[(f64, f64)]) -> Support {
        let colours = vec![ColourKnot {
            value: 0.0,
            rgb: [1.0; 3],
        }];
        let knots = knots
            .iter()
            .map(|&(value, opacity)| OpacityKnot { value, opacity })
            .collect();
        Support::new(&TransferFunction::new(colours, knots).expect("a valid function"))
    }

    #[test]
    fn a_support_covers_what_lies_inside_it() {
        let wide = support(&[(10.0, 0.0), (20.0, 1.0), (50.0, 0.5), (60.0, 0.0)]);
        let narrow = support(&[(15.0, 0.0), (30.0, 1.0), (60.0, 0.0)]);
        assert!(
            wide.covers(&narrow) && !narrow.covers(&wide),
            "one inside another"
        );
        assert!(
            wide.covers(&wide) && Support::everything().covers(&wide),
            "the same, and all"
        );
        let parts = support(&[
            (10.0, 0.0),
            (20.0, 1.0),
            (30.0, 0.0),
            (40.0, 0.0),
            (50.0, 1.0),
            (60.0, 0.0),
        ]);
        assert!(
            wide.covers(&parts) && !parts.covers(&wide),
            "a gap is not covered"
        );
        let open = support(&[(10.0, 0.0), (20.0, 1.0)]);
        assert!(open.covers(&wide) && !wide.covers(&open), "without end");
        assert!(
            narrow.covers(&support(&[(0.0, 0.0)])),
            "nothing is covered by anything"
        );
    }

    #[test]
    fn a_mean_shows_what_either_function_shows() {
        let colours = vec![ColourKnot {
            value: 0.0,
            rgb: [1.0; 3],
        }];
        let function = |knots: &[(f64, f64)]| {
            let knots = knots
                .iter()
                .map(|&(value, opacity)| OpacityKnot { value, opacity })
                .collect();
            TransferFunction::new(colours.clone(), knots).expect("a valid function")
        };
        let (a, b) = (
            function(&[(10.0, 0.0), (20.0, 0.4), (20.0, 0.0), (40.0, 0.0)]),
            function(&[(15.0, 0.0), (30.0, 0.1), (35.0, 0.0)]),
        );
        let kept = Support::new(&a.mixed(&b, 0.5));
        for share in [0.0, 0.1, 0.7, 1.0] {
            assert!(
                kept.covers(&Support::new(&a.mixed(&b, share))),
                "share {share}"
            );
        }
    }
}
