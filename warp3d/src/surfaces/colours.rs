//! The colours of a reference's samples, as coefficients of a cubic spline, surface by surface.

use fearless_simd::prelude::*;
use fearless_simd::{i32x8, u32x8};
use rayon::prelude::*;

use crate::surfaces::input_copy::TakenColours;
use crate::surfaces::surface::{RECOLOURED, Surfaces};

// The colours of a reference as surfaces have them: the reference's own, except a few beside edges.

/// Samples that one task looks at.
const PART: usize = 1 << 16;

/// The colours that are looked up.
#[derive(Clone, Debug)]
pub(crate) struct Colours {
    /// Coefficients of the cubic spline through the samples.
    pub(crate) coefficients: Coefficients,
    /// The reference's own.
    pub(crate) taken: TakenColours,
    /// Samples that have another colour than the reference, in order, and that colour.
    recoloured: Vec<(u32, [f32; 3])>,
}

impl Colours {
    /// With the samples' colours as they are unmixed, where they differ from those `taken`; `surfaces` record which.
    /// Coefficients are still to be found.
    pub(crate) fn new(
        samples: Vec<[f32; 3]>,
        taken: TakenColours,
        surfaces: &mut Surfaces,
    ) -> Self {
        let links = surfaces.links.par_chunks_mut(PART);
        let parts = links.zip(samples.par_chunks(PART)).enumerate();
        let recoloured = parts.flat_map_iter(|(part, (links, samples))| {
            let mut recoloured = Vec::new();
            for (i, (links, sample)) in links.iter_mut().zip(samples).enumerate() {
                let index = part * PART + i;
                if *sample != taken.get(index) {
                    recoloured.push((index as u32, *sample));
                    *links |= RECOLOURED;
                }
            }
            recoloured
        });
        Self {
            recoloured: recoloured.collect(),
            coefficients: Coefficients::new(samples),
            taken,
        }
    }

    /// The colour of a sample, which is the reference's own unless its links say otherwise.
    #[inline(always)]
    pub(crate) fn sample(&self, index: usize, links: u8) -> [f32; 3] {
        if links & RECOLOURED == 0 {
            return self.taken.get(index);
        }
        let place = self
            .recoloured
            .binary_search_by_key(&(index as u32), |&(index, _)| index);
        place.map_or_else(|_| self.taken.get(index), |place| self.recoloured[place].1)
    }
}

/// Linear red, green and blue of each sample.
#[derive(Clone, Debug)]
pub(crate) struct Coefficients(Vec<[f32; 3]>);

impl Coefficients {
    /// Entries behind the samples, so that vectors can be loaded at the last ones.
    const MORE: usize = 2;

    fn new(mut samples: Vec<[f32; 3]>) -> Self {
        samples.reserve_exact(Self::MORE);
        samples.extend([[0.0; 3]; Self::MORE]);
        Self(samples)
    }

    /// Number of samples.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.0.len() - Self::MORE
    }

    /// The samples.
    pub(crate) fn samples_mut(&mut self) -> &mut [[f32; 3]] {
        let count = self.len();
        &mut self.0[..count]
    }

    /// The numbers of four samples, and four more.
    #[inline(always)]
    pub(crate) fn sixteen(&self, first: usize) -> &[f32] {
        &self.0.as_flattened()[3 * first..3 * first + 16]
    }

    /// The numbers of a sample, and one more.
    #[inline(always)]
    pub(crate) fn four(&self, sample: usize) -> &[f32] {
        &self.0.as_flattened()[3 * sample..3 * sample + 4]
    }
}

/// The number of a sample beside which there are not sixteen.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// The numbers of eight samples by their columns and rows, [`NOWHERE`] for those that have not one column and row of samples
/// before them and two behind.
#[inline(always)]
pub(crate) fn eight_samples<S: Simd>(simd: S, [x, y]: [i32x8<S>; 2], size: [usize; 2]) -> u32x8<S> {
    let constant = |v: i32| i32x8::splat(simd, v);
    let [width, height] = [size[0] as i32, size[1] as i32];
    let behind = x.simd_lt(constant(width - 2)) & y.simd_lt(constant(height - 2));
    let inside = x.simd_gt(constant(0)) & y.simd_gt(constant(0)) & behind;
    let index: i32x8<S> = inside.select(y * constant(width) + x, constant(NOWHERE as i32));
    index.bitcast()
}

// Cubic spline coefficients of the colours, surface by surface.
//
// The cubic B-spline is smooth but a blur; with coefficients solved for, it interpolates, and follows a band-limited
// picture about as well as a Lanczos filter of six taps at the cost of four (Unser 1999). Coefficients are solved along
// each run of linked samples, first along rows and then along columns, with natural ends: a run continued linearly is
// what lookups beyond its end assume.
//
// Limits: where a surface's outline is ragged the two directions see different runs, and samples there are met to
// second order only.

/// Columns that one task solves: a row of them is several cache lines long, and their pivots stay in a near cache.
const STRIP: usize = 32;

