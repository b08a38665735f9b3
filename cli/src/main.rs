//! The command line `resample`.
//!
//! Takes words, gives an exit code: 0 when everything asked for was written, 2 when the input or the options are
//! bad (nothing is written then), 1 when a file could not be written although all checks had passed, 130 after
//! Ctrl-C. This file parses, starts the threads and dispatches; each command reads as its list of steps in `commands/`.

mod args;
mod camera_file;
mod camera_path;
mod choices;
mod clip;
mod commands;
mod framing;
mod interrupt;
mod json_fields;
mod output;
mod picture;
mod report;
mod sequence;
mod settings;
mod transfer;
mod transfer_plot;
mod values;

use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;

use crate::args::{Cli, Command, GlobalArgs};
use crate::interrupt::Interrupted;
use crate::output::WriteFailure;
use crate::report::Verbosity;

/// Bad input or options; also what clap uses.
const EXIT_BAD_INPUT: u8 = 2;

/// Everything was fine but the writing.
const EXIT_WRITE_FAILED: u8 = 1;

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Interrupted>() => {
            report::say(&report::one_line(&error));
            ExitCode::from(interrupt::EXIT_INTERRUPTED)
        }
        Err(error) => {
            report::say(&format!("error: {}", report::one_line(&error)));
            ExitCode::from(if error.is::<WriteFailure>() { EXIT_WRITE_FAILED } else { EXIT_BAD_INPUT })
        }
    }
}

fn run(cli: &Cli) -> Result<()> {
    start_threads(&cli.global)?;
    let verbosity = verbosity(&cli.global);
    match &cli.command {
        Command::Demo(args) => commands::demo::run(args, verbosity),
        Command::Info(args) => commands::info::run(args),
        Command::Volsplat(args) => commands::volsplat::run(args, verbosity),
    }
}

fn start_threads(args: &GlobalArgs) -> Result<()> {
    let Some(threads) = args.threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads))
        .build_global()
        .with_context(|| format!("--threads {threads}: cannot start that many"))
}

fn verbosity(args: &GlobalArgs) -> Verbosity {
    match (args.quiet, args.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, true) => Verbosity::Verbose,
        (false, false) => Verbosity::Normal,
    }
}
