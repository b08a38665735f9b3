//! Three cameras on a volume of unit spacing: magnified, both, minified. Those of the peer comparison in the tests
//! package; pictures have 400x400 px.

use glam::DVec3;
use resample_core::{Camera, LookAt};
use volsplat::Volume;

/// Where the camera stands.
#[derive(Clone, Copy, Debug)]
pub(crate) enum View {
    /// Every voxel is larger than a pixel.
    Close,
    /// Wide angle: near voxels are larger than a pixel, far ones smaller.
    Mixed,
    /// Two voxels a pixel.
    Far,
}

/// Picture side, px.
const SIDE_PX: u32 = 400;

impl View {
    /// Every view.
    pub(crate) const ALL: [Self; 3] = [Self::Close, Self::Mixed, Self::Far];
}

/// The camera of a view of this volume.
pub(crate) fn camera(volume: &Volume, view: View) -> Camera {
    let extent = DVec3::from(volume.dims.map(|n| (n - 1) as f64));
    let (centre, radius) = (0.5 * extent, 0.5 * extent.length());
    let fov_y_rad = match view {
        View::Close | View::Far => 30f64.to_radians(),
        View::Mixed => 60f64.to_radians(),
    };
    let focal_px = 0.5 * f64::from(SIDE_PX) / (0.5 * fov_y_rad).tan();
    let distance = match view {
        // The far side is still a little closer than one voxel a pixel.
        View::Close => (420.0 / 220.8 * radius).min(0.97 * focal_px - radius),
        View::Mixed => focal_px.max(1.08 * radius),
        View::Far => 2.0 * focal_px,
    };
    let position = centre + distance * DVec3::new(0.62, 0.38, 0.69).normalize();
    let pose = LookAt {
        position,
        target: centre,
        up: DVec3::Y,
    };
    Camera::perspective(&pose, fov_y_rad, [SIDE_PX; 2]).expect("the eye is outside the volume")
}
