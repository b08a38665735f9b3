//! A panorama with depth as six pinhole references around its eye, or, for two eyes, as one reference that is unrolled.
//!
//! The faces overlap, so that no seam opens between them. Depth is the distance from the eye: camera z has no meaning in
//! a panorama, and numbers that say "z" are read as distances.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::DAffine3;
use resample_core::narrow::single;
use resample_core::{Camera, Projection};
use resample_io::files::fault;

use super::regrid::{Lens, Model};
use super::{DepthKind, DepthMeaning, Picture, Plane, check_proportions, codes, regrid};
use crate::input::meaning::{along_the_axis, assembled, nothing_known};
use crate::view::panorama;
use crate::{Error, Reference};

/// Columns of a panorama that are repeated at both ends: more than the spline and an interpolation read.
const REPEATED: usize = 8;

/// An unrolled panorama repeats this part of its width at each end, 22.5 degrees. A sample turns by that much at 2.6 times half the baseline, 8 cm with human eyes; nothing is nearer.
const MARGIN: usize = 16;

/// Latitude up to which the eyes of a pair are as far apart as was asked for: ceilings and floors. A guess.
const FULL_TO: f64 = PI / 3.0;

/// The largest turn of a sample, radians: nearer than 1.2 times half the baseline nothing can be seen by both eyes.
const NEAREST: f64 = PI / 3.0;

/// Pixels by which a face reaches over its neighbours: the widest filter of a warp that neither minifies nor magnifies.
const OVERLAP_PX: f64 = 8.0;

