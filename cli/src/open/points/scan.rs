//! A scan and the part of it that is drawn.
//!
//! Takes a file or points of memory, gives discs. Positions are handed to the preparation and are gone after it, unless they are
//! to be prepared again for another part.

use anyhow::{Context, Result, anyhow, bail};
use glam::{DVec3, Vec3};
use resample_cloud::input::{CloudFormat, CloudLoadOptions, PointCloudFile, cloud_format_of, load};
use resample_cloud::{PointCloud, Prepared, prepare_bytes, prepare_with};
use resample_core::narrow::count;
use resample_io::Gate;

use crate::args::{PointsArgs, PointsPartArgs};

/// Colours of points before they get theirs.
const GREY: [u8; 3] = [188; 3];

/// The positions of a scan after its discs are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Positions {
    /// They stay in memory.
    Kept,
    /// They are handed over.
    Spent,
}

/// A scan that is read.
pub(super) struct Scan {
    /// Its format; `None` for points of memory.
    pub(super) format: Option<CloudFormat>,
    /// How many points were read.
    pub(super) points: usize,
    /// Its points. The positions may be spent.
    pub(super) file: PointCloudFile,
}

impl Scan {
    /// Reads the scan of a command.
    pub(super) fn read(args: &PointsArgs, gate: &Gate) -> Result<Self> {
        let (format, file) = match args.source.held() {
            Some(held) => (
                None,
                held.thinned(args.part.points.map_or(usize::MAX, count)),
            ),
            None => (
                cloud_format_of(&args.input.path)?,
                load(&args.input.path, &load_options(&args.part, gate))?,
            ),
        };
        Ok(Self {
            format,
            points: file.positions.len(),
            file,
        })
    }

    /// The discs of the part that is drawn. Their points are numbered as in the file.
    pub(super) fn prepared(
        &mut self,
        args: &PointsArgs,
        gate: &Gate,
        after: Positions,
    ) -> Result<Prepared> {
        let name = || args.input.path.display().to_string();
        let part = &args.part;
        if self.file.positions.is_empty() {
            *self = Self::read(args, gate)?;
        }
        let kept = self.kept(part).with_context(name)?;
        let points = kept.as_ref().map_or(self.points, Vec::len);
        let asked = gate.ask(prepare_bytes(points), &format!("discs of {points} points"));
        asked
            .map_err(|what| anyhow!("{what}; --points N keeps N of them"))
            .with_context(name)?;
        let positions = match (&kept, after) {
            (Some(kept), _) => {
                let of = |&point: &u32| self.file.positions[point as usize];
                kept.iter().map(of).collect()
            }
            (None, Positions::Kept) => self.file.positions.clone(),
            (None, Positions::Spent) => std::mem::take(&mut self.file.positions),
        };
        if after == Positions::Spent {
            self.file.positions = Vec::new();
        }
        let cloud = PointCloud {
            origin_in_world: self.file.origin_in_world,
            colours: vec![GREY; positions.len()],
            positions,
        };
        let mut prepared = prepare_with(&cloud, part.floating())
            .with_context(|| format!("{}: cannot be drawn", name()))?;
        if let Some(kept) = kept {
            for point in &mut prepared.points {
                *point = kept[*point as usize];
            }
        }
        if prepared.discs.is_empty() {
            bail!(
                "{}: none of its {points} points has neighbours from which a surface could be made: expected at least two \
                 places",
                name()
            );
        }
        Ok(prepared)
    }

    /// The numbers of the points inside the box and the planes; `None` where there are no such.
    fn kept(&self, part: &PointsPartArgs) -> Result<Option<Vec<u32>>> {
        let leaves_out = self.file.of_grid.is_some() && !part.keep_all;
        if part.crop.is_none() && part.clip_plane.is_empty() && !leaves_out {
            return Ok(None);
        }
        let origin = self.file.origin_in_world;
        let is_inside = |position: &[f32; 3]| {
            let at = origin + Vec3::from(*position).as_dvec3();
            let in_box = part.crop.is_none_or(|[a, b]| {
                let (a, b) = (DVec3::from(a), DVec3::from(b));
                at.cmpge(a.min(b)).all() && at.cmple(a.max(b)).all()
            });
            let planes = &part.clip_plane;
            in_box && planes.iter().all(|p| p.normal.dot(at) >= p.offset)
        };
        let is_kept = |number: u32| !leaves_out || self.file.is_kept(number as usize);
        let numbered = self.file.positions.iter().zip(0..);
        let inside = numbered.filter(|(position, number)| is_inside(position) && is_kept(*number));
        let inside: Vec<u32> = inside.map(|(_, number)| number).collect();
        if inside.is_empty() {
            let option = if part.crop.is_some() {
                "--crop"
            } else {
                "--clip-plane"
            };
            let [low, high] = span(&self.file);
            bail!("{option}: leaves no point; they lie between {low} and {high}");
        }
        Ok(Some(inside))
    }
}

/// How the file of a command is read.
pub(crate) fn load_options(part: &PointsPartArgs, gate: &Gate) -> CloudLoadOptions {
    CloudLoadOptions {
        gate: gate.clone(),
        points: part.points.map(count),
    }
}

/// The box around all points, world units.
pub(crate) fn span(file: &PointCloudFile) -> [DVec3; 2] {
    let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let corners = file.positions.iter().fold(none, |[low, high], &at| {
        [low.min(at.into()), high.max(at.into())]
    });
    corners.map(|corner| file.origin_in_world + corner.as_dvec3())
}

/// The direction that is up in files of a format. Surveyors count heights along z, and PLY comes from programs of meshes.
pub(crate) fn up_of(format: Option<CloudFormat>) -> DVec3 {
    match format {
        Some(CloudFormat::Ply) => DVec3::Y,
        Some(
            CloudFormat::Las
            | CloudFormat::Laz
            | CloudFormat::E57
            | CloudFormat::Pcd
            | CloudFormat::Ptx
            | CloudFormat::Pts
            | CloudFormat::Xyz,
        )
        | None => DVec3::Z,
    }
}
