//! `resample bench`: published tables, measured again on this machine.
//!
//! Every table is Markdown on stdout, headed by what a reader needs to compare it: version, date, machine, threads
//! and settings. Times are medians over interleaved repetitions of one run, so that a disturbance hits every row.

mod scenes;
mod settings;

use anyhow::Result;

use crate::args::{BenchArgs, BenchTable};
use crate::process::report;
use crate::process::report::Verbosity;

/// Measures and prints one table.
pub(crate) fn run(args: &BenchArgs, verbosity: Verbosity) -> Result<()> {
    let table = match &args.table {
        BenchTable::Footprint(args) => scenes::footprint(args, verbosity)?,
        BenchTable::Orders(args) => scenes::orders(args, verbosity)?,
        BenchTable::Texture(args) => scenes::texture(args, verbosity)?,
        BenchTable::Warp(args) => scenes::warp(args, verbosity)?,
    };
    report::print(&table)
}
