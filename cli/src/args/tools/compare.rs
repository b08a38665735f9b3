//! Options of `resample compare`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked.

use std::path::PathBuf;

use clap::Args;

use crate::values;

/// Options of `resample compare`.
#[derive(Args, Clone, Debug)]
pub struct CompareArgs {
    /// Picture to judge: .png, .apng or .exr, or numbered pictures such as out/a_%04d.png
    #[arg(value_name = "PICTURE")]
    pub picture: PathBuf,
    /// Picture to compare with: the same kinds and the same size
    #[arg(value_name = "REFERENCE")]
    pub reference: PathBuf,
    /// Compare only where this picture is lighter than middle grey and not transparent
    #[arg(long, value_name = "FILE", conflicts_with = "inside")]
    pub within: Option<PathBuf>,
    /// Compare only where the reference shows something: where its alpha is above 1/255
    #[arg(long)]
    pub inside: bool,
    /// Write the FLIP error of each pixel as colours, black for none to bright for 1 (of several: the worst picture)
    #[arg(long, value_name = "FILE.png", value_parser = values::png_name)]
    pub heatmap: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Exit with 1 if a figure is above a bound, such as flip=0.02; may be repeated
    ///
    /// For psnr, alpha-psnr and ssim, where more is better: if it is below.
    #[arg(long = "fail-above", value_name = "METRIC=VALUE", value_parser = values::metric_bound)]
    pub bounds: Vec<(String, f64)>,
}
