//! The voxels that a post-classified sum of wide kernels needs, and coefficients in place of their scalars, so that the kernels' sum passes
//! through the data.
//!
//! A kernel that is not 0 at its neighbours blurs: at a voxel, the normalised sum is a mean over the neighbourhood. Solved
//! for at load, the coefficients c of sum_k c_k h(x_i - x_k) / sum_k h(x_k) = f_i undo that at every voxel. The operator is a
//! stencil of 27 weights whose symbol lies between its least value and 1, both known in closed form, so that Chebyshev steps
//! need no inner product: the same digits on any number of threads. Between voxels the sum may overshoot; the tiles clamp it
//! to the range of the voxels in reach. Source: the idea is M. Unser's for B-splines (IEEE Signal Processing Magazine 1999);
//! a radial kernel is not separable, so that his recursive filter does not serve.
//! Limits: kernels of radius up to 2. Beyond the volume the outermost coefficients go on.
//!
//! A kernel reaches over [`REACH`] voxels, so a place may be visible when the scalars within its reach range over a visible
//! one; every voxel that reaches such a place is *needed*. A place next to it is reached by some needed voxels as well, and
//! would be classified from a part of its neighbours: so the voxels around the needed ones are kept too, without being
//! needed, and places that no needed voxel reaches are known to be invisible. The volume is continued beyond its faces by its
//! outermost voxels, so that sums are complete up to them; indices count from [`MARGIN`] before the first voxel.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use resample_core::Kernel;
use resample_volume::volume::{Grid, Volume, with_voxels};

use crate::bricks::support::Support;
use crate::grid::{BRICK_SIDE, Bounds, brick_corners, pack_place, place};
use crate::look::scene::count_visible;
use crate::look::transfer::TransferFunction;
use crate::paper::samples::sample::{Brick, Samples};

/// The residual at which the steps end, as a share of the range of the data: a fifth of a step of 8-bit data.
const RESIDUAL: f32 = 1.0 / 1280.0;

/// Steps at most. For the widest kernel, whose least value of the symbol is 0.02, they reduce any error 3000 times.
const STEPS: usize = 28;

/// Coefficients for one volume.
#[derive(Clone, Debug)]
pub(crate) struct Coefficients {
    /// One for each voxel, x fastest.
    pub(crate) values: Vec<f32>,
    /// The largest difference between the kernels' sum at a voxel and its scalar.
    pub(crate) residual: f32,
}

/// The weights of the kernel at a voxel and at those next to it by face, edge and corner; they sum to 1 over all 27.
#[derive(Clone, Copy, Debug)]
struct Stencil([f32; 4]);

impl Stencil {
    fn new(kernel: &Kernel) -> Self {
        let at: [f64; 4] = std::array::from_fn(|n| kernel.value(n as f64));
        let sum = at[0] + 6.0 * at[1] + 12.0 * at[2] + 8.0 * at[3];
        Self(at.map(|weight| (weight / sum) as f32))
    }

    /// The least value of the symbol. It is a polynomial of first degree in each cosine, so that it lies where all are 1
    /// or -1: along so many axes the sign changes from voxel to voxel.
    fn least(&self) -> f32 {
        let [centre, face, edge, corner] = self.0;
        let at = |changing: i32| {
            let cosine = |axis: i32| if axis < changing { -1.0f32 } else { 1.0 };
            let [x, y, z] = [cosine(0), cosine(1), cosine(2)];
            centre
                + 2.0 * face * (x + y + z)
                + 4.0 * edge * (x * y + y * z + x * z)
                + 8.0 * corner * x * y * z
        };
        (0..=3).map(at).fold(f32::INFINITY, f32::min)
    }
}

