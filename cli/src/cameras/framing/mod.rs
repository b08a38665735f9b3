//! Automatic framing: a camera that shows a box, from a direction given by two angles.
//!
//! Takes a box in the world, an up axis and an orbit, gives a camera. A sphere around the content of
//! the box gives the view, and is then moved and resized to hold the visible part (`fit.rs`). The pictures of a turntable share one
//! sphere, so that they have the same scale. The picture's up direction is the derivative of the eye's position along the elevation, which is defined
//! everywhere, the poles included.

use anyhow::Result;
use glam::{DVec3, Vec3Swizzles};
use resample_core::{Camera, LookAt};

use crate::values::{Orbit, Size};

pub mod fit;
pub mod volume;

/// The points that must be in the picture.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Two corners of a box along the world's axes that holds all of it.
    pub bounds: [DVec3; 2],
    /// How far any of it is from the middle of the box, world units.
    pub radius: f64,
}

/// A view, beside the extent that it shows.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Picture size.
    pub size: Size,
    /// Angles and distance.
    pub orbit: Orbit,
    /// The up direction and the front side.
    pub stance: Stance,
    /// Kind of view and its opening.
    pub lens: Lens,
}

/// How the scene stands in the world for its viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// The direction that is up in the picture, a unit vector.
    pub up: DVec3,
    /// The direction that is to the right in the picture at azimuth 0, a unit vector at a right angle to `up`.
    pub right: DVec3,
}

/// How the view is projected.
#[derive(Clone, Copy, Debug)]
pub enum Lens {
    /// Perspective with this vertical field of view, degrees.
    Perspective {
        /// Vertical field of view, degrees.
        fov_y_deg: f64,
    },
    /// Parallel rays; the orbit's distance multiplies the height of the view.
    Orthographic,
}

/// The default angles: three faces of the box are seen, the front one most. A matter of taste.
pub const DEFAULT_ORBIT: Orbit = Orbit {
    azimuth_deg: 30.0,
    elevation_deg: 20.0,
    distance: 1.0,
};

/// Smallest radius of the sphere, as a fraction of the box's distance from the world's origin: rounding leaves four digits of
/// a box with less extent, and it is shown as if it had this one.
const MIN_RADIUS_FRACTION: f64 = 1e-11;

/// Smallest radius of the sphere at the origin, world units: its square is still far from underflow.
const MIN_RADIUS: f64 = 1e-100;

impl Extent {
    /// All of a box, its corners too.
    pub fn of_box(bounds: [DVec3; 2]) -> Self {
        Self {
            bounds,
            radius: 0.5 * (bounds[1] - bounds[0]).length(),
        }
    }

    /// Points that lie in a box: a ball in its box is drawn larger than the box.
    pub fn of_points(bounds: [DVec3; 2], points: impl Iterator<Item = DVec3>) -> Self {
        let middle = 0.5 * (bounds[0] + bounds[1]);
        let farthest = points
            .map(|point| point.distance_squared(middle))
            .fold(0.0, f64::max)
            .sqrt();
        Self {
            bounds,
            radius: farthest.min(Self::of_box(bounds).radius),
        }
    }
}

impl Extent {
    /// The point that the camera looks at.
    fn middle(&self) -> DVec3 {
        0.5 * (self.bounds[0] + self.bounds[1])
    }
}

impl Stance {
    /// `up` in the picture, and x to the right, or y where `up` leaves x no room.
    pub fn upright(up: DVec3) -> Self {
        Self::facing(up, DVec3::X)
    }

    /// `up` in the picture, and `side` to the right as far as `up` lets it.
    fn facing(up: DVec3, side: DVec3) -> Self {
        let up = up.normalize_or(DVec3::Y);
        // An up axis within 45 degrees of x leaves x no room to point to the right.
        let side = if up.x.abs() > up.yz().length() {
            DVec3::Y
        } else {
            side
        };
        Self {
            up,
            right: side.reject_from_normalized(up).normalize_or(DVec3::X),
        }
    }
}

/// A camera that shows all of `extent`.
pub fn frame(extent: &Extent, view: &View) -> Result<Camera> {
    let target = extent.middle();
    let floor = (MIN_RADIUS_FRACTION * target.length()).max(MIN_RADIUS);
    let radius = extent.radius.max(floor);
    let (eye_direction, up) = orbit_directions(&view.orbit, &view.stance);
    let pose = |distance: f64| LookAt {
        position: target + distance * eye_direction,
        target,
        up,
    };
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

/// Views that go once around the scene in `steps` equal steps, from the azimuth of `view` on.
///
/// The last stands one step before the first, so that a film that starts again does not stop for a picture.
pub fn turned(view: &View, steps: u32) -> impl Iterator<Item = View> {
    let view = *view;
    (0..steps).map(move |step| {
        let turned_deg = 360.0 * f64::from(step) / f64::from(steps);
        let orbit = Orbit {
            azimuth_deg: view.orbit.azimuth_deg + turned_deg,
            ..view.orbit
        };
        View { orbit, ..view }
    })
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
    (
        cos_elevation * level + sin_elevation * up,
        cos_elevation * up - sin_elevation * level,
    )
}

#[cfg(test)]
mod tests;
