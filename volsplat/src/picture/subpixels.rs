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

/// The camera with as many times the pixels along each side, and how many times that is: half as many, and half of that, until
/// a camera may have them.
pub(crate) fn refined(camera: &Camera, subpixels: u32) -> (Camera, u32) {
    let mut subpixels = subpixels;
    loop {
        match camera.resized(camera.width * subpixels, camera.height * subpixels) {
            Ok(fine) => return (fine, subpixels),
            Err(_) if subpixels > 1 => subpixels /= 2,
            Err(_) => return (*camera, 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use resample_core::LookAt;

    use super::*;

    #[test]
    fn large_pictures_get_as_many_sub_pixels_as_a_camera_may_have() {
        let pose = LookAt {
            position: DVec3::Z,
            target: DVec3::ZERO,
            up: DVec3::Y,
        };
        for (side, asked, found) in [(4096, 8, 8), (4097, 8, 4), (10_000, 8, 2), (32_768, 16, 1)] {
            let camera = Camera::perspective(&pose, 1.0, [side, 10]).expect("a camera");
            let (fine, subpixels) = refined(&camera, asked);
            assert_eq!((fine.width, subpixels), (side * found, found), "{side}");
        }
    }
}
