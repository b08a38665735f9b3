//! Scans of points: PLY, LAS and LAZ, E57, PCD, PTX, PTS and XYZ, found by content.
//!
//! Takes a path and [`CloudLoadOptions`], gives a [`PointCloudFile`]. A reader hands one point after another to `collect`, which
//! thins them evenly, keeps their places relative to an origin, and leaves out those that have no finite place. The memory is
//! asked for before a point is read. Coordinates stay as the file has them.
//! Limits: links between points, times, waveforms and further attributes are left out.

mod collect;
mod ply;
mod laz;
mod las;
mod e57;
mod lzf;
mod pcd;
mod lines;
mod text;
mod format;
#[cfg(test)]
mod test_files;

use std::path::Path;

use glam::DVec3;
use resample_io::Gate;
use resample_io::files::fault;

use crate::Error;

pub use format::{CloudFormat, cloud_format_of};

/// Options of reading a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudLoadOptions {
    /// The memory that the points may take.
    pub gate: Gate,
    /// Points to keep at most, evenly from the order of the file; all where it is absent.
    pub points: Option<usize>,
}

/// The points of a file. Each list is as long as that of the positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloudFile {
    /// The place that positions are relative to, world units.
    pub origin_in_world: DVec3,
    /// Places of the points relative to the origin, world units.
    pub positions: Vec<[f32; 3]>,
    /// Colours, sRGB.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Strengths of the returns, stretched to 16 bits where the file has other numbers.
    pub intensities: Option<Vec<u16>>,
    /// Classes of the points, as the file numbers them.
    pub classes: Option<Vec<u8>>,
    /// Normals, as the file has them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Radii of the points, world units.
    pub radii_in_world: Option<Vec<f32>>,
    /// Remarks for the person who reads the file.
    pub notes: Vec<String>,
}

/// Reads a scan.
///
/// # Errors
/// [`Error::Input`] names the file: it cannot be read, contradicts its format, holds no points, or does not fit into memory.
pub fn load(path: &Path, options: &CloudLoadOptions) -> Result<PointCloudFile, Error> {
    if options.points == Some(0) {
        let what = "the number of points to keep is 0: expected at least 1";
        return Err(Error::Input(what.to_owned()));
    }
    let read = match cloud_format_of(path)? {
        Some(CloudFormat::Ply) => ply::load(path, options),
        Some(CloudFormat::Las | CloudFormat::Laz) => las::load(path, options),
        Some(CloudFormat::E57) => e57::load(path, options),
        Some(CloudFormat::Pcd) => pcd::load(path, options),
        Some(CloudFormat::Ptx | CloudFormat::Pts | CloudFormat::Xyz) => text::load(path, options),
        None => Err(
            "it holds no points of a known format: expected PLY without faces, LAS, LAZ, E57, PCD, PTX, PTS or XYZ".to_owned(),
        ),
    };
    read.map_err(|what| fault(path, what))
}
