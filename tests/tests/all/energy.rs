//! Energy at the threshold between points and splats (method, section 3, "Points" and "EWA").
//!
//! A sample's mass is the optical depth that it adds to all pixels together. As a point it is exact by construction
//! (its weights sum to 1); as a splat it is what the pixel grid samples of the footprint; as EWA, what it samples of the
//! footprint convolved with the pixel's Gaussian. The true mass is the sample's world volume times the pixels per world
//! area seen square on, there. The seam is measured on a plane of voxels whose spacing moves through the threshold.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, SelectMode};
use resample_tests::volumes::scenes::{
    full, grey, orthographic, perspective, render, single_voxel, volume,
};
use volsplat::{RenderOptions, Volume};

/// Sum of the optical depths of all pixels.
fn mass(volume: &Volume, options: &RenderOptions, camera: &Camera) -> f64 {
    let image = render(volume, &grey(OPACITY), options, camera);
    image
        .rgba
        .iter()
        .map(|pixel| -(1.0 - f64::from(pixel[3])).ln())
        .sum()
}

/// Opacity of the voxels: any would do, as optical depths add up.
const OPACITY: f64 = 0.2;

/// Largest relative error of mass at a spacing on the screen (px), over positions in a pixel and places off the axis.
fn worst_mass_error(select: SelectMode, spacing_px: f64) -> f64 {
    let options = full(select);
    let tau = -(1.0 - OPACITY).ln();
    let mut worst = 0.0f64;
    for step in 0..25 {
        // Positions inside a pixel, and four places off the axis, out to 35 degrees.
        let (u, v) = (
            f64::from(step % 5) * 0.2 + 0.03,
            f64::from(step / 5) * 0.2 + 0.07,
        );
        for off_axis in [[0.0, 0.0], [0.3, 0.0], [-0.2, 0.5], [0.0, -0.7]] {
            let distance = 100.0;
            let focal_px = spacing_px * distance;
            let centre = DVec3::new(
                off_axis[0] * distance + (u - 0.5) / spacing_px,
                off_axis[1] * distance + (v - 0.5) / spacing_px,
                distance,
            );
            // The picture is 24 px around the voxel, wherever it is.
            let [cx, cy] = off_axis.map(|o| 12.0 - o * focal_px);
            let camera = Camera {
                fx: focal_px,
                fy: focal_px,
                cx,
                cy,
                ..straight([24, 24])
            };
            let truth = tau * focal_px.powi(2) * centre.length() / centre.z.powi(3);
            let got = mass(&single_voxel(centre), &options, &camera);
            worst = worst.max((got / truth - 1.0).abs());
        }
    }
    worst
}

/// A camera at the origin that looks along z.
fn straight(size: [u32; 2]) -> Camera {
    let camera = perspective(DVec3::ZERO, DVec3::Z, 60.0, size);
    Camera {
        camera_from_world: DAffine3::IDENTITY,
        near: 1e-3,
        ..camera
    }
}

#[test]
fn a_point_has_its_mass_everywhere() {
    for spacing_px in [0.25, 0.5, 1.0, 2.0] {
        let error = worst_mass_error(SelectMode::Points, spacing_px);
        println!("point, spacing {spacing_px} px: {error:.1e}");
        assert!(
            error < 1e-4,
            "a point at {spacing_px} px has its mass wrong by {error}"
        );
    }
}

/// The kernel is wide enough for the pixel grid from 1 px spacing on: the mass is within 1 %. Below, splats fall
/// between the pixels: 13 % at 0.7 px, 86 % at 0.5 px. That is what points are for.
#[test]
fn a_splat_has_its_mass_from_the_threshold_on() {
    for (spacing_px, bound) in [
        (0.5, 1.0),
        (0.7, 0.2),
        (0.999, 0.01),
        (1.001, 0.01),
        (1.4, 0.01),
        (2.0, 0.01),
    ] {
        let error = worst_mass_error(SelectMode::Splats, spacing_px);
        println!("splat, spacing {spacing_px} px: {error:.1e}");
        assert!(
            error < bound,
            "a splat at {spacing_px} px has its mass wrong by {error}"
        );
    }
}

/// At a small spacing EWA is the pixel's filter alone, of sigma 1/2 px, cut at 1.6 px: what the pixel grid samples of it
/// ripples by 1.5 %.
#[test]
fn ewa_has_its_mass_at_every_spacing() {
    for (spacing_px, bound) in [
        (0.25, 0.02),
        (0.5, 0.01),
        (0.7, 0.01),
        (1.0, 0.01),
        (1.4, 0.01),
        (2.0, 0.01),
    ] {
        let error = worst_mass_error(SelectMode::Ewa, spacing_px);
        println!("ewa, spacing {spacing_px} px: {error:.1e}");
        assert!(
            error < bound,
            "ewa at {spacing_px} px has its mass wrong by {error}"
        );
    }
}

/// Mean of the red channel over the middle of a picture of a plane of voxels.
fn mean_intensity(select: SelectMode, spacing_px: f64, turn_deg: f64) -> f64 {
    let plane = volume([49, 49, 1], DAffine3::IDENTITY, |_| 1.0);
    let middle = DVec3::new(24.0, 24.0, 0.0);
    let turn = turn_deg.to_radians();
    let eye = middle + 60.0 * DVec3::new(0.3 * turn.sin(), turn.sin(), -turn.cos());
    // Orthographic: every voxel has one spacing, so that all cross the threshold together.
    let camera = orthographic(eye, middle, 32.0 / spacing_px, [32, 32]);
    let image = render(&plane, &grey(0.5), &full(select), &camera);
    let inner = (10..22).flat_map(|y| (10..22).map(move |x| (x, y)));
    inner
        .map(|(x, y)| f64::from(image.pixel(x, y)[0]))
        .sum::<f64>()
        / 144.0
}

/// Section 3 asks for the seam of hybrid and of ewa: the jump in mean intensity of a plane of voxels as its spacing
/// passes the threshold.
#[test]
fn the_seam_of_a_plane_of_voxels() {
    for turn_deg in [0.0, 20.0, 45.0] {
        for (select, bound) in [(SelectMode::Hybrid, 1e-3), (SelectMode::Ewa, 1e-5)] {
            let (below, above) = (0.9995, 1.0005);
            let [low, high] =
                [below, above].map(|spacing| mean_intensity(select, spacing, turn_deg));
            let jump = (high / low - 1.0).abs();
            println!(
                "{select:?}, plane turned by {turn_deg}: {low:.5} to {high:.5}, a jump of {jump:.1e}"
            );
            assert!(
                jump < bound,
                "{select:?}: the intensity jumps by {jump} at the threshold"
            );
        }
    }
}
