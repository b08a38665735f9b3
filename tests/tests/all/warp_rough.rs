//! Depth with gaps and with noise: pictures keep their surfaces, and frames cost about what they cost on whole depth.

use glam::DVec3;
use resample_tests::warps::filtered::filtered_scene;
use resample_tests::warps::measure::{WarpFigures, measure};
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::truth::WarpScene;
use warp3d::{WarpOptions, Warper};

fn room() -> WarpScene {
    let from = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let to = camera([320, 240], 260.0, DVec3::X * 0.25, 0.0);
    filtered_scene("room", &AnalyticScene::room(), &from, &to)
}

/// Uniform numbers from 0 to 1.
fn uniform() -> impl FnMut() -> f32 {
    let mut state = 1u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// The figures of the picture and its edge pixels.
fn warped(scene: &WarpScene) -> (WarpFigures, u64) {
    let warper = Warper::new(vec![scene.reference.clone()], &WarpOptions::default());
    let frame = warper
        .expect("good")
        .render(&scene.target)
        .expect("a camera");
    let figures = measure(&frame.image, &scene.truth);
    println!(
        "{:.1} dB, holes {:.2} %, false fill {:.2} %, edge pixels {}",
        figures.psnr_db, figures.holes_percent, figures.false_fill_percent, frame.stats.edge_pixels
    );
    (figures, frame.stats.edge_pixels)
}

#[test]
fn single_missing_samples_open_no_holes() {
    let mut scene = room();
    let (whole, edges) = warped(&scene);
    let mut random = uniform();
    for z in &mut scene.reference.depth {
        if random() < 0.1 {
            *z = f32::NAN;
        }
    }
    let (found, found_edges) = warped(&scene);
    // Before gaps were bridged: most pixels were at edges, and holes were everywhere.
    assert!(found.psnr_db > 40.0 && found.psnr_db < whole.psnr_db + 0.1);
    assert!(found.holes_percent < 0.05, "{} %", found.holes_percent);
    assert!(found.false_fill_percent <= whole.false_fill_percent);
    assert!(found_edges < 2 * edges, "{found_edges} of {edges}");
}

#[test]
fn noise_cuts_no_surface() {
    let mut scene = room();
    let (_, edges) = warped(&scene);
    let mut random = uniform();
    for z in &mut scene.reference.depth {
        let normal = (0..12).map(|_| random()).sum::<f32>() - 6.0;
        *z *= 1.0 + 0.01 * normal;
    }
    let (found, found_edges) = warped(&scene);
    assert!(found.holes_percent < 0.05, "{} %", found.holes_percent);
    assert!(found_edges < 2 * edges, "{found_edges} of {edges}");
}
