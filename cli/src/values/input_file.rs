//! A file as it is typed, and behind a `#` the part of it that is meant: `FILE#PART`; or the memory of the program that uses this library.
//!
//! A scene of memory is shared, so that planning, drawing and looking live read the same one. It takes the place of the file alone: all
//! options that say how it looks, and how it is placed, are still those of the command.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::builder::{OsStringValueParser, TypedValueParser};
use resample_cloud::input::PointCloudFile;
use resample_io::{Picture, Plane};
use texmap::Loaded;
use volsplat::input::{ImageAxes, ImageChannel};
use volsplat::{Gaussians, Volume};

use crate::values::mesh_word::MeshWord;

/// A file, and perhaps a part of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputFile {
    /// The file.
    pub path: PathBuf,
    /// The part, without the `#`.
    pub part: Option<String>,
}

impl InputFile {
    /// The name without its folder, with the part.
    pub(crate) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        let name = name.to_string_lossy();
        match &self.part {
            Some(part) => format!("{name}#{part}"),
            None => name.into_owned(),
        }
    }

    /// Splits at the last `#`; a file whose own name holds it wins.
    pub fn of(text: OsString) -> Self {
        let split = text.to_str().and_then(|text| text.rsplit_once('#'));
        match split {
            Some((path, part))
                if !path.is_empty() && !part.is_empty() && !Path::new(&text).exists() =>
            {
                Self {
                    path: path.into(),
                    part: Some(part.to_owned()),
                }
            }
            _ => Self {
                path: text.into(),
                part: None,
            },
        }
    }
}

impl fmt::Display for InputFile {
    /// As it is typed.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let path = self.path.display();
        match &self.part {
            Some(part) => write!(f, "{path}#{part}"),
            None => write!(f, "{path}"),
        }
    }
}

impl From<PathBuf> for InputFile {
    fn from(path: PathBuf) -> Self {
        Self { path, part: None }
    }
}

/// For clap.
pub fn parser() -> impl TypedValueParser<Value = InputFile> {
    OsStringValueParser::new().map(InputFile::of)
}

/// Where a scene comes from.
#[derive(Debug, Default)]
pub enum Source<T> {
    /// From the files that were typed.
    #[default]
    File,
    /// From memory.
    Memory(Arc<T>),
}

/// Volumes of memory.
#[derive(Debug)]
pub struct HeldVolumes {
    /// The volume, which gives the picture its grid.
    pub volume: Arc<Volume>,
    /// Its further channels, where it has several.
    pub channels: Vec<Arc<Volume>>,
    /// Hides every sample whose nearest voxel in it is 0; on the same grid.
    pub mask: Option<Arc<Volume>>,
    /// Further volumes on the same grid, each with its look as `--also` takes it.
    pub also: Vec<(Arc<Volume>, String)>,
    /// Meshes that stand in it.
    pub meshes: Vec<MeshWord>,
}

impl HeldVolumes {
    /// The channels, of which nothing is known but their number.
    pub fn axes(&self) -> ImageAxes {
        ImageAxes {
            channels: vec![ImageChannel::default(); 1 + self.channels.len()],
            ..ImageAxes::default()
        }
    }

    /// A channel by its number, counted from 0.
    pub fn channel(&self, number: usize) -> Option<Arc<Volume>> {
        match number.checked_sub(1) {
            None => Some(self.volume.clone()),
            Some(further) => self.channels.get(further).cloned(),
        }
    }
}

/// A picture of memory and its depth.
#[derive(Debug)]
pub struct HeldPicture {
    /// The colours.
    pub colour: Picture,
    /// The numbers that `--depth-kind` explains.
    pub depth: Plane,
}

/// A picture and its depth, and then those of each `--reference`.
#[derive(Debug)]
pub struct HeldPictures(pub Vec<HeldPicture>);

/// A scene of memory, of any command.
#[derive(Clone, Debug)]
pub enum Held {
    /// Of `volsplat`.
    Volumes(Arc<HeldVolumes>),
    /// Meshes that stand in the volume of a file, of `volsplat`.
    Meshes(Vec<MeshWord>),
    /// Of `gaussians`.
    Gaussians(Arc<Gaussians>),
    /// Of `texmap`.
    Mesh(Arc<Loaded>),
    /// Of `warp3d`.
    Pictures(Arc<HeldPictures>),
    /// Of `points`.
    Points(Arc<PointCloudFile>),
}

impl<T> Source<T> {
    /// The scene in memory.
    pub fn held(&self) -> Option<&T> {
        match self {
            Self::File => None,
            Self::Memory(held) => Some(held),
        }
    }
}

impl<T> Clone for Source<T> {
    fn clone(&self) -> Self {
        match self {
            Self::File => Self::File,
            Self::Memory(held) => Self::Memory(held.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_stands_behind_the_last_hash() {
        let of = |text: &str| InputFile::of(text.into());
        assert_eq!(of("a#1/scene.glb#2").part.as_deref(), Some("2"));
        for whole in ["a.nrrd", "a.nrrd#", "#1"] {
            assert_eq!(of(whole), PathBuf::from(whole).into(), "no part");
        }
    }
}
