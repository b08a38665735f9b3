//! Reads pictures, their depths and their cameras.
//!
//! Takes paths and what the user says about them, gives a checked [`Reference`]. The format of a file follows from its content, never
//! its name. Whatever the source, what leaves here is one convention: linear light, camera z, and the
//! core's camera (x right, y down, z forward, pixel centres at one half); the conversions stand at this edge alone.
//! Limits: one picture a file; of a fish eye, what a pinhole of its focal length sees.

pub mod cameras;
mod codes;
pub mod film;
pub mod meaning;
mod panoramas;
pub mod procedural;
mod range;
mod regrid;

use std::path::{Path, PathBuf};

use resample_core::Camera;
use resample_io::Room;
use resample_io::files::fault;
pub use resample_io::files::read_text;
pub use resample_io::{MAX_PIXELS, Part, Picture, Plane, Stored, colour, depth};

use crate::input::cameras::Distortion;
pub(crate) use crate::input::meaning::nothing_known;
pub use crate::input::meaning::{DepthKind, DepthMeaning};
use crate::input::meaning::{along_the_axis, assembled};
pub use crate::input::panoramas::{face_sizes, panorama, unrolled, unrolled_camera};
use crate::input::range::RangeOf;
pub use crate::input::range::SHARE as RANGE_SHARE;
use crate::input::regrid::{Lens, Model};
use crate::{Error, Reference};

/// The camera that a picture was taken with, and how its lens departs from a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// The camera, as a pinhole.
    pub camera: Camera,
    /// Distortion of its lens; picture and depth are resampled without it.
    pub distortion: Option<Distortion>,
}

impl From<Camera> for Taken {
    fn from(camera: Camera) -> Self {
        Self {
            camera,
            distortion: None,
        }
    }
}

