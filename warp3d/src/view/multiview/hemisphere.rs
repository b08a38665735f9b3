//! The directions ahead of a camera in one square picture, 180 degrees along each side, as headsets show them (VR180).
//!
//! The camera's own view is drawn as a plane, as wide as its lens and what moves in from its sides, and resampled once; beyond it the picture is empty.

use glam::DVec2;
use resample_core::narrow::code32;
use resample_core::{Camera, Image};

use super::panorama::gathered;
use crate::view::panorama;

/// A half panorama.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hemisphere {
    /// Width and height of its picture, px.
    pub side_px: u32,
    /// Left, right, top and bottom of the part that is drawn, on the plane at distance 1.
    on_plane: [f64; 4],
}

/// The farthest that a view reaches on its plane: 80 degrees from ahead, where a plane has 33 times the pixels of a sphere.
const FARTHEST: f64 = 5.67;

/// Columns beyond the lens at each side, of its width: room for what comes nearer later on. A guess.
const ROOM: f64 = 0.05;

/// Most pixels along a side where nobody asks for another number: two views then have the width that H.264's decoders go up to.
const MOST_PX: f64 = 4096.0;

impl Hemisphere {
    /// That of eyes `baseline` apart which see what `camera` sees, down to the distance `nearest`, world units; of `side_px`, else of the camera's scale up to 4096.
    pub fn new(camera: &Camera, baseline: f64, nearest: f64, side_px: Option<u32>) -> Self {
        let own_px = (std::f64::consts::PI * camera.fx).min(MOST_PX);
        // Video has even sides.
        let side_px = side_px.unwrap_or_else(|| 2 * code32(0.5 * own_px).max(1));
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let aside = 0.5 * baseline / nearest + ROOM * width / camera.fx;
        let on_plane = [
            -camera.cx / camera.fx - aside,
            (width - camera.cx) / camera.fx + aside,
            -camera.cy / camera.fy,
            (height - camera.cy) / camera.fy,
        ];
        Self {
            side_px,
            on_plane: on_plane.map(|edge| edge.clamp(-FARTHEST, FARTHEST)),
        }
    }

    fn focal_px(&self) -> f64 {
        panorama::focal_px([2 * self.side_px, self.side_px])
    }

    /// The plane that is drawn, at the pose of `sheet`.
    pub(super) fn camera(&self, sheet: &Camera) -> Camera {
        let focal_px = self.focal_px();
        let [left, right, top, bottom] = self.on_plane.map(|edge| edge * focal_px);
        Camera {
            width: code32((right - left).ceil()).max(1),
            height: code32((bottom - top).ceil()).max(1),
            fx: focal_px,
            fy: focal_px,
            cx: -left,
            cy: -top,
            ..*sheet
        }
    }

    /// The half panorama of a view that was drawn as a plane.
    pub(super) fn rolled(&self, view: &Image) -> Image {
        let (side, focal_px) = (self.side_px, self.focal_px());
        let [left, _, top, _] = self.on_plane;
        let (width, height) = (view.width as f64, view.height as f64);
        gathered(std::slice::from_ref(view), [side; 2], |pos| {
            // The middle of a panorama twice as wide.
            let in_whole = DVec2::new(pos.x + 0.5 * f64::from(side), pos.y);
            let towards = panorama::direction(in_whole, [2 * side, side]);
            if towards.z <= 0.0 {
                return None;
            }
            let on_plane = towards.truncate() / towards.z;
            let at = (on_plane - DVec2::new(left, top)) * focal_px;
            let is_inside = at.x >= 0.0 && at.x < width && at.y >= 0.0 && at.y < height;
            is_inside.then_some((0, at, on_plane))
        })
    }
}
