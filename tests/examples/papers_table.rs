//! The paper's table, measured: visible voxels, shares of splats and times of the paper's own orders and kernels beside its figures.
//!
//! `cargo run --release -p resample-tests --example papers_table [-- FRAMES]`, on one thread. Rows whose data is absent are left out, with a line that says so. The
//! paper's times are of a 1.7 GHz Pentium 4 (2003).

use resample_tests::frames::{frames_argument, one_thread};
use resample_tests::volumes::papers_table::{ROWS, measured};

fn main() {
    let Some(frames) = frames_argument("papers_table", 5) else {
        return;
    };
    println!(
        "| volume | size | visible (paper) | all splats s (paper) | mixed s, splats (paper) | all points s (paper) |"
    );
    println!("|---|---|---|---|---|---|");
    one_thread().install(|| {
        for row in &ROWS {
            if let Some(figures) = measured(row, frames) {
                println!("{}", row.line(&figures));
            }
        }
    });
}
