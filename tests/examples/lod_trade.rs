//! Measures the level of detail: the largest change of a pixel, and what it saves, as the camera recedes.
//!
//! `cargo run --release -p resample-tests --example lod_trade [-- VIEWS]` prints Markdown tables: each volume from so many
//! sides (3 if not given) at every distance, with `--lod-error` 1/512, 1/128 and 1/32 against 0. Time is the least
//! process-CPU time of a view on one thread; the change is the largest of any channel of any pixel of any view. The
//! first frame at a distance also prepares what may be drawn instead, and the least leaves that out.

use std::process::ExitCode;

use resample_tests::interleaved::{Entrant, run};
use resample_tests::lod_scenes::{Subject, subjects};
use resample_tests::scenes::{transfer, worst_difference};
use volsplat::RenderOptions;
use volsplat::procedural::checker_box;

fn main() -> ExitCode {
    let Ok(views @ 1..) = std::env::args()
        .nth(1)
        .map_or(Ok(3), |argument| argument.parse::<usize>())
    else {
        eprintln!("usage: lod_trade [VIEWS], with VIEWS a whole number above 0");
        return ExitCode::FAILURE;
    };
    for subject in subjects("lod_trade").into_iter().chain([large()]) {
        println!("### {}\n", subject.name);
        println!(
            "| px a voxel | without: CPU ms | lod-error | CPU ms | largest change | over bound | bricks by level | by stride |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let with = |lod_error: f32| RenderOptions {
            lod_error,
            ..RenderOptions::default()
        };
        let pair = (&subject.volume, &subject.transfer);
        let mut entrants = vec![Entrant::new("off", pair, &with(0.0))];
        entrants.extend(ERRORS.map(|error| Entrant::new("on", pair, &with(error))));
        for px in [1.0, 0.5, 0.25, 0.125, 0.0625] {
            print_distance(&subject, px, &mut entrants, views);
        }
        println!();
    }
    ExitCode::SUCCESS
}

/// The bounds that are measured.
const ERRORS: [f32; 3] = [1.0 / 512.0, 1.0 / 128.0, 1.0 / 32.0];

/// A large volume, homogeneous over stretches of 32 voxels.
fn large() -> Subject {
    let volume = checker_box(320, 32).expect("a good size");
    let transfer = transfer(
        &[(85.0, [0.9, 0.2, 0.1]), (170.0, [0.1, 0.3, 0.9])],
        &[(85.0, 0.004), (170.0, 0.02)],
    );
    Subject {
        name: "checker box, 320^3",
        volume,
        transfer,
    }
}

fn print_distance(subject: &Subject, px: f64, entrants: &mut [Entrant], views: usize) {
    entrants
        .iter_mut()
        .for_each(|entrant| entrant.stats.clear());
    let mut worst = [0.0f64; ERRORS.len()];
    for number in 0..views {
        run(entrants, &[subject.camera(px, number)], 0);
        let (off, on) = entrants.split_first().expect("one is off");
        for (worst, on) in worst.iter_mut().zip(on) {
            *worst = worst.max(worst_difference(&off.image, &on.image));
        }
    }
    let off = entrants[0].least(|stats| stats.cpu_ms);
    for ((entrant, error), worst) in entrants[1..].iter().zip(ERRORS).zip(worst) {
        println!(
            "| {px} | {off:.1} | 1/{:.0} | {:.1} | {worst:.5} | {:.2} | {:?} | {:?} |",
            1.0 / error,
            entrant.least(|stats| stats.cpu_ms),
            worst / f64::from(error),
            entrant.last().bricks_by_level,
            entrant.last().bricks_by_stride
        );
    }
}
