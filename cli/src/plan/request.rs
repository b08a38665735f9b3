//! The common request of every command that draws.

use std::path::Path;

use resample_core::simd::SimdLevel;
use resample_io::Gate;

use crate::args::{CameraArgs, PictureArgs, SequenceArgs};
use crate::cameras::camera_path::KeyKind;

/// The options that every command shares.
pub(crate) struct Request<'a> {
    /// The picture, pattern or animation.
    pub output: &'a Path,
    /// The stats file.
    pub stats: Option<&'a Path>,
    /// From where it is seen.
    pub camera: &'a CameraArgs,
    /// How many pictures there are.
    pub sequence: &'a SequenceArgs,
    /// Steps of a scene that changes from picture to picture; 0 for one that rests.
    pub steps: usize,
    /// How they are written.
    pub picture: &'a PictureArgs,
    /// The fields that the keys of a path may have.
    pub keys: KeyKind,
    /// The vector instructions that are asked for.
    pub vector_level: SimdLevel,
    /// Rules for names inside files, and the memory their data may take.
    pub gate: Gate,
    /// Files that are read, beside the camera file and the background.
    pub inputs: Vec<&'a Path>,
    /// Files that are written beside the picture, each with its option.
    pub others: Vec<(&'static str, &'a Path)>,
}
