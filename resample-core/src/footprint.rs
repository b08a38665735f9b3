//! Footprints.

/// How the distance from a kernel's centre to a pixel's ray is found, in perspective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FootprintMode {
    /// The outline is an ellipse around the projected centre (the paper, Appendix A, small-angle form); the index is
    /// affine in it.
    AffineApprox,
    /// The outline is the exact ellipse around its midpoint (Appendix A); the index is affine in it.
    Affine,
    /// As `Affine`, with the index corrected by the cone angle (section 4.2, with the printed error repaired).
    Table,
    /// The exact distance from centre to ray: a quadratic form times a map that only the pixel decides.
    Exact,
}
