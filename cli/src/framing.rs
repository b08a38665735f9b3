//! Automatic framing: a camera that shows a box, from a direction given by two angles.
//!
//! Takes a box in the world, an up axis and an orbit, gives a camera. The view is fitted to the sphere around the
//! box, not to the box itself, so that pictures from different angles have the same scale and an orbit does not
//! jump. The picture's up direction is the derivative of the eye's position along the elevation, which is defined
//! everywhere, the poles included.

use anyhow::Result;
use glam::{DVec3, Vec3Swizzles};
use resample_core::{Camera, LookAt};
use volsplat::Volume;

use crate::values::{Orbit, Size};

/// What a view is made of, beside the box that it shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Picture size.
    pub size: Size,
    /// Angles and distance.
    pub orbit: Orbit,
    /// Which way up, and which side is the front.
    pub stance: Stance,
    /// Kind of view and its opening.
    pub lens: Lens,
}

/// How a volume stands in the world for its viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stance {
    /// The direction that is up in the picture, a unit vector.
    pub up: DVec3,
    /// The direction that is to the right in the picture at azimuth 0, a unit vector at a right angle to `up`.
    pub right: DVec3,
}

/// How the view is projected.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lens {
    /// Perspective with this vertical field of view, degrees.
    Perspective {
        /// Vertical field of view, degrees.
        fov_y_deg: f64,
    },
    /// Parallel rays; the orbit's distance multiplies the height of the view.
    Orthographic,
}

/// The angles when nothing is asked for: three faces of the box are seen, the front one most. A matter of taste.
pub(crate) const DEFAULT_ORBIT: Orbit = Orbit { azimuth_deg: 30.0, elevation_deg: 20.0, distance: 1.0 };

/// Smallest radius of the sphere, as a fraction of the box's distance from the world's origin: a box with less
/// extent is one point as far as rounding can tell, and is shown as if it had this one.
const MIN_RADIUS_FRACTION: f64 = 1e-9;

/// Smallest radius of the sphere at the origin, world units: its square is still far from underflow.
const MIN_RADIUS: f64 = 1e-100;

/// The stance of a volume: `up` if asked for, else what the file says, else y.
///
/// Azimuth 0 has the world's x axis to the right (y, if x is up). A medical volume whose y axis points to the
/// patient's front is seen from there instead, so that azimuth 0 always shows the face.
pub(crate) fn stance(volume: &Volume, up: Option<DVec3>) -> Stance {
    let up = up.or(volume.up_hint).unwrap_or(DVec3::Y).normalize_or(DVec3::Y);
    let space = volume.space.as_deref().unwrap_or("").to_lowercase();
    let y_is_front = space.split('-').nth(1) == Some("anterior");
    // An up axis within 45 degrees of x leaves x no room to point to the right.
    let side = match (up.x.abs() > up.yz().length(), y_is_front) {
        (true, _) => DVec3::Y,
        (false, true) => DVec3::NEG_X,
        (false, false) => DVec3::X,
    };
    Stance { up, right: side.reject_from_normalized(up).normalize_or(DVec3::X) }
}

/// Two corners of the box, along the world's axes, around all voxels of a volume.
pub(crate) fn grid_bounds(volume: &Volume) -> [DVec3; 2] {
    let last = DVec3::from_array(volume.dims.map(|n| (n - 1) as f64));
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
    let in_world = |i: u32| volume.world_from_index.transform_point3(corner(i) * last);
    (1..8).map(in_world).fold([in_world(0); 2], |[low, high], pos| [low.min(pos), high.max(pos)])
}

/// The box of voxel centres, widened to hold what is drawn around them.
///
/// A kernel reaches about two spacings from its voxel and has all but faded after one, so one is added.
pub(crate) fn with_kernels(bounds: [DVec3; 2], volume: &Volume) -> [DVec3; 2] {
    let reach = volume.spacing().into_iter().fold(0.0, f64::max);
    [bounds[0] - reach, bounds[1] + reach]
}

/// A camera that shows the box with corners `bounds`.
pub(crate) fn frame(bounds: [DVec3; 2], view: &View) -> Result<Camera> {
    let target = 0.5 * (bounds[0] + bounds[1]);
    let floor = (MIN_RADIUS_FRACTION * target.length()).max(MIN_RADIUS);
    let radius = (0.5 * (bounds[1] - bounds[0]).length()).max(floor);
    let (eye_direction, up) = orbit_directions(&view.orbit, &view.stance);
    let pose = |distance: f64| LookAt { position: target + distance * eye_direction, target, up };
    let size = [view.size.width, view.size.height];
    let aspect = f64::from(view.size.width) / f64::from(view.size.height);
    Ok(match view.lens {
        Lens::Perspective { fov_y_deg } => {
            let fov_y_rad = fov_y_deg.to_radians();
            let distance = view.orbit.distance * fitting_distance(radius, fov_y_rad, aspect);
            Camera::perspective(&pose(distance), fov_y_rad, size)?
        }
        Lens::Orthographic => {
            // The eye stays outside the sphere, so that the near plane cuts nothing however small the view.
            let height_in_world = view.orbit.distance * 2.0 * radius / aspect.min(1.0);
            Camera::orthographic(&pose(2.0 * radius), height_in_world, size)?
        }
    })
}

/// Cameras that go once around the box in `steps` equal steps, from the azimuth of `view` on.
///
/// The last stands one step before the first, so that a film that starts again does not stop for a picture.
pub(crate) fn turntable(bounds: [DVec3; 2], view: &View, steps: u32) -> Result<Vec<Camera>> {
    let at = |step: u32| {
        let turned_deg = 360.0 * f64::from(step) / f64::from(steps);
        let orbit = Orbit { azimuth_deg: view.orbit.azimuth_deg + turned_deg, ..view.orbit };
        frame(bounds, &View { orbit, ..*view })
    };
    (0..steps).map(at).collect()
}

/// The distance at which a sphere touches the nearer pair of picture edges.
fn fitting_distance(radius: f64, fov_y_rad: f64, aspect: f64) -> f64 {
    let half_tangent = (0.5 * fov_y_rad).tan() * aspect.min(1.0);
    radius / half_tangent.atan().sin()
}

/// The unit directions from the target to the eye, and up in the picture.
fn orbit_directions(orbit: &Orbit, &Stance { up, right }: &Stance) -> (DVec3, DVec3) {
    let front = right.cross(up);
    let (sin_azimuth, cos_azimuth) = orbit.azimuth_deg.to_radians().sin_cos();
    let (sin_elevation, cos_elevation) = orbit.elevation_deg.to_radians().sin_cos();
    let level = cos_azimuth * front + sin_azimuth * right;
    (cos_elevation * level + sin_elevation * up, cos_elevation * up - sin_elevation * level)
}

#[cfg(test)]
mod tests;
