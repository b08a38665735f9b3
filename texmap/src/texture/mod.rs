//! Texture look-ups: takes a place on a surface with its footprint, returns filtered texels.
//!
//! `lookup` decides which look-up each sub-pixel gets, `taps` reads mip levels and keeps a look-up inside its chart. Points gather
//! by an ellipse (`ellipse`, `points`), or by the tents of a few texels where they are magnified (`magnified`).

pub(crate) mod lookup;
pub(crate) mod taps;
pub(crate) mod ellipse;
pub(crate) mod magnified;
pub(crate) mod points;