/// Turns samples into the coefficients whose cubic B-spline passes through them.
pub(crate) fn solve<const C: usize>(rows: &mut [[f32; C]], surfaces: &Surfaces) {
    let width = surfaces.size[0];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        solve_runs(row, |x| surfaces.linked_on(y * width + x, 0));
    });
    let mut strips: Vec<Vec<&mut [[f32; C]]>> =
        (0..width.div_ceil(STRIP)).map(|_| Vec::new()).collect();
    for row in rows.chunks_mut(width) {
        strips
            .iter_mut()
            .zip(row.chunks_mut(STRIP))
            .for_each(|(strip, part)| strip.push(part));
    }
    strips
        .par_iter_mut()
        .enumerate()
        .for_each(|(index, strip)| {
            solve_columns(strip, |x, y| {
                surfaces.linked_on(y * width + index * STRIP + x, 1)
            });
        });
}

/// Solves every run down the columns of a strip, given by its rows, as [`solve_run`] does; `linked(x, y)` says whether an
/// entry and the one below are in one run. All columns go down together, so that memory is read along rows.
fn solve_columns<const C: usize>(
    strip: &mut [&mut [[f32; C]]],
    linked: impl Fn(usize, usize) -> bool,
) {
    let width = strip.first().map_or(0, |row| row.len());
    // 0 at the ends of runs, which stay as they are.
    let mut pivots = vec![0.0f32; width * strip.len()];
    for y in 1..strip.len().saturating_sub(1) {
        let (above, rest) = strip.split_at_mut(y);
        for (x, (value, before)) in rest[0].iter_mut().zip(above[y - 1].iter()).enumerate() {
            if !(linked(x, y - 1) && linked(x, y)) {
                continue;
            }
            let pivot = 1.0 / (4.0 - pivots[(y - 1) * width + x]);
            pivots[y * width + x] = pivot;
            *value = std::array::from_fn(|c| (6.0 * value[c] - before[c]) * pivot);
        }
    }
    for y in (1..strip.len().saturating_sub(1)).rev() {
        let (here, below) = strip.split_at_mut(y + 1);
        for (x, (value, after)) in here[y].iter_mut().zip(below[0].iter()).enumerate() {
            let pivot = pivots[y * width + x];
            if pivot > 0.0 {
                *value = std::array::from_fn(|c| value[c] - pivot * after[c]);
            }
        }
    }
}

/// Solves every run; `linked(i)` says whether entry i and the next are in one run.
fn solve_runs<const C: usize>(line: &mut [[f32; C]], linked: impl Fn(usize) -> bool) {
    let mut scratch = vec![0.0; line.len()];
    let mut first = 0;
    for i in 0..line.len() {
        if i + 1 == line.len() || !linked(i) {
            solve_run(&mut line[first..=i], &mut scratch);
            first = i + 1;
        }
    }
}

/// Solves `(c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i]` with c = f at both ends, in place (Thomas).
fn solve_run<const C: usize>(run: &mut [[f32; C]], scratch: &mut [f32]) {
    if run.len() < 3 {
        return;
    }
    let last = run.len() - 1;
    scratch[0] = 0.0;
    for i in 1..last {
        let pivot = 1.0 / (4.0 - scratch[i - 1]);
        scratch[i] = pivot;
        run[i] = std::array::from_fn(|c| (6.0 * run[i][c] - run[i - 1][c]) * pivot);
    }
    for i in (1..last).rev() {
        run[i] = std::array::from_fn(|c| run[i][c] - scratch[i] * run[i + 1][c]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_of_the_coefficients_passes_through_the_samples() {
        let samples: Vec<[f32; 4]> = (0..40)
            .map(|i| [((i * i * 7) % 13) as f32 / 13.0; 4])
            .collect();
        let mut c = samples.clone();
        solve_runs(&mut c, |i| i != 20);
        for i in (1..20).chain(22..39) {
            let met = (c[i - 1][0] + 4.0 * c[i][0] + c[i + 1][0]) / 6.0;
            assert!(
                (met - samples[i][0]).abs() < 1e-6,
                "sample {i}: {met} against {}",
                samples[i][0]
            );
        }
        for end in [0, 20, 21, 39] {
            assert_eq!(c[end], samples[end], "natural end at {end}");
        }
    }

    #[test]
    fn columns_are_solved_as_lines_are() {
        let value = |x: usize, y: usize| ((x * 31 + y * y * 7) % 13) as f32 / 13.0;
        let cut =
            |x: usize, y: usize| (x + 3 * y).is_multiple_of(17) || (x == 2 && y.is_multiple_of(2));
        let (width, height) = (5, 40);
        let mut rows: Vec<Vec<[f32; 4]>> = (0..height)
            .map(|y| (0..width).map(|x| [value(x, y); 4]).collect())
            .collect();
        let mut strip: Vec<&mut [[f32; 4]]> = rows.iter_mut().map(Vec::as_mut_slice).collect();
        solve_columns(&mut strip, |x, y| !cut(x, y));
        for x in 0..width {
            let mut line: Vec<[f32; 4]> = (0..height).map(|y| [value(x, y); 4]).collect();
            solve_runs(&mut line, |y| !cut(x, y));
            let column: Vec<[f32; 4]> = rows.iter().map(|row| row[x]).collect();
            assert_eq!(column, line, "column {x}");
        }
    }
}
