//! Why ramps are sampled in the middle of a segment and not integrated between two planes: the error of the one has no
//! preferred sign and leaves with the mean of a pixel's rays, that of the other stays. All in f64, without a renderer.
//!
//! Scene: a vessel of 1.2 voxels' radius that winds through a small volume, a ramp that bends once, and pixels two voxels wide
//! with 16 parallel rays each. The truth takes 16 samples where each method has one segment of half a voxel.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3};
use resample_tests::twins::trilinear::scalar;
use volsplat::{Volume, Voxels};

/// Voxels along an axis.
const SIDE: usize = 40;

/// Length of a segment, voxels.
const SEGMENT: f64 = 0.5;

/// Segments of a ray: through the middle of the volume, not out of it.
const SEGMENTS: usize = 48;

/// A tube around a helix, 200 on its axis.
fn vessel() -> Volume {
    let value = |index: usize| {
        let at = DVec3::new(
            (index % SIDE) as f64,
            (index / SIDE % SIDE) as f64,
            (index / SIDE / SIDE) as f64,
        );
        let distance2 = (0..800).map(|step| {
            let turn = f64::from(step) / 800.0;
            let (sin, cos) = (2.0 * TAU * turn).sin_cos();
            at.distance_squared(DVec3::new(
                20.0 + 9.0 * cos,
                8.0 + 24.0 * turn,
                20.0 + 9.0 * sin,
            ))
        });
        let nearest2 = distance2.fold(f64::INFINITY, f64::min);
        (200.0 * (-nearest2 / (2.0 * 1.2 * 1.2)).exp()) as f32
    };
    let values = (0..SIDE.pow(3)).map(value).collect();
    Volume::new([SIDE; 3], Voxels::F32(values), DAffine3::IDENTITY).expect("a volume")
}

/// Extinction per voxel: none below 24, then a slope, and a steeper one from 90 on.
fn extinction(scalar: f64) -> f64 {
    0.008 * (scalar - 24.0).max(0.0) + 0.02 * (scalar - 90.0).max(0.0)
}

/// Its mean between two scalars, exactly: it is piecewise linear, so its integral is piecewise quadratic.
fn mean_between(one: f64, other: f64) -> f64 {
    let integral =
        |s: f64| 0.004 * (s - 24.0).max(0.0).powi(2) + 0.01 * (s - 90.0).max(0.0).powi(2);
    if (one - other).abs() < 1e-9 {
        return extinction(one);
    }
    (integral(one) - integral(other)) / (one - other)
}

/// Opacities of one ray: the truth, samples in the middle of segments, and integrals between planes.
fn opacities(volume: &Volume, start: DVec3, direction: DVec3) -> [f64; 3] {
    let at = |t: f64| scalar(volume, start + t * direction);
    let mut depths = [0.0; 3];
    for segment in 0..SEGMENTS {
        let from = segment as f64 * SEGMENT;
        let fine = (0..16).map(|k| extinction(at(from + (f64::from(k) + 0.5) / 16.0 * SEGMENT)));
        depths[0] += fine.sum::<f64>() / 16.0;
        depths[1] += extinction(at(from + 0.5 * SEGMENT));
        depths[2] += mean_between(at(from), at(from + SEGMENT));
    }
    depths.map(|depth| -(-depth * SEGMENT).exp_m1())
}

#[test]
fn errors_of_samples_average_out_and_those_of_integrals_between_planes_do_not() {
    let volume = vessel();
    let direction = DVec3::new(0.5, 0.35, 0.79).normalize();
    let (right, up) = direction.any_orthonormal_pair();
    let (mut sum2, mut bias) = ([0.0; 2], [0.0; 2]);
    let mut pixels = 0.0;
    for pixel in 0..36 {
        let place = [pixel % 6, pixel / 6].map(|i| 3.0 * (f64::from(i) - 2.5));
        let mut errors = [0.0; 2];
        for ray in 0..16 {
            let across = [ray % 4, ray / 4].map(|i| 0.5 * (f64::from(i) - 1.5));
            let middle = (place[0] + across[0]) * right + (place[1] + across[1]) * up;
            let start = DVec3::splat(19.5) + middle - 0.5 * SEGMENT * SEGMENTS as f64 * direction;
            let [truth, samples, integrals] = opacities(&volume, start, direction);
            errors[0] += (samples - truth) / 16.0;
            errors[1] += (integrals - truth) / 16.0;
        }
        pixels += 1.0;
        for method in 0..2 {
            sum2[method] += errors[method] * errors[method];
            bias[method] += errors[method];
        }
    }
    let [samples, integrals] = sum2.map(|sum: f64| (sum / pixels).sqrt());
    let [of_samples, of_integrals] = bias.map(|sum: f64| sum / pixels);
    println!(
        "pixel error {samples:.1e} and {integrals:.1e}, mean {of_samples:.1e} and {of_integrals:.1e}"
    );
    assert!(integrals > 3.0 * samples, "{integrals} against {samples}");
    assert!(
        of_integrals < 0.0 && of_integrals.abs() > 5.0 * of_samples.abs(),
        "chords cut off the tops: {of_integrals} against {of_samples}"
    );
}
