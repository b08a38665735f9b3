//! What a caller can choose: one plain struct, every field with unit, range, default and effect.

use glam::DVec3;
use resample_core::FootprintMode;
use resample_core::simd::SimdLevel;

use crate::Error;

/// The choices of one rendering. `RenderOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// How texels become pixels.
    pub method: Method,
    /// How a texel's place on the screen is found: `Affine` or `Exact`; the other modes have no meaning for flat samples.
    pub footprint: FootprintMode,
    /// How surfaces are lit.
    pub shade: Shade,
    /// Where the light of [`Shade::Lambert`] comes from: points towards the light, any length above 0.
    pub light: DVec3,
    /// Sub-pixels along a pixel's side at which visibility is decided: 1, 2, 3, 4 or 8. A pixel has one more than their
    /// square, on a turned lattice.
    pub subpixels: u32,
    /// From which level minified texels are taken.
    pub level: LevelChoice,
    /// Most texels that one pixel gathers from one surface, 16 or more; a coarser level is taken where it would be
    /// more, at a loss of sharpness across the direction of strong foreshortening.
    pub max_texels: u32,
    /// What the picture carries beside its colour.
    pub planes: Vec<PlaneKind>,
    /// Vector instructions to use. Levels agree to rounding.
    pub simd: SimdLevel,
}

/// How texels become pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Minified texels are points gathered by the pixel's Gaussian, magnified ones splats of the texture's own kernel.
    Hybrid,
    /// Every texel is a point: magnified textures have holes (the paper, Figure 5a). Minified ones are points in
    /// `Hybrid` too, and the same.
    Point,
    /// Texels are split along magnified axes until all are points.
    Supersample,
    /// The texel nearest to the pixel's centre.
    BackwardNearest,
    /// Bilinear at the pixel's centre (the paper, Figure 5c).
    BackwardBilinear,
    /// Bilinear in two levels of the mip pyramid, mixed.
    BackwardTrilinear,
    /// Elliptical weighted average in the mip pyramid, at most 16 times longer than wide (Heckbert 1989).
    BackwardEwa,
}

impl Method {
    /// Every method, forward ones first.
    pub const ALL: [Self; 7] = [
        Self::Hybrid,
        Self::Point,
        Self::Supersample,
        Self::BackwardNearest,
        Self::BackwardBilinear,
        Self::BackwardTrilinear,
        Self::BackwardEwa,
    ];
}

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shade {
    /// As the material says: its own colour where it is unlit, a headlight otherwise.
    Auto,
    /// Every surface shows its own colour.
    Unlit,
    /// A light at the eye.
    Headlight,
    /// A distant light from [`RenderOptions::light`].
    Lambert,
}

/// From which level of the pyramid minified texels are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelChoice {
    /// The level whose texels are just under the pixel: the cost follows the pixels.
    Auto,
    /// The full texture: the cost follows the texels.
    Full,
}

/// A plane of the picture beside its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneKind {
    /// Camera z of what is seen, coverage-weighted, world units; +infinity where nothing is. [`resample_core::Image::depth`].
    Depth,
    /// World normal towards the eye, times coverage: channels `normal.X`, `normal.Y`, `normal.Z`.
    Normal,
    /// Share of the pixel that any surface covers, 0..=1, whatever its alpha: channel `coverage`.
    Coverage,
    /// Share of the covered part that is laid as points, the rest being splats, 0..=1: channel `selection`.
    Selection,
    /// Texels of the full texture per pixel, by area: channel `texels`.
    TexelDensity,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            method: Method::Hybrid,
            footprint: FootprintMode::Exact,
            shade: Shade::Auto,
            light: DVec3::new(0.4, 1.0, 0.6),
            subpixels: 4,
            level: LevelChoice::Auto,
            max_texels: 1024,
            planes: Vec::new(),
            simd: SimdLevel::Auto,
        }
    }
}

impl RenderOptions {
    /// Checks every choice against its range.
    pub fn validate(&self) -> Result<(), Error> {
        let refuse = |what: String| Err(Error::Option(what));
        if !matches!(self.footprint, FootprintMode::Affine | FootprintMode::Exact) {
            return refuse(
                "flat samples have the footprints affine and exact; choose one of them".into(),
            );
        }
        if ![1, 2, 3, 4, 8].contains(&self.subpixels) {
            return refuse(format!(
                "the number of sub-pixels is {}, expected 1, 2, 3, 4 or 8",
                self.subpixels
            ));
        }
        if self.max_texels < 16 {
            return refuse(format!(
                "the most texels of a pixel are {}, expected 16 or more",
                self.max_texels
            ));
        }
        if self.light.try_normalize().is_none() {
            return refuse(format!(
                "the light comes from {}, expected a direction",
                self.light
            ));
        }
        Ok(())
    }

    /// Whether the picture carries this plane.
    pub fn has(&self, plane: PlaneKind) -> bool {
        self.planes.contains(&plane)
    }
}
