//! Texture look-ups: takes a place on a surface with its footprint, returns filtered texels.
//!
//! `lookup_plan` decides which look-up each sub-pixel gets, `lookup` and `taps` read mip levels, `at_borders` keeps a look-up
//! inside its chart. Points gather by an ellipse (`points`, `ellipse`, `sums`).

pub(crate) mod lookup;
pub(crate) mod lookup_plan;
pub(crate) mod taps;
pub(crate) mod at_borders;
pub(crate) mod sums;
pub(crate) mod ellipse;
pub(crate) mod points;
