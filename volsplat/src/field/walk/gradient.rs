//! The gradient of the field at samples, from the vectors or the differences at the corners of their cells.
//!
//! Differences of bytes are interpolated as whole numbers, along the axes of the grid, and then turned into the world. With axes
//! of a power of two these are the bits that vectors give; with others the roundings lie elsewhere, and are as large.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, i32x8, i32x16, u32x8, u32x16};

use crate::bricks::cells::{
    CELL_CORNERS, DifferenceTable, FromDifferences, GradientTable, Gradients, LAST_CELL, SHIFTS,
};
use crate::field::walk::cell_sample::Located;
use crate::slabs::view::LANES;

/// The mix of differences, for vectors of one width. Without closures: they are left as calls here, and make a lit frame a fifth
/// longer.
macro_rules! mix_of_differences {
    ($gradient:ident, $part:ident, $mixed:ident, $mix:ident, $floats:ident, $signed:ident, $whole:ident) => {
        impl FromDifferences {
            /// The gradients of samples at these positions in their cells, with the differences at the cells' corners.
            #[inline(always)]
            pub(crate) fn $gradient<S: Simd>(
                &self,
                simd: S,
                corners: &[$whole<S>; 8],
                share: &[$floats<S>; 3],
            ) -> [$floats<S>; 3] {
                let along = [
                    $mixed(simd, corners, SHIFTS[0], share),
                    $mixed(simd, corners, SHIFTS[1], share),
                    $mixed(simd, corners, SHIFTS[2], share),
                ];
                [
                    self.$part(simd, &along, 0),
                    self.$part(simd, &along, 1),
                    self.$part(simd, &along, 2),
                ]
            }

            /// The part of gradients along an axis of the world.
            #[inline(always)]
            fn $part<S: Simd>(&self, simd: S, along: &[$floats<S>; 3], axis: usize) -> $floats<S> {
                let [x, y, z] = self.columns;
                let (x, y, z) = (
                    $floats::splat(simd, x[axis]),
                    $floats::splat(simd, y[axis]),
                    $floats::splat(simd, z[axis]),
                );
                along[0].mul_add(x, along[1].mul_add(y, along[2] * z))
            }
        }

        /// The trilinear mix of the differences along one axis.
        #[inline(always)]
        fn $mixed<S: Simd>(
            simd: S,
            corners: &[$whole<S>; 8],
            [left, right]: [u32; 2],
            share: &[$floats<S>; 3],
        ) -> $floats<S> {
            let mut along = [$floats::splat(simd, 0.0); 8];
            for k in 0..8 {
                let whole = (corners[k] << left).bitcast::<$signed<S>>() >> right;
                along[k] = whole.to_float();
            }
            let near = $mix(
                $mix(along[0], along[1], share[0]),
                $mix(along[2], along[3], share[0]),
                share[1],
            );
            let far = $mix(
                $mix(along[4], along[5], share[0]),
                $mix(along[6], along[7], share[0]),
                share[1],
            );
            $mix(near, far, share[2])
        }

        #[inline(always)]
        fn $mix<S: Simd>(a: $floats<S>, b: $floats<S>, t: $floats<S>) -> $floats<S> {
            (b - a).mul_add(t, a)
        }
    };
}

mix_of_differences!(gradient8, part8, mixed8, mix8, f32x8, i32x8, u32x8);
mix_of_differences!(gradient16, part16, mixed16, mix16, f32x16, i32x16, u32x16);

/// The trilinear mix of the gradients at the corners of the cells of those lanes whose weight is above 0; any finite vector in the
/// others.
#[inline(always)]
pub(crate) fn interpolated_gradient<S: Simd>(
    simd: S,
    (gradients, from): (&Gradients, &FromDifferences),
    located: &Located<S>,
    weight: f32x8<S>,
) -> [f32x8<S>; 3] {
    match gradients {
        Gradients::Vectors(table) => of_vectors(simd, table, located, weight),
        Gradients::Differences(table) => {
            from.gradient8(simd, &corners(simd, table, &located.places), &located.share)
        }
    }
}

