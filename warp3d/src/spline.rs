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

use crate::surface::Surfaces;

/// Coefficients whose cubic B-spline passes through `samples`.
pub(crate) fn coefficients(samples: &[[f32; 4]], surfaces: &Surfaces) -> Vec<[f32; 4]> {
    let [width, height] = surfaces.size;
    let mut rows = samples.to_vec();
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        solve_runs(row, |x| surfaces.linked_on(y * width + x, 0));
    });
    let mut columns = transposed(&rows, width, height);
    columns.par_chunks_mut(height).enumerate().for_each(|(x, column)| {
        solve_runs(column, |y| surfaces.linked_on(y * width + x, 1));
    });
    transposed(&columns, height, width)
}

/// Solves every run; `linked(i)` says whether entry i and the next are in one run.
fn solve_runs(line: &mut [[f32; 4]], linked: impl Fn(usize) -> bool) {
    let mut scratch = vec![0.0; line.len()];
    let mut first = 0;
    for i in 0..line.len() {
        if i + 1 == line.len() || !linked(i) {
            solve(&mut line[first..=i], &mut scratch);
            first = i + 1;
        }
    }
}

/// Solves `(c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i]` with c = f at both ends, in place (Thomas).
fn solve(run: &mut [[f32; 4]], scratch: &mut [f32]) {
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

fn transposed(from: &[[f32; 4]], width: usize, height: usize) -> Vec<[f32; 4]> {
    let mut to = vec![[0.0; 4]; from.len()];
    to.par_chunks_mut(height).enumerate().for_each(|(x, column)| {
        column.iter_mut().enumerate().for_each(|(y, v)| *v = from[y * width + x]);
    });
    to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_of_the_coefficients_passes_through_the_samples() {
        let samples: Vec<[f32; 4]> = (0..40).map(|i| [((i * i * 7) % 13) as f32 / 13.0; 4]).collect();
        let mut c = samples.clone();
        solve_runs(&mut c, |i| i != 20);
        for i in (1..20).chain(22..39) {
            let met = (c[i - 1][0] + 4.0 * c[i][0] + c[i + 1][0]) / 6.0;
            assert!((met - samples[i][0]).abs() < 1e-6, "sample {i}: {met} against {}", samples[i][0]);
        }
        for end in [0, 20, 21, 39] {
            assert_eq!(c[end], samples[end], "natural end at {end}");
        }
    }
}
