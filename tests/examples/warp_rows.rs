//! Error and time of a stereo pair's second view: drawn row by row, by the hybrid, and by the simple warper, as a table.
//!
//! `cargo run --release -p resample-tests --example warp_rows [-- FOLDER]`. A time is the least of five runs on
//! one thread, and includes the preparation of the picture. With FOLDER, pictures are written there. Pairs whose data is absent are left out.

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use resample_core::Image;
use resample_io::write::png::Depth;
use resample_io::write::{Format, write_picture};
use resample_tests::warps::films::{FilmScene, Network};
use resample_tests::warps::filtered::{filtered_scene, forward_backward};
use resample_tests::warps::measure::measure;
use resample_tests::warps::pairs::pair;
use resample_tests::warps::scenes::{AnalyticScene, camera};
use resample_tests::warps::soft::{Numbers, Softening, softened};
use resample_tests::warps::truth::WarpScene;
use warp3d::{Method, Reference, SurfaceTolerance, WarpOptions, Warper};

fn main() {
    let folder = std::env::args().nth(1);
    println!(
        "| pair | depth | depth forward, cubic back | hybrid | rows | edges: simple | hybrid | rows | false fill %: hybrid | rows | ms: hybrid | rows |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let cases = cases();
    let cases = cases.iter().flat_map(|(scene, depths)| {
        depths
            .iter()
            .map(move |(depth, reference)| (scene, *depth, reference))
    });
    for (scene, depth, reference) in cases {
        let simple = measure(&forward_backward(reference, &scene.target), &scene.truth);
        let tolerance = match depth {
            "network" => SurfaceTolerance::Relative(0.03),
            _ => SurfaceTolerance::Auto,
        };
        let [hybrid, rows] = [
            Method::Hybrid {
                tolerance,
                subpixels: 4,
            },
            Method::Rows { tolerance },
        ]
        .map(|method| drawn(reference, scene, method));
        let figures = [&hybrid, &rows].map(|(image, _)| measure(image, &scene.truth));
        println!(
            "| {} | {depth} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} |",
            scene.name,
            simple.psnr_db,
            figures[0].psnr_db,
            figures[1].psnr_db,
            simple.edge_db,
            figures[0].edge_db,
            figures[1].edge_db,
            figures[0].false_fill_percent,
            figures[1].false_fill_percent,
            hybrid.1,
            rows.1
        );
        if let Some(folder) = &folder {
            for (name, image) in [
                ("hybrid", &hybrid.0),
                ("rows", &rows.0),
                ("truth", &scene.truth.image),
            ] {
                let name = format!("{folder}/{}-{depth}-{name}.png", scene.name);
                let format = Format::Png(Depth::Eight);
                write_picture(Path::new(&name), format, image).expect("a writable folder");
            }
        }
    }
}

fn drawn(reference: &Reference, scene: &WarpScene, method: Method) -> (Image, f64) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    pool.install(|| {
        let mut best = f64::INFINITY;
        let mut image = None;
        for _ in 0..5 {
            let start = Instant::now();
            let options = WarpOptions::with_method(method);
            let mut warper = Warper::new(vec![reference.clone()], &options).expect("a reference");
            let frame = warper.render(&scene.target).expect("along the rows");
            best = best.min(1e3 * start.elapsed().as_secs_f64());
            image = Some(frame.image);
        }
        (image.expect("a picture"), best)
    })
}

/// Pairs, and the depths with which their first picture is given.
fn cases() -> Vec<(WarpScene, Vec<(&'static str, Reference)>)> {
    let vga = [320, 240];
    let start = camera(vga, 260.0, DVec3::ZERO, 0.0);
    let to = camera(vga, 260.0, DVec3::X * 0.5, 0.0);
    let mut scenes = vec![filtered_scene("room", &AnalyticScene::room(), &start, &to)];
    scenes.extend(WarpScene::load("warp_rows", "stereo"));
    let soft = |scene: WarpScene| {
        let exact = scene.reference.clone();
        let soft = softened(&exact, Numbers::Inverse, Softening::Blurred(1.2));
        (scene, vec![("exact", exact), ("blurred", soft)])
    };
    let films = FilmScene::ALL.map(|film| {
        let scene = film.pair(7, [640, 360], 0.1);
        let exact = scene.reference.clone();
        let network = Network::USUAL.of(&exact, 7);
        (scene, vec![("exact", exact), ("network", network)])
    });
    let real = ["Cones", "Teddy", "Art", "Piano", "Pipes"].into_iter();
    let real = real
        .filter_map(|name| pair("warp_rows", name))
        .map(|scene| {
            let exact = scene.reference.clone();
            (scene, vec![("measured", exact)])
        });
    scenes
        .into_iter()
        .map(soft)
        .chain(films)
        .chain(real)
        .collect()
}
