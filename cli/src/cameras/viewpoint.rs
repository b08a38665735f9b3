//! Cameras as they are typed: `FILE`, `FILE#ENTRY`, `fov:DEGREES`, `shift:X,Y,Z`.
//!
//! Takes a word and the facts known by then, gives cameras. Files of this program's own kind are read by
//! `camera_file`, all others by `warp3d::input::cameras`. A camera of one pixel gives the point that it sees.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use glam::{DAffine3, DVec2, DVec3};
use resample_core::{Camera, Image, LookAt};
use resample_io::files;
use warp3d::input::cameras;
use warp3d::input::cameras::{CameraSet, Distortion, Hints, Lens, Pair};
use warp3d::panorama;

use crate::values;
use crate::values::Size;
use resample_io::camera_file;
use resample_io::camera_file::{CameraDefaults, CameraFile, FileCamera};

/// A camera as it was typed.
#[derive(Clone, Debug, PartialEq)]
pub enum Viewpoint {
    /// A file, and perhaps the name or number of a camera in it.
    File {
        /// The file.
        path: PathBuf,
        /// The camera of the file, by name.
        entry: Option<String>,
    },
    /// A pinhole at the origin with this vertical field of view, degrees.
    Fov(f64),
    /// All directions around the origin, longitude along x and latitude along y.
    Equirectangular,
    /// The picture's camera, moved right, down and forward, world units.
    Shift(DVec3),
}

impl std::fmt::Display for Viewpoint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File {
                path,
                entry: Some(entry),
            } => write!(f, "{}#{entry}", path.display()),
            Self::File { path, entry: None } => write!(f, "{}", path.display()),
            Self::Equirectangular => write!(f, "{EQUIRECTANGULAR}"),
            Self::Fov(degrees) => write!(f, "fov:{degrees}"),
            Self::Shift(shift) => write!(f, "shift:{},{},{}", shift.x, shift.y, shift.z),
        }
    }
}

/// The facts known when cameras are read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// Size of the camera's picture, where the file states none.
    pub picture: [u32; 2],
    /// Size that was asked for.
    pub size: Option<Size>,
    /// Lens that was typed.
    pub lens: Option<Lens>,
}

/// The cameras of a word.
#[derive(Clone, Debug)]
pub(crate) struct Views {
    /// At least one.
    pub cameras: Vec<FileCamera>,
    /// The geometry of a rectified pair, where the file states one.
    pub pair: Option<Pair>,
    /// The distortion of the only camera's lens.
    pub distortion: Option<Distortion>,
}

/// The camera that a picture was taken with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TakenWith {
    /// The camera, as a pinhole.
    pub camera: FileCamera,
    /// The geometry of a rectified pair, where the file states one.
    pub pair: Option<Pair>,
    /// How its lens departs from a pinhole.
    pub distortion: Option<Distortion>,
}

impl From<FileCamera> for TakenWith {
    fn from(camera: FileCamera) -> Self {
        Self {
            camera,
            pair: None,
            distortion: None,
        }
    }
}

/// Vertical field of view of a look-at camera whose file states none, degrees: the default of `--fov`.
pub(crate) const DEFAULT_FOV_Y_DEG: f64 = 30.0;

/// The word for a panorama's camera.
const EQUIRECTANGULAR: &str = "equirectangular";

/// Splits the word of a camera.
pub fn parse(text: &str) -> Result<Viewpoint, String> {
    if text == EQUIRECTANGULAR {
        return Ok(Viewpoint::Equirectangular);
    }
    if let Some(angle) = text.strip_prefix("fov:") {
        return values::field_of_view(angle).map(Viewpoint::Fov);
    }
    if let Some(shift) = text.strip_prefix("shift:") {
        return values::vector(shift).map(|shift| Viewpoint::Shift(DVec3::from_array(shift)));
    }
    let (path, entry) = match text.rsplit_once('#') {
        Some((path, entry))
            if !path.is_empty() && !entry.is_empty() && !Path::new(text).exists() =>
        {
            (path, Some(entry.to_owned()))
        }
        _ => (text, None),
    };
    if path.is_empty() {
        Err("expected a camera".into())
    } else {
        Ok(Viewpoint::File {
            path: path.into(),
            entry,
        })
    }
}

