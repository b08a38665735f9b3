//! What a caller can choose: one plain struct, every field with unit, range, default and effect.

use crate::Error;
use resample_core::FootprintMode;
use resample_core::simd::SimdLevel;

/// The choices of one warp. `WarpOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
pub struct WarpOptions {
    /// How samples become pixels.
    pub method: Method,
    /// How hidden samples are kept out.
    pub visibility: Visibility,
    /// What is put where no sample was seen.
    pub fill: Fill,
    /// How the footprint of a flat sample is evaluated: [`FootprintMode::Exact`] by its homography, every other mode by
    /// the Jacobian at its centre. Used by `Splats` and `Ewa`.
    pub footprint: FootprintMode,
    /// When two neighbours are on one surface.
    pub tolerance: SurfaceTolerance,
    /// What happens to reference pixels that blend two surfaces.
    pub mixed: MixedPixels,
    /// Sub-pixels along a pixel's side at which coverage is resolved near depth edges: 1 to 8.
    pub subpixels: u32,
    /// How several references become one picture.
    pub blend: Blend,
    /// Whether the picture carries the planes `filled` and `confidence`.
    pub planes: ExtraPlanes,
    /// Vector instructions: the best of this CPU, or fewer, for tests.
    pub simd: SimdLevel,
}

/// How samples become pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// One pixel per sample (McMillan 1997): fast, with cracks where samples are magnified.
    Nearest,
    /// Surfaces are projected forward and resolved at sub-pixels; colour is reconstructed where they are seen.
    Hybrid,
    /// The samples of each surface joined by a Delaunay triangulation, cut at depth edges.
    Mesh,
    /// Every sample is a point gathered by the pixel's Gaussian: holes where samples are magnified.
    Points,
    /// Every sample is a disc in its tangent plane, without a pixel filter: minified ones alias.
    Splats,
    /// Every sample is its disc convolved with the pixel's Gaussian: covariances add (Heckbert 1989).
    Ewa,
}

/// How hidden samples are kept out. `OcclusionOrder` is for the methods `Nearest` and `Hybrid`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// The nearest one wins.
    ZBuffer,
    /// Samples are drawn in the order around the epipole in which the later one is always the nearer
    /// (McMillan 1995). No depth is compared.
    OcclusionOrder,
}

/// What is put where no sample was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// Nothing: the pixel is transparent.
    None,
    /// The farther side of the hole's rim is extended.
    Background,
    /// Natural-neighbour interpolation from the far side of the hole's rim.
    Natural,
}

/// When two neighbours of a reference are on one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceTolerance {
    /// From the depth map's own steps: 0.4 % of inverse depth where depth is exact, about 2 % where it is coarse.
    Auto,
    /// Departure of inverse depth from linearity, relative, above 0 and below 1.
    Relative(f32),
}

/// What happens to reference pixels that blend two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MixedPixels {
    /// Used as they are: a rim of the other surface's colour travels with them.
    Keep,
    /// Detected beside depth edges and replaced by the colour of their own surface.
    Unmix,
}

/// How several references become one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// Weighted by baseline, resolution and agreement of depth.
    Weighted,
    /// The best one at each pixel.
    Best,
}

/// Whether the picture carries planes beside colour and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtraPlanes {
    /// Colour and depth alone.
    None,
    /// `filled` (1 where a hole was filled) and `confidence` (0 to 1: how well the pixel was seen).
    FilledAndConfidence,
}

impl Default for WarpOptions {
    fn default() -> Self {
        Self {
            method: Method::Hybrid,
            visibility: Visibility::ZBuffer,
            fill: Fill::None,
            footprint: FootprintMode::Exact,
            tolerance: SurfaceTolerance::Auto,
            mixed: MixedPixels::Unmix,
            subpixels: 4,
            blend: Blend::Weighted,
            planes: ExtraPlanes::FilledAndConfidence,
            simd: SimdLevel::Auto,
        }
    }
}

impl Method {
    /// Every method, for tests and tables that sweep over them.
    pub const ALL: [Self; 6] = [
        Self::Nearest,
        Self::Hybrid,
        Self::Mesh,
        Self::Points,
        Self::Splats,
        Self::Ewa,
    ];
}

impl WarpOptions {
    /// The method, with the default of every other choice.
    pub fn with_method(method: Method) -> Self {
        Self {
            method,
            ..Self::default()
        }
    }

    /// Checks every number against its range.
    pub fn validate(&self) -> Result<(), Error> {
        let ordered = matches!(self.method, Method::Nearest | Method::Hybrid);
        if self.visibility == Visibility::OcclusionOrder && !ordered {
            let what =
                "occlusion order is for the methods nearest and hybrid: use --visibility zbuffer";
            return Err(Error::Option(what.into()));
        }
        if !(1..=8).contains(&self.subpixels) {
            let n = self.subpixels;
            return Err(Error::Option(format!(
                "the number of sub-pixels is {n}, expected 1 to 8"
            )));
        }
        match self.tolerance {
            SurfaceTolerance::Relative(t) if !(t > 0.0 && t < 1.0) => Err(Error::Option(format!(
                "the surface tolerance is {t}, expected a part of inverse depth above 0 and below 1"
            ))),
            _ => Ok(()),
        }
    }
}
