//! Sizes and numbers on the screen that every stage shares.
//!
//! In the order of use: tiles with their border (`padded_tile`), the part of the picture that is drawn (`window`), functions
//! that are linear on the screen (`plane`), and vectors of sub-pixels (`lanes`).

pub(crate) mod padded_tile;
pub(crate) mod window;
pub(crate) mod plane;
pub(crate) mod lanes;
