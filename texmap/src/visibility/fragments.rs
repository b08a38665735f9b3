//! The triangles that the pixels of a row see: the share of the pixel's filter that each has, and where that lies.
//!
//! Takes the triangles at sub-pixels, gives sums and fragments. The pixels of a row of the tile are computed together: each row
//! of sub-pixels is a list of triangles with a bit for each column, and the bits under one weight of the filter, shifted,
//! are sixteen pixels that see the triangle there.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::screen::{IOTA, LANES, NONE, SPAN_HEIGHT, SPAN_WIDTH, WINDOW_PX};
use crate::visibility::edges::Edges;
use crate::visibility::filter::{PixelFilter, WindowRow};

/// One triangle in one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    /// Place in the tile's list.
    pub(crate) id: u32,
    /// Share of the pixel's filter, 0..=1.
    pub(crate) weight: f32,
    /// Weighted mean of its sub-pixels' positions, px from the corner of the tile's border.
    pub(crate) at: [f32; 2],
}

/// One triangle in a row of pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterSums {
    /// Place in the tile's list.
    pub(crate) id: u32,
    /// Shares of the pixels' filters.
    pub(crate) weight: [f32; LANES],
    /// Sums of its sub-pixels' weighted positions, px from the corner of the tile's border.
    pub(crate) at: [[f32; LANES]; 2],
}

/// A triangle that has less than this of a pixel is left out: its mean position would be rounding.
pub(crate) const LEAST_WEIGHT: f32 = 1e-4;

/// A triangle in a row of sub-pixels, with a bit for each column that shows it.
#[derive(Clone, Copy, Debug)]
struct TriangleColumns {
    id: u32,
    columns: u32,
}

/// The fragments of a tile's pixels, found row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fragments {
    /// By row of sub-pixels: where its triangles begin in `shown`; one more for the end. Empty before they are listed.
    starts: Vec<u32>,
    shown: Vec<TriangleColumns>,
    /// The row of pixels that `sums` belong to.
    row: Option<usize>,
    sums: Vec<FilterSums>,
    /// By place in the tile's list: place in `sums`, or [`NONE`].
    places: Vec<u32>,
}

impl Fragments {
    /// Forgets the last tile.
    pub(crate) fn clear(&mut self) {
        self.starts.clear();
        self.forget_row();
    }

    fn forget_row(&mut self) {
        for sums in self.sums.drain(..) {
            self.places[sums.id as usize] = NONE;
        }
        self.row = None;
    }

    /// Lists the triangles that `ids` (by sub-pixel of the tile, the same ones until all is forgotten) hold within the filter
    /// of pixel (x, y) of the tile.
    pub(crate) fn collect(
        &mut self,
        by: (&PixelFilter, Vectors),
        shown: (&[u32], &Edges),
        [x, y]: [usize; 2],
        fragments: &mut Vec<Fragment>,
    ) {
        let sums = self.sums(by, shown, y).iter();
        let seen = sums.filter(|sums| sums.weight[x] > LEAST_WEIGHT);
        fragments.clear();
        fragments.extend(seen.map(|sums| {
            let scale = 1.0 / sums.weight[x];
            Fragment {
                id: sums.id,
                weight: sums.weight[x],
                at: sums.at.map(|sums| sums[x] * scale),
            }
        }));
    }

    /// The triangles that `ids` hold within the filters of the pixels of row `y` of the tile.
    pub(crate) fn sums(
        &mut self,
        (filter, simd): (&PixelFilter, Vectors),
        (ids, edges): (&[u32], &Edges),
        y: usize,
    ) -> &[FilterSums] {
        if self.starts.is_empty() {
            self.list(ids, filter);
        }
        if self.row != Some(y) {
            self.forget_row();
            self.row = Some(y);
            dispatch!(simd, simd => sum_row(simd, (filter, ids, edges), y, self));
        }
        &self.sums
    }

    /// The sums of a triangle.
    #[inline(always)]
    fn of(&mut self, id: u32) -> &mut FilterSums {
        let place = id as usize;
        if place >= self.places.len() {
            self.places.resize(place + 1, NONE);
        }
        if self.places[place] == NONE {
            self.places[place] = self.sums.len() as u32;
            self.sums.push(FilterSums {
                id,
                weight: [0.0; LANES],
                at: [[0.0; LANES]; 2],
            });
        }
        &mut self.sums[self.places[place] as usize]
    }

