//! The process: messages, progress, interruption, the machine.

pub mod report;
pub(crate) mod notes;
pub(crate) mod progress;
pub mod interrupt;
pub(crate) mod machine;
