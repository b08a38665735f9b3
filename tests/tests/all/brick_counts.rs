//! Counts of the bricks of a frame, where they can be told beforehand: 4x4x4 bricks of 8 cells each, seen along an axis, so that a brick
//! covers one tile.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, LookAt};
use resample_tests::volumes::scenes::{grey, volume};
use volsplat::stats::FrameStats;
use volsplat::{RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

/// Cells along each axis.
const CELLS: f64 = 32.0;

/// A picture of 64x64 pixels that is as wide as `width` cells, around a point of the face that it looks at along z.
fn camera(x: f64, y: f64, width: f64) -> Camera {
    let pose = LookAt {
        position: DVec3::new(x, y, -40.0),
        target: DVec3::new(x, y, 0.0),
        up: DVec3::NEG_Y,
    };
    Camera::orthographic(&pose, width, [64, 64]).expect("a valid camera")
}

fn counts(volume: &Volume, transfer: &TransferFunction, camera: &Camera) -> FrameStats {
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(volume, transfer, &options).expect("valid options");
    renderer.render(camera).expect("a valid camera").stats
}

/// Rises along z, so that no brick is of one colour.
fn slope(from_x: f64) -> Volume {
    volume([CELLS as usize + 1; 3], DAffine3::IDENTITY, |p| {
        if p.x > from_x { 0.9 + 0.001 * p.z } else { 0.0 }
    })
}

#[test]
fn the_bricks_behind_an_opaque_face_are_hidden() {
    let stats = counts(&slope(-1.0), &grey(1.0), &camera(16.0, 16.0, CELLS));
    assert_eq!(
        [stats.bricks, stats.bricks_empty, stats.bricks_outside],
        [64, 0, 0]
    );
    assert_eq!(stats.bricks_hidden, 48, "all but the first layer");
}

#[test]
fn nothing_is_hidden_behind_a_faint_face() {
    let stats = counts(&slope(-1.0), &grey(1e-3), &camera(16.0, 16.0, CELLS));
    assert_eq!([stats.bricks, stats.bricks_hidden], [64, 0]);
}

#[test]
fn bricks_without_a_visible_voxel_are_empty() {
    // The cells from 16 to 17 on have a corner that is seen.
    let stats = counts(&slope(16.0), &grey(1.0), &camera(16.0, 16.0, CELLS));
    assert_eq!(
        [stats.bricks, stats.bricks_empty, stats.bricks_outside],
        [32, 32, 0]
    );
    assert_eq!(
        stats.bricks_hidden, 12,
        "behind the last column of bricks; the first begins with a faint cell"
    );
}

#[test]
fn bricks_beside_the_picture_are_outside() {
    let stats = counts(&slope(-1.0), &grey(1e-3), &camera(8.0, 8.0, 15.0));
    assert_eq!(
        [stats.bricks, stats.bricks_empty, stats.bricks_outside],
        [16, 0, 48]
    );
}

#[test]
fn bricks_that_a_narrower_look_leaves_out_are_empty() {
    let volume = slope(-1.0);
    let options = RenderOptions {
        subpixels: Subpixels::Fixed(1),
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&volume, &grey(1e-3), &options).expect("valid options");
    // Seen from z = 16 on: 0.9 + 0.016.
    let narrow = resample_tests::volumes::scenes::transfer(
        &[(0.0, [1.0; 3])],
        &[(0.9161, 0.0), (0.95, 0.5)],
    );
    assert_ne!(
        renderer.update_transfer(&narrow),
        resample_core::Reuse::NeedsRenderer
    );
    let stats = renderer
        .render(&camera(16.0, 16.0, CELLS))
        .expect("a valid camera")
        .stats;
    assert_eq!([stats.bricks, stats.bricks_empty], [32, 32]);
}