impl Viewpoint {
    /// The file that is read, if one is.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::File { path, .. } => Some(path),
            Self::Fov(_) | Self::Shift(_) | Self::Equirectangular => None,
        }
    }
}

/// The one camera that a picture was taken with.
pub(crate) fn only_one(viewpoint: &Viewpoint, known: &Known) -> Result<TakenWith> {
    let Viewpoint::File { path, entry } = viewpoint else {
        return Ok(typed(viewpoint, None, known)?.into());
    };
    let views = views_of_file(path, entry.as_deref(), known)?;
    match views.cameras.as_slice() {
        [camera] => Ok(TakenWith {
            camera: *camera,
            pair: views.pair,
            distortion: views.distortion,
        }),
        several => bail!(
            "{}: holds {} cameras, but a picture has one: name it behind a #, as in {}#0",
            path.display(),
            several.len(),
            path.display()
        ),
    }
}

/// The names of the cameras of a file.
pub(crate) enum Names {
    /// A format with names.
    Named(CameraSet),
    /// This program's own, numbered from 0.
    Numbered(usize),
}

impl Names {
    /// Reads them.
    pub(crate) fn of_file(path: &Path, known: &Known) -> Result<Self> {
        let hints = Hints {
            size: Some(known.picture),
            lens: known.lens,
        };
        Ok(match cameras::read(path, &hints)? {
            Some(set) => Self::Named(set),
            None => Self::Numbered(own_file(path, None, known)?.cameras.len()),
        })
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Named(set) => set.entries.len(),
            Self::Numbered(count) => *count,
        }
    }

    /// Returns true if the names are times.
    pub(crate) fn are_times(&self) -> bool {
        matches!(self, Self::Named(set) if set.names == cameras::Names::Times)
    }

    /// The camera of this name or time.
    pub(crate) fn find(&self, name: &str) -> Option<String> {
        match self {
            Self::Named(set) => Some(set.entry(name).ok()?.name.clone()),
            Self::Numbered(_) => None,
        }
    }

    /// The camera at this place.
    pub(crate) fn at(&self, index: usize) -> Option<String> {
        match self {
            Self::Named(set) => Some(set.entries.get(index)?.name.clone()),
            Self::Numbered(count) => (index < *count).then(|| index.to_string()),
        }
    }
}

/// The cameras to draw from; `from` is the picture's own.
pub(crate) fn several(
    viewpoint: &Viewpoint,
    from: &Camera,
    known: &Known,
) -> Result<Vec<FileCamera>> {
    match viewpoint {
        Viewpoint::File { path, entry } => {
            Ok(views_of_file(path, entry.as_deref(), known)?.cameras)
        }
        _ => Ok(vec![typed(viewpoint, Some(from), known)?]),
    }
}

/// `camera` with its picture at the size that was asked for.
pub(crate) fn sized(camera: Camera, size: Option<Size>) -> Result<Camera> {
    match size {
        Some(size) => Ok(camera.resized(size.width, size.height)?),
        None => Ok(camera),
    }
}

/// A lens at the world's origin that looks along its own z.
pub(crate) fn at_origin(lens: &Lens, size: [u32; 2]) -> Result<FileCamera> {
    let k = resample_core::Intrinsics {
        width: size[0],
        height: size[1],
        fx: lens.fx,
        fy: lens.fy,
        cx: lens.cx,
        cy: lens.cy,
        pixel_centre: lens.pixel_centre,
    };
    let camera = Camera::from_intrinsics(
        &k,
        glam::DMat3::IDENTITY,
        DVec3::ZERO,
        cameras::NEAR_PLACEHOLDER,
    );
    Ok(FileCamera::without_near(camera.context("--intrinsics")?))
}

