//! A scan as it comes from a file, its format, and how it is read.

use glam::DVec3;
use resample_io::Gate;

use crate::GridFate;

/// The formats of scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CloudFormat {
    /// PLY without faces.
    Ply,
    /// LAS of the ASPRS.
    Las,
    /// LAS whose points are packed.
    Laz,
    /// ASTM E57.
    E57,
    /// The format of PCL.
    Pcd,
    /// Leica's text of a grid of points.
    Ptx,
    /// Leica's text of points behind their number.
    Pts,
    /// A line of numbers for each point.
    Xyz,
}

impl CloudFormat {
    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Las => "LAS",
            Self::Laz => "LAZ",
            Self::E57 => "E57",
            Self::Pcd => "PCD",
            Self::Ptx => "PTX",
            Self::Pts => "PTS",
            Self::Xyz => "XYZ",
        }
    }
}

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
    /// Fates of the points by the grid of their scanner; absent where all stay.
    pub of_grid: Option<Vec<GridFate>>,
    /// Remarks for the person who reads the file.
    pub notes: Vec<String>,
}

impl PointCloudFile {
    /// Returns true if the grid of its scanner says that a point shows a surface which no other shows.
    pub fn is_kept(&self, point: usize) -> bool {
        let fates = self.of_grid.as_ref();
        fates.is_none_or(|fates| fates[point] == GridFate::Kept)
    }

    /// How many points are not kept, and why, for people.
    pub fn left_by_grid(&self) -> Vec<String> {
        let count = |wanted: GridFate| {
            let fates = self.of_grid.iter().flatten();
            fates.filter(|fate| **fate == wanted).count()
        };
        let total = self.of_grid.as_ref().map_or(0, Vec::len);
        let whys = [
            (
                GridFate::Mixed,
                "lie between two surfaces, as the scanner's grid shows, and are left out",
            ),
            (
                GridFate::Crowded,
                "lie closer on their row of the scanner's grid than rows do, and are left out",
            ),
        ];
        let counted = whys.map(|(fate, why)| (count(fate), why));
        let there = counted.into_iter().filter(|(count, _)| *count > 0);
        there
            .map(|(count, why)| format!("{count} of {total} points {why}; --keep-all draws them"))
            .collect()
    }
}

/// Points of another program, before they are a scan. Each list is as long as that of the places.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointLists {
    /// Places in the world.
    pub places: Vec<DVec3>,
    /// Colours, sRGB.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Strengths of the returns, of any range.
    pub intensities: Option<Vec<f32>>,
    /// Classes, as the LAS standard numbers them.
    pub classes: Option<Vec<u8>>,
}