/// Solves for the coefficients of `scalars`, x fastest.
pub(crate) fn coefficients(scalars: &[f32], dims: [usize; 3], kernel: &Kernel) -> Coefficients {
    let stencil = Stencil::new(kernel);
    let (low, high) = scalars.par_iter().map(|&v| (v, v)).reduce(
        || (f32::INFINITY, f32::NEG_INFINITY),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    let enough = RESIDUAL * (high - low);
    let (middle, half) = (0.5 * (1.0 + stencil.least()), 0.5 * (1.0 - stencil.least()));
    let mut values = scalars.to_vec();
    let mut step = vec![0.0f32; values.len()];
    let mut left = vec![0.0f32; values.len()];
    let mut length = 1.0 / middle;
    for number in 0..STEPS {
        let residual = residuals(&stencil, scalars, dims, &values, &mut left);
        if residual <= enough {
            return Coefficients { values, residual };
        }
        let kept = match number {
            0 => 0.0,
            1 => 0.5 * (half * length).powi(2),
            _ => 0.25 * (half * length).powi(2),
        };
        if number > 0 {
            length = 1.0 / (middle - kept / length);
        }
        values
            .par_iter_mut()
            .zip(&mut step)
            .zip(&left)
            .for_each(|((value, step), left)| {
                *step = left + kept * *step;
                *value += length * *step;
            });
    }
    let residual = residuals(&stencil, scalars, dims, &values, &mut left);
    Coefficients { values, residual }
}

/// The scalars less the kernels' sum of `values`, and the largest of them.
fn residuals(
    stencil: &Stencil,
    scalars: &[f32],
    dims: [usize; 3],
    values: &[f32],
    left: &mut [f32],
) -> f32 {
    let [nx, ny, _] = dims;
    let row = |y: usize, z: usize| &values[nx * (y + ny * z)..nx * (y + ny * z) + nx];
    let worst = left.par_chunks_mut(nx * ny).enumerate().map_init(
        || [const { Vec::new() }; 3],
        |sums: &mut [Vec<f32>; 3], (z, slice)| {
            let mut worst = 0.0f32;
            for (y, out) in slice.chunks_mut(nx).enumerate() {
                add_rows(sums, row, y, z, dims);
                let scalars = &scalars[nx * (y + ny * z)..nx * (y + ny * z) + nx];
                worst = worst.max(subtract(stencil, sums, scalars, out));
            }
            worst
        },
    );
    worst.reduce(|| 0.0, f32::max)
}

/// The sums of the rows in a row's own place, beside it, and diagonally beside it; each with its ends repeated.
fn add_rows<'a>(
    sums: &mut [Vec<f32>; 3],
    row: impl Fn(usize, usize) -> &'a [f32],
    y: usize,
    z: usize,
    [nx, ny, nz]: [usize; 3],
) {
    let ys = [y.saturating_sub(1), y, (y + 1).min(ny - 1)];
    let zs = [z.saturating_sub(1), z, (z + 1).min(nz - 1)];
    let places = [
        &[(1, 1)][..],
        &[(0, 1), (2, 1), (1, 0), (1, 2)],
        &[(0, 0), (2, 0), (0, 2), (2, 2)],
    ];
    for (sum, places) in sums.iter_mut().zip(places) {
        sum.clear();
        sum.resize(nx + 2, 0.0);
        for &(dy, dz) in places {
            for (sum, value) in sum[1..=nx].iter_mut().zip(row(ys[dy], zs[dz])) {
                *sum += value;
            }
        }
        (sum[0], sum[nx + 1]) = (sum[1], sum[nx]);
    }
}

/// A row of scalars less the weighted sums; the largest of them.
fn subtract(stencil: &Stencil, sums: &[Vec<f32>; 3], scalars: &[f32], out: &mut [f32]) -> f32 {
    let [centre, face, edge, corner] = stencil.0;
    let [own, beside, across] = sums;
    let mut worst = 0.0f32;
    for (x, out) in out.iter_mut().enumerate() {
        let ends = |sum: &[f32]| sum[x] + sum[x + 2];
        let sum = centre * own[x + 1]
            + face * (ends(own) + beside[x + 1])
            + edge * (ends(beside) + across[x + 1])
            + corner * ends(across);
        *out = scalars[x] - sum;
        worst = worst.max(out.abs());
    }
    worst
}

