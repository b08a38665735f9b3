//! Popping of Gaussians: the greatest second difference of a pixel over small steps of the camera, of the volume, of the order by
//! centre, and of the truth where the volume's and the other's are greatest.
//!
//! `cargo run --release -p resample-tests --example gaussian_popping [COUNT] [STEPS] [PIXELS]`

use std::sync::Arc;

use glam::DVec3;
use resample_tests::gaussians::popping::{Jump, Turn};
use resample_tests::gaussians::scenes::{ball, knot};
use volsplat::{GaussianModel, GaussianOptions, Gaussians};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: usize| {
        let word = words.get(at);
        word.map_or(default, |word| word.parse().expect("a number"))
    };
    let (count, steps, pixels) = (number(0, 20_000), number(1, 60), number(2, 12));
    let eye = DVec3::new(0.3, 0.4, 1.0).normalize();
    let turn = |distance: f64| Turn {
        eye: distance * eye,
        step_deg: 0.05,
        steps,
        fov_y_deg: 50.0,
        size: [160, 120],
    };
    println!("| scene | drawn as | greatest | the truth there | greatest beyond the truth |");
    println!("|---|---|---|---|---|");
    for (name, scene, turn) in [
        ("knot, near", knot(count, 1), turn(1.7)),
        ("knot", knot(count, 1), turn(3.2)),
        ("ball", ball(count / 20, 2), turn(3.0)),
    ] {
        let scene = Arc::new(scene);
        for (way, options) in [
            ("volume", GaussianOptions::default()),
            ("volume, slab error 0.01", thin()),
            ("khr", of_model(GaussianModel::Khr)),
        ] {
            let jumps = turn.jumps(&scene, &options);
            row([name, way], &scene, &turn, &jumps[..pixels]);
        }
    }
}

fn thin() -> GaussianOptions {
    GaussianOptions {
        slab_error: 0.01,
        ..GaussianOptions::default()
    }
}

fn of_model(model: GaussianModel) -> GaussianOptions {
    GaussianOptions {
        model,
        ..GaussianOptions::default()
    }
}

fn row([name, way]: [&str; 2], scene: &Gaussians, turn: &Turn, jumps: &[Jump]) {
    let truths: Vec<f64> = jumps
        .iter()
        .map(|jump| turn.true_jump(scene, jump))
        .collect();
    let beyond = jumps
        .iter()
        .zip(&truths)
        .map(|(jump, truth)| jump.size - truth);
    println!(
        "| {name} | {way} | {:.4} | {:.4} | {:+.4} |",
        jumps[0].size,
        truths.iter().copied().fold(0.0, f64::max),
        beyond.fold(f64::NEG_INFINITY, f64::max)
    );
}
