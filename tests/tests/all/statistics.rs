//! The greatest, the least and the mean scalar of a ray against their f64 reference.

use glam::{DAffine3, DVec3};
use resample_core::Camera;
use resample_tests::choices::with_field;
use resample_tests::twins::samples::Scene;
use resample_tests::twins::statistic::render as reference;
use resample_tests::volumes::scenes::{
    coloured, orthographic, perspective, random_volume, render, sheared_grid, transfer, volume,
};
use volsplat::{Blend, Clip, RenderOptions, Renderer, Subpixels, TransferFunction, Volume};

const DIMS: [usize; 3] = [20, 17, 25];

/// Rounding of f32 sums, beside what the reference admits.
const ROUNDING: f64 = 1e-5;

fn options(blend: Blend, subpixels: u32) -> RenderOptions {
    with_field(
        RenderOptions {
            subpixels: Subpixels::Fixed(subpixels),
            ..RenderOptions::default()
        },
        |field| field.blend = blend,
    )
}

fn cameras(grid: DAffine3) -> [Camera; 2] {
    let end = DVec3::from(DIMS.map(|n| (n - 1) as f64));
    let (target, size) = (
        grid.transform_point3(0.5 * end),
        (grid.matrix3 * end).length(),
    );
    let eye = target + size * DVec3::new(0.9, 0.55, -1.0);
    [
        perspective(eye, target, 40.0, [24, 20]),
        orthographic(eye, target, 0.9 * size, [24, 20]),
    ]
}

fn hold(
    name: &str,
    (volume, look): (&Volume, &TransferFunction),
    camera: &Camera,
    options: &RenderOptions,
) {
    let truth = reference(&Scene {
        volume,
        transfer: look,
        camera,
        options,
    });
    let image = render(volume, look, options, camera);
    let (mut beyond, mut wide, mut seen) = (0.0f64, 0.0f64, 0);
    for (got, [low, high]) in image.rgba.iter().zip(&truth) {
        for k in 0..4 {
            let got = f64::from(got[k]);
            beyond = beyond.max(low[k] - got).max(got - high[k]);
            wide = wide.max(high[k] - low[k]);
        }
        seen += usize::from(low[3] > 0.01);
    }
    println!("{name}: {beyond:.1e} outside of intervals up to {wide:.1e} wide; {seen} px seen");
    assert!(
        seen > 20,
        "{name}: next to nothing is seen, so nothing is tested"
    );
    assert!(
        beyond < ROUNDING,
        "{name}: {beyond:.1e} outside of what is admitted"
    );
}

#[test]
fn against_the_reference() {
    let crop = Clip {
        crop_in_grid: Some([DVec3::new(2.3, 1.2, 3.4), DVec3::new(14.1, 20.0, 19.7)]),
        ..Clip::default()
    };
    for grid in [
        DAffine3::IDENTITY,
        sheared_grid(),
        DAffine3::from_translation(DVec3::splat(1e7)),
    ] {
        let volume = random_volume(DIMS, grid);
        for camera in &cameras(grid) {
            for blend in [Blend::Maximum, Blend::Minimum, Blend::Average] {
                for subpixels in [1, 2] {
                    let options = options(blend, subpixels);
                    let name =
                        format!("{blend:?}, {:?}, {subpixels} sub-pixels", camera.projection);
                    hold(&name, (&volume, &coloured(0.9)), camera, &options);
                }
                let options = RenderOptions {
                    clip: crop.clone(),
                    ..options(blend, 1)
                };
                hold(
                    &format!("{blend:?}, cropped"),
                    (&volume, &coloured(0.9)),
                    camera,
                    &options,
                );
            }
        }
    }
}

/// The statistic is that of the whole volume, whatever the transfer function shows.
#[test]
fn what_the_transfer_function_hides_counts() {
    let field = volume(DIMS, DAffine3::IDENTITY, |p| p.x);
    let band = transfer(&[(0.0, [1.0; 3])], &[(9.0, 0.0), (9.5, 0.5), (10.0, 0.0)]);
    let camera = perspective(
        DVec3::new(9.5, 8.0, -60.0),
        DVec3::new(9.5, 8.0, 12.0),
        30.0,
        [40, 40],
    );
    let side = perspective(
        DVec3::new(-60.0, 8.0, 12.0),
        DVec3::new(9.5, 8.0, 12.0),
        30.0,
        [40, 40],
    );
    let mean = options(Blend::Average, 1);
    let alpha = |camera: &Camera| render(&field, &band, &mean, camera).rgba[20 * 40 + 20][3];
    assert!(
        alpha(&side) > 0.3,
        "the mean along x is 9.5, which is seen: {}",
        alpha(&side)
    );
    assert!(alpha(&camera) < 0.5, "along z the mean follows x");
    let greatest = options(Blend::Maximum, 1);
    let most = render(&field, &band, &greatest, &side).rgba[20 * 40 + 20][3];
    assert_eq!(most, 0.0, "the greatest is 19, which is not seen");
}

/// Bricks that cannot exceed what was met are passed over.
#[test]
fn bricks_that_change_nothing_are_passed_over() {
    let field = volume([64, 64, 64], DAffine3::IDENTITY, |p| {
        1.0 / (1.0 + 0.01 * (p - 32.0).length_squared())
    });
    let camera = perspective(
        DVec3::new(32.0, 32.0, -150.0),
        DVec3::splat(32.0),
        30.0,
        [64, 64],
    );
    let touched = |blend| {
        let mut renderer =
            Renderer::new(&field, &coloured(0.9), &options(blend, 1)).expect("valid options");
        renderer.render(&camera).expect("a valid camera").stats
    };
    let (greatest, mean) = (touched(Blend::Maximum), touched(Blend::Average));
    println!(
        "{} of {} pairs are passed over",
        greatest.hidden_pairs, greatest.tile_pairs
    );
    assert_eq!(mean.hidden_pairs, 0, "the mean looks at all");
    assert!(
        greatest.hidden_pairs * 5 > greatest.tile_pairs,
        "a fifth at least is passed over"
    );
}

#[test]
fn extremes_are_sound() {
    let (huge, tiny) = (|_| 1e30, |p: DVec3| 1e-30 * p.x);
    for value in [&huge as &dyn Fn(DVec3) -> f64, &tiny] {
        let field = volume(
            [2, 3, 9],
            DAffine3::from_scale(DVec3::new(1e-3, 1.0, 30.0)),
            value,
        );
        let camera = perspective(
            DVec3::new(3.0, 4.0, -500.0),
            DVec3::new(0.0, 1.0, 100.0),
            60.0,
            [20, 20],
        );
        for blend in [Blend::Maximum, Blend::Minimum, Blend::Average] {
            render(&field, &coloured(1.0), &options(blend, 4), &camera);
        }
    }
}
