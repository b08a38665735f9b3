//! Footprint tables and profiles: the kernel's line integral as a function of squared distance, made fast.
//!
//! Both take q = d^2/R^2 in 0..=1, so that nobody takes a square root to find an index. [`FootprintTable`] is the
//! classical table (Westover 1990), linear between entries. [`FootprintProfile`] is for vector units, which have no
//! cheap gather: with u = 1 - q, a kernel that is a power series in u has the line integral u^(3/2) times a power
//! series in u, because the integral of u^k along the line is a multiple of u^(k + 1/2). A short polynomial in u is
//! therefore exact for the polynomial kernel and converges fast for the Gaussian.

use crate::kernels::kernel::{Kernel, KernelShape};

/// Entries of a footprint table. The error of linear interpolation falls with the square of the spacing, except in
/// the last interval, where the integral starts as u^(3/2): measured by [`FootprintTable::max_error`], 1024 entries
/// keep every kernel within 1e-5 of the peak and still fit the first-level cache.
pub const TABLE_LEN: usize = 1024;

/// A kernel's line integral, tabulated at equal steps of squared distance.
#[derive(Clone, Debug)]
pub struct FootprintTable {
    /// `TABLE_LEN + 1` entries, from q = 0 to q = 1, and one more so that the upper neighbour always exists.
    entries: Vec<f32>,
}

impl FootprintTable {
    /// Tabulates the line integral of `kernel`.
    pub fn new(kernel: &Kernel) -> Self {
        let radius2 = kernel.radius() * kernel.radius();
        let at = |i: usize| kernel.line_integral(radius2 * (i as f64 / TABLE_LEN as f64)) as f32;
        Self {
            entries: (0..=TABLE_LEN + 1).map(at).collect(),
        }
    }

    /// The line integral (grid units) at q = d^2/R^2; 0 at q >= 1, for NaN, and below 0 the value at 0.
    pub fn line_integral(&self, q: f32) -> f32 {
        if !(q < 1.0) {
            return 0.0;
        }
        let position = q.max(0.0) * TABLE_LEN as f32;
        let index = position as usize;
        let fraction = position - index as f32;
        self.entries[index] + fraction * (self.entries[index + 1] - self.entries[index])
    }

    /// Largest error over the support, relative to the peak, by evaluation between the entries.
    pub fn max_error(&self, kernel: &Kernel) -> f64 {
        max_relative_error(kernel, |q| self.line_integral(q))
    }
}

/// Number of coefficients of a profile. Seven leave 8e-6 of the peak for the Gaussian (six 6e-5); the B-spline, which is not a
/// power series in u, keeps 8e-4 with seven and 3e-4 with nine.
pub const PROFILE_LEN: usize = 7;

/// A kernel's line integral as u^(3/2) P(u), u = 1 - d^2/R^2, for vector units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootprintProfile {
    /// Coefficients of P, constant term first, grid units.
    pub coefficients: [f32; PROFILE_LEN],
}

impl FootprintProfile {
    /// Fits P by least squares on Chebyshev nodes, weighted by u^(3/2): this minimises the error of the
    /// line integral itself. That of the polynomial kernel is known.
    pub fn new(kernel: &Kernel) -> Self {
        if kernel.shape() == KernelShape::Polynomial {
            // The integral of (u - s^2)^3 along the line is a multiple of u^(7/2): no fit, which would undershoot 0.
            let mut coefficients = [0.0; PROFILE_LEN];
            coefficients[2] = kernel.line_integral(0.0) as f32;
            return Self { coefficients };
        }
        const NODES: usize = 256;
        let mut normal = [[0.0; PROFILE_LEN]; PROFILE_LEN];
        let mut right = [0.0; PROFILE_LEN];
        for node in 0..NODES {
            let angle = std::f64::consts::PI * (node as f64 + 0.5) / NODES as f64;
            let u = 0.5 + 0.5 * angle.cos();
            let target = kernel.line_integral(kernel.radius().powi(2) * (1.0 - u));
            let basis: [f64; PROFILE_LEN] = std::array::from_fn(|k| u.powf(1.5 + k as f64));
            for i in 0..PROFILE_LEN {
                right[i] += basis[i] * target;
                for j in 0..PROFILE_LEN {
                    normal[i][j] += basis[i] * basis[j];
                }
            }
        }
        Self {
            coefficients: solve(normal, right).map(|c| c as f32),
        }
    }

    /// The line integral (grid units) at q = d^2/R^2; 0 at q >= 1 and for NaN. The scalar twin of the tile kernels.
    pub fn line_integral(&self, q: f32) -> f32 {
        let u = 1.0 - q;
        if !(u > 0.0) {
            return 0.0;
        }
        u * u.sqrt()
            * self
                .coefficients
                .iter()
                .rev()
                .fold(0.0, |sum, c| sum * u + c)
    }

    /// Largest error over the support, relative to the peak.
    pub fn max_error(&self, kernel: &Kernel) -> f64 {
        max_relative_error(kernel, |q| self.line_integral(q))
    }
}

/// Largest |approximation - truth| / peak at 100,000 squared distances, which fall between any table's entries.
fn max_relative_error(kernel: &Kernel, approximation: impl Fn(f32) -> f32) -> f64 {
    const STEPS: u32 = 100_000;
    let radius2 = kernel.radius() * kernel.radius();
    let error_at = |i: u32| {
        let q = f64::from(i) / f64::from(STEPS);
        (f64::from(approximation(q as f32)) - kernel.line_integral(q * radius2)).abs()
    };
    (0..=STEPS).map(error_at).fold(0.0, f64::max) / kernel.line_integral(0.0)
}

/// Gaussian elimination with partial pivoting; the normal matrix of distinct powers is never singular.
pub(crate) fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for column in 0..N {
        let pivot = (column..N)
            .max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()))
            .unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..N {
            let factor = matrix[row][column] / matrix[column][column];
            let pivot_row = matrix[column];
            for (entry, above) in matrix[row].iter_mut().zip(pivot_row).skip(column) {
                *entry -= factor * above;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_and_profile_keep_their_stated_bounds() {
        for (shape, table_bound, profile_bound) in [
            (KernelShape::Gaussian, 1e-5, 1e-5),
            (KernelShape::Polynomial, 1e-5, 1e-6),
            (KernelShape::BSpline, 1e-5, 1e-3),
        ] {
            let kernel = Kernel::new(shape);
            let table = FootprintTable::new(&kernel).max_error(&kernel);
            let profile = FootprintProfile::new(&kernel).max_error(&kernel);
            println!("{shape:?}: table {table:.1e}, profile {profile:.1e} of the peak");
            assert!(table < table_bound, "{shape:?} table error {table}");
            assert!(profile < profile_bound, "{shape:?} profile error {profile}");
        }
    }

    #[test]
    fn outside_and_not_a_number_are_zero() {
        let kernel = Kernel::new(KernelShape::Gaussian);
        let (table, profile) = (FootprintTable::new(&kernel), FootprintProfile::new(&kernel));
        for q in [1.0, 2.0, f32::INFINITY, f32::NAN] {
            assert_eq!(
                (table.line_integral(q), profile.line_integral(q)),
                (0.0, 0.0),
                "q = {q}"
            );
        }
        assert_eq!(
            table.line_integral(-1e-6),
            table.line_integral(0.0),
            "rounding below 0"
        );
    }
}
