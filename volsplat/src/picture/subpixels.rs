//! How many sub-pixels a picture needs along a pixel's side.

use glam::{DAffine3, DVec3};
use resample_core::view::largest_eigenvalue;
use resample_core::{Camera, GridView};

/// The least of 1, 2, 4 and 8 at which samples, which stand on the lattice that `world_from_grid` places, are `least_px`
/// sub-pixels apart at this position of the lattice; 8 where even that is too few. A position behind the eye, or one that is no
/// number, gives 1.
pub(crate) fn automatic(
    camera: &Camera,
    world_from_grid: &DAffine3,
    pos_in_grid: DVec3,
    least_px: f64,
) -> u32 {
    let view = GridView::new(camera, world_from_grid);
    let gram = view.gram_px2(view.camera_from_grid.transform_point3(pos_in_grid));
    let spacing_px = largest_eigenvalue(gram).sqrt();
    [1, 2, 4]
        .into_iter()
        .find(|&n| !(f64::from(n) * spacing_px < least_px))
        .unwrap_or(8)
}

/// The camera with as many times the pixels along each side, and how many times that is: a picture of more sub-pixels than
/// a camera may have gets one a pixel.
pub(crate) fn refined(camera: &Camera, subpixels: u32) -> (Camera, u32) {
    match camera.resized(camera.width * subpixels, camera.height * subpixels) {
        Ok(fine) => (fine, subpixels),
        Err(_) => (*camera, 1),
    }
}