/// Puts a picture, its depth and its camera together.
///
/// `stored` holds the numbers of the depth file and `meaning` what they say. Depth of another size than the picture's is
/// resampled to it, with its edges where the colour's are; disparities count in pixels of their own file. Depth is unknown where the picture's
/// coverage is below one half: the centre of such a pixel shows nothing. Errors if the proportions differ, if the
/// meaning does not fit the numbers, or if no pixel has a usable depth; `depth_file` is named in them.
pub fn reference(
    picture: Picture,
    stored: &Plane,
    taken: impl Into<Taken>,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Reference, Error> {
    let Taken { camera, distortion } = taken.into();
    let (size, depth_size) = (
        [picture.width, picture.height],
        [stored.width, stored.height],
    );
    check_camera(size, &camera)?;
    check_proportions(size, depth_size, depth_file)?;
    let (picture, depth) = if size == depth_size && distortion.is_none() {
        let depth = meaning.camera_z(stored, &camera);
        (picture, depth.map_err(|what| fault(depth_file, what))?)
    } else {
        let model = distortion.as_ref().map_or(Model::Pinhole, Model::Distorted);
        let lens = Lens {
            camera: &camera,
            model,
            size,
        };
        let depth = regridded(stored, meaning, &picture, &lens);
        let depth = depth.map_err(|what| fault(depth_file, what))?;
        let picture = match model {
            Model::Pinhole => picture,
            _ => regrid::seen(&picture, &lens),
        };
        (picture, depth)
    };
    assembled(picture, depth, camera)
        .ok_or_else(|| nothing_known(meaning, stored.stored, depth_file))
}

/// Camera z on the pixels of the lens's camera, from a depth of another size or through a lens with distortion.
fn regridded(
    stored: &Plane,
    meaning: &DepthMeaning,
    picture: &Picture,
    lens: &Lens,
) -> Result<Vec<f32>, String> {
    // The numbers' own camera: of the same view, with the pixels of the depth file.
    let own = lens
        .camera
        .resized(stored.width as u32, stored.height as u32)
        .map_err(|error| error.to_string())?;
    let distance = meaning.distance(&meaning.numbers(stored), &own)?;
    let smooth = codes::smoothed(stored, &*distance);
    let stored = smooth.as_ref().unwrap_or(stored);
    let distances = Plane {
        values: stored.values.iter().map(|&v| distance(v) as f32).collect(),
        ..*stored
    };
    let mut z = regrid::distances(&distances, picture, lens);
    if meaning.kind == DepthKind::Ray {
        along_the_axis(&mut z, lens.camera);
    }
    Ok(z)
}

/// Largest stretch of a depth against its picture: networks round sides to multiples of 14 or 32 pixels, which is 4 %
/// of 384; the proportions 5:4 and 4:3 differ by 6 %.
const LARGEST_STRETCH: f64 = 0.05;

/// Picture and depth must show the same view.
fn check_proportions(
    size: [usize; 2],
    depth_size: [usize; 2],
    depth_file: &Path,
) -> Result<(), Error> {
    let ([width, height], [depth_width, depth_height]) = (size, depth_size);
    let expected = height as f64 * depth_width as f64 / width as f64;
    let off_px = (expected - depth_height as f64).abs();
    // Small sides are rounded to whole pixels.
    if off_px <= 0.6 || off_px <= LARGEST_STRETCH * expected {
        return Ok(());
    }
    Err(fault(
        depth_file,
        format!(
            "the depth has {depth_width}x{depth_height} pixels, the picture {width}x{height}: they differ in proportions, \
             so that they cannot show the same view; register the depth to the picture first"
        ),
    ))
}

/// Picture and camera must have one size.
fn check_camera(size: [usize; 2], camera: &Camera) -> Result<(), Error> {
    if [camera.width as usize, camera.height as usize] == size {
        return Ok(());
    }
    let (width, height) = (camera.width, camera.height);
    Err(Error::Input(format!(
        "the camera is for a picture of {width}x{height} pixels, the picture has {}x{}: scale the camera's focal \
         lengths and centre to the picture, or the picture to the camera",
        size[0], size[1]
    )))
}

// One range for the depths of a whole sequence.
//
// Takes the depth files and what their numbers mean, gives the stored numbers at the far and at the near end, from frames
// that are evenly spread over all of them: whichever part of the sequence a process draws, it finds the same.

/// Frames of a sequence that are looked through, evenly spread: a thing that is missed shows in fewer than one frame of
/// these, so that its numbers are less than [`RANGE_SHARE`] of all, even if it fills those frames.
const FRAMES: usize = (1.0 / RANGE_SHARE) as usize;

/// The range of the numbers of a sequence's depth files, the same whichever of its pictures are drawn; `None` where the
/// meaning needs none. A file may take `room` to be decoded; `watch` takes the share that is done.
///
/// # Errors
/// A file that cannot be read, or none that holds a usable number.
pub fn range_of_sequence(
    files: &[Part],
    meaning: &DepthMeaning,
    room: Room,
    watch: &mut dyn FnMut(f64),
) -> Result<Option<[f64; 2]>, Error> {
    if !meaning.may_need_range() {
        return Ok(None);
    }
    let count = files.len().min(FRAMES);
    let is_known = |value| meaning.is_known(value);
    let mut range = RangeOf::new(&is_known);
    for number in 0..count {
        // From the first to the last.
        let place = number * files.len().saturating_sub(1) / count.saturating_sub(1).max(1);
        let stored = depth::decode(&files[place], room, &mut range)?;
        if !meaning.needs_range(stored) {
            return Ok(None);
        }
        watch((number + 1) as f64 / count as f64);
    }
    let named = || {
        files
            .first()
            .map_or_else(PathBuf::new, |file| file.path.clone())
    };
    let nothing = || {
        fault(
            &named(),
            "no depth file of the sequence holds a usable number",
        )
    };
    range.found().map(Some).ok_or_else(nothing)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::{DMat3, DVec2, DVec3};
    use resample_core::camera::PixelCentre;
    use resample_core::{Camera, Intrinsics};

    use super::*;

    fn refused<T: std::fmt::Debug>(result: Result<T, Error>, path: &Path, named: &str) {
        let said = result.expect_err("must be refused").to_string();
        assert!(
            said.starts_with(&path.display().to_string()),
            "the file is not named: {said}"
        );
        assert!(
            said.contains(named),
            "expected a word on '{named}', got: {said}"
        );
        assert!(!said.contains('\n'), "one line: {said}");
    }

    fn camera(width: u32, height: u32) -> Camera {
        let pixel_centre = PixelCentre::Half;
        let k = Intrinsics {
            width,
            height,
            fx: 4.0,
            fy: 4.0,
            cx: 1.5,
            cy: 1.0,
            pixel_centre,
        };
        Camera::from_intrinsics(&k, DMat3::IDENTITY, DVec3::ZERO, 0.1).expect("a good camera")
    }

    #[test]
    fn sizes_must_agree_and_something_must_be_known() {
        let picture = |coverage| Picture {
            width: 3,
            height: 2,
            rgb: vec![[0.5; 3]; 6],
            coverage,
        };
        let plane = |width: usize, values: Vec<f32>| Plane {
            width,
            height: 2,
            values,
            stored: Stored::Float,
        };
        let meaning = DepthMeaning::of(DepthKind::Z);
        let file = Path::new("z.pfm");
        let all = |picture: Picture, plane: Plane, camera: Camera| {
            reference(picture, &plane, camera, &meaning, file)
        };
        let good = all(
            picture(Some(vec![1.0, 0.4, 0.5, 1.0, 0.0, 1.0])),
            plane(3, vec![2.0; 6]),
            camera(3, 2),
        );
        let known: Vec<bool> = good
            .expect("a good view")
            .depth
            .iter()
            .map(|z| !z.is_nan())
            .collect();
        assert_eq!(
            known,
            [true, false, true, true, false, true],
            "depth is known where the pixel is half covered"
        );
        refused(
            all(picture(None), plane(2, vec![2.0; 4]), camera(3, 2)),
            file,
            "2x2",
        );
        refused(
            all(picture(None), plane(3, vec![-1.0; 6]), camera(3, 2)),
            file,
            "no pixel",
        );
        let said = all(picture(None), plane(3, vec![2.0; 6]), camera(6, 4))
            .expect_err("sizes differ")
            .to_string();
        assert!(
            said.contains("6x4") && said.contains("3x2"),
            "both sizes: {said}"
        );
    }

    /// The ray that a lens puts at `distorted`, by fixed-point iteration.
    fn undistort(distortion: &Distortion, distorted: DVec2) -> DVec2 {
        let mut at = distorted;
        for _ in 0..100 {
            at += distorted - distortion.distort(at).expect("within reach");
        }
        at
    }

    #[test]
    fn distances_along_the_ray_are_those_of_the_undistorted_ray() {
        let taken = Camera {
            fx: 120.0,
            fy: 120.0,
            cx: 80.0,
            cy: 60.0,
            ..camera(160, 120)
        };
        let distortion = Distortion::new([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]);
        // A tilted wall.
        let z = |ray: DVec2| 3.0 / (1.0 - 0.4 * ray.x + 0.2 * ray.y);
        let pinhole = |index: usize| {
            let pixel = DVec2::new((index % 160) as f64, (index / 160) as f64) + 0.5;
            (pixel - DVec2::new(80.0, 60.0)) / 120.0
        };
        let stored = |index: usize| {
            let ray = undistort(distortion.as_ref().expect("distorted"), pinhole(index));
            (z(ray) * ray.extend(1.0).length()) as f32
        };
        let plane = Plane {
            width: 160,
            height: 120,
            values: (0..160 * 120).map(stored).collect(),
            stored: Stored::Float,
        };
        let picture = Picture {
            width: 160,
            height: 120,
            rgb: vec![[0.5; 3]; 160 * 120],
            coverage: None,
        };
        let with = Taken {
            camera: taken,
            distortion,
        };
        let meaning = DepthMeaning::of(DepthKind::Ray);
        let found = reference(picture, &plane, with, &meaning, Path::new("ray.exr")).expect("good");
        let known = || found.depth.iter().enumerate().filter(|(_, z)| !z.is_nan());
        assert!(
            known().count() > 160 * 120 * 8 / 10,
            "most of the picture is known"
        );
        for (index, &depth) in known() {
            let expected = z(pinhole(index));
            assert!(
                (f64::from(depth) / expected - 1.0).abs() < 1e-4,
                "{depth}, not {expected}"
            );
        }
    }
}
