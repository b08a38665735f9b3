//! The samples of a reference that belong to one surface.
//!
//! Disparity is linear over the picture on a plane, at any slope. So two neighbours are linked when the one lies where
//! the other's side, continued linearly, expects it; a jump is no link from either side. Cells between four samples are
//! joined if the links go around them, and cut otherwise. The tolerance comes from the depth map's own steps.
//!
//! Limits: depth that was smoothed across an edge (a ramp of flying samples) may link both sides.

use rayon::prelude::*;
use resample_core::{Camera, Projection};

use crate::options::SurfaceTolerance;
use crate::surfaces::tolerance::{bridge, tolerance_of};

// The numbers of the flat pieces of a reference's surfaces: a cell, and a kind of piece in it.

/// Kinds of pieces in one cell: 0 and 1 are the triangles beside the main diagonal, 2 to 5 the quarter of a corner, 6 and 7
/// the triangles beside the other diagonal.
pub(crate) const KINDS: u32 = 8;

/// The first triangle beside the other diagonal.
pub(crate) const ANTI: u32 = 6;

/// Most cells whose pieces have different numbers.
pub(crate) const MAX_CELLS: usize = (u32::MAX / KINDS) as usize;

/// The number of no piece.
pub(crate) const NO_PATCH: u32 = u32::MAX;

/// A piece's number: its cell and kind.
pub(crate) fn patch_id(cell: usize, kind: u32) -> u32 {
    cell as u32 * KINDS + kind
}

/// Returns true if a piece is a triangle of a joined cell.
#[inline(always)]
pub(crate) fn is_triangle(id: u32) -> bool {
    id.wrapping_add(KINDS - ANTI) % KINDS < 4
}

/// The cell of a piece.
pub(crate) fn cell_of(id: u32) -> usize {
    (id / KINDS) as usize
}

/// The row of a cell, by a multiplication: it is needed for every pixel, and a division takes longer than all else.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRows {
    factor: u64,
    shift: u32,
}

impl CellRows {
    /// For rows of `cells` cells.
    ///
    /// The factor is above 2^shift / cells by less than 1, so a number n below 2^29 ([`MAX_CELLS`]) gives a quotient that
    /// is too large by less than n / 2^shift <= 1 / cells: never as far as the next whole number.
    pub(crate) fn new(cells: usize) -> Self {
        let shift = MAX_CELLS.ilog2() + 1 + cells.next_power_of_two().ilog2();
        Self {
            factor: (1u64 << shift).div_ceil(cells as u64),
            shift,
        }
    }

    #[inline(always)]
    pub(crate) fn row(self, cell: usize) -> usize {
        ((cell as u64 * self.factor) >> self.shift) as usize
    }
}

/// A step this many times the one before it, in the same direction, still is one surface: depth falls off like a square
/// root at the limb of a round body, where the last step of whole samples is 1 / (sqrt 2 - 1) times the one before.
const LIMB_RATIO: f32 = 2.42;

/// Distances to a cut are counted up to this, samples.
const FAR_FROM_CUT: u8 = 32;

/// How a cell's corners are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    /// No corner has a depth.
    Empty,
    /// Two triangles that share the diagonal from the first corner to the last.
    MainDiagonal,
    /// Two triangles that share the other diagonal.
    AntiDiagonal,
    /// Each corner keeps its own quarter.
    Cut,
}

/// Disparity, slopes, joints of one reference. Cell (cx, cy) has the samples (cx-1, cy-1) to (cx, cy) as corners, so
/// there is one more cell than samples along each axis.
#[derive(Clone, Debug)]
pub(crate) struct Surfaces {
    /// The meaning of disparity: 1/z for a pinhole, z for parallel rays.
    pub(crate) projection: Projection,
    /// Samples along x and y.
    pub(crate) size: [usize; 2],
    /// Generalised disparity; NaN where unknown.
    pub(crate) disparity: Vec<f32>,
    /// The slopes of samples at corners of cut cells.
    slopes: Slopes,
    /// Bit 0: linked with the sample to the right. Bit 1: with the one below. Bit 2: recoloured. Bits 3 to 5: how the depth
    /// that was given follows from the disparity.
    pub(crate) links: Vec<u8>,
    /// The cells, rows from the top; empty once they are made into segments.
    pub(crate) cells: Vec<Cell>,
    /// The row of a cell.
    pub(crate) cell_rows: CellRows,
    /// Chebyshev distance to the nearest corner of a cut cell, samples, at most [`FAR_FROM_CUT`].
    pub(crate) clearance: Vec<u8>,
    /// The largest disparity.
    pub(crate) largest: f32,
    /// Departure from linearity that still is one surface, relative to disparity.
    pub(crate) tolerance: f32,
}

