//! Prints what goes wrong at the edges of depth images: colours out of the reference's range, rims shown too far out,
//! known pixels that do not come back.
//!
//! `cargo run --release -p resample-tests --example warp_edges`. Scenes with ray-traced truth are left out where the test
//! data is absent.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::warps::edges::{
    changed_at_home, out_of_range, rim_fill_percent, turned, with_unknown,
};
use resample_tests::warps::filtered::{filtered_scene, fresh_scenes};
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::truth::{SCENES, WarpScene};
use warp3d::{Reference, WarpOptions, Warper};

fn main() {
    let mut scenes: Vec<WarpScene> = fresh_scenes();
    scenes.push(turned());
    scenes.extend(
        SCENES
            .into_iter()
            .filter_map(|name| WarpScene::load("warp_edges", name)),
    );
    println!("| scene | PSNR | edge band | out of range | rim fill % | holes % |");
    println!("|---|---|---|---|---|---|");
    for scene in &scenes {
        let image = warped(&scene.reference, &scene.target);
        let figures = measure(&image, &scene.truth);
        println!(
            "| {} | {:.1} | {:.1} | {:.3} | {:.1} | {:.3} |",
            scene.name,
            figures.psnr_db,
            figures.edge_db,
            out_of_range(&image, &scene.reference),
            rim_fill_percent(&image, &scene.truth),
            figures.holes_percent,
        );
    }
    let home = camera([320, 240], 260.0, DVec3::ZERO, 0.0);
    let scene = filtered_scene("home", &AnalyticScene::room(), &home, &home);
    for (name, reference) in with_unknown(&scene.reference) {
        let change = changed_at_home(&warped(&reference, &home), &reference);
        println!("{name}: {change:?}");
    }
}

fn warped(reference: &Reference, target: &Camera) -> Image {
    let options = WarpOptions::default();
    let mut warper = Warper::new(vec![reference.clone()], &options).expect("a good reference");
    warper.render(target).expect("a camera").image
}
