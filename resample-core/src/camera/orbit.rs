//! Orbits: cameras that show a scene from a direction given by two angles, fitted to its visible part. ([`framing`](crate::camera::framing) fits a box alone,
//! in closed form.)
//!
//! Takes a box in the world, an up axis and an orbit, gives a camera. A sphere around the content of
//! the box gives the view, and is then moved and resized to hold the visible part ([`fit`]). The pictures of a turntable share one
//! sphere, so that they have the same scale. The picture's up direction is the derivative of the eye's position along the elevation, which is defined
//! everywhere, the poles included.

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::camera::{Camera, CameraError, LookAt, Projection};

/// A picture size, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
}

/// The place of the eye around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Turn around the up axis, degrees; 0 is the front, positive moves the eye to the right.
    pub azimuth_deg: f64,
    /// Angle above the horizon, degrees, -90 to 90.
    pub elevation_deg: f64,
    /// Multiple of the distance that just fits the view, above 0.
    pub distance: f64,
}

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
    pub fn facing(up: DVec3, side: DVec3) -> Self {
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
pub fn frame(extent: &Extent, view: &View) -> Result<Camera, CameraError> {
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

/// The larger side of the visible part, as a share of the picture's side.
pub const FILL: f64 = 0.85;

/// Where something is seen, counted from the picture's middle in half pictures, to the right and up: -1 to 1 inside the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Left, bottom.
    pub low: DVec2,
    /// Right, top.
    pub high: DVec2,
    /// Off by less than this in its middle or its size, half pictures, a view is near enough.
    pub near_enough: f64,
}

impl Seen {
    /// Where any of the two is seen.
    pub fn both(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => Some(Self {
                low: a.low.min(b.low),
                high: a.high.max(b.high),
                near_enough: a.near_enough.max(b.near_enough),
            }),
            (one, None) | (None, one) => one,
        }
    }
}

/// The extent that a camera sees; `None` where that is nothing.
pub type Measure<'a, E> = dyn FnMut(&Camera) -> Result<Option<Seen>, E> + 'a;

/// The largest number of rounds for each view. A round errs where near and far parts lie at different distances; the next round starts
/// almost at the right place.
const ROUNDS: usize = 6;

/// Corners are projected exactly, which costs next to nothing: two pixels of a picture of 800.
const NEAR_ENOUGH: f64 = 0.005;

/// Off by so much after all rounds, half pictures, a view was led away, and is not merely unsteady. A guess.
const LOST: f64 = 0.05;

/// The offset of the visible parts from the picture's middle, over all views.
struct Excess {
    /// In the picture, half pictures.
    middle: DVec2,
    /// The larger side, as a share of the picture.
    fill: f64,
    /// Below which it counts as nothing.
    near_enough: f64,
}

/// Returns the extent that shows all visible parts in every view, or `extent` if nothing is visible.
///
/// In a very wide view rounds may lead away from it: then the best one that shows all counts.
pub fn fit<E: From<CameraError>>(
    extent: &Extent,
    views: &[View],
    measure: &mut Measure<E>,
) -> Result<Extent, E> {
    let mut fitted = *extent;
    let mut best = (f64::INFINITY, *extent);
    let mut last = 0.0;
    for _ in 0..ROUNDS {
        let Some(excess) = excess(&fitted, views, measure)? else {
            return Ok(best.1);
        };
        let off = excess.off();
        if off < best.0 && excess.is_inside() {
            best = (off, fitted);
        }
        last = off;
        fitted = moved(&fitted, &views[0], views.len(), &excess)?;
        if off < excess.near_enough {
            break;
        }
    }
    Ok(if last > LOST { best.1 } else { fitted })
}

impl Excess {
    /// How far it is from a picture that is filled around its middle.
    fn off(&self) -> f64 {
        let size = (self.fill / FILL - 1.0).abs();
        size.max(self.middle.abs().max_element())
    }

    /// Returns true if all of it is in the picture.
    fn is_inside(&self) -> bool {
        self.fill + self.middle.abs().max_element() <= 1.0
    }
}

fn excess<E: From<CameraError>>(
    extent: &Extent,
    views: &[View],
    measure: &mut Measure<E>,
) -> Result<Option<Excess>, E> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let mut near_enough = 0.0f64;
    for view in views {
        if let Some(seen) = measure(&frame(extent, view)?)? {
            (low, high) = (low.min(seen.low), high.max(seen.high));
            near_enough = near_enough.max(seen.near_enough);
        }
    }
    if !(low.is_finite() && high.is_finite() && low.cmple(high).all()) {
        return Ok(None);
    }
    let mut middle = 0.5 * (low + high);
    let mut half = 0.5 * (high - low);
    if views.len() > 1 {
        // It turns around the upright axis through the middle.
        half.x = low.x.abs().max(high.x.abs());
        middle.x = 0.0;
    }
    Ok(Some(Excess {
        middle,
        fill: half.max_element(),
        near_enough,
    }))
}

/// The extent with its middle where the excess has it, and its size changed.
fn moved(
    extent: &Extent,
    view: &View,
    views: usize,
    excess: &Excess,
) -> Result<Extent, CameraError> {
    let camera = frame(extent, view)?;
    let target = extent.middle();
    let scale = match camera.projection {
        Projection::Perspective => camera.eye_in_world().distance(target) / camera.fy,
        Projection::Orthographic => 1.0 / camera.fy,
    };
    let half_in_world = 0.5 * scale * DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let (_, up) = orbit_directions(&view.orbit, &view.stance);
    let right = camera.forward_in_world().cross(up);
    let lifted = if views > 1 {
        // Along the axis of the turn, which is seen under the elevation's cosine.
        let foreshortened = up.dot(view.stance.up);
        if foreshortened < 0.1 {
            DVec3::ZERO
        } else {
            view.stance.up / foreshortened
        }
    } else {
        up
    };
    let shift = excess.middle * half_in_world;
    // One pixel, or a haze that is seen by its border alone.
    let growth = (excess.fill / FILL).clamp(0.02, 4.0);
    let by = shift.x * right + shift.y * lifted;
    Ok(Extent {
        bounds: extent.bounds.map(|corner| corner + by),
        radius: extent.radius * growth,
    })
}

/// Where points are seen; those behind the eye are left out.
pub fn seen_points(camera: &Camera, points: impl Iterator<Item = DVec3>) -> Option<Seen> {
    let half = 0.5 * DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for point in points {
        let in_camera = camera.camera_from_world.transform_point3(point);
        if in_camera.z > camera.near || camera.projection == Projection::Orthographic {
            let at = camera.screen_from_camera(in_camera);
            (low, high) = (low.min(at), high.max(at));
        }
    }
    let seen = of_pixels(low, high, half);
    low.is_finite().then_some(seen)
}

/// From pixels, counted from the upper left corner, to half pictures.
pub fn of_pixels(low: DVec2, high: DVec2, half: DVec2) -> Seen {
    let (a, b) = ((low - half) / half, (high - half) / half);
    Seen {
        low: DVec2::new(a.x, -b.y),
        high: DVec2::new(b.x, -a.y),
        near_enough: NEAR_ENOUGH,
    }
}

#[cfg(test)]
mod tests;
