//! The words of a command line, before and after they are parsed.
//!
//! `listed_slices` joins slices that a shell expanded, `content` finds the command of a file by its content and parses the
//! words of one command, `typed` records which options were typed, and `tips` helps where the words are not ours.

pub(crate) mod listed_slices;
pub(crate) mod session;
pub(crate) mod tips;
pub mod content;
pub mod typed;