/// Bit of [`Surfaces::links`]: with the sample to the right.
pub(crate) const RIGHT: u8 = 1;
/// Bit of [`Surfaces::links`]: with the sample below.
pub(crate) const BELOW: u8 = 2;

/// Bit of [`Surfaces::links`]: the sample has another colour than the reference gives it.
pub(crate) const RECOLOURED: u8 = 4;

/// First bit of [`Surfaces::links`] of those that tell the depth.
pub(crate) const DEPTH: u8 = 8;

impl Surfaces {
    /// Finds the surfaces of what `camera` sees at these camera z.
    pub(crate) fn new(camera: &Camera, depth: Vec<f32>, tolerance: SurfaceTolerance) -> Self {
        let projection: Projection = camera.projection;
        let size = [camera.width as usize, camera.height as usize];
        // In place: a large depth is not held twice.
        let mut disparity = depth;
        disparity
            .par_iter_mut()
            .for_each(|z| *z = crate::view::warp::disparity(projection, *z).unwrap_or(f32::NAN));
        let tolerance = match tolerance {
            SurfaceTolerance::Relative(t) => t,
            SurfaceTolerance::Auto => tolerance_of(&disparity, size),
        };
        bridge(&mut disparity, size, tolerance);
        let links = links(&disparity, size, tolerance);
        let mut surfaces = Self {
            projection,
            size,
            slopes: Slopes::default(),
            cells: Vec::new(),
            cell_rows: CellRows::new(size[0] + 1),
            clearance: Vec::new(),
            largest: disparity.par_iter().copied().reduce(|| 0.0, f32::max),
            disparity,
            links,
            tolerance,
        };
        surfaces.cells = surfaces.joined_cells();
        surfaces.clearance = surfaces.clearances();
        surfaces
    }

    /// Keeps the slopes of samples at corners of cut cells, now that it is known how far they `reach` into these.
    pub(crate) fn keep_slopes(
        &mut self,
        reach: impl Fn(&Self, usize, usize, i32) -> Option<f64> + Sync,
    ) {
        let (clearance, count) = (&self.clearance, self.disparity.len());
        let reach = |index, axis, towards| reach(self, index, axis, towards);
        let slopes = |index| self.slopes_by_side(reach, index);
        self.slopes = Slopes::new(count, |index| clearance[index] == 0, slopes);
    }

    /// Returns true if the sample at `index` is linked with the next one along an axis (0: x, 1: y).
    pub(crate) fn linked_on(&self, index: usize, axis: usize) -> bool {
        self.links[index] & [RIGHT, BELOW][axis] != 0
    }

    /// Returns true if the sample `a` is nearer to the reference's eye than `b`.
    pub(crate) fn nearer(&self, a: usize, b: usize) -> bool {
        match self.projection {
            Projection::Perspective => self.disparity[a] > self.disparity[b],
            Projection::Orthographic => self.disparity[a] < self.disparity[b],
        }
    }

    /// Change of disparity per pixel along x and y, on the sample's own surface.
    pub(crate) fn slope(&self, index: usize) -> [f32; 2] {
        let width = self.size[0];
        [
            self.slope_along(index, index % width, 0),
            self.slope_along(index, index / width, 1),
        ]
    }

    /// The same in the quarter of this number of a cut cell's corner: the sample is that corner of the cell.
    #[inline]
    pub(crate) fn slope_of_quarter(&self, index: usize, corner: usize) -> [f32; 2] {
        match self.slopes.get(index) {
            Some(slopes) => [slopes[0][1 - corner % 2], slopes[1][1 - corner / 2]],
            None => self.slope(index),
        }
    }

    /// The mean of the steps to the linked neighbours along an axis, 0 without one. At an end of a surface that
    /// curves away the step grows on as it grew before.
    fn slope_along(&self, index: usize, place: usize, axis: usize) -> f32 {
        let step = [1, self.size[0]][axis];
        let here = self.disparity[index];
        let after = self
            .linked_on(index, axis)
            .then(|| self.disparity[index + step] - here);
        let before = (place > 0 && self.linked_on(index - step, axis))
            .then(|| here - self.disparity[index - step]);
        match (before, after) {
            (Some(b), Some(a)) => 0.5 * (a + b),
            (Some(b), None) => {
                let linked = place > 1 && self.linked_on(index - 2 * step, axis);
                b * self.growth(
                    here,
                    b,
                    linked.then(|| self.disparity[index - step] - self.disparity[index - 2 * step]),
                )
            }
            (None, Some(a)) => {
                let linked = self.linked_on(index + step, axis);
                let inner =
                    linked.then(|| self.disparity[index + 2 * step] - self.disparity[index + step]);
                a * self.growth(here, -a, inner.map(|i| -i))
            }
            (None, None) => 0.0,
        }
    }