fn typed(viewpoint: &Viewpoint, from: Option<&Camera>, known: &Known) -> Result<FileCamera> {
    let camera = match (viewpoint, from) {
        (Viewpoint::Shift(_), None) => {
            bail!(
                "--from shift:...: a shift counts from the camera of --from, and is for --to alone"
            )
        }
        (&Viewpoint::Shift(shift), Some(&from)) => {
            let moved = DAffine3::from_translation(-shift) * from.camera_from_world;
            sized(
                Camera {
                    camera_from_world: moved,
                    ..from
                },
                known.size,
            )?
        }
        (&Viewpoint::Fov(fov_y_deg), from) => {
            let size = known
                .size
                .map_or(known.picture, |size| [size.width, size.height]);
            // World axes as the camera's: x right, y down, z forward.
            let pose = LookAt {
                position: DVec3::ZERO,
                target: DVec3::Z,
                up: DVec3::NEG_Y,
            };
            let camera = Camera::perspective(&pose, fov_y_deg.to_radians(), size)?;
            let pose = from.map_or(camera.camera_from_world, |from| from.camera_from_world);
            Camera {
                camera_from_world: pose,
                ..camera
            }
        }
        (Viewpoint::Equirectangular, None) => front_of_panorama(known.picture),
        (Viewpoint::Equirectangular, Some(_)) => bail!(
            "--to equirectangular: a panorama is drawn with --layout equirectangular, from the camera of --to"
        ),
        (Viewpoint::File { .. }, _) => bail!("a file is no typed camera"),
    };
    Ok(FileCamera::without_near(camera))
}

/// The camera that looks at the middle of a panorama: a right angle, at the panorama's scale.
fn front_of_panorama(size: [u32; 2]) -> Camera {
    let focal_px = 0.5 * (2.0 * panorama::focal_px(size)).round();
    panorama::faces(DAffine3::IDENTITY, cameras::NEAR_PLACEHOLDER, focal_px, 0.0)[0]
}

fn views_of_file(path: &Path, entry: Option<&str>, known: &Known) -> Result<Views> {
    if files::typed_json(path).is_some() {
        return own_file(path, entry, known);
    }
    let hints = Hints {
        size: Some(known.picture),
        lens: known.lens,
    };
    let Some(set) = cameras::read(path, &hints)? else {
        return own_file(path, entry, known);
    };
    let chosen = match entry {
        Some(name) => {
            let entry = set
                .entry(name)
                .map_err(|what| anyhow!("{}: {what}", path.display()))?;
            std::slice::from_ref(entry)
        }
        None => &set.entries,
    };
    let sized = |entry: &cameras::Entry| -> Result<FileCamera> {
        let camera = sized(entry.camera, known.size)
            .with_context(|| format!("{}: '{}'", path.display(), entry.name));
        Ok(FileCamera::without_near(camera?))
    };
    Ok(Views {
        cameras: chosen.iter().map(sized).collect::<Result<_>>()?,
        pair: set.pair,
        distortion: chosen[0].distortion,
    })
}

/// A file of this program's own kind.
fn own_file(path: &Path, entry: Option<&str>, known: &Known) -> Result<Views> {
    let [width, height] = known.picture;
    let defaults = CameraDefaults {
        size: known.size,
        look_at_size: Size { width, height },
        fov_y_deg: DEFAULT_FOV_Y_DEG,
    };
    let cameras = match camera_file::read(path, &defaults)? {
        CameraFile::One(camera) => vec![camera],
        CameraFile::List(list) => list,
    };
    let cameras = match entry {
        None => cameras,
        Some(entry) => {
            let count = cameras.len();
            let index = entry.parse::<usize>().ok().filter(|&index| index < count);
            let index = index.with_context(|| {
                format!(
                    "{}: no camera '{entry}': expected a number from 0 to {}",
                    path.display(),
                    count - 1
                )
            })?;
            vec![cameras[index]]
        }
    };
    Ok(Views {
        cameras,
        pair: None,
        distortion: None,
    })
}

/// The place on the ray of the pixel's centre at this camera z, world units.
pub(crate) fn world_at(pixel: &Camera, depth: f64) -> DVec3 {
    let (origin, direction) = pixel.ray_in_camera(DVec2::new(0.5, 0.5));
    let pos_in_camera = origin + direction * (depth - origin.z) / direction.z;
    pixel
        .camera_from_world
        .inverse()
        .transform_point3(pos_in_camera)
}

/// The place that a picture of one pixel shows; `None` where it shows nothing, or has no depth.
pub(crate) fn in_world(pixel: &Camera, picture: &Image) -> Option<DVec3> {
    let depth = *picture.depth.as_ref()?.first()?;
    depth.is_finite().then(|| world_at(pixel, f64::from(depth)))
}
