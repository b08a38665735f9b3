//! Values blurred along the short axes of a grid: their differences are smooth gradients.
//!
//! Takes the spacing of a grid, gives Gaussians of half its greatest spacing along the axes of shorter ones, less what their own spacing
//! blurs. A field that is sampled once in five millimetres has no detail below that along one axis; a gradient that has it along
//! the others turns with the terrace between two slices, not with the surface that was scanned.
//! Limits: the field itself is not blurred, so the terraces' outlines stay.

use glam::DMat3;
use resample_volume::volume::Grid;

/// Standard deviation of the Gaussian, greatest spacings: of balls, skulls, rods and lobes sampled in thick slices, this has the least error of the
/// gradients' directions over all, from 0.2 to 0.8.
const DEVIATION: f64 = 0.5;

/// Least standard deviation, voxels, that is not left out: beside it the nearest voxels weigh 0.4 %.
const LEAST_DEVIATION: f64 = 0.3;

/// Greatest standard deviation, voxels: slices ten times as far apart as their pixels. Beyond, preparing would take longer than drawing.
const GREATEST_DEVIATION: f64 = 5.0;

/// End of the Gaussian, standard deviations: it leaves out 1.2 % of the sum.
const TRUNCATED_AT: f64 = 2.5;

/// A blur along each axis.
#[derive(Clone, Debug)]
pub(crate) struct Smoothing {
    /// The weights of the voxels around each, in order; their number is odd, and 1 where the axis is not blurred.
    weights: [Vec<f32>; 3],
}

impl Smoothing {
    /// The smoothing of a grid with these axes; `None` where its spacings are alike.
    pub(crate) fn new(world_from_index: &DMat3) -> Option<Self> {
        let spacing = [0, 1, 2].map(|axis| world_from_index.col(axis).length());
        let greatest = spacing.into_iter().fold(0.0, f64::max);
        let deviations = spacing.map(|spacing| {
            let ratio = greatest / spacing;
            (DEVIATION * (ratio * ratio - 1.0).max(0.0).sqrt()).min(GREATEST_DEVIATION)
        });
        let is_blurred = |deviation: &f64| *deviation >= LEAST_DEVIATION;
        deviations.iter().any(is_blurred).then(|| Self {
            weights: deviations.map(|deviation| match is_blurred(&deviation) {
                true => gaussian(deviation),
                false => vec![1.0],
            }),
        })
    }

    /// Voxels on either side that a blurred value depends on, along each axis.
    pub(crate) fn radius(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.weights[axis].len() / 2)
    }

    /// The blurred values of a cube of `N` voxels along each side, x fastest, from one voxel before `corner` on; what lies beyond the
    /// volume is the nearest inside.
    pub(crate) fn cube<T: Copy, const N: usize>(
        &self,
        grid: &Grid<T>,
        value: impl Fn(T) -> f32,
        corner: [u32; 3],
    ) -> Vec<f32> {
        let radius = self.radius();
        let indices: [Vec<usize>; 3] = [0, 1, 2].map(|axis| {
            let from_first =
                |i: usize| (corner[axis] as usize + i).saturating_sub(1 + radius[axis]);
            let last = grid.dims[axis] - 1;
            (0..N + 2 * radius[axis])
                .map(|i| from_first(i).min(last))
                .collect()
        });
        let [width, height, depth] = [0, 1, 2].map(|axis| indices[axis].len());
        let mut values = vec![0.0; width];
        let mut along_x = vec![0.0; N * height * depth];
        let mut rows = along_x.chunks_exact_mut(N);
        for &z in &indices[2] {
            for &y in &indices[1] {
                let row = grid.row([0, y, z], grid.dims[0]);
                for (entry, &x) in values.iter_mut().zip(&indices[0]) {
                    *entry = value(row[x]);
                }
                if let Some(out) = rows.next() {
                    blur::<N>(&values, &self.weights[0], 1, out);
                }
            }
        }
        let mut along_y = vec![0.0; N * N * depth];
        for (layer, out) in along_x
            .chunks_exact(N * height)
            .zip(along_y.chunks_exact_mut(N * N))
        {
            for (y, out) in out.chunks_exact_mut(N).enumerate() {
                blur::<N>(&layer[y * N..], &self.weights[1], N, out);
            }
        }
        let mut along_z = vec![0.0; N * N * N];
        for (row, out) in along_z.chunks_exact_mut(N).enumerate() {
            blur::<N>(&along_y[row * N..], &self.weights[2], N * N, out);
        }
        along_z
    }
}

/// Adds rows of `N` values, each `step` after the one before, by their weights.
fn blur<const N: usize>(values: &[f32], weights: &[f32], step: usize, out: &mut [f32]) {
    let mut sum = [0.0; N];
    for (row, &weight) in values.windows(N).step_by(step).zip(weights) {
        for (sum, &value) in sum.iter_mut().zip(row) {
            *sum += weight * value;
        }
    }
    out.copy_from_slice(&sum);
}

/// A Gaussian at whole numbers around 0, with a sum of 1.
fn gaussian(deviation: f64) -> Vec<f32> {
    let radius = (TRUNCATED_AT * deviation).ceil();
    let count = 2 * radius as usize + 1;
    let place = |i: usize| (i as f64 - radius) / deviation;
    let weights: Vec<f64> = (0..count)
        .map(|i| (-0.5 * place(i) * place(i)).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| (weight / sum) as f32).collect()
}