/// Voxels that a kernel reaches to either side: the largest radius is 2, and the kernel is 0 there.
const REACH: usize = 2;

/// Voxels added before and behind the volume along each axis.
const MARGIN: usize = REACH;

/// Voxels around a brick that decide about it: a voxel is kept when a needed one lies within twice the reach, which is
/// needed for a cell within the reach, which looks at voxels one less than the reach around it.
const HALO: usize = 4 * REACH - 1;

const SIDE: usize = BRICK_SIDE + 2 * HALO;

/// The voxels that the kernels' sum needs. A sample's value is what its kernel is multiplied with (its scalar, or the
/// coefficient given for it), 1, whether it is needed, and its scalar.
pub(crate) fn kernel_samples(
    volume: &Volume,
    transfer: &TransferFunction,
    coefficients: Option<&[f32]>,
) -> Samples {
    let support = Support::new(transfer);
    let dims = volume.dims.map(|n| n + 2 * MARGIN);
    let corners = brick_corners(dims, BRICK_SIDE);
    let all = corners.len();
    let bricks: Vec<Brick> = corners
        .into_par_iter()
        .filter_map(|corner| {
            with_voxels!(&volume.voxels, slice => {
                let grid = Grid { voxels: slice, dims: volume.dims };
                let first = corner.map(|c| c as isize - (HALO + MARGIN) as isize);
                let scalars = block(|at| grid.at([0, 1, 2].map(|axis| first[axis] + at[axis] as isize)));
                let mut brick = brick(&scalars, corner, dims, &support)?;
                if let Some(voxels) = coefficients {
                    set_coefficients(&mut brick, &Grid { voxels, dims: volume.dims });
                }
                Some(brick)
            })
        })
        .collect();
    let shift = DAffine3::from_translation(DVec3::splat(-(MARGIN as f64)));
    Samples {
        empty: (all - bricks.len()) as u64,
        bricks,
        voxels: volume.len() as u64,
        count: count_visible(volume, transfer),
        world_from_index: volume.world_from_index * shift,
        index_from_voxel: [1.0, MARGIN as f64],
    }
}

/// Gives each sample of a brick its coefficient; beyond the volume, that of the nearest voxel.
fn set_coefficients(brick: &mut Brick, grid: &Grid<f32>) {
    for (&packed, value) in brick.places.iter().zip(&mut brick.values) {
        let at = place(packed);
        let index =
            |axis: usize| brick.bounds.corner[axis] as isize + at[axis] as isize - MARGIN as isize;
        value[0] = grid.at([0, 1, 2].map(index));
    }
}

fn block(scalar: impl Fn([usize; 3]) -> f32) -> Vec<f32> {
    (0..SIDE * SIDE * SIDE)
        .map(|i| scalar([i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)]))
        .collect()
}

fn brick(scalars: &[f32], corner: [u32; 3], dims: [usize; 3], support: &Support) -> Option<Brick> {
    let range = scalars
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if !support.meets(range.0, range.1) {
        return None;
    }
    let reach = REACH as isize;
    // The voxels that a place between voxels c and c + 1 depends on.
    let around_cell = [1 - reach, reach];
    let low = spread(scalars, around_cell, f32::min);
    let high = spread(scalars, around_cell, f32::max);
    let visible: Vec<bool> = low
        .iter()
        .zip(&high)
        .map(|(&low, &high)| support.meets(low, high))
        .collect();
    let either = |a: bool, b: bool| a | b;
    let needed = spread(&visible, [-reach, reach - 1], either);
    let kept = spread(&needed, [-2 * reach, 2 * reach], either);
    let size: [usize; 3] =
        std::array::from_fn(|axis| BRICK_SIDE.min(dims[axis] - corner[axis] as usize));
    let (mut places, mut values) = (Vec::new(), Vec::new());
    let mut bounds = Bounds::nothing(corner);
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let at = x + HALO + SIDE * (y + HALO + SIDE * (z + HALO));
                if kept[at] {
                    places.push(pack_place([x, y, z]));
                    values.push([
                        scalars[at],
                        1.0,
                        if needed[at] { 1.0 } else { 0.0 },
                        scalars[at],
                    ]);
                    bounds.add([x, y, z]);
                }
            }
        }
    }
    (!places.is_empty()).then_some(Brick {
        bounds,
        places,
        values,
        gradients: Vec::new(),
    })
}

