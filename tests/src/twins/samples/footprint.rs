//! Footprints of the reference renderer: the box of an outline, and the EWA filter.
//!
//! The box comes from planes: a picture column is the plane of the rays through it, and the outermost columns that a
//! ball touches are the planes tangent to it. EWA is a Gaussian-like profile whose covariance is the kernel's on the
//! screen plus the pixel's, with the mass of the sample.

use glam::{DVec2, DVec3};
use resample_core::{Camera, Projection};

use crate::twins::field::ReferenceKernel;
use crate::twins::rays::RaySource;

/// Least and greatest screen position (px) of a ball that is wholly in front of the eye plane.
pub(crate) fn outline_box(
    rays: &RaySource,
    camera: &Camera,
    centre: DVec3,
    radius: f64,
) -> [DVec2; 2] {
    let middle = DVec2::new(camera.cx, camera.cy);
    let base = rays.ray(middle);
    let steps = [DVec2::X, DVec2::Y].map(|step| {
        let ray = rays.ray(middle + step);
        match camera.projection {
            Projection::Perspective => ray.direction - base.direction,
            Projection::Orthographic => ray.origin - base.origin,
        }
    });
    let c = centre - base.origin;
    let ends = [0, 1].map(|axis| {
        let (along, across) = (steps[axis], steps[1 - axis]);
        match camera.projection {
            Projection::Perspective => {
                tangent_planes(base.direction.cross(across), along.cross(across), c, radius)
            }
            Projection::Orthographic => {
                let normal = base.direction.cross(across).normalize();
                let per_px = along.dot(normal);
                let ends = [c.dot(normal) - radius, c.dot(normal) + radius].map(|d| d / per_px);
                [ends[0].min(ends[1]), ends[0].max(ends[1])]
            }
        }
    });
    [0, 1].map(|end| middle + DVec2::new(ends[0][end], ends[1][end]))
}

/// The two x at which the plane through the eye with normal a + x b touches the ball at c.
fn tangent_planes(a: DVec3, b: DVec3, c: DVec3, radius: f64) -> [f64; 2] {
    let (ac, bc, r2) = (a.dot(c), b.dot(c), radius * radius);
    let (p, q, s) = (
        bc * bc - r2 * b.dot(b),
        ac * bc - r2 * a.dot(b),
        ac * ac - r2 * a.dot(a),
    );
    let root = (q * q - p * s).max(0.0).sqrt();
    let ends = [(-q - root) / p, (-q + root) / p];
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}

/// The footprint of one sample convolved with the pixel's Gaussian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ewa {
    inverse: [f64; 3],
    cutoff2: f64,
    radius: f64,
    scale: f64,
    /// Half the box beyond which it is 0, px.
    pub(crate) half_extent: DVec2,
}

impl Ewa {
    /// From the kernel's covariance per unit variance on the screen, the pixel's variance, and the mass to spread.
    pub(crate) fn new(
        kernel: &ReferenceKernel,
        gram: [f64; 3],
        pixel_variance: f64,
        mass: f64,
    ) -> Self {
        let variance = kernel.variance();
        let xx = variance * gram[0] + pixel_variance;
        let xy = variance * gram[1];
        let yy = variance * gram[2] + pixel_variance;
        let det = xx * yy - xy * xy;
        // The kernel's footprint ends at its radius, which is this many of its own standard deviations.
        let cutoff2 = kernel.radius.powi(2) / variance;
        // The footprint integrates to 1 over the plane of the kernel, where one standard deviation is sqrt(variance);
        // on the screen the unit of area is sqrt(det) instead of the variance.
        let scale = mass * variance / det.sqrt();
        let half_extent = DVec2::new((xx * cutoff2).sqrt(), (yy * cutoff2).sqrt());
        let inverse = [yy / det, -xy / det, xx / det];
        Self {
            inverse,
            cutoff2,
            radius: kernel.radius,
            scale,
            half_extent,
        }
    }

    /// The contribution of the sample at an offset from its centre, px.
    pub(crate) fn value(&self, kernel: &ReferenceKernel, d: DVec2) -> f64 {
        let [xx, xy, yy] = self.inverse;
        let q = (xx * d.x * d.x + 2.0 * xy * d.x * d.y + yy * d.y * d.y) / self.cutoff2;
        self.scale * kernel.line_integral(self.radius * q.sqrt(), f64::NEG_INFINITY)
    }
}