    /// Lists the triangles of each row of sub-pixels.
    fn list(&mut self, ids: &[u32], filter: &PixelFilter) {
        self.shown.clear();
        self.starts.push(0);
        let mut before: &[u32] = &[];
        for ids in ids
            .chunks_exact(SPAN_WIDTH)
            .take(SPAN_HEIGHT * filter.per_pixel)
        {
            let start = self.shown.len();
            if ids == before {
                // Most rows show the triangles of the row above.
                let above = self.starts[self.starts.len() - 2] as usize;
                self.shown.extend_from_within(above..start);
            } else {
                let mut at = usize::MAX;
                for (column, &id) in ids.iter().enumerate().filter(|(_, id)| **id != NONE) {
                    if self.shown.get(at).is_none_or(|shown| shown.id != id) {
                        let known = self.shown[start..].iter().position(|shown| shown.id == id);
                        at = start + known.unwrap_or(self.shown.len() - start);
                        if known.is_none() {
                            self.shown.push(TriangleColumns { id, columns: 0 });
                        }
                    }
                    self.shown[at].columns |= 1 << column;
                }
            }
            self.starts.push(self.shown.len() as u32);
            before = ids;
        }
    }
}

impl FilterSums {
    /// Adds the columns of a row of sub-pixels that show the triangle; `first_px` is the position of the first column.
    #[inline(always)]
    fn add_row<S: Simd>(&mut self, simd: S, columns: u32, window: &WindowRow, first_px: [f32; 2]) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let mut weights = f32x16::from_slice(simd, &self.weight);
        let [mut x, mut y] = [0, 1].map(|k: usize| f32x16::from_slice(simd, &self.at[k]));
        let mut at = f32x16::from_slice(simd, &IOTA) + splat(first_px[0] + window.column as f32);
        for (k, &weight) in window.weights.iter().enumerate() {
            let columns = columns >> (window.column + k);
            let seen = mask32x16::from_bitmask(simd, u64::from(columns));
            let weight = seen.select(splat(weight), splat(0.0));
            weights += weight;
            x += weight * at;
            at += splat(1.0);
            y += weight * splat(first_px[1]);
        }
        weights.store_slice(&mut self.weight);
        x.store_slice(&mut self.at[0]);
        y.store_slice(&mut self.at[1]);
    }

    /// Adds a gain at a place.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, gain: f32x16<S>, at: [f32; 2]) {
        let sum = f32x16::from_slice(simd, &self.weight) + gain;
        sum.store_slice(&mut self.weight);
        for (sums, at) in self.at.iter_mut().zip(at) {
            let sum = f32x16::from_slice(simd, sums) + gain * f32x16::splat(simd, at);
            sum.store_slice(sums);
        }
    }
}

