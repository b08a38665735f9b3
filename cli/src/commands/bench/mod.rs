//! `resample bench`: published tables, measured again on this machine.
//!
//! Every table is Markdown on stdout, headed by what a reader needs to compare it: version, date, machine, threads
//! and settings. Times are medians over interleaved repetitions of one run, so that a disturbance hits every row.

mod paper;
mod scenes;
mod settings;

use std::io::{self, Write};

use anyhow::Result;

use crate::args::{BenchArgs, BenchTable};
use crate::report::Verbosity;

/// Measures and prints one table.
pub(crate) fn run(args: &BenchArgs, verbosity: Verbosity) -> Result<()> {
    let table = match &args.table {
        BenchTable::Paper(args) => paper::table(args, verbosity)?,
        BenchTable::Footprint(args) => scenes::footprint(args, verbosity)?,
        BenchTable::Orders(args) => scenes::orders(args, verbosity)?,
        BenchTable::Texture(args) => scenes::texture(args, verbosity)?,
        BenchTable::Warp(args) => scenes::warp(args, verbosity)?,
    };
    Ok(io::stdout().write_all(table.as_bytes())?)
}

/// The middle of a list of times; of an even number the upper one. 0 for none.
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
