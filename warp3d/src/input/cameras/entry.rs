//! The cameras of a file, and the lens and size that files of poses alone lack.

use glam::{DAffine3, DMat3};
use resample_core::camera::PixelCentre;
use resample_core::{Camera, CameraError, Intrinsics};

use super::distortion::Distortion;

/// The user's hints beside the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Size of the camera's picture, px, for formats that do not state it.
    pub size: Option<[u32; 2]>,
    /// Lens, for formats that hold poses alone.
    pub lens: Option<Lens>,
}

/// Focal lengths and principal point, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal length along x.
    pub fx: f64,
    /// Focal length along y.
    pub fy: f64,
    /// Principal point along x, in the convention of `pixel_centre`.
    pub cx: f64,
    /// Principal point along y.
    pub cy: f64,
    /// The origin of `cx` and `cy`.
    pub pixel_centre: PixelCentre,
}

/// The cameras of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraSet {
    /// The format, for messages.
    pub format: &'static str,
    /// At least one camera, in the file's order.
    pub entries: Vec<Entry>,
    /// The geometry of a rectified pair, where the file states one.
    pub pair: Option<Pair>,
    /// The meaning of names: texts, or times in seconds, of which the nearest is meant.
    pub names: Names,
}

/// The meaning of camera names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Names {
    /// Words.
    Words,
    /// Times in seconds.
    Times,
}

/// One camera of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its name in the file: a number, a picture's name, a path of keys.
    pub name: String,
    /// The camera, as a pinhole.
    pub camera: Camera,
    /// How its lens departs from the pinhole.
    pub distortion: Option<Distortion>,
}

/// Lens, picture size and distortion, as files of several cameras share them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LensModel {
    pub(super) lens: Lens,
    /// Width and height, px.
    pub(super) size: [u32; 2],
    pub(super) distortion: Option<Distortion>,
}

impl LensModel {
    /// The camera with this lens at a world-to-camera pose.
    pub(super) fn entry(&self, name: String, camera_from_world: DAffine3) -> Result<Entry, String> {
        let camera = camera(&self.lens, self.size, camera_from_world);
        Ok(Entry {
            name,
            camera: camera.map_err(|error| error.to_string())?,
            distortion: self.distortion,
        })
    }
}

/// The geometry of a rectified pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Distance between the eyes, world units.
    pub baseline: f64,
    /// Principal point of the right eye less that of the left along x, px.
    pub doffs: f64,
}

/// Near plane of a camera whose file states none, until it is known what the camera sees.
pub const NEAR_PLACEHOLDER: f64 = 1.0;

/// Largest distance between a time that is asked for and the time of a pose, s: pictures and poses are taken by
/// different clocks, and the tools of the TUM benchmark match them within as much.
const TIME_TOLERANCE_S: f64 = 0.02;

/// Largest departure of a stated rotation from orthonormal that is rounding in the file, and is then corrected.
const ROTATION_ROUNDING: f64 = 1e-3;

impl CameraSet {
    /// The camera that is called `name`, or the one at this index.
    ///
    /// The error, without the file's name, lists what there is.
    pub fn entry(&self, name: &str) -> Result<&Entry, String> {
        let by_name = self.entries.iter().find(|entry| entry.name == name);
        // Pictures are often known by their file name alone.
        let by_file = || {
            let last = |full: &str| full.rsplit(['/', '\\']).next().map(str::to_owned);
            let mut same = self
                .entries
                .iter()
                .filter(|entry| last(&entry.name).as_deref() == Some(name));
            same.next().filter(|_| same.next().is_none())
        };
        let by_index = || {
            name.parse::<usize>()
                .ok()
                .and_then(|index| self.entries.get(index))
        };
        let by_time = || match self.names {
            Names::Words => None,
            Names::Times => self.nearest_in_time(name.parse().ok()?),
        };
        let found = by_name.or_else(by_file).or_else(by_time).or_else(by_index);
        found.ok_or_else(|| {
            format!(
                "no camera '{name}' in this {}: there are {}",
                self.format,
                self.names()
            )
        })
    }

    /// The camera whose time is nearest, if it is near enough.
    fn nearest_in_time(&self, time_s: f64) -> Option<&Entry> {
        let apart_s = |entry: &Entry| {
            let time: Option<f64> = entry.name.parse().ok();
            time.map_or(f64::INFINITY, |time| (time - time_s).abs())
        };
        let nearest = self
            .entries
            .iter()
            .min_by(|a, b| apart_s(a).total_cmp(&apart_s(b)))?;
        (apart_s(nearest) <= TIME_TOLERANCE_S).then_some(nearest)
    }

    /// The names of the cameras, for a message: the first ones if there are many.
    pub fn names(&self) -> String {
        const MOST: usize = 6;
        let names: Vec<_> = self
            .entries
            .iter()
            .take(MOST)
            .map(|entry| entry.name.as_str())
            .collect();
        match self.entries.len() - names.len() {
            0 => names.join(", "),
            more => format!("{} and {more} more", names.join(", ")),
        }
    }
}

/// A camera from a lens, a picture size and a world-to-camera pose.
pub(super) fn camera(
    lens: &Lens,
    size: [u32; 2],
    camera_from_world: DAffine3,
) -> Result<Camera, CameraError> {
    let intrinsics = Intrinsics {
        width: size[0],
        height: size[1],
        fx: lens.fx,
        fy: lens.fy,
        cx: lens.cx,
        cy: lens.cy,
        pixel_centre: lens.pixel_centre,
    };
    let pose = camera_from_world;
    Camera::from_intrinsics(
        &intrinsics,
        upright(pose.matrix3),
        pose.translation,
        NEAR_PLACEHOLDER,
    )
}

/// A rotation freed of the rounding of its file (one step towards the nearest orthonormal matrix); anything that is
/// more than rounding stays, and the camera's own check refuses it.
pub(super) fn upright(rotation: DMat3) -> DMat3 {
    let defect = rotation.transpose() * rotation - DMat3::IDENTITY;
    let worst = defect
        .to_cols_array()
        .into_iter()
        .fold(0.0f64, |worst, x| worst.max(x.abs()));
    // Newton's step for the polar factor: its error is of the order of the defect's square.
    if worst < ROTATION_ROUNDING {
        rotation * (DMat3::IDENTITY - defect * 0.5)
    } else {
        rotation
    }
}

/// A lens for a file of poses alone.
pub(super) fn lens_from_hints(hints: &Hints, format: &str) -> Result<LensModel, String> {
    let lens = hints.lens.ok_or_else(|| {
        format!("a {format} holds poses alone: give the lens's intrinsics, FX,FY,CX,CY or a file of them")
    })?;
    let size = hints
        .size
        .ok_or_else(|| format!("a {format} holds no picture size: give the picture's size"))?;
    Ok(LensModel {
        lens,
        size,
        distortion: None,
    })
}
