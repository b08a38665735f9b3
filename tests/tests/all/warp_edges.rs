//! Edges of depth images: colours stay in the reference's range, known pixels come back, and holes beyond the frame go on
//! from the nearest pixels.

use glam::DVec3;
use resample_core::Image;
use resample_tests::warps::edges::{changed_at_home, out_of_range, turned, with_unknown};
use resample_tests::warps::filtered::{filtered_scene, fresh_scenes};
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::truth::WarpScene;
use warp3d::{Fill, Reference, WarpOptions, Warper};

fn warped(scene: &WarpScene, options: &WarpOptions) -> Image {
    let mut warper = Warper::new(vec![scene.reference.clone()], options).expect("a good reference");
    warper.render(&scene.target).expect("a camera").image
}

#[test]
fn unmixing_invents_no_colours() {
    let mut scenes = fresh_scenes();
    scenes.retain(|scene| ["stereo", "6dof", "mag4", "mag8"].contains(&scene.name.as_str()));
    scenes.push(turned());
    // Ray-traced, where there is test data: its limb had colours out of range by 0.89.
    scenes.extend(WarpScene::load("warp_edges", "sphere"));
    for scene in &scenes {
        let image = warped(scene, &WarpOptions::default());
        let worst = out_of_range(&image, &scene.reference);
        let psnr_db = measure(&image, &scene.truth).psnr_db;
        println!("{}: out of range {worst:.3}, {psnr_db:.2} dB", scene.name);
        // The spline through samples of full contrast overshoots by as much.
        assert!(worst < 0.06, "{}: {worst}", scene.name);
        if scene.name.starts_with("mag") {
            assert!(worst < 0.02, "{}: {worst}", scene.name);
        }
    }
}

#[test]
fn a_limb_seen_from_aside_is_as_smooth_as_the_body() {
    // Where each row ended at its last sample, the ball ended in teeth of ten pixels: 35.1 dB near edges, 37.7 dB where more
    // than half is seen.
    let scene = turned();
    let figures = measure(&warped(&scene, &WarpOptions::default()), &scene.truth);
    println!("{figures:?}");
    assert!(figures.edge_db > 36.5, "{figures:?}");
    assert!(figures.half_seen_db > 39.9, "{figures:?}");
    assert!(figures.holes_percent < 0.03, "{figures:?}");
}

#[test]
fn known_pixels_come_back_beside_unknown_depth() {
    let home = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let scene = filtered_scene("home", &AnalyticScene::room(), &home, &home);
    for (name, reference) in with_unknown(&scene.reference) {
        let mut warper = Warper::new(vec![reference.clone()], &WarpOptions::default())
            .expect("a good reference");
        let image = warper.render(&home).expect("a camera").image;
        let change = changed_at_home(&image, &reference);
        assert_eq!(change.transparent_percent, 0.0, "{name}: {change:?}");
        assert!(change.largest < 1e-6, "{name}: {change:?}");
    }
}

/// A wall of two colours, the upper half red and the lower half blue, that fills the view.
fn two_colours() -> Reference {
    let camera = camera([160, 120], 130.0, DVec3::ZERO, 0.0);
    let rows = (0..120).flat_map(|y| {
        let rgb = if y < 60 {
            [0.8, 0.1, 0.1]
        } else {
            [0.1, 0.1, 0.8]
        };
        std::iter::repeat_n(rgb, 160)
    });
    Reference {
        camera,
        colour: rows.collect(),
        depth: vec![4.0; 160 * 120],
    }
}

#[test]
fn what_lies_beyond_the_frame_goes_on_from_the_nearest_pixels() {
    let reference = two_colours();
    let to = camera([160, 120], 130.0, DVec3::X * 1.5, 0.0);
    for fill in [Fill::Background, Fill::Natural] {
        let options = WarpOptions {
            fill,
            ..WarpOptions::default()
        };
        let mut warper = Warper::new(vec![reference.clone()], &options).expect("a good reference");
        let image = warper.render(&to).expect("a camera").image;
        for (x, y) in (115..160).flat_map(|x| (0..120).map(move |y| (x, y))) {
            let [red, _, blue, alpha] = image.pixel(x, y);
            assert_eq!(alpha, 1.0, "{fill:?}: {x}, {y}");
            // The disc at the far border has a radius of 54 pixels: nearer to the change it shows both.
            let own = if y < 60 { red } else { blue };
            let away = if y < 60 { 59 - y } else { y - 60 };
            let clear = 1.2 * (x as f32 - 110.0) < away as f32;
            assert!(own >= 0.4, "{fill:?}: {x}, {y}: {own}");
            assert!(!clear || own > 0.799, "{fill:?}: {x}, {y}: {own}");
        }
    }
}
