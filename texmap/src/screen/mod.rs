//! Sizes and numbers on the screen that every stage shares.
//!
//! In the order of use: tiles with their border and the part of the picture that is drawn (`padded_tile`), functions
//! that are linear on the screen (`plane`), and vectors of sub-pixels (`lanes`).

pub(crate) mod padded_tile;
pub(crate) mod plane;
pub(crate) mod lanes;
