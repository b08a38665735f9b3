//! Labels: a volume whose scalars are names, and how each of them looks.

#[cfg(feature = "input")]
mod files;
mod table;
#[cfg(all(test, feature = "input"))]
mod tests;

pub use table::{LabelLook, LabelTable, MAX_LABELS};
