//! The words of a command line, before and after they are parsed.
//!
//! `listed_slices` joins slices that a shell expanded, `content` finds the command of a file by its content and parses the
//! words of one command, and `typed` records which options were typed.

pub(crate) mod listed_slices;
pub(crate) mod session;
pub mod content;
pub mod typed;
