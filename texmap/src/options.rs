//! Options: one plain struct, every field with unit, range, default and effect.
//!
//! With the feature `serde` the choices can be written and read; with the feature `clap` they are the arguments of a
//! command line, whose help is the text below. Both use the same names, in kebab case.

use glam::DVec3;
use resample_core::simd::SimdLevel;

use crate::Error;

/// The choices of one rendering. `RenderOptions::default()` is what the measured trade favours.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
#[cfg_attr(
    feature = "clap",
    derive(clap::Args),
    command(next_help_heading = "Rendering")
)]
pub struct RenderOptions {
    /// How texels become pixels
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = Method::Hybrid))]
    pub method: Method,
    /// How surfaces are lit
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = Shade::Auto))]
    pub shade: Shade,
    /// Turn of the surroundings about +y, degrees, counter-clockwise seen from above
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "environment-turn",
            value_name = "DEG",
            default_value_t = 0.0,
            allow_hyphen_values = true
        )
    )]
    pub environment_turn_deg: f64,
    /// Direction towards the distant light of lambert shading, in the world, of any length
    #[cfg_attr(feature = "clap", arg(long, value_name = "X,Y,Z", value_parser = direction, default_value = "0.4,1,0.6",
        allow_hyphen_values = true, requires = "shade"))]
    pub light: DVec3,
    /// Where the mesh casts shadows in the light of the surroundings: nowhere, on itself, or also on a ground that shows nothing else
    #[cfg_attr(
        feature = "clap",
        arg(long, value_enum, value_name = "WHERE", default_value_t = Shadows::None, num_args = 0..=1, require_equals = true,
            default_missing_value = "mesh")
    )]
    pub shadows: Shadows,
    /// Sub-pixels along a pixel's side at which visibility is decided: 1, 2, 3, 4 or 8
    ///
    /// A pixel has one more than their square, on a turned lattice.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 4))]
    pub subpixels: u32,
    /// Brightness of the picture, stops: each doubles the light
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "STOPS",
            default_value_t = 0.0,
            allow_hyphen_values = true
        )
    )]
    pub exposure: f32,
    /// How light beyond what a screen shows is brought into its range
    #[cfg_attr(feature = "clap", arg(long, value_enum, default_value_t = ToneMap::None))]
    pub tone_map: ToneMap,
    /// Planes of the picture beside its colour
    #[cfg_attr(feature = "serde", serde(rename = "layers"))]
    #[cfg_attr(
        feature = "clap",
        arg(
            long = "layers",
            value_enum,
            value_name = "NAMES",
            value_delimiter = ','
        )
    )]
    pub planes: Vec<PlaneKind>,
    /// Linear colour of what the picture is laid over: alpha alone does not say in which colour tinted glass shows it
    #[cfg_attr(feature = "serde", serde(skip))]
    #[cfg_attr(feature = "clap", arg(skip = [1.0; 3]))]
    pub background: [f32; 3],
    /// SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    #[cfg_attr(
        feature = "clap",
        arg(long = "vector-level", value_enum, default_value = "auto")
    )]
    pub simd: SimdLevel,
}

/// How texels become pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Method {
    /// Minified texels are points gathered by the pixel's Gaussian, magnified ones splats of the texture's own kernel
    Hybrid,
    /// Every texel is a point: magnified textures have holes (the paper, Figure 5a), minified ones look as in the hybrid
    Point,
    /// Look-up: the texel nearest to the pixel's centre
    BackwardNearest,
    /// Look-up: bilinear at the pixel's centre (the paper, Figure 5c)
    BackwardBilinear,
    /// Look-up: bilinear in two levels of the mip pyramid, mixed
    BackwardTrilinear,
    /// Look-up: elliptical weighted average, at most 16 times longer than wide (Heckbert 1989)
    BackwardEwa,
}

impl Method {
    /// Every method, forward ones first.
    ///
    /// ```
    /// use texmap::Method;
    ///
    /// assert_eq!(Method::ALL[0], Method::Hybrid);
    /// ```
    pub const ALL: [Self; 6] = [
        Self::Hybrid,
        Self::Point,
        Self::BackwardNearest,
        Self::BackwardBilinear,
        Self::BackwardTrilinear,
        Self::BackwardEwa,
    ];
}

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shade {
    /// As the material says: its own colour where it is unlit, the surroundings' light where it gives metal and
    /// roughness, a headlight otherwise
    Auto,
    /// Every surface shows its own colour
    Unlit,
    /// A light at the eye
    Headlight,
    /// A distant light
    Lambert,
    /// The surroundings' light on metal, roughness and normal maps; what is unlit stays so
    Pbr,
}

/// How light beyond what a screen shows is brought into its range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum ToneMap {
    /// Cut off
    #[default]
    None,
    /// Compressed from 0.8 on, hues kept: the PBR Neutral tone mapper of the Khronos Group
    Neutral,
}

/// Where shadows fall. Every surface that is not unlit takes the light of the surroundings then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shadows {
    /// Nowhere: all light of the surroundings arrives
    #[default]
    None,
    /// On the mesh: it blocks the light of the surroundings from itself
    Mesh,
    /// On the mesh, and on a ground below it that shows nothing else
    Ground,
}

