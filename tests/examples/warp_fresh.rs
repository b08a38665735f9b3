//! Warps analytic scenes that no setting was chosen on, and prints error, flicker and displaced edges as tables.
//!
//! `cargo run --release -p resample-tests --example warp_fresh`. Beside the methods of this project stands the strongest
//! simple warper: depth forward, colour backward by a cubic. Flicker is how much the error of a pixel changes from one of
//! 16 sub-pixel steps of the camera to the next, mean over what is seen throughout, in thousandths. Fattening is by how
//! much each edge of a card before a wall is shown too far out, px.

use glam::DVec3;
use resample_core::{Camera, Image};
use resample_tests::warps::filtered::{filtered_scene, forward_backward, fresh_scenes};
use resample_tests::warps::measure::measure;
use resample_tests::warps::scenes::{AnalyticScene, Body, camera};
use resample_tests::warps::truth::WarpScene;
use warp3d::{Method, Reference, WarpOptions, Warper};

/// Sub-pixel steps of the camera.
const STEPS: usize = 16;

fn main() {
    println!("| scene | figure | {} |", names().join(" | "));
    println!("|---|---|{}", "---|".repeat(names().len()));
    for scene in fresh_scenes() {
        let figures = pictures(&scene).map(|image| measure(&image, &scene.truth));
        let row = |what: &str, of: &dyn Fn(usize) -> String| {
            let cells: Vec<String> = (0..figures.len()).map(of).collect();
            println!("| {} | {what} | {} |", scene.name, cells.join(" | "));
        };
        row("PSNR", &|i| format!("{:.1}", figures[i].psnr_db));
        row("interior", &|i| format!("{:.1}", figures[i].interior_db));
        row("edge band", &|i| format!("{:.1}", figures[i].edge_db));
        row("holes %", &|i| format!("{:.3}", figures[i].holes_percent));
        row("false fill %", &|i| {
            format!("{:.2}", figures[i].false_fill_percent)
        });
    }
    for (name, from, to) in [("1:1", 1.0, 1.0), ("minified 4x", 4.0, 1.0)] {
        let figures: Vec<String> = flicker(from, to)
            .iter()
            .map(|v| format!("{v:.1}"))
            .collect();
        println!(
            "| {name} | flicker, thousandths | {} |",
            figures.join(" | ")
        );
    }
    for (name, scale) in [("unit scale", 1.0), ("magnified 4x", 4.0)] {
        let figures: Vec<String> = fattening(scale)
            .iter()
            .map(|v| format!("{v:+.2}"))
            .collect();
        println!("| {name} | fattening, px | {} |", figures.join(" | "));
    }
}

fn settings() -> [WarpOptions; 4] {
    let of = WarpOptions::with_method;
    [
        of(Method::NEAREST),
        of(Method::POINTS),
        of(Method::SPLATS),
        WarpOptions::default(),
    ]
}

fn names() -> [&'static str; 5] {
    [
        "depth forward, cubic back",
        "nearest",
        "points",
        "splats",
        "hybrid",
    ]
}

fn pictures(scene: &WarpScene) -> [Image; 5] {
    let warp = |options: &WarpOptions| warped(&scene.reference, &scene.target, options);
    let mut images = settings().iter().map(warp).collect::<Vec<_>>();
    images.insert(0, forward_backward(&scene.reference, &scene.target));
    images.try_into().expect("one picture a name")
}

fn warped(reference: &Reference, target: &Camera, options: &WarpOptions) -> Image {
    let mut warper = Warper::new(vec![reference.clone()], options).expect("a good reference");
    warper.render(target).expect("a camera").image
}

/// Mean change of the error from step to step, thousandths.
fn flicker(from: f64, to: f64) -> [f64; 6] {
    let view = |scale: f64, eye: DVec3| {
        camera(
            [(160.0 * scale) as u32, (120.0 * scale) as u32],
            130.0 * scale,
            eye,
            0.0,
        )
    };
    let start = view(from, DVec3::ZERO);
    let room = AnalyticScene::room();
    // A sixteenth of a pixel a step at the ball.
    let eye = |step: usize| DVec3::X * (0.1 + step as f64 * 5.0 / 130.0 / STEPS as f64);
    let scenes: Vec<WarpScene> = (0..STEPS)
        .map(|s| filtered_scene("step", &room, &start, &view(to, eye(s))))
        .collect();
    let frames: Vec<[Image; 5]> = scenes.iter().map(pictures).collect();
    let visible: Vec<Vec<bool>> = scenes.iter().map(|scene| scene.truth.visible()).collect();
    let seen: Vec<usize> = (0..160 * 120)
        .filter(|&i| visible.iter().all(|v| v[i]))
        .collect();
    std::array::from_fn(|k| {
        let error = |step: usize, i: usize, c: usize| {
            let pixel = frames[step][k].rgba[i];
            let shown = if pixel[3] > 0.25 {
                pixel[c] / pixel[3]
            } else {
                0.0
            };
            f64::from(shown - scenes[step].truth.image.rgba[i][c])
        };
        let change = |step: usize| {
            let sum = |i: &usize| {
                (0..3)
                    .map(|c| (error(step, *i, c) - error(step - 1, *i, c)).abs())
                    .sum::<f64>()
            };
            seen.iter().map(sum).sum::<f64>()
        };
        1e3 * (1..STEPS).map(change).sum::<f64>() / (3 * seen.len() * (STEPS - 1)) as f64
    })
}

/// By how much each of the two upright edges of a card is shown too far out, px of the new picture.
fn fattening(scale: f64) -> [f64; 5] {
    const HALF: f64 = 0.7;
    const TILT: f64 = 0.05;
    // One colour each: what is shown of the card is how red a row is.
    let flat = 1e9;
    let turned = |x: f64, y: f64| {
        DVec3::new(
            x * TILT.cos() - y * TILT.sin(),
            x * TILT.sin() + y * TILT.cos(),
            0.0,
        )
    };
    let scene = AnalyticScene(vec![
        (
            Body::Card(DVec3::Z * 4.0, turned(HALF, 0.0), turned(0.0, 6.0)),
            flat,
            [1.0, 0.0, 0.0],
        ),
        (
            Body::Card(DVec3::Z * 9.0, DVec3::X * 30.0, DVec3::Y * 30.0),
            flat,
            [0.0, 0.0, 1.0],
        ),
    ]);
    let size = [320, 240];
    let small = [(320.0 / scale) as u32, (240.0 / scale) as u32];
    let from = camera(small, 260.0 / scale, DVec3::ZERO, 0.0);
    let to = camera(size, 260.0, DVec3::X * 0.13, 0.0);
    let pictures = pictures(&filtered_scene("card", &scene, &from, &to));
    let width_px = 260.0 * 2.0 * HALF / TILT.cos() / 4.0;
    pictures.map(|image| {
        let rows = 60..180;
        // Light of the card is 0.6 of its tint.
        let red = |y: usize| {
            (0..320)
                .map(|x| f64::from(image.pixel(x, y)[0]) / 0.6)
                .sum::<f64>()
        };
        let count = rows.len() as f64;
        0.5 * (rows.map(red).sum::<f64>() / count - width_px)
    })
}
