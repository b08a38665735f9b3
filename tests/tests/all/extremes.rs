//! Extreme inputs (method, section 8). The table of [`resample_tests::extremes`] bounds errors of pictures; this file tests other
//! properties: emptiness, early termination and refusals. Values of opacity at their extremes are in `extreme_opacities.rs`.

use glam::{DAffine3, DVec3};
use resample_core::{Camera, KernelShape, SelectMode};
use resample_tests::choices::with_samples;
use resample_tests::extremes;
use resample_tests::volumes::scenes::{
    coloured, full, grey, orthographic, perspective, random_volume, render, single_voxel, volume,
};
use volsplat::{DepthPlane, RenderOptions, Renderer, Volume};

#[test]
fn every_row_of_the_table_is_within_its_bound() {
    // One of 1000 samples: the whole table takes minutes in a build with checks.
    let rows = extremes::rows(1000);
    let beyond: String = rows
        .iter()
        .filter(|row| !row.holds())
        .map(|row| row.line())
        .collect();
    assert!(beyond.is_empty(), "{beyond}");
    assert!(rows.len() > 150, "{} rows", rows.len());
}

#[test]
fn a_camera_that_looks_away_sees_nothing() {
    let volume = random_volume([8, 8, 8], DAffine3::IDENTITY);
    let eye = DVec3::new(20.0, 3.0, 4.0);
    for select in [SelectMode::Hybrid, SelectMode::Ewa] {
        let options = RenderOptions {
            depth: DepthPlane::Expected,
            ..full(select)
        };
        let image = render(
            &volume,
            &grey(0.5),
            &options,
            &perspective(eye, 2.0 * eye, 60.0, [20, 20]),
        );
        assert!(
            image.rgba.iter().all(|p| *p == [0.0; 4]),
            "{select:?}: something is seen behind the eye"
        );
        let depth = image.depth.expect("a depth plane was asked for");
        assert!(
            depth.iter().all(|d| *d == f32::INFINITY),
            "{select:?}: nothing has a depth"
        );
    }
}

/// Sheets of points too thin to be numbered in f32 are still seen.
#[test]
fn sheets_of_no_thickness() {
    let volume = random_volume([3, 3, 5], DAffine3::IDENTITY);
    let eye = DVec3::new(3.1, 2.9, -9.0);
    for camera in [
        orthographic(eye, DVec3::ONE, 8.0, [24, 24]),
        perspective(eye, DVec3::ONE, 40.0, [24, 24]),
    ] {
        for sheet_voxels in [1e-300, 1e-30, 1e300] {
            let options = with_samples(full(SelectMode::Points), |samples| {
                samples.sheet_voxels = sheet_voxels
            });
            let image = render(&volume, &coloured(0.6), &options, &camera);
            let seen = image.rgba.iter().any(|p| p[3] > 0.1);
            assert!(
                seen,
                "{:?}: nothing is seen in sheets of {sheet_voxels:e}",
                camera.projection
            );
        }
    }
}

/// Section 4: a pixel left at transmittance T changes by at most T.
#[test]
fn an_early_end_changes_no_pixel_by_more_than_its_bound() {
    let volume = random_volume([16, 16, 16], DAffine3::IDENTITY);
    let camera = perspective(
        DVec3::new(26.0, 21.0, -17.0),
        DVec3::splat(7.5),
        45.0,
        [48, 48],
    );
    for select in [SelectMode::Splats, SelectMode::Hybrid] {
        let picture = |min_transmittance| {
            let options = RenderOptions {
                min_transmittance,
                ..full(select)
            };
            render(&volume, &coloured(0.5), &options, &camera)
        };
        let whole = picture(0.0);
        for bound in [1.0 / 512.0, 0.05, 0.5, 0.99] {
            let difference =
                resample_tests::volumes::scenes::worst_difference(&whole, &picture(bound));
            println!("{select:?}, end at {bound}: {difference:.1e}");
            assert!(
                difference <= f64::from(bound),
                "{select:?}: {difference}, more than {bound}"
            );
            assert!(
                bound < 0.5 || difference > 0.0,
                "{select:?}: {bound} ended nothing early"
            );
        }
    }
}

/// One clear error before any work.
#[test]
fn numbers_that_are_none_are_refused() {
    let voxel = single_voxel(DVec3::ZERO);
    let good = perspective(DVec3::splat(5.0), DVec3::ZERO, 40.0, [8, 8]);
    let mut renderer =
        Renderer::new(&voxel, &grey(0.5), &RenderOptions::paper()).expect("valid options");
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let error = renderer
            .render(&Camera { fx: bad, ..good })
            .expect_err("a camera with a bad focal length");
        assert!(
            error.to_string().contains("fx"),
            "the error does not name fx: {error}"
        );
        let options = RenderOptions {
            opacity_unit: Some(bad),
            ..RenderOptions::paper()
        };
        assert!(
            Renderer::new(&voxel, &grey(0.5), &options).is_err(),
            "an opacity unit of {bad}"
        );
    }
    let nan = Volume::new(
        [1, 1, 1],
        volsplat::Voxels::F32(vec![f32::NAN]),
        DAffine3::IDENTITY,
    );
    assert!(nan.is_err(), "a voxel that is not a number must be refused");
    let denormal = volume([2, 2, 2], DAffine3::IDENTITY, |_| f64::MIN_POSITIVE / 4.0);
    render(&denormal, &grey(1.0), &full(SelectMode::Splats), &good);
    for shape in KernelShape::ALL {
        let options = with_samples(full(SelectMode::Splats), |samples| samples.kernel = shape);
        render(&voxel, &grey(1.0), &options, &good);
    }
}