    /// How much larger the next step outwards is than the last one, `outwards`, given the one before it.
    fn growth(&self, here: f32, outwards: f32, before: Option<f32>) -> f32 {
        let away = match self.projection {
            Projection::Perspective => outwards < 0.0,
            Projection::Orthographic => outwards > 0.0,
        };
        let steep = outwards.abs() > 0.5 * self.tolerance * here.abs();
        match before {
            Some(before) if away && steep && before * outwards > 0.0 => {
                (outwards / before).clamp(1.0, LIMB_RATIO)
            }
            _ => 1.0,
        }
    }

    fn joined_cells(&self) -> Vec<Cell> {
        let [width, height] = self.size;
        (0..(width + 1) * (height + 1))
            .into_par_iter()
            .map(|cell| self.joined(cell % (width + 1), cell / (width + 1)))
            .collect()
    }

    fn joined(&self, cx: usize, cy: usize) -> Cell {
        let [width, height] = self.size;
        if cx == 0 || cy == 0 || cx == width || cy == height {
            let known = self
                .corners(cx, cy)
                .iter()
                .flatten()
                .any(|&i| !self.disparity[i].is_nan());
            return if known { Cell::Cut } else { Cell::Empty };
        }
        let a = (cy - 1) * width + cx - 1;
        let [a, b, c, d] = [a, a + 1, a + width, a + width + 1];
        let around = [
            self.linked_on(a, 0),
            self.linked_on(c, 0),
            self.linked_on(a, 1),
            self.linked_on(b, 1),
        ];
        let values = [a, b, c, d].map(|i| self.disparity[i]);
        if values.iter().all(|v| v.is_nan()) {
            return Cell::Empty;
        }
        // Three links of four already lead to every corner.
        if around.iter().filter(|&&linked| linked).count() < 3 {
            return Cell::Cut;
        }
        let flatter_main = (values[0] - values[3]).abs() <= (values[1] - values[2]).abs();
        if flatter_main {
            Cell::MainDiagonal
        } else {
            Cell::AntiDiagonal
        }
    }

    /// Indices of a cell's corners (top left, top right, bottom left, bottom right), where there are samples.
    pub(crate) fn corners(&self, cx: usize, cy: usize) -> [Option<usize>; 4] {
        let [width, height] = self.size;
        let sample = |right: usize, below: usize| {
            let inside =
                cx + right >= 1 && cy + below >= 1 && cx + right <= width && cy + below <= height;
            inside.then(|| (cy + below - 1) * width + cx + right - 1)
        };
        [sample(0, 0), sample(1, 0), sample(0, 1), sample(1, 1)]
    }

    /// Two sweeps of a chamfer with unit steps give the Chebyshev distance exactly.
    fn clearances(&self) -> Vec<u8> {
        let [width, height] = self.size;
        let mut distance = vec![FAR_FROM_CUT; width * height];
        for cell in (0..self.cells.len())
            .filter(|&c| self.cells[c] == Cell::Cut || self.cells[c] == Cell::Empty)
        {
            for corner in self
                .corners(cell % (width + 1), cell / (width + 1))
                .into_iter()
                .flatten()
            {
                distance[corner] = 0;
            }
        }
        let relax = |distance: &mut [u8], index: usize, from: usize| {
            distance[index] = distance[index].min(distance[from].saturating_add(1));
        };
        for index in 0..width * height {
            let (x, y) = (index % width, index / width);
            if x > 0 {
                relax(&mut distance, index, index - 1);
            }
            if y > 0 {
                for from in
                    index - width - usize::from(x > 0)..=index - width + usize::from(x + 1 < width)
                {
                    relax(&mut distance, index, from);
                }
            }
        }
        for index in (0..width * height).rev() {
            let (x, y) = (index % width, index / width);
            if x + 1 < width {
                relax(&mut distance, index, index + 1);
            }
            if y + 1 < height {
                for from in
                    index + width - usize::from(x > 0)..=index + width + usize::from(x + 1 < width)
                {
                    relax(&mut distance, index, from);
                }
            }
        }
        distance
    }
}

