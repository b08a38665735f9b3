//! Volumes whose voxels are colours: which channels draw them.
//!
//! Takes the typed options and the reading options, gives the words of `--channel`: red, green and blue. Their extinctions add, so
//! bright voxels are opaque, and their colours mix by extinction. Alpha is not used.

use anyhow::Result;
use volsplat::LoadOptions;

use crate::args::VolsplatArgs;
use crate::look;

/// The channels of a file that holds colours, where nobody said how it looks; a note says that.
pub(crate) fn channels(args: &VolsplatArgs, options: &LoadOptions) -> Result<Vec<String>> {
    let scene = &args.scene;
    let is_typed = !scene.channel.is_empty() || scene.labels || look::is_typed(&args.transfer);
    if is_typed || args.source.held().is_some() {
        return Ok(Vec::new());
    }
    let path = &args.input.path;
    if volsplat::input::colours_of(path, options)?.is_none() {
        return Ok(Vec::new());
    }
    let words = ["0", "red", "1", "green", "2", "blue"];
    options.gate.remark(format!(
        "{}: its voxels are colours, drawn as --channel {}; FILE#component=N draws one of them",
        path.display(),
        words
            .chunks(2)
            .map(|pair| pair.join(" "))
            .collect::<Vec<_>>()
            .join(" --channel ")
    ));
    Ok(words.map(str::to_owned).to_vec())
}
