//! Options of `resample demo` and `resample info`.

use std::path::PathBuf;

use clap::Args;

use crate::args::VolumeArgs;
use crate::values;
use crate::values::input_file::InputFile;
use crate::values::{Size, input_file};

/// Options of `resample demo`.
#[derive(Args, Clone, Debug)]
pub struct DemoArgs {
    /// Folder for the page, its pictures and the scenes' files; it is made if it does not exist
    #[arg(short, long, value_name = "FOLDER", default_value = "demo")]
    pub output: PathBuf,
    /// Picture size in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub size: Size,
}

/// Options of `resample info`.
#[derive(Args, Clone, Debug)]
pub struct InfoArgs {
    /// Volume, mesh, picture or depth; a folder of slices, or a pattern such as 'slices/*.tif'; FILE#PART reads a part of the file
    #[arg(value_name = "FILE[#PART]", value_parser = input_file::parser())]
    pub input: InputFile,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// How the file is read.
    #[command(flatten)]
    pub volume: VolumeArgs,
}
