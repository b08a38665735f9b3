//! Spacing and layout (method, section 2, "Non-uniform voxels"): the picture follows the world, not the voxel grid.
//!
//! The same scene in other units, stored in another order of axes, or sampled twice as finely along one axis is the
//! same picture. Opacity is meant per world unit and is fixed here.

use glam::{DAffine3, DMat3, DVec3};
use resample_core::{Camera, SelectMode};
use resample_tests::twins::march::optical_depths;
use resample_tests::twins::rays::RaySource;
use resample_tests::volumes::scenes::{
    coloured, full, grey, perspective, random_volume, render, volume, worst_difference,
};
use volsplat::{RenderOptions, Volume};

const MODES: [SelectMode; 4] = [
    SelectMode::Hybrid,
    SelectMode::Points,
    SelectMode::Splats,
    SelectMode::Ewa,
];

fn options(select: SelectMode, unit: f64) -> RenderOptions {
    RenderOptions {
        opacity_unit: Some(unit),
        ..full(select)
    }
}

#[test]
fn other_units_of_length_are_the_same_picture() {
    let grid = DAffine3::from_scale(DVec3::new(1.0, 0.8, 1.7));
    let (eye, target) = (DVec3::new(12.0, 9.0, -11.0), DVec3::new(2.5, 2.5, 6.0));
    for select in MODES {
        let picture = |scale: f64| {
            let volume = random_volume([6, 7, 8], DAffine3::from_scale(DVec3::splat(scale)) * grid);
            let camera = perspective(scale * eye, scale * target, 60.0, [40, 30]);
            // A sheet of points is as thick as the smallest spacing and so scales with the world.
            render(&volume, &coloured(0.3), &options(select, scale), &camera)
        };
        let unit = picture(1.0);
        for scale in [0.5, 2.0, 1024.0, 2f64.powi(-20)] {
            let difference = worst_difference(&unit, &picture(scale));
            println!("{select:?}, scale {scale:e}: {difference:.1e}");
            assert!(
                difference < 1e-5,
                "{select:?}: a scale of {scale} changes the picture by {difference}"
            );
        }
    }
}

/// Axes in another order and direction: the same voxels in the same places. Few voxels a tile, so that no depths tie.
#[test]
fn another_order_of_storage_is_the_same_picture() {
    let dims = [3, 4, 5];
    let grid = DAffine3::from_scale(DVec3::new(1.0, 0.8, 1.7));
    let original = random_volume(dims, grid);
    // Stored index (a, b, c) is the original's (4 - c is z, a is y, b is x).
    let original_from_stored = DAffine3::from_mat3_translation(
        DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::NEG_Z),
        DVec3::new(0.0, 0.0, 4.0),
    );
    let stored = volume([4, 3, 5], grid * original_from_stored, |at| {
        let [x, y, z] = original_from_stored
            .transform_point3(at)
            .to_array()
            .map(|c| c as usize);
        original.value((z * dims[1] + y) * dims[0] + x)
    });
    let camera = perspective(
        DVec3::new(7.1, 5.3, -8.2),
        DVec3::new(1.1, 1.2, 3.3),
        50.0,
        [40, 30],
    );
    for select in MODES {
        let [a, b] =
            [&original, &stored].map(|v| render(v, &coloured(0.3), &options(select, 1.0), &camera));
        let difference = worst_difference(&a, &b);
        println!("{select:?}, another order of storage: {difference:.1e}");
        assert!(
            difference < 1e-5,
            "{select:?}: the order of storage changes the picture by {difference}"
        );
    }
}

/// Extinction per world unit of a smooth cloud in a box of 24.
fn cloud(at: DVec3) -> f64 {
    let blob =
        |centre: DVec3, sigma: f64| (-0.5 * at.distance_squared(centre) / (sigma * sigma)).exp();
    0.12 * blob(DVec3::new(9.0, 11.0, 10.0), 4.0) + 0.2 * blob(DVec3::new(15.0, 13.0, 14.0), 3.0)
}

/// The cloud sampled at this spacing; value = opacity over one world unit.
fn sampled(spacing: DVec3) -> Volume {
    let dims = (DVec3::splat(24.0) / spacing)
        .to_array()
        .map(|n| n as usize + 1);
    volume(dims, DAffine3::from_scale(spacing), |index| {
        1.0 - (-cloud(index * spacing)).exp()
    })
}

/// Optical depth of the cloud itself along each pixel's ray, by small steps in the world.
fn true_depths(camera: &Camera) -> Vec<f64> {
    let rays = RaySource::new(camera, &DAffine3::IDENTITY);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let along = |i: usize| {
        let ray = rays.pixel(i % width, i / width);
        let dz = 0.02;
        let steps = (0..4000).map(|k| (f64::from(k) + 0.5) * dz);
        steps
            .map(|z| cloud(ray.origin + z * ray.direction))
            .sum::<f64>()
            * dz
            * ray.world_per_z
    };
    (0..width * height).map(along).collect()
}

/// Twice the voxels along z change nothing but the error of reconstruction, which is measured against the cloud itself.
#[test]
fn twice_the_voxels_along_an_axis_are_the_same_picture() {
    let camera = perspective(
        DVec3::new(38.0, 25.0, -19.0),
        DVec3::splat(12.0),
        40.0,
        [32, 32],
    );
    let truth = true_depths(&camera);
    for select in [SelectMode::Splats, SelectMode::Hybrid, SelectMode::Ewa] {
        let pictures = [1.0, 0.5].map(|z| {
            let options = options(select, 1.0);
            render(
                &sampled(DVec3::new(1.0, 1.0, z)),
                &grey(1.0),
                &options,
                &camera,
            )
        });
        let [coarse, fine] = pictures.each_ref().map(|picture| {
            let errors = picture
                .rgba
                .iter()
                .zip(&truth)
                .map(|(p, d)| (1.0 - f64::from(p[3]) - (-d).exp()).abs());
            errors.fold(0.0, f64::max)
        });
        let difference = worst_difference(&pictures[0], &pictures[1]);
        println!(
            "{select:?}: error {coarse:.2e} coarse, {fine:.2e} fine; they differ by {difference:.2e}"
        );
        // The kernel's variance of 0.3 blurs blobs of variance 9 and 16 by 2 to 3 % of their optical depth.
        assert!(
            coarse < 0.02 && fine < 0.02,
            "{select:?}: errors {coarse} and {fine}"
        );
        assert!(
            difference < 0.01,
            "{select:?}: the finer volume is another picture by {difference}"
        );
    }
    let least = truth.iter().map(|d| (-d).exp()).fold(1.0, f64::min);
    assert!(
        least < 0.4,
        "the cloud is too faint to test anything: {least}"
    );
}

/// The march agrees with the cloud too, so that both references are about the same thing.
#[test]
fn the_rebuilt_field_is_near_the_cloud() {
    let camera = perspective(
        DVec3::new(38.0, 25.0, -19.0),
        DVec3::splat(12.0),
        40.0,
        [12, 12],
    );
    let volume = sampled(DVec3::new(1.0, 1.0, 0.5));
    let field = resample_tests::twins::field::Field::new(
        &volume,
        &grey(1.0),
        resample_core::KernelShape::Gaussian,
    );
    let marched = optical_depths(&field, &camera, 1.0, 0.05);
    let worst = marched
        .iter()
        .zip(true_depths(&camera))
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    println!("rebuilt field against the cloud: {worst:.2e} of optical depth");
    assert!(worst < 0.05, "the rebuilt field is off by {worst}");
}
