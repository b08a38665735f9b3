//! Fitting a view to the visible part: its larger side fills [`FILL`] of the picture, and it stands in the middle.
//!
//! Takes an extent that holds everything, the views, and a measure, which says where in the picture of a camera something is seen.
//! Gives the extent moved and resized, round by round. The measure of a mesh projects its corners; that of a volume
//! draws a small picture, in which hidden and faint parts do not show.
//! Several views (a turntable) share one extent, so that the scene keeps its size while it turns.

use anyhow::Result;
use glam::{DVec2, DVec3};
use resample_core::{Camera, Projection};

use super::{Extent, View, frame, orbit_directions};

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

/// The extent that a camera sees; `None` where that is nothing.
pub type Measure<'a> = dyn FnMut(&Camera) -> Result<Option<Seen>> + 'a;

/// How often the measure is asked for each view at most: a round misses by the difference in distance of what is near and far, which the
/// next one sees from almost the right place.
const ROUNDS: usize = 6;

/// Corners are projected exactly, which costs next to nothing: two pixels of a picture of 800.
const NEAR_ENOUGH: f64 = 0.005;

/// How what is seen lies beside the picture's middle, over all views.
struct Excess {
    /// In the picture, half pictures.
    middle: DVec2,
    /// The larger side, as a share of the picture.
    fill: f64,
    /// Below which it counts as nothing.
    near_enough: f64,
}

/// The extent that shows in all views what the measure sees; the first extent where that is nothing.
pub fn fit(extent: &Extent, views: &[View], measure: &mut Measure) -> Result<Extent> {
    let mut fitted = *extent;
    for _ in 0..ROUNDS {
        let Some(excess) = excess(&fitted, views, measure)? else {
            return Ok(*extent);
        };
        fitted = moved(&fitted, &views[0], views.len(), &excess)?;
        let is_near = (excess.fill / FILL - 1.0)
            .abs()
            .max(excess.middle.abs().max_element());
        if is_near < excess.near_enough {
            break;
        }
    }
    Ok(fitted)
}

fn excess(extent: &Extent, views: &[View], measure: &mut Measure) -> Result<Option<Excess>> {
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
fn moved(extent: &Extent, view: &View, views: usize, excess: &Excess) -> Result<Extent> {
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
