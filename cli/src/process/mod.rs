//! The process: messages, progress, interruption, the machine.

pub mod report;
pub mod interrupt;
pub(crate) mod machine;