/// The faces of a panorama whose eye stands at the origin and looks along z.
///
/// The world has the panorama's axes: x right, y down, z forward, which is the middle of the picture. Faces of which
/// nothing is known are left out. Errors if picture and depth differ in their proportions, if the numbers need a pinhole camera, or
/// if nothing is known at all; `depth_file` is named in them.
pub fn panorama(
    picture: &Picture,
    stored: &Plane,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Vec<Reference>, Error> {
    let size = [picture.width, picture.height];
    let distances = distances(picture, stored, meaning, depth_file)?;
    let cameras = faces([picture.width as u32, picture.height as u32]);
    let wide = wider(picture, REPEATED);
    let distances = Plane {
        values: repeated(&distances, picture.width, REPEATED),
        width: wide.width,
        height: wide.height,
        stored: stored.stored,
    };
    let references: Vec<Reference> = (cameras.iter().enumerate())
        .filter_map(|(index, camera)| {
            let lens = Lens {
                camera,
                model: Model::Panorama {
                    panorama_from_camera: panorama::turn_of(index).transpose(),
                    size: size.map(|side| side as u32),
                    repeated: REPEATED,
                },
                size: [wide.width, wide.height],
            };
            let mut z = regrid::distances(&distances, &wide, &lens);
            along_the_axis(&mut z, camera);
            assembled(regrid::seen(&wide, &lens), z, *camera)
        })
        .collect();
    if references.is_empty() {
        return Err(nothing_known(meaning, stored.stored, depth_file));
    }
    Ok(references)
}

/// A panorama for two eyes as one reference, unrolled: its camera's x counts longitude, and its depth is that at which eyes `baseline` apart, world units, see a sample
/// shifted as those of an omnidirectional pair do.
///
/// Such a pair (Ishiguro et al., "Omni-directional stereo", 1992) sees each direction from the place on a circle at which an eye would stand that looks there. A sample at
/// the distance rho from the axis is seen turned by asin(h / rho), h half the baseline, so rows stay rows, and two pinholes with parallel rows see the same shifts at the depth
/// h / asin(h / rho). The elevation changes by up to (h / rho)^2 / 2 of its tangent, which is left out. Beyond 60 degrees up and down h shrinks to 0 at the poles, where no two eyes
/// have a common row.
///
/// # Errors
/// As [`panorama()`].
pub fn unrolled(
    picture: &Picture,
    stored: &Plane,
    meaning: &DepthMeaning,
    depth_file: &Path,
    baseline: f64,
) -> Result<Reference, Error> {
    let (width, height) = (picture.width, picture.height);
    let distances = distances(picture, stored, meaning, depth_file)?;
    let half = 0.5 * baseline;
    let mut z = distances;
    for (y, row) in z.chunks_mut(width).enumerate() {
        let latitude = (0.5 - (y as f64 + 0.5) / height as f64) * PI;
        let cos = latitude.cos();
        let eye = half * (cos / FULL_TO.cos()).min(1.0);
        for z in row {
            let turn = (eye / (f64::from(*z) * cos)).min(NEAREST.sin()).asin();
            *z = single(half / turn);
        }
    }
    let repeated_px = width / MARGIN;
    let wide = wider(picture, repeated_px);
    let camera = unrolled_camera([width as u32, height as u32]);
    let camera = Camera {
        width: wide.width as u32,
        cx: camera.cx + repeated_px as f64,
        ..camera
    };
    let z = repeated(&z, width, repeated_px);
    assembled(wide, z, camera).ok_or_else(|| nothing_known(meaning, stored.stored, depth_file))
}

/// The camera of an unrolled panorama of this size at the origin: a pixel is as wide as the angle that it holds.
pub fn unrolled_camera([width, height]: [u32; 2]) -> Camera {
    let (width_px, height_px) = (f64::from(width), f64::from(height));
    Camera {
        projection: Projection::Perspective,
        width,
        height,
        fx: width_px / TAU,
        fy: height_px / PI,
        cx: 0.5 * width_px,
        cy: 0.5 * height_px,
        camera_from_world: DAffine3::IDENTITY,
        // The near plane follows from the samples.
        near: f64::MIN_POSITIVE,
    }
}

/// The distance of each pixel of the picture from the eye, made smooth where codes are coarse; a depth of another size is resampled.
fn distances(
    picture: &Picture,
    stored: &Plane,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Vec<f32>, Error> {
    let size = [picture.width, picture.height];
    check_proportions(size, [stored.width, stored.height], depth_file)?;
    if matches!(meaning.kind, DepthKind::Disparity | DepthKind::OpenGl) {
        let what = "a panorama has no disparity and no depth buffer: expected distances, their inverse or a code of it";
        return Err(fault(depth_file, what));
    }
    let camera = unrolled_camera([picture.width as u32, picture.height as u32]);
    let distance = meaning
        .distance(&meaning.numbers(stored), &camera)
        .map_err(|what| fault(depth_file, what))?;
    let smooth = codes::smoothed(stored, &*distance);
    let stored = smooth.as_ref().unwrap_or(stored);
    let values = stored.values.iter().map(|&v| single(distance(v))).collect();
    if [stored.width, stored.height] == size {
        return Ok(values);
    }
    let lens = Lens {
        camera: &camera,
        model: Model::Pinhole,
        size,
    };
    let distances = Plane { values, ..*stored };
    Ok(regrid::distances(&distances, picture, &lens))
}

/// The sizes of the references that a panorama of this size becomes, px.
pub fn face_sizes(size: [u32; 2]) -> [[u32; 2]; 6] {
    faces(size).map(|face| [face.width, face.height])
}

/// The cameras of a panorama's faces, the front first.
pub(super) fn faces(size: [u32; 2]) -> [Camera; 6] {
    let focal_px = panorama::focal_px(size);
    // The near plane follows from the samples.
    panorama::faces(DAffine3::IDENTITY, f64::MIN_POSITIVE, focal_px, OVERLAP_PX)
}

/// A picture with `columns` of the other end at each end of its rows.
fn wider(picture: &Picture, columns: usize) -> Picture {
    let of = |held: &Vec<f32>| repeated(held, picture.width, columns);
    Picture {
        width: picture.width + 2 * columns,
        height: picture.height,
        rgb: repeated(&picture.rgb, picture.width, columns),
        coverage: picture.coverage.as_ref().map(of),
    }
}

/// Rows with their last columns before the first and the first behind the last.
fn repeated<T: Copy>(values: &[T], width: usize, columns: usize) -> Vec<T> {
    let end = columns.min(width);
    let mut wide = Vec::with_capacity(values.len() / width * (width + 2 * end));
    for row in values.chunks(width) {
        wide.extend_from_slice(&row[width - end..]);
        wide.extend_from_slice(row);
        wide.extend_from_slice(&row[..end]);
    }
    wide
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::super::Stored;
    use super::*;

    /// Inside a box around the eye, 2 x 1.4 x 3 units: the distance to its wall.
    fn distance(towards: DVec3) -> f64 {
        let half = DVec3::new(1.0, 0.7, 1.5);
        (half / towards.abs()).min_element()
    }

    #[test]
    fn the_faces_of_a_room_lie_on_its_walls_across_the_seam_and_at_the_poles() {
        let size = [256usize, 128];
        let towards = |index: usize| {
            let pos = DVec2::new((index % size[0]) as f64, (index / size[0]) as f64) + 0.5;
            panorama::direction(pos, [256, 128])
        };
        let colour = |towards: DVec3| (towards * 0.4 + 0.5).as_vec3().to_array();
        let pixels = size[0] * size[1];
        let picture = Picture {
            width: size[0],
            height: size[1],
            rgb: (0..pixels).map(|index| colour(towards(index))).collect(),
            coverage: None,
        };
        let stored = Plane {
            width: size[0],
            height: size[1],
            values: (0..pixels)
                .map(|index| distance(towards(index)) as f32)
                .collect(),
            stored: Stored::Float,
        };
        let meaning = DepthMeaning::of(DepthKind::Z);
        let references = panorama(&picture, &stored, &meaning, Path::new("z.exr")).expect("a room");
        assert_eq!(references.len(), 6, "faces");
        let (mut off, mut total) = (0, 0);
        for reference in &references {
            let camera = &reference.camera;
            let width = camera.width as usize;
            for (index, &z) in reference.depth.iter().enumerate() {
                let pos = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
                let (_, ray) = camera.ray_in_camera(pos);
                let towards = camera.camera_from_world.matrix3.transpose() * ray;
                let error = f64::from(z) * ray.length() / distance(towards.normalize()) - 1.0;
                total += 1;
                // Beside the edges of the room, where a cell of the panorama bends.
                off += u32::from(!(error.abs() < 2e-3));
                let expected = colour(towards.normalize());
                for (found, expected) in reference.colour[index].iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < 2e-3,
                        "{towards}: colour {found}, not {expected}"
                    );
                }
            }
        }
        assert!(
            f64::from(off) < 0.05 * f64::from(total),
            "{off} of {total} samples are off the walls"
        );
    }
}
