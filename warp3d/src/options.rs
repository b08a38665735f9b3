//! Options: one plain struct, every field with unit, range, default and effect.
//!
//! A method carries the choices that only it has. With the feature `serde` the choices can be written and read, all in
//! one object; with the feature `clap`, `WarpArgs` are the arguments of a command line. Both use the same names.

use resample_core::simd::SimdLevel;

use crate::Error;

/// The choices of one warp. `WarpOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WarpOptions {
    /// How samples become pixels.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub method: Method,
    /// Filling of holes.
    pub fill: Fill,
    /// The planes `filled` and `confidence` of the picture.
    pub planes: ExtraPlanes,
    /// Vector instructions: the best of this CPU, or fewer, for tests.
    pub simd: SimdLevel,
}

/// How samples become pixels, with the choices of each method.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "method", rename_all = "kebab-case")
)]
pub enum Method {
    /// One pixel per sample (McMillan 1997): fast, with cracks where samples are magnified.
    Nearest {
        /// How hidden samples are kept out.
        visibility: Visibility,
    },
    /// Every sample is a point gathered by the pixel's Gaussian: holes where samples are magnified.
    Points {
        /// When two neighbours are on one surface.
        tolerance: SurfaceTolerance,
    },
    /// Every sample is a disc in its tangent plane, without a pixel filter: minified ones alias.
    Splats {
        /// When two neighbours are on one surface.
        tolerance: SurfaceTolerance,
    },
    /// Every row on its own, for cameras that are moved along the rows alone, such as both eyes of a stereo pair: several times as fast.
    Rows {
        /// When two neighbours are on one surface.
        tolerance: SurfaceTolerance,
    },
    /// Surfaces are projected forward and resolved at sub-pixels; colour is reconstructed where they are seen.
    Hybrid {
        /// When two neighbours are on one surface.
        tolerance: SurfaceTolerance,
        /// Sub-pixels along a pixel's side at which coverage is resolved near depth edges: 1 to 8.
        subpixels: u32,
    },
}

/// How the method `Nearest` keeps hidden samples out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Visibility {
    /// The nearest one wins
    #[cfg_attr(feature = "serde", serde(rename = "zbuffer"))]
    #[cfg_attr(feature = "clap", value(name = "zbuffer"))]
    ZBuffer,
    /// Drawn from back to front around the epipole, without comparing depth (McMillan 1995)
    OcclusionOrder,
}

/// Filling of holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Fill {
    /// Nothing: the pixel is transparent
    None,
    /// The farther side of the hole's rim, extended
    Background,
    /// Natural-neighbour interpolation from the farther side of the hole's rim
    Natural,
    /// The background that other pictures of a film show there, else as background
    Film,
}

/// When two neighbours of a reference are on one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum SurfaceTolerance {
    /// From the depth map's own steps: 0.4 % of inverse depth where depth is exact, about 2 % where it is coarse.
    Auto,
    /// Departure of inverse depth from linearity, relative, above 0 and below 1.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Relative(f32),
}

/// Planes of a picture beside colour and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum ExtraPlanes {
    /// Colour and depth alone.
    None,
    /// `filled` (1 where a hole was filled) and `confidence` (0 to 1: how well the pixel was seen).
    FilledAndConfidence,
}

impl Default for WarpOptions {
    fn default() -> Self {
        Self {
            method: Method::HYBRID,
            fill: Fill::None,
            planes: ExtraPlanes::FilledAndConfidence,
            simd: SimdLevel::Auto,
        }
    }
}

impl Method {
    /// [`Method::Nearest`] with its defaults.
    pub const NEAREST: Self = Self::Nearest {
        visibility: Visibility::ZBuffer,
    };
    /// [`Method::Points`] with its defaults.
    pub const POINTS: Self = Self::Points {
        tolerance: SurfaceTolerance::Auto,
    };
    /// [`Method::Splats`] with its defaults.
    pub const SPLATS: Self = Self::Splats {
        tolerance: SurfaceTolerance::Auto,
    };
    /// [`Method::Rows`] with its defaults.
    pub const ROWS: Self = Self::Rows {
        tolerance: SurfaceTolerance::Auto,
    };
    /// [`Method::Hybrid`] with its defaults.
    pub const HYBRID: Self = Self::Hybrid {
        tolerance: SurfaceTolerance::Auto,
        subpixels: 4,
    };

    /// Every method for all cameras with its defaults, for tests and tables that sweep over them.
    pub const ALL: [Self; 4] = [Self::NEAREST, Self::POINTS, Self::SPLATS, Self::HYBRID];

    /// When two neighbours are on one surface; `None` for a method that needs no surfaces.
    pub fn tolerance(&self) -> Option<SurfaceTolerance> {
        match *self {
            Self::Nearest { .. } => None,
            Self::Points { tolerance }
            | Self::Splats { tolerance }
            | Self::Rows { tolerance }
            | Self::Hybrid { tolerance, .. } => Some(tolerance),
        }
    }

    /// Returns true if what one method prepares serves the other too.
    pub(crate) fn prepares_as(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
            && self.tolerance() == other.tolerance()
    }
}

impl WarpOptions {
    /// The method, with the default of every other choice.
    ///
    /// ```
    /// use warp3d::{Method, Visibility, WarpOptions};
    ///
    /// let nearest = Method::Nearest { visibility: Visibility::ZBuffer };
    /// assert!(WarpOptions::with_method(nearest).validate().is_ok());
    /// ```
    pub fn with_method(method: Method) -> Self {
        Self {
            method,
            ..Self::default()
        }
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`Error::Option`] names the choice and its range.
    pub fn validate(&self) -> Result<(), Error> {
        if let Method::Hybrid { subpixels: n, .. } = self.method
            && !(1..=8).contains(&n)
        {
            return Err(Error::Option(format!(
                "the number of sub-pixels is {n}, expected 1 to 8"
            )));
        }
        match self.method.tolerance() {
            Some(SurfaceTolerance::Relative(t)) if !(t > 0.0 && t < 1.0) => {
                Err(Error::Option(format!(
                    "the surface tolerance is {t}, expected a part of inverse depth above 0 and below 1"
                )))
            }
            _ => Ok(()),
        }
    }
}
