//! Thin opaque shells: against an f64 twin of the renderer's own rule, and against the truth of fields with a formula.

use glam::DVec3;
use resample_core::metrics::{Mask, compare};
use resample_core::{Camera, Image};
use resample_tests::twins::samples::Scene;
use resample_tests::twins::segments;
use resample_tests::volumes::scenes::{perspective, random_volume, sheared_grid, transfer, volume};
use resample_tests::volumes::shells::{SIDE, Shell};
use volsplat::{RenderOptions, Renderer, Shading, Subpixels, TransferFunction, Volume};

/// Width of the peak, as a part of the volume's range, and its opacity over a voxel.
const WIDTH: f64 = 0.02;
const OPACITY: f64 = 0.95;

fn rendered(
    volume: &Volume,
    look: &TransferFunction,
    camera: &Camera,
    options: &RenderOptions,
) -> Image {
    let mut renderer = Renderer::new(volume, look, options).expect("valid options");
    renderer.render(camera).expect("a valid camera").image
}

fn psnr_db(image: &Image, truth: &Image) -> f64 {
    let inside = Mask::from_alpha(truth);
    compare(image, truth, Some(&inside))
        .expect("pictures of one size")
        .psnr_db
}

/// One sub-pixel, every sample composited: what the twin draws.
fn plain() -> RenderOptions {
    RenderOptions {
        subpixels: Subpixels::Fixed(1),
        min_transmittance: 0.0,
        ..RenderOptions::default()
    }
}

/// The greatest difference of any channel.
fn departure(volume: &Volume, look: &TransferFunction, camera: &Camera) -> f64 {
    let options = plain();
    let image = rendered(volume, look, camera, &options);
    let twin = segments::render(&Scene {
        volume,
        transfer: look,
        camera,
        options: &options,
    });
    let differ = |(got, wanted): (&[f32; 4], &[f64; 4])| {
        (0..4)
            .map(|k| (f64::from(got[k]) - wanted[k]).abs())
            .fold(0.0, f64::max)
    };
    image.rgba.iter().zip(&twin).map(differ).fold(0.0, f64::max)
}

#[test]
fn shells_are_what_the_twin_draws() {
    for shell in Shell::ALL {
        let (volume, look) = (shell.volume(), shell.look(WIDTH, OPACITY));
        let worst = departure(&volume, &look, &shell.camera(1.5));
        assert!(worst < 2e-3, "{}: off by {worst}", shell.name());
    }
}

/// Two peaks of different colours on a field without order, on a grid whose axes are neither equal nor perpendicular.
#[test]
fn peaks_on_noise_are_what_the_twin_draws() {
    let volume = random_volume([14, 13, 12], sheared_grid());
    let look = transfer(
        &[(0.45, [1.0, 0.1, 0.1]), (0.7, [0.1, 0.3, 1.0])],
        &[
            (0.49, 0.0),
            (0.5, 0.9),
            (0.51, 0.0),
            (0.69, 0.0),
            (0.7, 0.6),
            (0.72, 0.0),
        ],
    );
    let middle = volume
        .world_from_index
        .transform_point3(DVec3::new(6.5, 6.0, 5.5));
    for towards in [
        DVec3::new(0.3, 0.5, -1.0),
        DVec3::X,
        DVec3::new(1.0, 1.0, 1.0),
    ] {
        let camera = perspective(middle + 40.0 * towards.normalize(), middle, 25.0, [48, 40]);
        let worst = departure(&volume, &look, &camera);
        assert!(worst < 4e-3, "from {towards}: off by {worst}");
    }
}

