//! Interpolating coefficients, by Gaussian elimination on the whole system in f64.
//!
//! One equation a voxel: the kernels' sum there, over the sum of the kernels, is the voxel's scalar. Voxels beyond the volume
//! are the nearest ones inside. Limits: cubic in the number of voxels.

use volsplat::Volume;

use crate::twins::field::ReferenceKernel;

/// The coefficients of a volume, x fastest.
pub fn coefficients(volume: &Volume, kernel: &ReferenceKernel) -> Vec<f64> {
    let n = volume.len();
    let dims = volume.dims;
    let offsets: Vec<[i64; 3]> = (0..125)
        .map(|k| [k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2])
        .collect();
    let value = |d: &[i64; 3]| kernel.value(d.iter().map(|v| (v * v) as f64).sum::<f64>().sqrt());
    let total: f64 = offsets.iter().map(value).sum();
    let mut rows = vec![vec![0.0; n + 1]; n];
    for (i, row) in rows.iter_mut().enumerate() {
        row[n] = volume.value(i);
        let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        for d in &offsets {
            let [x, y, z]: [usize; 3] = std::array::from_fn(|a| {
                (at[a] as i64 + d[a]).clamp(0, dims[a] as i64 - 1) as usize
            });
            row[x + dims[0] * (y + dims[1] * z)] += value(d) / total;
        }
    }
    eliminate(&mut rows);
    rows.iter()
        .enumerate()
        .map(|(i, row)| row[n] / row[i])
        .collect()
}

/// Leaves one unknown in each row.
fn eliminate(rows: &mut [Vec<f64>]) {
    for column in 0..rows.len() {
        let by_size =
            |a: &usize, b: &usize| rows[*a][column].abs().total_cmp(&rows[*b][column].abs());
        let pivot = (column..rows.len()).max_by(by_size).expect("a row is left");
        rows.swap(column, pivot);
        let pivot = rows[column].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let factor = row[column] / pivot[column];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(value, above)| *value -= factor * above);
        }
    }
}
