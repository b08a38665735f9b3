//! The command line `resample` as a library, so that other front ends share its files, framing, settings, planner and output.
//!
//! A front end fills the typed options of a command, reads the scene, and draws it from its own or from any camera:
//!
//! ```no_run
//! use std::path::PathBuf;
//!
//! use resample_cli::args::{Drawing, VolsplatArgs};
//! use resample_cli::open::Opened;
//! use resample_cli::plan::Purpose;
//! use resample_cli::process::report::Verbosity;
//!
//! # fn main() -> anyhow::Result<()> {
//! let args = VolsplatArgs {
//!     input: PathBuf::from("head.nrrd").into(),
//!     output: "head.png".into(),
//!     ..VolsplatArgs::default()
//! };
//! let drawing = Drawing::Volsplat(Box::new(args));
//! let mut scene = Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)?;
//! let camera = scene.cameras()[0];
//! let picture = scene.draw(&camera)?.image;
//! # Ok(())
//! # }
//! ```
//!
//! [`run`] takes the words of this process and gives an exit code: 0 when everything asked for was written, 2 when the
//! input or the options are bad (nothing is written then), 1 when a file could not be written although all checks had
//! passed or a bound of a comparison is broken, 130 after Ctrl-C. This file parses, starts the threads and dispatches;
//! each command reads as its list of steps in `commands/`.

// In the order in which data flow.
pub mod process;
pub mod values;
pub mod args;
pub mod cameras;
mod look;
pub mod output;
pub mod picture;
pub mod plan;
pub mod open;
mod measure;
pub mod planner;
mod commands;
pub mod view;
mod threads;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use clap::{CommandFactory, FromArgMatches};

use crate::args::words::typed::Typed;
use crate::args::words::{content, listed_slices, session};
use crate::args::{Cli, Command, Drawing, GlobalArgs};
use crate::commands::compare::TooFar;
use crate::commands::thumbnails::SomeFailed;
use crate::open::Opened;
use crate::output::WriteFailure;
use crate::plan::{Purpose, RunLog};
use crate::planner::Planned;
use crate::process::interrupt::Interrupted;
use crate::process::report::Verbosity;
use crate::process::{interrupt, report};

/// Bad input or options; also what clap uses.
const EXIT_BAD_INPUT: u8 = 2;

/// The input was fine, but a file could not be written or pictures are too far apart.
const EXIT_FAILED: u8 = 1;

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    let is_command = |word: &str| word == "help" || Cli::command().find_subcommand(word).is_some();
    let words = std::env::args_os().collect();
    let words = content::with_command(words, is_command)
        .and_then(session::expanded)
        .map(content::of_content)
        .and_then(listed_slices::as_pattern);
    let words = match words {
        Ok(words) => words,
        Err(error) => return failed(&error),
    };
    let matches = match Cli::command().try_get_matches_from(&words) {
        Ok(matches) => matches,
        Err(error) => match args::listed(&error) {
            Some(list) => {
                return report::print(&list)
                    .map_or_else(|error| failed(&error), |()| ExitCode::SUCCESS);
            }
            None => args::with_tip(error, &words, &Cli::command()).exit(),
        },
    };
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let typed = Typed::of(Cli::command(), &matches);
    match dispatched(cli, &typed) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Interrupted>() => {
            report::say(&report::one_line(&error));
            ExitCode::from(interrupt::EXIT_INTERRUPTED)
        }
        Err(error) => failed(&error),
    }
}

/// Says what went wrong.
fn failed(error: &anyhow::Error) -> ExitCode {
    report::say(&format!("error: {}", report::one_line(error)));
    let failed = error.is::<WriteFailure>() || error.is::<TooFar>() || error.is::<SomeFailed>();
    ExitCode::from(if failed { EXIT_FAILED } else { EXIT_BAD_INPUT })
}

fn dispatched(cli: Cli, typed: &Typed) -> Result<()> {
    threads::start(&cli.global)?;
    let verbosity = verbosity(&cli.global);
    match cli.command {
        Command::Demo(args) => commands::demo::run(&args, verbosity),
        Command::Bench(args) => commands::bench::run(&args, verbosity),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Info(args) => commands::info::run(&args),
        Command::Join(args) => commands::join::run(&args, verbosity),
        Command::Thumbnails(args) => commands::thumbnails::run(&args, verbosity),
        Command::Trade(args) => commands::trade::run(args, typed, verbosity),
        Command::View(args) => view::run(args, verbosity),
        Command::Completions(args) => {
            commands::completions::print(args);
            Ok(())
        }
        Command::Man(args) => commands::completions::write_pages(&args),
        Command::Draw(drawing) => draw(drawing, typed, verbosity),
    }
}

/// Reads a scene, chooses its setting where an error or a time is asked for, draws, writes, and reports.
fn draw(drawing: Drawing, typed: &Typed, verbosity: Verbosity) -> Result<()> {
    let log = RunLog {
        start: Instant::now(),
        verbosity,
        follow: None,
    };
    drawing.check_part()?;
    if let Some(Planned { opened, record }) = planner::planned(&drawing, typed, verbosity)? {
        interrupt::watch()?;
        return opened.finish(Some(record), log);
    }
    interrupt::watch()?;
    Opened::read(drawing, Purpose::Draw, verbosity)?.finish(None, log)
}

fn verbosity(args: &GlobalArgs) -> Verbosity {
    match (args.quiet, args.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, true) => Verbosity::Verbose,
        (false, false) => Verbosity::Normal,
    }
}
