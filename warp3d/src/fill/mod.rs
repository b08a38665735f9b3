//! The last stage: takes the layers of all references, returns one picture.
//!
//! `blend` joins references, `extrapolate` continues colours outside a reference's frame, `holes` fills what no reference shows.

pub(crate) mod blend;
pub(crate) mod extrapolate;
pub(crate) mod holes;
