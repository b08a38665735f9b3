//! Soft depth: maps that were blurred, enlarged or packed with loss are shown without sheets between surfaces.

use glam::DVec3;
use resample_core::Image;
use resample_tests::warps::filtered::{filtered_scene, forward_backward};
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::soft::{Numbers, Softening, softened};
use resample_tests::warps::truth::WarpScene;
use warp3d::{Method, Reference, WarpOptions, Warper};

/// A step to the right so wide that the card uncovers many pixels of the wall.
fn scene() -> WarpScene {
    let from = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let to = camera([320, 240], 260.0, DVec3::X * 0.5, 0.0);
    filtered_scene("stereo", &AnalyticScene::room(), &from, &to)
}

fn warped(reference: &Reference, scene: &WarpScene, method: Method) -> Image {
    let options = WarpOptions::with_method(method);
    let mut warper = Warper::new(vec![reference.clone()], &options).expect("a good reference");
    warper.render(&scene.target).expect("a camera").image
}

#[test]
fn soft_edges_are_no_rubber_sheets() {
    let scene = scene();
    let all = [0.5, 0.8, 1.2, 2.0, 3.0]
        .map(Softening::Blurred)
        .into_iter()
        .chain([2, 4].map(Softening::Linear))
        .chain([Softening::Cubic(4), Softening::Jpeg(95.0)]);
    for softening in all {
        for numbers in [Numbers::Z, Numbers::Inverse] {
            let reference = softened(&scene.reference, numbers, softening);
            let shown = warped(&reference, &scene, Method::HYBRID);
            let hybrid = measure(&shown, &scene.truth);
            let others = [
                forward_backward(&reference, &scene.target),
                warped(&reference, &scene, Method::NEAREST),
            ];
            let best = others
                .map(|image| measure(&image, &scene.truth).psnr_db)
                .into_iter()
                .fold(0.0, f64::max);
            let (fill, holes) = (hybrid.false_fill_percent, hybrid.holes_percent);
            println!(
                "{softening:?} in {numbers:?}: {:.1} dB (simple {best:.1}), false fill {fill:.1} %, holes {holes:.2} %",
                hybrid.psnr_db
            );
            let what = format!("{softening:?} in {numbers:?}");
            assert!(fill <= 5.0, "{what}: {fill} % false fill");
            assert!(holes <= 0.5, "{what}: {holes} % holes");
            assert!(hybrid.psnr_db >= best, "{what}: {} dB", hybrid.psnr_db);
        }
    }
}
