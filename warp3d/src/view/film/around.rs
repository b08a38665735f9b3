//! Sums, means and extremes over the pixels around each pixel.

use rayon::prelude::*;

/// Joins the number of each pixel with those within `reach` of it, as far as they lie in the picture: along rows, then along columns.
pub(super) fn around<T: Copy + Send + Sync>(
    values: &[T],
    width: usize,
    reach: usize,
    join: impl Fn(&mut T, T) + Sync,
) -> Vec<T> {
    let height = values.len() / width;
    let add = |to: &mut [T], from: &[T]| {
        to.iter_mut()
            .zip(from)
            .for_each(|(to, &value)| join(to, value));
    };
    let mut along = values.to_vec();
    let rows = along.par_chunks_mut(width).zip(values.par_chunks(width));
    rows.for_each(|(to, row)| {
        for step in 1..=reach.min(width - 1) {
            add(to, &row[step..]);
            add(&mut to[step..], row);
        }
    });
    let mut all = along.clone();
    all.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
        for other in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            if other != y {
                add(to, &along[other * width..][..width]);
            }
        }
    });
    all
}

/// The mean of the box of `reach` pixels to each side, as far as it lies in the picture; infinite numbers stay.
pub(super) fn boxes(values: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let width = width.max(1);
    let height = values.len() / width;
    let mut sums = around(values, width, reach, |sum, value| *sum += value);
    let count = |at: usize, side: usize| (at + reach + 1).min(side) - at.saturating_sub(reach);
    let rows = sums.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, row)| {
        let rows = count(y, height);
        for (x, sum) in row.iter_mut().enumerate() {
            *sum /= (rows * count(x, width)) as f32;
        }
    });
    sums
}
