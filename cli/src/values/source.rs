//! Where a scene comes from: the files that were typed, or the memory of the program that uses this library.
//!
//! A scene of memory is shared, so that planning, drawing and looking live read the same one. It takes the place of the
//! file alone: all options that say how it looks, and how it is placed, are still those of the command.

use std::sync::Arc;

use resample_io::{Picture, Plane};
use texmap::Loaded;
use volsplat::Volume;

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
    /// Hides every sample whose nearest voxel in it is 0; on the same grid.
    pub mask: Option<Arc<Volume>>,
    /// Further volumes on the same grid, each with its look as `--also` takes it.
    pub also: Vec<(Arc<Volume>, String)>,
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
    /// Of `texmap`.
    Mesh(Arc<Loaded>),
    /// Of `warp3d`.
    Pictures(Arc<HeldPictures>),
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
