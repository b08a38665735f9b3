//! Volumes with places that light does not reach, each 56 voxels along a side, and looks for them.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, Image};
use volsplat::{Blend, FieldOptions, Isosurface, Order, TransferFunction, Volume};

use crate::volumes::scenes::{perspective, transfer, volume};

/// Voxels along a side.
pub const SIDE_VOXELS: usize = 56;

/// Towards the light.
pub fn towards() -> DVec3 {
    DVec3::new(-0.5, 0.8, 0.45).normalize()
}

/// An eye from which each of these volumes fills the picture.
pub fn camera() -> Camera {
    let middle = DVec3::splat(0.5 * (SIDE_VOXELS - 1) as f64);
    let eye = middle + 110.0 * DVec3::new(0.62, 0.5, 0.69).normalize();
    perspective(eye, middle, 32.0, [28; 2])
}

/// Peak signal to noise ratio over the pixels that a true picture covers, dB.
pub fn psnr_db(image: &Image, truth: &Image) -> f64 {
    let covered = image
        .rgba
        .iter()
        .zip(&truth.rgba)
        .filter(|(_, t)| t[3] > 0.02);
    let (mut squares, mut count) = (0.0, 0.0);
    for (pixel, truth) in covered {
        for (a, b) in pixel[..3].iter().zip(truth) {
            squares += f64::from(a - b).powi(2);
            count += 1.0;
        }
    }
    assert!(count > 500.0, "{count} numbers are covered");
    -10.0 * (squares / count).log10()
}

/// Distance below 0 inside, in voxels, as a number from 0 to 1 that falls from 1 to 0 over four voxels.
fn soft(distance: f64) -> f64 {
    (0.5 - distance / 4.0).clamp(0.0, 1.0)
}

/// A ball over a plate.
pub fn ball() -> Volume {
    volume([SIDE_VOXELS; 3], DAffine3::IDENTITY, |p| {
        let ball = (p - DVec3::new(28.0, 30.0, 28.0)).length() - 10.0;
        let plate = (p.y - 9.0).abs() - 3.0;
        let beside = (p.x - 28.0).abs().max((p.z - 28.0).abs()) - 24.0;
        soft(ball.min(plate.max(beside)))
    })
}

/// Thin tubes across each other, three voxels wide.
pub fn vessels() -> Volume {
    volume([SIDE_VOXELS; 3], DAffine3::IDENTITY, |p| {
        let tubes = (0..7).map(|number| {
            let turn = f64::from(number) * 0.9;
            let along = DVec3::new(turn.cos(), 0.3 * (2.0 * turn).sin(), turn.sin()).normalize();
            let middle = DVec3::new(28.0, 12.0 + 5.0 * f64::from(number), 28.0);
            (p - middle).reject_from(along).length() - 1.8
        });
        let inside = (p - 27.5).length() - 26.0;
        soft(tubes.fold(f64::INFINITY, f64::min).max(inside))
    })
}

/// A wide lump of fog.
pub fn fog() -> Volume {
    volume([SIDE_VOXELS; 3], DAffine3::IDENTITY, |p| {
        let q = (p - 27.5) / 26.0;
        (1.0 - q.length_squared()).max(0.0) * (0.6 + 0.4 * (0.6 * p.x).sin() * (0.5 * p.y).cos())
    })
}

/// Shells one in another.
pub fn shells() -> Volume {
    volume([SIDE_VOXELS; 3], DAffine3::IDENTITY, |p| {
        ((p - 27.5).length() / 26.0).min(1.0)
    })
}

/// Opaque from the middle on.
pub fn solid() -> TransferFunction {
    let colours = [(0.0, [0.9, 0.6, 0.4]), (1.0, [1.0, 0.9, 0.8])];
    transfer(&colours, &[(0.2, 0.0), (0.8, 0.8)])
}

/// Opacity that rises with the scalar, and stays low.
pub fn thin() -> TransferFunction {
    transfer(&[(0.0, [0.8; 3])], &[(0.0, 0.0), (1.0, 0.15)])
}

/// Two peaks, each of which is two voxels wide.
pub fn peaks() -> TransferFunction {
    let peak = |at: f64, opacity: f64| [(at - 0.04, 0.0), (at, opacity), (at + 0.04, 0.0)];
    let knots: Vec<(f64, f64)> = [peak(0.5, 0.9), peak(0.9, 0.25)].concat();
    transfer(&[(0.0, [1.0, 0.4, 0.3]), (1.0, [0.5, 0.7, 1.0])], &knots)
}

/// The white, opaque isosurface at half of the range.
pub fn white_isosurface() -> Order {
    Order::Field(FieldOptions {
        blend: Blend::Isosurface(Isosurface {
            value: 0.5,
            colour: Some([1.0; 3]),
            opacity: 1.0,
        }),
        ..FieldOptions::default()
    })
}
