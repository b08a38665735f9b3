//! The paper's two-dimensional index table (section 4.2): from the index i in the ellipse and the half cone angle to
//! the true index d/r.
//!
//! The renderers use [`crate::kernels::footprint::index2_from_ellipse`], which is the same function in closed form and
//! measured faster than this table. The table stays as the paper describes it, so that the comparison can be made.

/// Largest half cone angle in the table, as the paper recommends; beyond it the equation is evaluated.
pub const MAX_ANGLE_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// Entries along the index. With bilinear interpolation the error is bounded by
/// (1/8) (1/INDEX_STEPS)^2 max|d''| + (1/8) (MAX_ANGLE/ANGLE_STEPS)^2 max|d''| , which the test measures as 1e-5.
const INDEX_STEPS: usize = 64;

/// Entries along the angle.
const ANGLE_STEPS: usize = 32;

/// d/r over i in 0..=1 and the half cone angle in 0..=15 degrees.
#[derive(Clone, Debug)]
pub struct IndexTable {
    entries: Vec<f32>,
}

/// d/r for an index i in the ellipse and a half cone angle: sin(atan(i tan alpha)) / sin alpha.
///
/// The paper prints tan alpha in the denominator. In its own figure OE = r/sin(alpha) and OF = r, so that OE/OF is
/// 1/sin(alpha); and i = 1, a tangent ray, must give 1.
pub fn index_from_ellipse(index: f64, half_cone_angle_rad: f64) -> f64 {
    if half_cone_angle_rad == 0.0 {
        return index;
    }
    (index * half_cone_angle_rad.tan()).atan().sin() / half_cone_angle_rad.sin()
}

/// The same as printed in the paper, kept to show what the misprint costs.
pub fn index_as_printed(index: f64, half_cone_angle_rad: f64) -> f64 {
    (index * half_cone_angle_rad.tan()).atan().sin() / half_cone_angle_rad.tan()
}

impl IndexTable {
    /// Tabulates [`index_from_ellipse`].
    pub fn new() -> Self {
        let entry = |k: usize| {
            let index = (k % (INDEX_STEPS + 1)) as f64 / INDEX_STEPS as f64;
            let angle = (k / (INDEX_STEPS + 1)) as f64 / ANGLE_STEPS as f64 * MAX_ANGLE_RAD;
            index_from_ellipse(index, angle) as f32
        };
        Self {
            entries: (0..(INDEX_STEPS + 1) * (ANGLE_STEPS + 1))
                .map(entry)
                .collect(),
        }
    }

    /// d/r by bilinear interpolation; beyond the table's angles by the equation.
    pub fn index(&self, index: f32, half_cone_angle_rad: f32) -> f32 {
        if !(f64::from(half_cone_angle_rad) < MAX_ANGLE_RAD) {
            return index_from_ellipse(f64::from(index), f64::from(half_cone_angle_rad)) as f32;
        }
        let (column, across) = cell(index, INDEX_STEPS);
        let (row, along) = cell(half_cone_angle_rad / MAX_ANGLE_RAD as f32, ANGLE_STEPS);
        let at = |row: usize| {
            let start = row * (INDEX_STEPS + 1) + column;
            self.entries[start] + across * (self.entries[start + 1] - self.entries[start])
        };
        at(row) + along * (at(row + 1) - at(row))
    }
}

impl Default for IndexTable {
    fn default() -> Self {
        Self::new()
    }
}

/// The cell and the fraction in it of a position in 0..=1 on a row of `steps` cells.
fn cell(position: f32, steps: usize) -> (usize, f32) {
    let scaled = position.clamp(0.0, 1.0) * steps as f32;
    let cell = (scaled as usize).min(steps - 1);
    (cell, scaled - cell as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::footprint::index2_from_ellipse;

    #[test]
    fn table_and_closed_form_are_the_equation() {
        let table = IndexTable::new();
        let (mut table_error, mut closed_error) = (0.0f64, 0.0f64);
        for a in 0..200 {
            let angle = f64::from(a) / 200.0 * 1.2 * MAX_ANGLE_RAD;
            for i in 0..=200 {
                let index = f64::from(i) / 200.0;
                let truth = index_from_ellipse(index, angle);
                table_error = table_error
                    .max((f64::from(table.index(index as f32, angle as f32)) - truth).abs());
                let closed = index2_from_ellipse(index * index, angle.sin().powi(2)).sqrt();
                closed_error = closed_error.max((closed - truth).abs());
            }
        }
        println!("table error {table_error:.1e}, closed form error {closed_error:.1e}");
        assert!(table_error < 2e-5, "table error {table_error}");
        assert!(closed_error < 1e-12, "closed form error {closed_error}");
    }

    #[test]
    fn a_tangent_ray_gives_one_and_the_printed_form_does_not() {
        for degrees in [1.0f64, 5.0, 15.0, 60.0] {
            let angle = degrees.to_radians();
            assert!((index_from_ellipse(1.0, angle) - 1.0).abs() < 1e-12);
            assert!(
                (index_as_printed(1.0, angle) - angle.cos()).abs() < 1e-12,
                "the misprint gives cos(alpha)"
            );
        }
    }
}
