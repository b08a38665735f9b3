//! The options of a warp as arguments of a command line.
//!
//! Takes the words of the command line, gives [`WarpOptions`]. An argument that the chosen method does not have is
//! refused.

use clap::{Args, ValueEnum};
use resample_core::simd::SimdLevel;

use crate::Error;
use crate::options::{Fill, Method, SurfaceTolerance, Visibility, WarpOptions};

/// The options of a warp, as words of a command line give them.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Rendering")]
pub struct WarpArgs {
    /// How samples become pixels
    #[arg(long, value_enum, default_value_t = MethodName::Hybrid)]
    pub method: MethodName,
    /// How the method nearest keeps hidden samples out [default: zbuffer]
    #[arg(long, value_enum)]
    pub visibility: Option<Visibility>,
    /// Filling of holes
    #[arg(long, value_enum, default_value_t = Fill::None)]
    pub fill: Fill,
    /// Depth jumps larger than this part of inverse depth separate surfaces [default: from the steps of the depth itself]
    #[arg(long, value_name = "PART")]
    pub tolerance: Option<f32>,
    /// Sub-pixels along a pixel's side at depth edges, 1 to 8, of the method hybrid [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8))]
    pub subpixels: Option<u32>,
    /// SIMD level. Levels differ by rounding only; one level gives the same bytes on every machine
    #[arg(long, value_enum, default_value = "auto")]
    pub vector_level: SimdLevel,
}

/// The methods by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// One pixel per sample: fast, with cracks where samples are magnified
    Nearest,
    /// Every sample is a point gathered by the pixel's Gaussian
    Points,
    /// Every sample is a disc in its surface
    Splats,
    /// Every row on its own: several times as fast as hybrid, for --stereo and cameras moved along the rows alone
    Rows,
    /// Surfaces are projected forward, colour is reconstructed where they are seen
    Hybrid,
}

impl MethodName {
    /// The methods that draw for any camera.
    pub const FOR_ANY_CAMERA: [Self; 4] = [Self::Nearest, Self::Points, Self::Splats, Self::Hybrid];
}

impl WarpArgs {
    /// When two neighbours are on one surface.
    pub fn tolerance(&self) -> SurfaceTolerance {
        self.tolerance
            .map_or(SurfaceTolerance::Auto, SurfaceTolerance::Relative)
    }

    /// The options.
    ///
    /// # Errors
    /// [`Error::Option`] names an option that the method does not have, or one outside its range.
    pub fn options(&self) -> Result<WarpOptions, Error> {
        let options = WarpOptions {
            method: self.method()?,
            fill: self.fill,
            simd: self.vector_level,
            ..WarpOptions::default()
        };
        options.validate()?;
        Ok(options)
    }

    fn method(&self) -> Result<Method, Error> {
        let nearest = self.method == MethodName::Nearest;
        let hybrid = self.method == MethodName::Hybrid;
        let given = [
            ("visibility", self.visibility.is_some() && !nearest),
            ("tolerance", self.tolerance.is_some() && nearest),
            ("subpixels", self.subpixels.is_some() && !hybrid),
        ];
        if let Some((option, _)) = given.iter().find(|(_, misplaced)| *misplaced) {
            let name = self.method.to_possible_value();
            let name = name.as_ref().map_or("", |name| name.get_name());
            return Err(Error::Option(format!(
                "{option} does not apply to the method {name}"
            )));
        }
        let tolerance = self.tolerance();
        Ok(match self.method {
            MethodName::Nearest => Method::Nearest {
                visibility: self.visibility.unwrap_or(Visibility::ZBuffer),
            },
            MethodName::Points => Method::Points { tolerance },
            MethodName::Splats => Method::Splats { tolerance },
            MethodName::Rows => Method::Rows { tolerance },
            MethodName::Hybrid => Method::Hybrid {
                tolerance,
                subpixels: self.subpixels.unwrap_or(4),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::FromArgMatches;

    use super::*;

    fn read(words: &[&str]) -> Result<WarpOptions, Error> {
        let command = WarpArgs::augment_args(clap::Command::new("warp").no_binary_name(true));
        let matches = command
            .try_get_matches_from(words)
            .expect("well-formed words");
        WarpArgs::from_arg_matches(&matches)
            .expect("every argument has a value")
            .options()
    }

    #[test]
    fn the_arguments_default_to_the_default_options() {
        assert_eq!(read(&[]).expect("legal"), WarpOptions::default());
        for (name, method) in [
            ("nearest", Method::NEAREST),
            ("points", Method::POINTS),
            ("splats", Method::SPLATS),
            ("rows", Method::ROWS),
            ("hybrid", Method::HYBRID),
        ] {
            let options = read(&["--method", name]).expect("legal");
            assert_eq!(options, WarpOptions::with_method(method), "{name}");
        }
    }

    #[test]
    fn an_argument_of_another_method_is_refused() {
        for words in [
            ["--method", "hybrid", "--visibility", "zbuffer"],
            ["--method", "nearest", "--tolerance", "0.1"],
            ["--method", "points", "--subpixels", "2"],
        ] {
            let error = read(&words).expect_err("refused").to_string();
            assert!(error.contains(&words[2][2..]), "{error}");
        }
    }
}
