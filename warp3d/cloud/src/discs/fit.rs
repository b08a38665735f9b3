//! A plane through points: the mean, and the principal axes of what departs from it (PCA; Hoppe et al. 1992).
//!
//! Takes places, returns a normal and the standard deviations along the three axes, least first.

use glam::{DMat3, DVec3, Vec3};

/// A plane through points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// Unit normal; its sign means nothing.
    pub(crate) normal: DVec3,
    /// Standard deviations along the normal, and along the lesser and the greater axis of the plane; world units.
    pub(crate) deviations: [f64; 3],
    /// The plane's place along the normal from the place that it was fitted around, world units.
    pub(crate) offset: f64,
}

impl Plane {
    /// The thickness against the lesser width: small on a surface, 1 in a ball of points.
    pub(crate) fn roughness(&self) -> f64 {
        self.deviations[0] / self.deviations[1].max(f64::MIN_POSITIVE)
    }
}

/// Fits a plane to places near `at`.
pub(crate) fn plane(at: Vec3, places: impl Iterator<Item = Vec3>) -> Plane {
    let (mut count, mut sum, mut squares) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for place in places {
        let d = (place - at).as_dvec3();
        count += 1.0;
        sum += d;
        squares += outer(d);
    }
    let mean = sum / count;
    let covariance = squares * (1.0 / count) - outer(mean);
    let variances = eigenvalues(&covariance);
    let normal = normal_of(&covariance, variances);
    Plane {
        normal,
        deviations: variances.map(|v| v.max(0.0).sqrt()),
        offset: normal.dot(mean),
    }
}

fn outer(d: DVec3) -> DMat3 {
    DMat3::from_cols(d * d.x, d * d.y, d * d.z)
}

/// Eigenvalues of a symmetric matrix, least first, in closed form (Smith 1961).
fn eigenvalues(m: &DMat3) -> [f64; 3] {
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let off = m.y_axis.x.powi(2) + m.z_axis.x.powi(2) + m.z_axis.y.powi(2);
    let diagonal = DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z) - mean;
    let scale = ((diagonal.length_squared() + 2.0 * off) / 6.0).sqrt();
    if !(scale > 0.0) {
        return [mean; 3];
    }
    let b = (*m - DMat3::from_diagonal(DVec3::splat(mean))) * (1.0 / scale);
    let angle = (0.5 * b.determinant()).clamp(-1.0, 1.0).acos() / 3.0;
    let greatest = mean + 2.0 * scale * angle.cos();
    let least = mean + 2.0 * scale * (angle + std::f64::consts::TAU / 3.0).cos();
    [least, 3.0 * mean - greatest - least, greatest]
}

/// The eigenvector of the least eigenvalue: what (M - middle)(M - greatest) leaves of any vector.
fn normal_of(m: &DMat3, [_, middle, greatest]: [f64; 3]) -> DVec3 {
    let less = |value: f64| *m - DMat3::from_diagonal(DVec3::splat(value));
    let product = less(middle) * less(greatest);
    let columns = [product.x_axis, product.y_axis, product.z_axis];
    let longest = columns.into_iter().fold(DVec3::ZERO, |a, b| {
        if b.length_squared() > a.length_squared() {
            b
        } else {
            a
        }
    });
    if let Some(normal) = longest.try_normalize() {
        return normal;
    }
    // Points on a line: any direction across it. Points in one place: any direction.
    let line = less(0.0);
    let along = [line.x_axis, line.y_axis, line.z_axis]
        .into_iter()
        .fold(DVec3::ZERO, |a, b| {
            if b.length_squared() > a.length_squared() {
                b
            } else {
                a
            }
        });
    along
        .try_normalize()
        .map_or(DVec3::Z, DVec3::any_orthonormal_vector)
}
