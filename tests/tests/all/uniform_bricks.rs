//! Bricks of one colour that a ray crosses in one step: the planes inside are those of the f64 reference.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::sheets::render as reference;
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, transfer, volume, worst_difference,
};
use volsplat::procedural::checker_box;
use volsplat::{DepthPlane, RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

fn options() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 1e-6,
        depth: DepthPlane::Expected,
        ..RenderOptions::default()
    }
}

/// Cameras from which a voxel is less than 0.3 pixels wide.
fn cameras(middle: DVec3, size: f64) -> [Camera; 3] {
    let side = [24; 2];
    [
        perspective(
            middle + size * DVec3::new(2.5, 1.3, -4.1),
            middle,
            25.0,
            side,
        ),
        orthographic(middle - 1.4 * size * DVec3::Z, middle, 1.6 * size, side),
        orthographic(
            middle + size * DVec3::new(1.1, 0.0, 1.1),
            middle,
            1.6 * size,
            side,
        ),
    ]
}

/// Renders with steps, checks every pixel against the reference, and returns how many bricks took a step.
fn hold(name: &str, (volume, look): (&Volume, &TransferFunction), camera: &Camera) -> u64 {
    let options = options();
    let truth = reference(&Scene {
        volume,
        transfer: look,
        camera,
        options: &options,
    });
    let mut renderer = Renderer::new(volume, look, &options).expect("valid options");
    let frame = renderer.render(camera).expect("a valid camera");
    let mut beyond = 0.0f64;
    for (got, truth) in frame.image.rgba.iter().zip(&truth) {
        let [r, g, b] = truth.rgb;
        for (got, truth_value) in got.iter().zip([r, g, b, 1.0 - truth.transmittance]) {
            beyond = beyond.max((f64::from(*got) - truth_value).abs() - truth.slack);
        }
    }
    println!(
        "{name}: {beyond:.1e} beyond the table, {:?}",
        camera.projection
    );
    // Colours of a step are kept in 16 bits: 1e-5; the rest is rounding.
    assert!(beyond < 4e-5, "{name}: off by {beyond}");
    frame.stats.bricks_uniform
}

#[test]
fn a_constant_volume_is_the_same_in_steps() {
    let volume = volume([65, 65, 65], DAffine3::IDENTITY, |_| 0.6);
    for camera in cameras(DVec3::splat(32.0), 64.0) {
        let steps = hold("constant", (&volume, &coloured(0.05)), &camera);
        assert!(steps > 400, "only {steps} bricks took a step");
    }
}

#[test]
fn bricks_of_one_colour_between_others_are_the_same_in_steps() {
    let volume = checker_box(64, 16).expect("a good size");
    let look = transfer(
        &[(85.0, [0.9, 0.2, 0.1]), (170.0, [0.1, 0.3, 0.9])],
        &[(85.0, 0.02), (170.0, 0.1)],
    );
    let at = |p: f64| volume.world_from_index.transform_point3(DVec3::splat(p));
    let size = (at(63.0) - at(0.0)).x;
    let mut steps = 0;
    for camera in cameras(at(31.5), size) {
        steps += hold("checker box", (&volume, &look), &camera);
    }
    assert!(steps > 0, "no brick took a step");
}

/// The early end inside a step leaves what it leaves plane by plane.
#[test]
fn a_step_ends_where_the_pixel_is_opaque() {
    let volume = volume([65, 65, 65], DAffine3::IDENTITY, |_| 0.6);
    let look = coloured(0.4);
    for camera in cameras(DVec3::splat(32.0), 64.0) {
        let of = |min_transmittance: f32| {
            let options = RenderOptions {
                min_transmittance,
                ..options()
            };
            let mut renderer = Renderer::new(&volume, &look, &options).expect("valid options");
            renderer.render(&camera).expect("a valid camera").image
        };
        let worst = worst_difference(&of(1.0 / 512.0), &of(0.0));
        assert!(worst <= 1.0 / 512.0 + 1e-5, "off by {worst}");
    }
}