/// For each place of a block, the join of the values from `offsets[0]` to `offsets[1]` around it, axis by axis; beyond the
/// block there is nothing to join.
fn spread<T: Copy>(block: &[T], offsets: [isize; 2], join: impl Fn(T, T) -> T) -> Vec<T> {
    let mut from = block.to_vec();
    for stride in [1, SIDE, SIDE * SIDE] {
        let mut to = from.clone();
        for (i, joined) in to.iter_mut().enumerate() {
            let at = (i / stride % SIDE) as isize;
            let first = (at + offsets[0]).max(0);
            let last = (at + offsets[1]).min(SIDE as isize - 1);
            let start = i as isize - at * stride as isize;
            let value = |k: isize| from[(start + k * stride as isize) as usize];
            *joined = (first + 1..=last).fold(value(first), |sum, k| join(sum, value(k)));
        }
        from = to;
    }
    from
}

#[cfg(test)]
mod tests {
    use resample_core::KernelShape;

    use super::*;

    /// The kernels' normalised sum at a voxel, by definition, in f64.
    fn sum_at(values: &[f32], dims: [usize; 3], at: [usize; 3], kernel: &Kernel) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in 0..125i64 {
            let d = [k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2];
            let [x, y, z]: [usize; 3] = std::array::from_fn(|a| {
                (at[a] as i64 + d[a]).clamp(0, dims[a] as i64 - 1) as usize
            });
            let weight = kernel.value(d.iter().map(|v| (v * v) as f64).sum());
            sum += weight * f64::from(values[x + dims[0] * (y + dims[1] * z)]);
            weights += weight;
        }
        sum / weights
    }

    #[test]
    fn sums_pass_through_the_data_up_to_the_stated_residual() {
        let dims = [7, 5, 6];
        let given: Vec<f32> = (0..210)
            .map(|i| ((i * i * 7 + i * 13) % 101) as f32 / 101.0 + (i % 7) as f32 * 0.1)
            .collect();
        for shape in KernelShape::ALL {
            let kernel = Kernel::new(shape);
            let least = Stencil::new(&kernel).least();
            let solved = coefficients(&given, dims, &kernel);
            let error = |values: &[f32]| {
                let at = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
                let off =
                    |i: usize| (sum_at(values, dims, at(i), &kernel) - f64::from(given[i])).abs();
                (0..given.len()).map(off).fold(0.0, f64::max)
            };
            let (before, after) = (error(&given), error(&solved.values));
            println!("{shape:?}: symbol from {least:.3}, blur {before:.3}, residual {after:.1e}");
            assert!(
                least > 0.01,
                "{shape:?}: the symbol must stay above 0, but falls to {least}"
            );
            assert!(
                (after - f64::from(solved.residual)).abs() < 1e-5,
                "{shape:?}: {after} is stated as {}",
                solved.residual
            );
            assert!(
                after < 2e-3 && before > 0.1,
                "{shape:?}: from {before} to {after}"
            );
        }
    }

    #[test]
    fn constants_stay_and_a_single_slice_is_solved_too() {
        for dims in [[4, 4, 4], [9, 1, 1], [1, 1, 1]] {
            let count = dims.iter().product();
            let solved = coefficients(&vec![3.5; count], dims, &Kernel::new(KernelShape::BSpline));
            assert!(
                solved.values.iter().all(|v| (v - 3.5).abs() < 1e-5),
                "{dims:?}"
            );
        }
    }
}