/// The differences at the corners of each lane's cell.
#[inline(always)]
fn corners<S: Simd>(simd: S, table: &DifferenceTable, places: &[i32; LANES]) -> [u32x8<S>; 8] {
    let mut corners = [[0; LANES]; 8];
    for lane in 0..LANES {
        let place = (places[lane] as usize).min(LAST_CELL);
        for (corner, offset) in corners.iter_mut().zip(CELL_CORNERS) {
            corner[lane] = table[place + offset];
        }
    }
    let mut loaded = [u32x8::splat(simd, 0); 8];
    for (loaded, corner) in loaded.iter_mut().zip(&corners) {
        *loaded = u32x8::from_slice(simd, corner);
    }
    loaded
}

/// The mix of vectors; 0 in the lanes without weight.
/// Lane by lane, a vector at a time: eight loads instead of twenty-four gathers, and none for what is not seen.
#[inline(always)]
fn of_vectors<S: Simd>(
    simd: S,
    table: &GradientTable,
    located: &Located<S>,
    weight: f32x8<S>,
) -> [f32x8<S>; 3] {
    let weights = weight.to_array();
    let shares = [
        located.share[0].to_array(),
        located.share[1].to_array(),
        located.share[2].to_array(),
    ];
    let mut lanes = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        if !(weights[lane] > 0.0) {
            continue;
        }
        let place = (located.places[lane] as usize).min(LAST_CELL);
        // Written out: closures over an array of vectors are left as calls here, and cost a third of a lit frame.
        let edge = |k: usize, t: f32x4<S>| {
            let first = f32x4::from_slice(simd, &table[place + CELL_CORNERS[k]]);
            let second = f32x4::from_slice(simd, &table[place + CELL_CORNERS[k + 1]]);
            (second - first).mul_add(t, first)
        };
        let [x, y, z] = [shares[0][lane], shares[1][lane], shares[2][lane]];
        let (x, y, z) = (
            f32x4::splat(simd, x),
            f32x4::splat(simd, y),
            f32x4::splat(simd, z),
        );
        let (near, far) = (edge(0, x), edge(2, x));
        let front = (far - near).mul_add(y, near);
        let (near, far) = (edge(4, x), edge(6, x));
        let back = (far - near).mul_add(y, near);
        let vector = (back - front).mul_add(z, front).to_array();
        (lanes[0][lane], lanes[1][lane], lanes[2][lane]) = (vector[0], vector[1], vector[2]);
    }
    let load = |axis: usize| f32x8::from_slice(simd, &lanes[axis]);
    [load(0), load(1), load(2)]
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;

    use super::*;
    use crate::bricks::cells::{CELL_SIDE, VERTEX_SIDE, differences, vectors};
    use crate::grid::{Bounds, gradient_from_differences};
    use resample_volume::volume::Grid;

    /// Voxels along each side: a brick in the middle has neighbours on all sides, and the first one none on three.
    const SIDE: usize = 27;

    /// Samples in one cell, at places that follow from its number.
    struct Samples {
        cell: [usize; 3],
        share: [[f32; LANES]; 3],
    }

    impl Samples {
        fn of(number: usize) -> Self {
            let at = |k: usize| (number * 37 + k * 101) % 997;
            Self {
                cell: [at(1) % CELL_SIDE, at(2) % CELL_SIDE, at(3) % CELL_SIDE],
                share: std::array::from_fn(|axis| {
                    std::array::from_fn(|lane| at(4 + 3 * lane + axis) as f32 / 997.0)
                }),
            }
        }

        /// What the kernels give.
        fn drawn(&self, gradients: &Gradients, from: &FromDifferences) -> [[f32; LANES]; 3] {
            let [x, y, z] = self.cell;
            let place = (x + VERTEX_SIDE * (y + VERTEX_SIDE * z)) as i32;
            let level = SimdLevel::Auto.resolve();
            dispatch!(level, simd => drawn(simd, (gradients, from), place, &self.share))
        }

        /// The same in f64, from the voxels.
        fn exact(&self, voxels: &[u8], corner: [u32; 3], axes: &DMat3, lane: usize) -> DVec3 {
            let at = |index: [isize; 3]| {
                let [x, y, z] = index.map(|i| i.clamp(0, SIDE as isize - 1) as usize);
                f64::from(voxels[x + SIDE * (y + SIDE * z)])
            };
            let mut sum = DVec3::ZERO;
            for vertex in 0..8 {
                let bits = [vertex & 1, vertex >> 1 & 1, vertex >> 2];
                let index: [isize; 3] = std::array::from_fn(|axis| {
                    corner[axis] as isize + (self.cell[axis] + bits[axis]) as isize
                });
                let weight: f64 = (0..3)
                    .map(
                        |axis| match (bits[axis], f64::from(self.share[axis][lane])) {
                            (1, share) => share,
                            (_, share) => 1.0 - share,
                        },
                    )
                    .product();
                let along = |axis: usize| {
                    let (mut below, mut above) = (index, index);
                    below[axis] -= 1;
                    above[axis] += 1;
                    0.5 * (at(above) - at(below))
                };
                sum += weight * DVec3::new(along(0), along(1), along(2));
            }
            gradient_from_differences(axes) * sum
        }
    }

    #[inline(always)]
    fn drawn<S: Simd>(
        simd: S,
        gradients: (&Gradients, &FromDifferences),
        place: i32,
        share: &[[f32; LANES]; 3],
    ) -> [[f32; LANES]; 3] {
        let one = f32x8::splat(simd, 1.0);
        let share = [0, 1, 2].map(|axis: usize| f32x8::from_slice(simd, &share[axis]));
        let located = Located {
            at: crate::slabs::view::HalfRow { row: 0, first: 0 },
            inside: one.simd_gt(f32x8::splat(simd, 0.0)),
            places: [place; LANES],
            share,
        };
        interpolated_gradient(simd, gradients, &located, one).map(|axis| axis.to_array())
    }

    /// Root mean square distances from f64 of the gradients by differences and by vectors, and whether both are the same bits.
    fn errors(axes: &DMat3) -> ([f64; 2], bool) {
        let voxels: Vec<u8> = (0..SIDE * SIDE * SIDE)
            .map(|i| (i * i % 251) as u8)
            .collect();
        let grid = Grid {
            voxels: &voxels[..],
            dims: [SIDE; 3],
        };
        let to_world = gradient_from_differences(axes);
        let from = FromDifferences::new(axes);
        let (mut squares, mut same) = ([0.0; 2], true);
        for corner in [[0; 3], [8, 16, 8]] {
            let bounds = Bounds::of_range(corner, [[0; 3], [CELL_SIDE as u8; 3]]);
            let both = [
                differences(&grid, &bounds),
                vectors(&grid, |value| value as f32, &bounds, (&to_world, None)),
            ];
            for samples in (0..2000).map(Samples::of) {
                let drawn = [0, 1].map(|k: usize| samples.drawn(&both[k], &from));
                same &= drawn[0] == drawn[1];
                for lane in 0..LANES {
                    let exact = samples.exact(&voxels, corner, axes, lane);
                    for (sum, drawn) in squares.iter_mut().zip(&drawn) {
                        let part = |axis: usize| f64::from(drawn[axis][lane]);
                        *sum += (DVec3::new(part(0), part(1), part(2)) - exact).length_squared();
                    }
                }
            }
        }
        (squares.map(|sum| (sum / 32_000.0).sqrt()), same)
    }

    #[test]
    fn differences_give_the_bits_of_vectors_where_axes_are_powers_of_two() {
        for axes in [
            DMat3::IDENTITY,
            DMat3::from_diagonal(DVec3::new(0.5, -2.0, 4.0)),
        ] {
            let (found, same) = errors(&axes);
            assert!(same, "{axes}: {found:?}");
        }
    }

    #[test]
    fn differences_are_as_near_to_f64_as_roundings_allow() {
        let sheared = DMat3::from_cols(
            DVec3::new(0.7, 0.1, 0.0),
            DVec3::new(-0.2, 1.3, 0.3),
            DVec3::new(0.1, 0.0, 2.9),
        );
        for axes in [DMat3::from_diagonal(DVec3::new(0.7, 1.1, 3.3)), sheared] {
            let ([by_differences, by_vectors], _) = errors(&axes);
            // Halves of differences reach 127.5; seven mixes of two roundings each and one with the axes are fifteen half steps of f32.
            let most = 15.0 * 127.5 * 2f64.powi(-24);
            for error in [by_differences, by_vectors] {
                assert!(error < most, "{error:e} of {most:e}");
            }
        }
    }
}
