//! `resample calibrate`: what this machine needs for what a picture is made of, measured once and kept.

use anyhow::{Context, Result};

use crate::args::CalibrateArgs;
use crate::output;
use crate::planner;
use crate::report::{self, Verbosity};

/// Measures, and writes the file.
pub(crate) fn run(args: &CalibrateArgs, verbosity: Verbosity) -> Result<()> {
    let path = match &args.output {
        Some(path) => path.clone(),
        None => {
            planner::cache_file().context("this user has no cache folder: name a file with -o")?
        }
    };
    if let (None, Some(folder)) = (&args.output, path.parent()) {
        output::make_folder(folder)?;
    }
    output::check_writable(&path)?;
    if verbosity != Verbosity::Quiet {
        report::say(
            "drawing the built-in scenes; times are best on a machine that does nothing else",
        );
    }
    let calibration = planner::measured(None, args.reps)?;
    output::write_text(&path, &planner::saved(&calibration)?)?;
    if verbosity != Verbosity::Quiet {
        report::say(&format!(
            "wrote {} ({})",
            path.display(),
            calibration.described
        ));
    }
    Ok(())
}
