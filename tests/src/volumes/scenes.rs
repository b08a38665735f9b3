//! Volumes, transfer functions, cameras and options that the tests share.
//!
//! Everything is made from formulas and is the same on every machine. Helpers that can only fail on a mistake in a test
//! panic with the reason.

use crate::choices::with_samples;
use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, Image, LookAt, SelectMode};
use volsplat::transfer::{ColourKnot, OpacityKnot};
use volsplat::{RenderOptions, Renderer, TransferFunction, Volume, Voxels};

/// A volume whose voxel (i, j, k) is a function of its indices.
pub fn volume(
    dims: [usize; 3],
    world_from_index: DAffine3,
    value: impl Fn(DVec3) -> f64,
) -> Volume {
    let at = |i: usize| {
        value(DVec3::new(
            (i % dims[0]) as f64,
            (i / dims[0] % dims[1]) as f64,
            (i / (dims[0] * dims[1])) as f64,
        ))
    };
    let voxels = (0..dims.iter().product()).map(at).collect();
    Volume::new(dims, Voxels::F64(voxels), world_from_index).expect("a valid test volume")
}

/// Voxels of 0.2..1 that look random and never change.
pub fn random_volume(dims: [usize; 3], world_from_index: DAffine3) -> Volume {
    volume(dims, world_from_index, |p| {
        let hash = (p.dot(DVec3::new(12.9898, 78.233, 37.719))).sin() * 43_758.545_3;
        0.2 + 0.8 * (hash - hash.floor())
    })
}

/// One voxel of value 1 at a place in the world, with unit spacing.
pub fn single_voxel(at: DVec3) -> Volume {
    volume([1, 1, 1], DAffine3::from_translation(at), |_| 1.0)
}

/// A grid whose axes are neither equal nor perpendicular.
pub fn sheared_grid() -> DAffine3 {
    DAffine3::from_mat3_translation(
        DMat3::from_cols(
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.3, 0.7, -0.2),
            DVec3::new(0.0, 0.4, 1.6),
        ),
        DVec3::new(0.5, -0.2, 0.1),
    )
}

/// Opacity in proportion to the value, `opacity` at 1; white.
pub fn grey(opacity: f64) -> TransferFunction {
    transfer(&[(0.0, [1.0; 3])], &[(0.0, 0.0), (1.0, opacity)])
}

/// Opacity in proportion to the value, `opacity` at 1; blue at 0, green, red at 1.
pub fn coloured(opacity: f64) -> TransferFunction {
    let colours = [
        (0.0, [0.1, 0.2, 1.0]),
        (0.5, [0.2, 0.9, 0.3]),
        (1.0, [1.0, 0.3, 0.1]),
    ];
    transfer(&colours, &[(0.0, 0.0), (1.0, opacity)])
}

/// A transfer function from its knots.
pub fn transfer(colours: &[(f64, [f32; 3])], opacities: &[(f64, f64)]) -> TransferFunction {
    let colours = colours
        .iter()
        .map(|&(value, rgb)| ColourKnot { value, rgb })
        .collect();
    let opacities = opacities
        .iter()
        .map(|&(value, opacity)| OpacityKnot { value, opacity })
        .collect();
    TransferFunction::new(colours, opacities).expect("a valid test transfer function")
}

/// A pinhole camera; up is a direction that no test looks along.
pub fn perspective(position: DVec3, target: DVec3, fov_y_deg: f64, size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position,
        target,
        up: DVec3::new(0.1, 1.0, 0.05),
    };
    Camera::perspective(&pose, fov_y_deg.to_radians(), size).expect("a valid test camera")
}

/// A camera of parallel rays, `height` world units high.
pub fn orthographic(position: DVec3, target: DVec3, height: f64, size: [u32; 2]) -> Camera {
    let pose = LookAt {
        position,
        target,
        up: DVec3::new(0.1, 1.0, 0.05),
    };
    Camera::orthographic(&pose, height, size).expect("a valid test camera")
}

/// The default options with this selection, and no early end.
pub fn full(select: SelectMode) -> RenderOptions {
    with_samples(
        RenderOptions {
            min_transmittance: 0.0,
            ..RenderOptions::paper()
        },
        |samples| samples.select = select,
    )
}

/// Renders one frame and checks that every number in it is finite and in range (depth may be +infinity).
pub fn render(
    volume: &Volume,
    transfer: &TransferFunction,
    options: &RenderOptions,
    camera: &Camera,
) -> Image {
    let mut renderer = Renderer::new(volume, transfer, options).expect("valid options");
    let image = renderer.render(camera).expect("a valid camera").image;
    assert_sound(&image);
    image
}

/// Every pixel is finite, alpha is in 0..=1, nothing is negative.
pub fn assert_sound(image: &Image) {
    for (i, pixel) in image.rgba.iter().enumerate() {
        let good = pixel.iter().all(|c| c.is_finite() && *c >= 0.0) && pixel[3] <= 1.0;
        assert!(
            good,
            "pixel ({}, {}) is {pixel:?}",
            i % image.width,
            i / image.width
        );
    }
    for depth in image.depth.iter().flatten() {
        assert!(!depth.is_nan(), "a depth is not a number");
    }
}

/// Largest difference of any channel of any pixel.
pub fn worst_difference(a: &Image, b: &Image) -> f64 {
    assert_eq!(
        (a.width, a.height),
        (b.width, b.height),
        "pictures of one size"
    );
    let pixels = a.rgba.iter().zip(&b.rgba);
    pixels
        .flat_map(|(a, b)| a.iter().zip(b))
        .map(|(a, b)| f64::from((a - b).abs()))
        .fold(0.0, f64::max)
}
