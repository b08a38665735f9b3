//! Separable convolution of [`ScalarMap`]s in f64.
//!
//! Takes a map and one row of taps, gives the map filtered along rows or along columns. A two-dimensional filter is
//! one pass of each kind, so its cost grows with the diameter and not with its square. Every output row is a sum of
//! shifted input rows, added tap by tap, which the compiler turns into vector code.
//!
//! Limits: taps are odd in number; they are applied as a correlation (not mirrored). The result does not depend on
//! the number of threads, because each output row is summed by one thread in one order.

use super::inputs::ScalarMap;
use rayon::prelude::*;

/// The values outside the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Border {
    /// The nearest pixel of the map.
    Replicate,
    /// The map mirrored at its outer edge, so that the border pixel comes twice.
    Mirror,
}

impl Border {
    /// The position in `0..length` that stands for `position`, which may lie outside.
    fn resolve(self, position: isize, length: usize) -> usize {
        let signed_length = length as isize;
        match self {
            Self::Replicate => position.clamp(0, signed_length - 1) as usize,
            Self::Mirror => {
                let in_period = position.rem_euclid(2 * signed_length);
                in_period.min(2 * signed_length - 1 - in_period) as usize
            }
        }
    }
}

/// Filters along x.
pub(super) fn along_rows(map: &ScalarMap, taps: &[f64], border: Border) -> ScalarMap {
    let (width, radius) = (map.width, taps.len() / 2);
    let columns: Vec<usize> = (0..width + 2 * radius)
        .map(|x| border.resolve(x as isize - radius as isize, width))
        .collect();
    let mut values = vec![0.0; map.values.len()];
    values
        .par_chunks_mut(width)
        .zip(map.values.par_chunks(width))
        .for_each_init(
            || vec![0.0; columns.len()],
            |extended, (out, row)| {
                for (value, &x) in extended.iter_mut().zip(&columns) {
                    *value = row[x];
                }
                for (shift, &tap) in taps.iter().enumerate() {
                    add_scaled(out, &extended[shift..], tap);
                }
            },
        );
    ScalarMap {
        width,
        height: map.height,
        values,
    }
}

/// Filters along y.
pub(super) fn along_columns(map: &ScalarMap, taps: &[f64], border: Border) -> ScalarMap {
    let (width, radius) = (map.width, taps.len() / 2);
    let mut values = vec![0.0; map.values.len()];
    values
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, out)| {
            for (shift, &tap) in taps.iter().enumerate() {
                let source = border.resolve((y + shift) as isize - radius as isize, map.height);
                add_scaled(out, &map.values[source * width..(source + 1) * width], tap);
            }
        });
    ScalarMap {
        width,
        height: map.height,
        values,
    }
}

/// Filters along both axes with the same taps.
pub(super) fn along_both(map: &ScalarMap, taps: &[f64], border: Border) -> ScalarMap {
    along_columns(&along_rows(map, taps, border), taps, border)
}

/// Values of `function` at the integers `-radius..=radius`.
pub(super) fn sampled_taps(radius: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| function(f64::from(x))).collect()
}

/// The taps divided by their sum, so that a constant map passes unchanged.
pub(super) fn normalised(mut taps: Vec<f64>) -> Vec<f64> {
    let sum: f64 = taps.iter().sum();
    taps.iter_mut().for_each(|tap| *tap /= sum);
    taps
}

fn add_scaled(out: &mut [f64], source: &[f64], factor: f64) {
    for (value, &from) in out.iter_mut().zip(source) {
        *value += factor * from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: usize, height: usize, values: &[f64]) -> ScalarMap {
        ScalarMap {
            width,
            height,
            values: values.to_vec(),
        }
    }

    #[test]
    fn borders_resolve_as_named() {
        let resolved = |border: Border| (-4..7).map(|at| border.resolve(at, 3)).collect::<Vec<_>>();
        assert_eq!(
            resolved(Border::Replicate),
            [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2],
            "replicate"
        );
        assert_eq!(
            resolved(Border::Mirror),
            [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0],
            "mirror"
        );
    }

    #[test]
    fn taps_are_applied_as_a_correlation_on_each_axis() {
        // Taps 1, 10, 100 weigh the left, own and right neighbour.
        let taps = [1.0, 10.0, 100.0];
        let row = along_rows(&map(3, 1, &[1.0, 2.0, 3.0]), &taps, Border::Replicate);
        assert_eq!(row.values, [211.0, 321.0, 332.0], "along x");
        let column = along_columns(&map(1, 3, &[1.0, 2.0, 3.0]), &taps, Border::Replicate);
        assert_eq!(column.values, row.values, "along y must agree with along x");
    }

    #[test]
    fn a_kernel_wider_than_the_map_keeps_a_constant() {
        let taps = normalised(sampled_taps(9, |x| (-0.02 * x * x).exp()));
        for border in [Border::Replicate, Border::Mirror] {
            let flat = along_both(&map(2, 3, &[0.5; 6]), &taps, border);
            assert!(
                flat.values.iter().all(|v| (v - 0.5).abs() < 1e-14),
                "{border:?} changed a constant"
            );
        }
    }
}
