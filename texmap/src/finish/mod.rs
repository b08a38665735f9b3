//! The last steps of a picture: its light in the range of a screen, and its background.

pub(crate) mod tone;
#[cfg(feature = "input")]
pub mod background;