/// The samples that are linked with the next along x and along y.
pub(crate) fn links(disparity: &[f32], size: [usize; 2], tolerance: f32) -> Vec<u8> {
    let [width, height] = size;
    let linked = |index: usize, place: usize, count: usize, step: usize| {
        if place + 1 >= count {
            return false;
        }
        let (a, b) = (disparity[index], disparity[index + step]);
        let allowed = tolerance * a.min(b);
        if (a - b).abs() <= allowed {
            return true;
        }
        // A NaN neighbour expects nothing, and no comparison with it is true.
        let expects = |near: f32, before: f32, far: f32| {
            let (ahead, behind) = (far - near, near - before);
            (ahead - behind).abs() <= allowed
                || (ahead * behind > 0.0 && ahead.abs() <= LIMB_RATIO * behind.abs())
        };
        let from_before = place > 0 && expects(a, disparity[index - step], b);
        let from_after = place + 2 < count && expects(b, disparity[index + 2 * step], a);
        from_before || from_after
    };
    let both = |index: usize| {
        let right = linked(index, index % width, width, 1);
        let below = linked(index, index / width, height, width);
        u8::from(right) * RIGHT + u8::from(below) * BELOW
    };
    (0..disparity.len()).into_par_iter().map(both).collect()
}

// Slopes of the samples beside cuts, which frames ask for; those of all others are computed when somebody asks.
//
// One bit a sample says which are kept, and a count for each word of bits where they begin.

/// Samples of a word.
const WORD: usize = 64;

/// Change of disparity of some samples along each axis, backwards and forwards.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slopes {
    kept: Vec<u64>,
    /// Number of slopes before those of each word.
    before: Vec<u32>,
    slopes: Vec<[[f32; 2]; 2]>,
}

impl Slopes {
    /// Those of the samples up to `count` for which `is_kept` holds.
    pub(crate) fn new(
        count: usize,
        is_kept: impl Fn(usize) -> bool + Sync,
        slope: impl Fn(usize) -> [[f32; 2]; 2] + Sync + Send,
    ) -> Self {
        let samples = |word: usize| word * WORD..((word + 1) * WORD).min(count);
        let bits = |word: usize| {
            let kept = samples(word).map(|index| u64::from(is_kept(index)) << (index % WORD));
            kept.sum::<u64>()
        };
        let kept: Vec<u64> = (0..count.div_ceil(WORD))
            .into_par_iter()
            .map(bits)
            .collect();
        let mut end = 0;
        let before = kept.iter().map(|bits| {
            let before = end;
            end += bits.count_ones();
            before
        });
        let before = before.collect();
        let is_set = |index: &usize| kept[index / WORD] >> (index % WORD) & 1 != 0;
        let slopes = (0..kept.len()).into_par_iter();
        let slopes = slopes.flat_map_iter(|word| samples(word).filter(is_set).map(&slope));
        Self {
            slopes: slopes.collect(),
            kept,
            before,
        }
    }

    /// The slope of a sample if it is kept.
    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> Option<[[f32; 2]; 2]> {
        let (word, bit) = (index / WORD, 1 << (index % WORD));
        let kept = self.kept[word];
        let among = (kept & (bit - 1)).count_ones();
        (kept & bit != 0).then(|| self.slopes[(self.before[word] + among) as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_cells_are_those_of_a_division() {
        for cells in [1, 2, 3, 7, 33, 641, 1921, 4096, 4097, 65_537, MAX_CELLS] {
            let rows = CellRows::new(cells);
            let last = MAX_CELLS - 1;
            let near_ends =
                (0..200).flat_map(|i| [i, last - i, (last / cells).saturating_sub(i) * cells]);
            let all = near_ends
                .chain((0..=last).step_by(99_991))
                .flat_map(|n| [n, n.saturating_sub(1)]);
            for cell in all {
                assert_eq!(
                    rows.row(cell),
                    cell / cells,
                    "cell {cell} in rows of {cells}"
                );
            }
        }
    }

    #[test]
    fn kept_slopes_are_found_and_others_are_not() {
        let is_kept = |i: usize| i.is_multiple_of(3) || i == 127;
        let slopes = Slopes::new(200, is_kept, |i| [[i as f32; 2], [-(i as f32); 2]]);
        for i in 0..200 {
            let expected = is_kept(i).then_some([[i as f32; 2], [-(i as f32); 2]]);
            assert_eq!(slopes.get(i), expected, "sample {i}");
        }
        assert!(Slopes::new(0, is_kept, |_| [[0.0; 2]; 2]).kept.is_empty());
    }
}
