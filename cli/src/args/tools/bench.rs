//! Options of `resample bench`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::values;
use crate::values::Size;

/// Options of `resample bench`.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// The table.
    #[command(subcommand)]
    pub table: BenchTable,
}

/// The tables that can be repeated.
#[derive(Clone, Debug, Subcommand)]
pub enum BenchTable {
    /// Figure 9 of the hybrid forward resampling paper: all splats, mixed and all points, beside the paper's own row
    ///
    /// Example: resample bench paper --data volumes/raw
    Paper(BenchPaperArgs),
    /// Footprint modes and kernels of the every-sample order, near and wide: error and cost
    Footprint(BenchSceneArgs),
    /// Orders of compositing: error, cost, and how much a picture jumps while the view turns
    Orders(BenchSceneArgs),
    /// Texture filters on a ground and a ball: error, cost and shimmer
    Texture(BenchSceneArgs),
    /// Methods of warping a picture with depth, against the true view: error and cost
    Warp(BenchSceneArgs),
}

/// Options of the tables over built-in scenes.
#[derive(Args, Clone, Debug)]
pub struct BenchSceneArgs {
    /// Frames of each setting; the median of their CPU times counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "320x240")]
    pub size: Size,
}

/// Options of `resample bench paper`.
#[derive(Args, Clone, Debug)]
pub struct BenchPaperArgs {
    /// Folder that holds the volumes of the paper: files such as engine_256x256x128_uint8.raw
    ///
    /// Missing volumes are left out with a note; the Checker Box is a formula and always there.
    #[arg(long, value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Frames of each kind; the median of their CPU times counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Also write the picture of each kind to this folder
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
}
