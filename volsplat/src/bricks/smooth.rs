//! Values blurred along the short axes of a grid: their differences are smooth gradients.
//!
//! Takes the spacing of a grid, gives Gaussians of half its greatest spacing along the axes of shorter ones, less what their own spacing
//! blurs. A field that is sampled once in five millimetres has no detail below that along one axis; a gradient that has it along
//! the others turns with the terrace between two slices, not with the surface that was scanned.
//! Limits: the field itself is not blurred, so the terraces' outlines stay.

use std::ops::Range;

use glam::DMat3;
use resample_core::narrow::{count, single, whole};
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

    /// The blurred values of a cube of `N` voxels along each side, x fastest, from one voxel before `corner` on. Beyond the volume the field
    /// goes on as a point reflection in its face, so that a field that rises evenly does so there, too.
    pub(crate) fn cube<T: Copy, const N: usize>(
        &self,
        grid: &Grid<T>,
        value: impl Fn(T) -> f32,
        corner: [u32; 3],
    ) -> Vec<f32> {
        let window = [0, 1, 2].map(|axis| {
            let before = 1 + self.weights[axis].len() / 2;
            let (corner, count) = (corner[axis] as usize, N - 2 + 2 * before);
            let first = corner.saturating_sub(before);
            Window {
                first,
                before: before.saturating_sub(corner),
                inside: grid.dims[axis].min(corner + count - before) - first,
                count,
            }
        });
        let [across, down, deep] = &window;
        let mut row = vec![0.0; across.count];
        let mut along_x = vec![0.0; N * down.count * deep.count];
        for z in deep.places() {
            for y in down.places() {
                let voxels = grid.row([0, down.voxel(y), deep.voxel(z)], grid.dims[0]);
                for x in across.places() {
                    row[x] = value(voxels[across.voxel(x)]);
                }
                across.extend(&mut row, 1);
                let out = &mut along_x[(z * down.count + y) * N..][..N];
                blur::<N>(&row, &self.weights[0], 1, out);
            }
        }
        let mut along_y = vec![0.0; N * N * deep.count];
        for z in deep.places() {
            let layer = &mut along_x[z * down.count * N..][..down.count * N];
            down.extend(layer, N);
            for y in 0..N {
                let out = &mut along_y[(z * N + y) * N..][..N];
                blur::<N>(&layer[y * N..], &self.weights[1], N, out);
            }
        }
        deep.extend(&mut along_y, N * N);
        let mut along_z = vec![0.0; N * N * N];
        for (place, out) in along_z.chunks_exact_mut(N).enumerate() {
            blur::<N>(&along_y[place * N..], &self.weights[2], N * N, out);
        }
        along_z
    }
}

/// The voxels along an axis that a cube needs, some of them beyond the volume.
struct Window {
    /// The first voxel inside the volume.
    first: usize,
    /// Places before the volume.
    before: usize,
    /// Places inside the volume.
    inside: usize,
    /// All places.
    count: usize,
}

impl Window {
    /// The places inside the volume.
    fn places(&self) -> Range<usize> {
        self.before..self.before + self.inside
    }

    /// The voxel at a place inside the volume.
    fn voxel(&self, place: usize) -> usize {
        self.first + place - self.before
    }

    /// Fills the lines of `len` values at the places beyond the volume with twice the line at the face, less its mirror image.
    fn extend(&self, lines: &mut [f32], len: usize) {
        let Range { start, end } = self.places();
        let beyond = (0..start).map(|place| (place, start, (2 * start - place).min(end - 1)));
        let last = end - 1;
        let behind = (end..self.count).map(|place| {
            let mirror = (2 * last).saturating_sub(place).max(start);
            (place, last, mirror)
        });
        for (place, face, mirror) in beyond.chain(behind) {
            for k in 0..len {
                lines[place * len + k] = 2.0 * lines[face * len + k] - lines[mirror * len + k];
            }
        }
    }
}

/// Writes the weighted sum of rows of `N` values, each `step` after the one before.
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
    let weighed = 2 * count(whole(radius)) + 1;
    let place = |i: usize| (i as f64 - radius) / deviation;
    let weights: Vec<f64> = (0..weighed)
        .map(|i| (-0.5 * place(i) * place(i)).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| single(weight / sum)).collect()
}