/// A plane of the picture beside its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum PlaneKind {
    /// Camera z of the visible surface, coverage-weighted, world units, +infinity where there is no surface: channel Z
    Depth,
    /// World normal towards the eye, times coverage: channels normal.X, normal.Y, normal.Z
    Normal,
    /// Share of the pixel that any surface covers, 0 to 1, whatever its alpha: channel coverage
    Coverage,
    /// Share of the covered part that is laid as points, the rest being splats, 0 to 1: channel selection
    Selection,
    /// Texels of the full texture per pixel, by area: channel texels
    Texels,
    /// Number of the mesh that covers most of the pixel, from 0 on, each instance with its own; -1 where none covers half of it: channel mesh
    Mesh,
    /// Number of its material, from 0 on; -1 likewise: channel material
    Material,
    /// Texture coordinates of the base texture there, from 0 to 1 for one repeat; 0 without one: channels uv.U, uv.V
    Coordinates,
}

impl PlaneKind {
    /// Every plane.
    pub const ALL: [Self; 8] = [
        Self::Depth,
        Self::Normal,
        Self::Coverage,
        Self::Selection,
        Self::Texels,
        Self::Mesh,
        Self::Material,
        Self::Coordinates,
    ];

    /// The planes of a file that has a place for them and names none.
    pub const USUAL: [Self; 5] = [
        Self::Depth,
        Self::Normal,
        Self::Coverage,
        Self::Selection,
        Self::Texels,
    ];
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            method: Method::Hybrid,
            shade: Shade::Auto,
            environment_turn_deg: 0.0,
            light: DVec3::new(0.4, 1.0, 0.6),
            shadows: Shadows::None,
            subpixels: 4,
            exposure: 0.0,
            tone_map: ToneMap::None,
            planes: Vec::new(),
            background: [1.0; 3],
            simd: SimdLevel::Auto,
        }
    }
}

impl RenderOptions {
    /// Checks every choice against its range.
    ///
    /// # Errors
    /// [`Error::Option`] names the choice and its range.
    ///
    /// ```
    /// use texmap::RenderOptions;
    ///
    /// assert!(RenderOptions::default().validate().is_ok());
    /// assert!(RenderOptions { subpixels: 5, ..RenderOptions::default() }.validate().is_err());
    /// ```
    pub fn validate(&self) -> Result<(), Error> {
        if ![1, 2, 3, 4, 8].contains(&self.subpixels) {
            return Err(Error::Option(format!(
                "the number of sub-pixels is {}, expected 1, 2, 3, 4 or 8",
                self.subpixels
            )));
        }
        if !self.environment_turn_deg.is_finite() {
            return Err(Error::Option(format!(
                "the surroundings are turned by {} degrees, expected a finite number",
                self.environment_turn_deg
            )));
        }
        // Beyond, black stays black and all else is white.
        if !(-64.0..=64.0).contains(&self.exposure) {
            return Err(Error::Option(format!(
                "the exposure is {} stops, expected -64 to 64",
                self.exposure
            )));
        }
        if self.shadows != Shadows::None && !matches!(self.shade, Shade::Auto | Shade::Pbr) {
            return Err(Error::Option(
                "shadows are cast in the light of the surroundings: leave out the other shade, or the shadows"
                    .into(),
            ));
        }
        if self.light.try_normalize().is_none() {
            return Err(Error::Option(format!(
                "the light comes from {}, expected a direction",
                self.light
            )));
        }
        Ok(())
    }

    /// Returns true if the picture carries this plane.
    ///
    /// ```
    /// use texmap::{PlaneKind, RenderOptions};
    ///
    /// let options = RenderOptions { planes: vec![PlaneKind::Depth], ..RenderOptions::default() };
    /// assert!(options.has(PlaneKind::Depth) && !options.has(PlaneKind::Normal));
    /// ```
    pub fn has(&self, plane: PlaneKind) -> bool {
        self.planes.contains(&plane)
    }
}

/// Reads `X,Y,Z`, a direction of any length.
#[cfg(feature = "clap")]
fn direction(text: &str) -> Result<DVec3, String> {
    let mut parts = [0.0; 3];
    let mut words = text.split(',');
    for part in &mut parts {
        let number = words.next().and_then(|word| word.trim().parse().ok());
        *part = number.unwrap_or(f64::NAN);
    }
    let direction = DVec3::from(parts);
    if words.next().is_none() && direction.try_normalize().is_some() {
        Ok(direction)
    } else {
        Err("expected X,Y,Z, three numbers that are not all 0".into())
    }
}

#[cfg(all(test, feature = "clap"))]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_default_to_the_default_options() {
        use clap::{Args, FromArgMatches};
        let command = RenderOptions::augment_args(clap::Command::new("render"));
        let matches = command
            .try_get_matches_from(["render"])
            .expect("no argument is needed");
        let options =
            RenderOptions::from_arg_matches(&matches).expect("every option has a default");
        assert_eq!(options, RenderOptions::default());
    }
}
