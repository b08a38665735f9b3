//! Memory and the time from nothing to the first picture, of a setting in a process of its own.
//!
//! A process that has measured other settings still holds some of their memory, and the memory of a later one would seem to be
//! next to nothing. So the program starts itself once for each setting, to read, prepare, and draw one picture.
//! Limits: the time does not count the start of the process; memory is known on Linux alone.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

use crate::args::Drawing;
use crate::open::Opened;
use crate::plan::Purpose;
use crate::process::report;
use crate::process::report::Verbosity;

/// Time and memory of one picture.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct Alone {
    /// Elapsed time: reading, preparing, drawing once, ms.
    pub(super) cold_ms: f64,
    /// Most memory that the process held, bytes.
    pub(super) peak_bytes: Option<u64>,
}

/// Draws one picture, and prints its time and memory.
pub(super) fn run(drawing: Drawing) -> Result<()> {
    let start = std::time::Instant::now();
    let mut opened = Opened::read(drawing, Purpose::Compare, Verbosity::Quiet)?;
    let camera = opened.cameras().first().copied();
    opened.draw(&camera.context("there is no camera to draw from")?)?;
    let alone = Alone {
        cold_ms: report::ms_since(start),
        peak_bytes: report::peak_bytes(),
    };
    println!("{}", serde_json::to_string(&alone)?);
    Ok(())
}

/// Time and memory of a command line in a process of its own. Nothing is written to the folder of the report.
pub(super) fn measured(words: &[String], folder: &Path) -> Result<Alone> {
    let program = std::env::current_exe().context("the program does not know where it lies")?;
    let mut command = Command::new(program);
    command
        .arg("trade")
        .args(words)
        .args(["--probe", "--out"])
        .arg(folder)
        .stdin(Stdio::null());
    // Ctrl-C asks this process to stop after the setting, and leaves the other alone.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let output = command
        .output()
        .context("the program cannot start itself")?;
    if !output.status.success() {
        bail!(
            "{}",
            String::from_utf8_lossy(&output.stderr)
                .trim()
                .trim_start_matches("error: ")
        );
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
