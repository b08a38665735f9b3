//! Reports of a running command: to the terminal, and to the program that it is part of.

use std::time::Instant;

use crate::process::report::Verbosity;
use resample_core::camera::bands::Next;

/// Called before each picture with the number of those that are done and of all; says whether it is drawn.
pub type Follow<'a> = &'a dyn Fn(usize, usize) -> Next;

/// When a command started, and how much it says.
#[derive(Clone, Copy)]
pub struct RunLog<'a> {
    /// The start, for the time at the end.
    pub start: Instant,
    /// Amount of messages on stderr.
    pub verbosity: Verbosity,
    /// Follows the run, where it is part of another program.
    pub follow: Option<Follow<'a>>,
}
