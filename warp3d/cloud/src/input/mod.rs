//! Scans of points: PLY, LAS and LAZ, E57, PCD, PTX, PTS and XYZ, found by content.
//!
//! Takes a path and [`CloudLoadOptions`], gives a [`PointCloudFile`]. A reader hands one point after another to `collect`, which
//! thins them evenly, keeps their places relative to an origin, and leaves out those that have no finite place. The memory is
//! asked for before a point is read. Coordinates stay as the file has them.
//! Limits: links between points, times, waveforms and further attributes are left out.

mod file;
mod collect;
mod ply;
mod las_header;
mod laz;
mod las;
mod e57;
mod lzf;
mod pcd;
mod lines;
mod text;
mod format;
mod classes;
#[cfg(test)]
mod test_files;

use std::path::Path;

use resample_io::files::fault;

use resample_core::Error;

pub use classes::{class_colour, class_name};
pub use file::{CloudFormat, CloudLoadOptions, PointCloudFile, PointLists};
pub use format::cloud_format_of;

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
