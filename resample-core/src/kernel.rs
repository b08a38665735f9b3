//! Reconstruction kernels.

/// The shape of a reconstruction kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KernelShape {
    /// Gaussian, truncated and shifted to reach 0 at its support radius.
    Gaussian,
    /// (1 - r^2/R^2)^2: compact, smooth, no exponential.
    Polynomial,
    /// Radial cubic B-spline of radius 2.
    BSpline,
}
