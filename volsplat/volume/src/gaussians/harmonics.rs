//! Spherical harmonics of colours, degrees 1 to 3, in 8 bits with a scale for each Gaussian.
//!
//! A coefficient is off by at most 1/254 of the largest of its Gaussian: with coefficients up to 0.3, colours are off by 0.001,
//! a quarter of a step of 8 bits.

use glam::Vec3;

/// Constants of the real spherical harmonics of degrees 1, 2 and 3, as the files of Gaussians use them (no Condon-Shortley phase
/// beyond the signs of [`basis`]): sqrt(3/4pi), sqrt(15/4pi), sqrt(5/16pi), sqrt(15/16pi) and so on.
const C1: f32 = 0.488_602_52;
const C2: [f32; 3] = [1.092_548_4, 0.315_391_57, 0.546_274_2];
const C3: [f32; 5] = [
    0.590_043_6,
    2.890_611_4,
    0.457_045_8,
    0.373_176_33,
    1.445_305_7,
];

/// Most coefficients of a channel beside the constant: degree 3.
const MOST: usize = 15;

/// The coefficients of all Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Harmonics {
    degree: usize,
    /// The coefficient of code 1, for each Gaussian; an f32 whose lower 16 bits are 0.
    steps: Vec<u16>,
    codes: Vec<i8>,
}

impl Harmonics {
    /// None yet, with room for `count`.
    pub(crate) fn with_capacity(degree: usize, count: usize) -> Self {
        let degree = degree.min(3);
        let per_gaussian = 3 * ((degree + 1) * (degree + 1) - 1);
        Self {
            degree,
            steps: Vec::with_capacity(if degree > 0 { count } else { 0 }),
            codes: Vec::with_capacity(per_gaussian * count),
        }
    }

    /// Degree, 0 to 3.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Numbers of one Gaussian: 0, 9, 24 or 45.
    pub fn per_gaussian(&self) -> usize {
        3 * ((self.degree + 1) * (self.degree + 1) - 1)
    }

    pub(crate) fn bytes(&self) -> usize {
        2 * self.steps.len() + self.codes.len()
    }

    pub(crate) fn push(&mut self, coefficients: &[f32]) {
        if self.degree == 0 {
            return;
        }
        let largest = coefficients.iter().fold(0f32, |most, c| most.max(c.abs()));
        // Rounded up to 8 bits of precision, so that the largest stays within 127.
        let step = (((largest / 127.0).to_bits() >> 16) + 1) as u16;
        let length = f32::from_bits(u32::from(step) << 16);
        self.steps.push(step);
        let codes = coefficients.iter().map(|c| (c / length).round() as i8);
        self.codes.extend(codes);
    }

    pub(crate) fn coefficients(&self, index: usize) -> impl Iterator<Item = f32> {
        let per_gaussian = self.per_gaussian();
        let step = match self.steps.get(index) {
            Some(step) => f32::from_bits(u32::from(*step) << 16),
            None => 0.0,
        };
        self.codes[per_gaussian * index..][..per_gaussian]
            .iter()
            .map(move |code| f32::from(*code) * step)
    }

    /// The sum of degrees 1 and more along a unit vector.
    pub(crate) fn towards(&self, index: usize, direction: Vec3) -> Vec3 {
        let Some(step) = self.steps.get(index) else {
            return Vec3::ZERO;
        };
        let basis = basis(direction);
        let per_gaussian = self.per_gaussian();
        let codes = &self.codes[per_gaussian * index..][..per_gaussian];
        let mut sum = Vec3::ZERO;
        for (code, weight) in codes.chunks_exact(3).zip(basis) {
            let code = Vec3::new(f32::from(code[0]), f32::from(code[1]), f32::from(code[2]));
            sum += weight * code;
        }
        sum * f32::from_bits(u32::from(*step) << 16)
    }
}

/// The real spherical harmonics of degrees 1 to 3 along a unit vector, in the order and with the signs of files of Gaussians.
pub fn basis(direction: Vec3) -> [f32; MOST] {
    let Vec3 { x, y, z } = direction;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2.0 * zz - xx - yy),
        -C2[0] * x * z,
        C2[2] * (xx - yy),
        -C3[0] * y * (3.0 * xx - yy),
        C3[1] * x * y * z,
        -C3[2] * y * (4.0 * zz - xx - yy),
        C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -C3[2] * x * (4.0 * zz - xx - yy),
        C3[4] * z * (xx - yy),
        -C3[0] * x * (xx - 3.0 * yy),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_keep_a_part_in_250_of_the_largest() {
        let mut all = Harmonics::with_capacity(3, 1);
        let given: Vec<f32> = (0..45).map(|i| 0.4 * (1.7 * i as f32).sin()).collect();
        all.push(&given);
        for (given, got) in given.iter().zip(all.coefficients(0)) {
            assert!((given - got).abs() <= 0.4 / 250.0, "{given} became {got}");
        }
    }

    #[test]
    fn no_coefficients_and_zeros_give_nothing() {
        let mut none = Harmonics::with_capacity(0, 1);
        none.push(&[]);
        assert_eq!(none.towards(0, Vec3::X), Vec3::ZERO);
        let mut zeros = Harmonics::with_capacity(2, 1);
        zeros.push(&[0.0; 24]);
        assert_eq!(zeros.towards(0, Vec3::X), Vec3::ZERO);
    }

    /// The harmonics are orthonormal: the mean of a product over the sphere is 1/4pi for equal ones, else 0.
    #[test]
    fn the_basis_is_orthonormal() {
        let steps = 96;
        let mut products = [[0f64; MOST]; MOST];
        let mut total = 0.0;
        for i in 0..steps {
            // Midpoints in the cosine: exact for none of these, near enough by far.
            let cos = -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(steps);
            let sin = (1.0 - cos * cos).sqrt();
            for j in 0..steps {
                let angle = std::f64::consts::TAU * f64::from(j) / f64::from(steps);
                let direction = Vec3::new(
                    (sin * angle.cos()) as f32,
                    (sin * angle.sin()) as f32,
                    cos as f32,
                );
                let values = basis(direction);
                for (row, a) in products.iter_mut().zip(values) {
                    for (product, b) in row.iter_mut().zip(values) {
                        *product += f64::from(a) * f64::from(b);
                    }
                }
                total += 1.0;
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let mean = product / total * 4.0 * std::f64::consts::PI;
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((mean - wanted).abs() < 3e-3, "{i}, {j}: {mean}");
            }
        }
    }
}
