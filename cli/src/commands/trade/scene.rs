//! A built-in scene in place of a file.

use std::path::Path;

use anyhow::{Result, bail};

use crate::args::SceneArg;
use crate::built_in;

/// Writes the scene into `folder`, and gives the words of the command with it.
pub(super) fn written(scene: SceneArg, folder: &Path, words: &[String]) -> Result<Vec<String>> {
    let Some((_, rest)) = words
        .split_first()
        .filter(|(first, _)| *first == "volsplat")
    else {
        bail!("--scene: the built-in scenes are volumes, expected volsplat");
    };
    Ok(built_in::volume(scene, folder)?
        .into_iter()
        .chain(rest.iter().cloned())
        .collect())
}
