//! Holds the methods to the truths of the texture comparison, where they are present.

use resample_core::Image;
use resample_core::metrics::{Mask, compare};
use resample_tests::meshes::texture_scenes::{TextureScene, TruthFilter};
use texmap::{Method, RenderOptions, Renderer};

/// The background of the truths, linear light.
const BACKGROUND: [f32; 3] = [0.5; 3];

#[test]
fn hybrid_is_six_decibels_above_every_single_sample_method() {
    // Best single-sample peer, and the row of 4 x 4 samples with a Gaussian, dB.
    let rows = [
        (TextureScene::CheckerPlane, 40.1, 44.4),
        (TextureScene::Siemens, 38.3, 56.3),
        (TextureScene::PhotoMinified, 44.4, 52.6),
        (TextureScene::Avocado, 38.6, 62.1),
    ];
    for (which, peer_db, bar_db) in rows {
        let name = which.name();
        let (Some(scene), Some(camera)) = (which.scene(name), which.camera(name)) else {
            continue;
        };
        let Some(truth) = which.truth(name, TruthFilter::Gaussian) else {
            continue;
        };
        // Over the pixels that the truth covers, and over those that it fills: our own backward methods share the
        // outlines, so that filters differ only inside them.
        let inside = truth.rgba.iter().map(|pixel| pixel[3] > 0.9999).collect();
        let inside = Mask::new(truth.width, truth.height, inside).expect("one flag a pixel");
        let against_truth = |method: Method, mask: &Mask| {
            let options = RenderOptions {
                method,
                ..RenderOptions::default()
            };
            let mut renderer =
                Renderer::new(&scene, &options).expect("options within their ranges");
            let image: Image = renderer.render(&camera).expect("a valid camera").image;
            let image = image.over_background(BACKGROUND);
            compare(&image, &truth, Some(mask))
                .expect("one size")
                .psnr_db
        };
        let hybrid = against_truth(Method::Hybrid, &Mask::from_alpha(&truth));
        println!("{name}: hybrid {hybrid:.1} dB");
        assert!(
            hybrid >= peer_db + 6.0 && hybrid >= bar_db,
            "{name}: hybrid is {hybrid:.1} dB"
        );
        let hybrid = against_truth(Method::Hybrid, &inside);
        for method in [
            Method::BackwardBilinear,
            Method::BackwardTrilinear,
            Method::BackwardEwa,
        ] {
            let backward = against_truth(method, &inside);
            assert!(
                hybrid >= backward + 6.0,
                "{name}: {method:?} {backward:.1} dB, hybrid {hybrid:.1} dB"
            );
        }
    }
}