/// Tents of which one is narrow; most cells are dropped.
#[test]
fn tents_are_what_the_twin_draws() {
    let look = transfer(
        &[(0.0, [1.0; 3])],
        &[
            (0.3, 0.0),
            (0.35, 0.7),
            (0.4, 0.0),
            (0.8, 0.0),
            (0.9, 0.3),
            (1.0, 0.0),
        ],
    );
    let volume = random_volume([11, 10, 9], glam::DAffine3::IDENTITY);
    let middle = DVec3::new(5.0, 4.5, 4.0);
    let camera = perspective(
        middle + DVec3::new(12.0, 9.0, -14.0),
        middle,
        40.0,
        [40, 40],
    );
    let worst = departure(&volume, &look, &camera);
    assert!(worst < 2e-3, "off by {worst}");
}

#[test]
fn shells_with_a_formula_reach_their_truth() {
    for shell in Shell::ALL {
        let (volume, look) = (shell.volume(), shell.look(WIDTH, OPACITY));
        for (voxel_px, least_db) in [(3.0, 40.0), (0.5, 42.0)] {
            let camera = shell.camera(voxel_px);
            let truth = shell.truth(&look, &camera);
            let reached_db = psnr_db(
                &rendered(&volume, &look, &camera, &RenderOptions::default()),
                &truth,
            );
            println!(
                "{} at {voxel_px} px a voxel: {reached_db:.2} dB",
                shell.name()
            );
            assert!(
                reached_db >= least_db,
                "{} at {voxel_px} px a voxel: {reached_db:.2} dB",
                shell.name()
            );
        }
    }
}

/// Head on, a shell is a flat sheet: light must not know where samples lie.
#[test]
fn a_lit_sheet_is_evenly_bright() {
    let volume = volume([24, 24, 24], glam::DAffine3::IDENTITY, |p| p.z);
    let look = transfer(
        &[(0.0, [1.0; 3])],
        &[(11.1, 0.0), (11.3, 0.95), (11.5, 0.0)],
    );
    let options = RenderOptions {
        shading: Shading::Lambert,
        ..plain()
    };
    let middle = DVec3::splat(11.5);
    let camera = perspective(middle + DVec3::new(3.0, 0.0, -60.0), middle, 10.0, [64, 64]);
    let image = rendered(&volume, &look, &camera, &options);
    let inside = image
        .rgba
        .iter()
        .filter(|pixel| pixel[3] > 0.0)
        .map(|pixel| pixel[0]);
    let (low, high) = inside.fold((f32::MAX, 0.0f32), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    assert!(low > 0.0 && high / low < 1.02, "from {low} to {high}");
}

/// A shell on the face between two layers of bricks is neither drawn twice nor left out.
#[test]
fn faces_of_bricks_are_not_seen() {
    let volume = volume([SIDE; 3], glam::DAffine3::IDENTITY, |p| p.z);
    let look = transfer(&[(0.0, [1.0; 3])], &[(15.9, 0.0), (16.0, 0.9), (16.1, 0.0)]);
    let middle = DVec3::splat(0.5 * (SIDE - 1) as f64);
    let camera = perspective(middle + DVec3::new(0.0, 0.0, -90.0), middle, 20.0, [96, 96]);
    let image = rendered(&volume, &look, &camera, &plain());
    let depth = 0.2 * mean_extinction(0.9);
    let focal_px = 48.0 / 10f64.to_radians().tan();
    for (x, y) in [(48, 48), (30, 60), (70, 25)] {
        let across = [x, y].map(|at| (at as f64 + 0.5 - 48.0) / focal_px);
        let slant = (1.0 + across[0] * across[0] + across[1] * across[1]).sqrt();
        let wanted = -(-depth * slant).exp_m1();
        let got = f64::from(image.rgba[x + 96 * y][3]);
        assert!(
            (got - wanted).abs() < 1e-3,
            "({x}, {y}): {got}, expected {wanted}"
        );
    }
}

/// Mean extinction of opacities that rise evenly from 0 on.
fn mean_extinction(opacity: f64) -> f64 {
    // The integral of -ln(1 - a).
    ((1.0 - opacity) * (1.0 - opacity).ln() + opacity) / opacity
}
