//! A panorama with depth as six pinhole references around its eye.
//!
//! The faces overlap, so that no seam opens between them. Depth is the distance from the eye: camera z has no meaning in
//! a panorama, and numbers that say "z" are read as distances.

use std::path::Path;

use glam::DAffine3;
use resample_core::Camera;
use resample_io::files::fault;

use super::regrid::{Lens, Model};
use super::{DepthKind, DepthMeaning, Picture, Plane, codes, regrid};
use crate::input::meaning::{along_the_axis, assembled, nothing_known};
use crate::view::panorama;
use crate::{Error, Reference};

/// Columns of a panorama that are repeated at both ends: more than the spline and an interpolation read.
const REPEATED: usize = 8;

/// Pixels by which a face reaches over its neighbours: the widest filter of a warp that neither minifies nor magnifies.
const OVERLAP_PX: f64 = 8.0;

/// The faces of a panorama whose eye stands at the origin and looks along z.
///
/// The world has the panorama's axes: x right, y down, z forward, which is the middle of the picture. Faces of which
/// nothing is known are left out. Errors if picture and depth differ in size, if the numbers need a pinhole camera, or
/// if nothing is known at all; `depth_file` is named in them.
pub fn panorama(
    picture: &Picture,
    stored: &Plane,
    meaning: &DepthMeaning,
    depth_file: &Path,
) -> Result<Vec<Reference>, Error> {
    let size = [picture.width, picture.height];
    if [stored.width, stored.height] != size {
        return Err(fault(
            depth_file,
            format!(
                "the depth has {}x{} pixels, the panorama {}x{}: both must have one size",
                stored.width, stored.height, size[0], size[1]
            ),
        ));
    }
    if matches!(meaning.kind, DepthKind::Disparity | DepthKind::OpenGl) {
        let what = "a panorama has no disparity and no depth buffer: expected distances, their inverse or a code of it";
        return Err(fault(depth_file, what));
    }
    let cameras = faces([picture.width as u32, picture.height as u32]);
    let distance = meaning
        .distance(&meaning.numbers(stored), &cameras[0])
        .map_err(|what| fault(depth_file, what))?;
    let smooth = codes::smoothed(stored, &*distance);
    let stored = smooth.as_ref().unwrap_or(stored);
    let distances: Vec<f32> = stored.values.iter().map(|&v| distance(v) as f32).collect();
    let distances = Plane {
        values: repeated(&distances, picture.width),
        width: picture.width + 2 * REPEATED,
        ..*stored
    };
    let wide = Picture {
        width: picture.width + 2 * REPEATED,
        height: picture.height,
        rgb: repeated(&picture.rgb, picture.width),
        coverage: (picture.coverage.as_ref()).map(|held| repeated(held, picture.width)),
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

/// Rows with their last columns before the first and the first behind the last.
fn repeated<T: Copy>(values: &[T], width: usize) -> Vec<T> {
    let end = REPEATED.min(width);
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
