//! The program `resample`: the library's command line, and nothing else.

use std::process::ExitCode;

fn main() -> ExitCode {
    resample_cli::run()
}
