//! Culling what lies behind opaque pixels changes no pixel by more than its bound, in every order of compositing.
//!
//! A pixel left alone at transmittance T can change by at most T: what lies behind adds at most T of colour.

use glam::{DAffine3, DVec3};
use resample_core::SelectMode;
use resample_tests::choices::with_samples;
use resample_tests::volumes::lod_scenes::procedural;
use resample_tests::volumes::scenes::{
    coloured, perspective, random_volume, render, transfer, worst_difference,
};
use volsplat::{Cells, RenderOptions, Renderer};

#[test]
fn the_early_end_changes_no_pixel_by_more_than_its_bound() {
    let mut scenes: Vec<_> = procedural()
        .into_iter()
        .map(|s| (s.name, s.volume, s.transfer))
        .collect();
    scenes.push((
        "noise",
        random_volume([40, 37, 33], DAffine3::IDENTITY),
        coloured(0.4),
    ));
    for (name, volume, look) in &scenes {
        let extent = DVec3::from(volume.dims.map(|n| (n - 1) as f64));
        let middle = volume.world_from_index.transform_point3(0.5 * extent);
        let size = (volume.world_from_index.matrix3 * extent).length();
        let cameras = [(0.9, 48u32), (4.0, 32)].map(|(away, side)| {
            let eye = middle + away * size * DVec3::new(0.5, 0.4, -0.75);
            perspective(eye, middle, 40.0, [side; 2])
        });
        // Voxels as they are: the samples of cells go the same way, and are many.
        let voxels = |options| with_samples(options, |samples| samples.cells = Cells::Off);
        for options in [
            RenderOptions::default(),
            voxels(RenderOptions::every_sample()),
            voxels(RenderOptions::axis_sheets()),
            voxels(RenderOptions::kernel_sheets()),
        ] {
            let pictures = |min_transmittance| {
                let options = RenderOptions {
                    min_transmittance,
                    ..options.clone()
                };
                let mut renderer = Renderer::new(volume, look, &options).expect("valid options");
                cameras.map(|camera| renderer.render(&camera).expect("a picture").image)
            };
            let whole = pictures(0.0);
            for bound in [1.0 / 512.0, 0.05] {
                for (early, whole) in pictures(bound).iter().zip(&whole) {
                    let worst = worst_difference(early, whole);
                    // Sums of f32 in another order, beside the bound.
                    let most = f64::from(bound) + 1e-5;
                    assert!(
                        worst <= most,
                        "{name}, {:?}: {worst}, bound {bound}",
                        options.order
                    );
                }
            }
        }
    }
}

/// More samples than one batch holds, so that what lies behind opaque tiles is never projected.
#[test]
fn hidden_bricks_and_samples_are_never_projected_and_missed_by_none() {
    let volume = volsplat::procedural::checker_box(80, 10).expect("a good size");
    let (low, high) = volsplat::Described::value_range(&volume);
    let look = transfer(
        &[(low, [0.2, 0.5, 0.9]), (high, [1.0, 0.8, 0.3])],
        &[(low, 0.9), (high, 0.9)],
    );
    let middle = volume.world_from_index.transform_point3(DVec3::splat(39.5));
    // Close enough for splats, far enough for points, and from a corner that is inside.
    let eyes = [(1.6, 90u32), (3.0, 150), (0.3, 70)];
    for (away, side) in eyes {
        let eye = middle + away * volume.smallest_spacing() * DVec3::new(50.0, 43.0, -62.0);
        let camera = perspective(eye, middle, 40.0, [side; 2]);
        for select in [SelectMode::Hybrid, SelectMode::Ewa] {
            let full = with_samples(
                RenderOptions {
                    min_transmittance: 0.0,
                    ..RenderOptions::paper()
                },
                |samples| samples.select = select,
            );
            let whole = render(&volume, &look, &full, &camera);
            let bound = 1.0 / 512.0;
            let early = RenderOptions {
                min_transmittance: bound,
                ..full
            };
            let mut renderer = Renderer::new(&volume, &look, &early).expect("valid options");
            let frame = renderer.render(&camera).expect("a valid camera");
            let worst = worst_difference(&frame.image, &whole);
            let stats = frame.stats;
            let name = format!("{select:?} at {away}");
            println!(
                "{name}: {} bricks and {} samples hidden, off by {worst:.1e}",
                stats.bricks_hidden, stats.hidden
            );
            assert!(
                worst <= f64::from(bound) + 1e-5,
                "{name}: a pixel changes by {worst}"
            );
            assert!(
                stats.hidden > 50_000,
                "{name}: hardly anything is hidden: {}",
                stats.hidden
            );
            assert!(
                select == SelectMode::Ewa || stats.bricks_hidden > 10,
                "{name}: no brick is hidden"
            );
            let told = stats.points + stats.splats + stats.culled + stats.hidden;
            assert_eq!(
                told,
                renderer.non_transparent(),
                "{name}: every sample is told of once"
            );
        }
    }
}

/// Batches are cut without regard to threads.
#[test]
fn hiding_gives_the_same_bytes_on_any_number_of_threads() {
    let volume = volsplat::procedural::checker_box(64, 8).expect("a good size");
    let (low, high) = volsplat::Described::value_range(&volume);
    let look = transfer(
        &[(low, [0.2, 0.5, 0.9]), (high, [1.0, 0.8, 0.3])],
        &[(low, 0.7), (high, 0.9)],
    );
    let middle = volume.world_from_index.transform_point3(DVec3::splat(31.5));
    let eye = middle + volume.smallest_spacing() * DVec3::new(70.0, 60.0, -90.0);
    let camera = perspective(eye, middle, 40.0, [80; 2]);
    let images = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| render(&volume, &look, &RenderOptions::every_sample(), &camera))
    });
    assert!(
        images[0] == images[1],
        "the picture depends on the number of threads"
    );
}
