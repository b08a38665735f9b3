//! Texture look-ups: takes a place on a surface with its footprint, returns filtered texels.
//!
//! `lookup` decides which look-up each sub-pixel gets, `taps` reads mip levels and keeps a look-up inside its chart. Points gather
//! by an ellipse (`ellipse`, `points`).

pub(crate) mod lookup;
pub(crate) mod taps;
pub(crate) mod ellipse;
pub(crate) mod points;
