//! Files that are written: the writers of `resample_io::write`, and the planes that an option asks for.

use anyhow::{Result, bail};
use clap::ValueEnum;

use crate::values::word;

pub use resample_io::names::FrameNames;
pub(crate) use resample_io::write::exr::mark as exr_mark;
pub use resample_io::write::png::Depth;
pub use resample_io::write::{
    DEFAULT_FPS, Film, FilmKind, FilmPlan, Format, Left, WriteFailure, check_name, check_new,
    check_not_input, check_not_inputs, check_writable, format_of, kind_of, make_folder, png_codes,
    png_file, temporary_file, write_bytes, write_grey, write_marked_picture, write_picture,
    write_text, write_tile,
};

/// The planes that `--layers` asks for. Only an EXR file has a place for them.
pub(crate) fn layers<L: ValueEnum + Copy + PartialEq>(
    format: Format,
    asked: Option<&Vec<L>>,
) -> Result<Vec<L>> {
    let Some(layers) = asked else {
        return Ok(Vec::new());
    };
    if format != Format::Exr {
        bail!("--layers: only a name that ends in .exr has a place for them");
    }
    let repeated = |&(index, layer): &(usize, &L)| layers[..index].contains(layer);
    if let Some((_, layer)) = layers.iter().enumerate().find(repeated) {
        bail!("--layers: {} is named twice", word(*layer));
    }
    Ok(layers.clone())
}