/// Sums the triangles of each pixel of row `y`.
#[simd]
fn sum_row<S: Simd>(
    simd: S,
    (filter, ids, edges): (&PixelFilter, &[u32], &Edges),
    y: usize,
    fragments: &mut Fragments,
) {
    for window in &filter.rows {
        let row = y * filter.per_pixel + window.row;
        let first_px = filter.position_px(0, row);
        let [start, end] = [row, row + 1].map(|row| fragments.starts[row] as usize);
        for at in start..end {
            let TriangleColumns { id, columns } = fragments.shown[at];
            fragments.of(id).add_row(simd, columns, window, first_px);
        }
    }
    for edge in edges.of_cells(y * SPAN_WIDTH..(y + WINDOW_PX) * SPAN_WIDTH) {
        let [p, q] = edge.between.map(|at| at as usize);
        let [of_p, of_q] = [p, q].map(|at| filter.weights(simd, y, at));
        let [share_p, share_q] = edge.shares.map(|share| f32x16::splat(simd, share));
        // Of each pixel count the edges that begin in the cells that its filter reaches.
        let begins = (((1 << WINDOW_PX) - 1) << (p % SPAN_WIDTH)) >> (WINDOW_PX - 1);
        let zero = f32x16::splat(simd, 0.0);
        let gain = share_p * of_p + share_q * of_q;
        let gain = mask32x16::from_bitmask(simd, begins).select(gain, zero);
        let [from, to] = [p, q].map(|at| filter.position_px(at % SPAN_WIDTH, at / SPAN_WIDTH));
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        // The second loses as much as the first gains; each at its own place.
        for (id, gain) in [(ids[p], gain), (ids[q], zero - gain)] {
            if id != NONE {
                fragments.of(id).add(simd, gain, middle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screen::{TILE_HEIGHT, TILE_WIDTH};
    use crate::visibility::edges::Crossing;
    use resample_core::simd::SimdLevel;

    /// Triangles of three slanted bands, one of them broken by a stripe of nothing.
    fn bands(filter: &PixelFilter) -> Vec<u32> {
        let at = |place: usize| filter.position_px(place % SPAN_WIDTH, place / SPAN_WIDTH);
        let shown = |[x, y]: [f32; 2]| match x + 0.37 * y {
            _ if (6.1..6.6).contains(&(y - 0.2 * x)) => NONE,
            t if t < 9.3 => 4,
            t if t < 11.9 => 0,
            _ => 7,
        };
        let count = SPAN_WIDTH * SPAN_HEIGHT * filter.per_pixel;
        let shown = (0..count).map(|place| shown(at(place)));
        shown.chain([NONE; LANES]).collect()
    }

    /// The share and the weighted position of a triangle in a pixel, sub-pixel by sub-pixel, in f64.
    fn slow(
        filter: &PixelFilter,
        (ids, edges): (&[u32], &Edges),
        [x, y]: [usize; 2],
        id: u32,
    ) -> [f64; 3] {
        let mut sums = [0.0; 3];
        let mut add = |weight: f64, at: [f64; 2]| {
            sums[0] += weight;
            sums[1] += weight * at[0];
            sums[2] += weight * at[1];
        };
        let at = |place: usize| {
            filter
                .position_px(place % SPAN_WIDTH, place / SPAN_WIDTH)
                .map(f64::from)
        };
        // The weight in the pixel of any sub-pixel, from the list of the filter's rows.
        let weight = |place: usize| {
            let (column, row) = (place % SPAN_WIDTH, place / SPAN_WIDTH);
            let window = filter
                .rows
                .iter()
                .find(|window| window.row + y * filter.per_pixel == row);
            let of_row = |window: &WindowRow| {
                let k = column.checked_sub(x + window.column)?;
                window.weights.get(k).copied()
            };
            f64::from(window.and_then(of_row).unwrap_or(0.0))
        };
        for place in (0..ids.len()).filter(|&place| ids[place] == id) {
            add(weight(place), at(place));
        }
        for edge in &edges.all {
            let [p, q] = edge.between.map(|at| at as usize);
            let begin = [p % SPAN_WIDTH, p / SPAN_WIDTH / filter.per_pixel];
            let near = |axis: usize, from: usize| (from..from + WINDOW_PX).contains(&begin[axis]);
            if !(near(0, x) && near(1, y)) {
                continue;
            }
            let [share_p, share_q] = edge.shares.map(f64::from);
            let gain = share_p * weight(p) + share_q * weight(q);
            let (from, to) = (at(p), at(q));
            let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
            if ids[p] == id {
                add(gain, middle);
            }
            if ids[q] == id {
                add(-gain, middle);
            }
        }
        sums
    }

    #[test]
    fn a_row_of_pixels_is_what_each_pixel_is_alone() {
        for n in [1, 2, 4] {
            let filter = PixelFilter::new(n);
            let ids = bands(&filter);
            let mut edges = Edges::default();
            edges.find((&filter, SimdLevel::Auto.resolve()), &ids, |_| {
                Some(Crossing {
                    t: 0.3,
                    across: [1.0, 0.4],
                })
            });
            assert!(!edges.all.is_empty(), "{n}: no edges");
            let mut fragments = Fragments::default();
            let mut found = Vec::new();
            for simd in SimdLevel::ALL.map(SimdLevel::resolve) {
                fragments.clear();
                for pixel in (0..TILE_WIDTH * TILE_HEIGHT).map(|i| [i % TILE_WIDTH, i / TILE_WIDTH])
                {
                    let shown = (&ids[..], &edges);
                    fragments.collect((&filter, simd), shown, pixel, &mut found);
                    for id in [0, 4, 7] {
                        let [weight, x, y] = slow(&filter, shown, pixel, id);
                        let fragment = found.iter().find(|fragment| fragment.id == id);
                        let Some(fragment) = fragment else {
                            assert!(weight < 2e-4, "{n}, {pixel:?}: {id} has {weight}");
                            continue;
                        };
                        assert!((f64::from(fragment.weight) - weight).abs() < 1e-6);
                        for (is, sum) in fragment.at.into_iter().zip([x, y]) {
                            let off = (f64::from(is) * weight - sum).abs();
                            assert!(off < 3e-5, "{n}, {pixel:?}: {id} is {off} px off");
                        }
                    }
                }
            }
        }
    }
}
