//! Cubic spline coefficients of the colours, surface by surface.
//!
//! The cubic B-spline is smooth but a blur; with coefficients solved for, it interpolates, and follows a band-limited
//! picture about as well as a Lanczos filter of six taps at the cost of four (Unser 1999). Coefficients are solved along
//! each run of linked samples, first along rows and then along columns, with natural ends: a run continued linearly is
//! what lookups beyond its end assume.
//!
//! Limits: where a surface's outline is ragged the two directions see different runs, and samples there are met to
//! second order only.

use rayon::prelude::*;

use crate::surfaces::surface::Surfaces;

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
