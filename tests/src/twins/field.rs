//! Reconstruction kernels and the extinction field that they rebuild, in f64 and by definition.
//!
//! Takes a kernel's shape, gives its value at a distance, and from that alone, by Simpson's rule, everything else:
//! scale, variance, and the integral along a line. The field is the sum over all voxels of extinction times kernel.
//! Source: the definitions in the method's section 3. Limits: slow; a line integral is good to 1e-8.

use glam::{DAffine3, DVec3};
use resample_core::KernelShape;
use std::f64::consts::PI;
use volsplat::{TransferFunction, Volume};

/// Extinction at which the library bounds a fully opaque voxel: exp(-87) is the edge of f32.
const MAX_EXTINCTION: f64 = 87.0;

/// A kernel with unit integral over space; lengths in voxels.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceKernel {
    shape: KernelShape,
    /// The kernel is 0 from here on.
    pub radius: f64,
    scale: f64,
}

impl ReferenceKernel {
    /// The kernel of this shape.
    pub fn new(shape: KernelShape) -> Self {
        let radius = match shape {
            KernelShape::Gaussian => 1.8,
            // First zero of J_9/2 over 2 pi.
            KernelShape::Polynomial => 8.182_561_452_571_1 / (2.0 * PI),
            KernelShape::BSpline => 2.0,
        };
        let mut kernel = Self {
            shape,
            radius,
            scale: 1.0,
        };
        kernel.scale = 1.0 / simpson(0.0, radius, 2000, |r| 4.0 * PI * r * r * kernel.value(r));
        kernel
    }

    /// The value at a distance from the centre.
    pub fn value(&self, distance: f64) -> f64 {
        if distance >= self.radius {
            return 0.0;
        }
        let gaussian = |r: f64| (-0.5 * (r / 0.6).powi(2)).exp();
        let raw = match self.shape {
            KernelShape::Gaussian => gaussian(distance) - gaussian(1.8),
            KernelShape::Polynomial => (1.0 - (distance / self.radius).powi(2)).powi(3),
            KernelShape::BSpline if distance < 1.0 => {
                (4.0 - 6.0 * distance.powi(2) + 3.0 * distance.powi(3)) / 6.0
            }
            KernelShape::BSpline => (2.0 - distance).powi(3) / 6.0,
        };
        self.scale * raw
    }

    /// The integral along a line at `distance` from the centre, from `start` on (0 is nearest to the centre).
    pub fn line_integral(&self, distance: f64, start: f64) -> f64 {
        if distance >= self.radius {
            return 0.0;
        }
        let end = (self.radius.powi(2) - distance.powi(2)).sqrt();
        if start >= end {
            return 0.0;
        }
        simpson(start.max(-end), end, 128, |t| self.value(distance.hypot(t)))
    }

    /// The variance along one axis.
    pub fn variance(&self) -> f64 {
        simpson(0.0, self.radius, 2000, |r| {
            4.0 * PI * r.powi(4) * self.value(r)
        }) / 3.0
    }
}

/// Simpson's rule on an even number of intervals.
pub fn simpson(from: f64, to: f64, intervals: u32, function: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / f64::from(intervals);
    let weight = |i: u32| match i {
        0 => 1.0,
        i if i == intervals => 1.0,
        i => f64::from(2 + 2 * (i % 2)),
    };
    let sum: f64 = (0..=intervals)
        .map(|i| weight(i) * function(from + f64::from(i) * step))
        .sum();
    sum * step / 3.0
}

/// Extinction per opacity unit of a voxel with this opacity.
pub fn extinction(opacity: f64) -> f64 {
    (-(-opacity).ln_1p()).min(MAX_EXTINCTION)
}

/// The extinction of a volume, rebuilt from its voxels.
#[derive(Clone, Debug)]
pub struct Field {
    dims: [usize; 3],
    extinction: Vec<f64>,
    /// The kernel.
    pub kernel: ReferenceKernel,
    /// From voxel indices to the world.
    pub world_from_index: DAffine3,
}

impl Field {
    /// The field of a classified volume.
    pub fn new(volume: &Volume, transfer: &TransferFunction, shape: KernelShape) -> Self {
        let voxel = |i: usize| extinction(transfer.opacity(volume.value(i)));
        Self {
            dims: volume.dims,
            extinction: (0..volume.len()).map(voxel).collect(),
            kernel: ReferenceKernel::new(shape),
            world_from_index: volume.world_from_index,
        }
    }

    /// The box in which the field may be above 0, in voxel indices.
    pub fn bounds(&self) -> [DVec3; 2] {
        let last = DVec3::from(self.dims.map(|n| (n - 1) as f64));
        [DVec3::splat(-self.kernel.radius), last + self.kernel.radius]
    }

    /// Extinction per opacity unit at a position in voxel indices: the sum over every kernel that reaches it.
    pub fn value(&self, at: DVec3) -> f64 {
        let radius = self.kernel.radius;
        let range = |axis: usize| {
            let first = (at[axis] - radius).ceil().max(0.0) as usize;
            let end =
                ((at[axis] + radius).floor() + 1.0).clamp(0.0, self.dims[axis] as f64) as usize;
            first..end
        };
        let mut sum = 0.0;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let tau = self.extinction[(z * self.dims[1] + y) * self.dims[0] + x];
                    if tau > 0.0 {
                        let centre = DVec3::new(x as f64, y as f64, z as f64);
                        sum += tau * self.kernel.value(at.distance(centre));
                    }
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_integrate_to_one_and_their_lines_fill_the_plane() {
        for shape in KernelShape::ALL {
            let kernel = ReferenceKernel::new(shape);
            let plane = simpson(0.0, kernel.radius, 400, |d| {
                2.0 * PI * d * kernel.line_integral(d, f64::NEG_INFINITY)
            });
            assert!(
                (plane - 1.0).abs() < 1e-6,
                "{shape:?}: the footprint integrates to {plane}"
            );
        }
    }
}
