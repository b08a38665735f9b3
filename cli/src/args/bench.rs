//! Options of `resample bench`.
//!
//! Takes the words of the command line, gives plain values with the spelling already checked.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Options of `resample bench`.
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    /// Which table.
    #[command(subcommand)]
    pub table: BenchTable,
}

/// The tables that can be repeated.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchTable {
    /// Figure 9 of the hybrid forward resampling paper: all splats, mixed and all points, beside the paper's own row
    ///
    /// Example: resample bench paper --data volumes/raw
    Paper(BenchPaperArgs),
}

/// Options of `resample bench paper`.
#[derive(Args, Debug)]
pub(crate) struct BenchPaperArgs {
    /// Folder that holds the volumes of the paper: files such as engine_256x256x128_uint8.raw
    ///
    /// What is missing is left out and said; the Checker Box is a formula and always there.
    #[arg(long, value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Frames of each kind; the median of their times counts
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub reps: u16,
    /// Also write the picture of each kind to this folder
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
}
