//! Surfaces of a reference: takes its picture and depth, once, returns joined samples with edges between them.
//!
//! In the order of preparing: the roughness of the depth and its single gaps (`tolerance`), soft edges (`sides`, `sharpen_edges`), samples of
//! one surface (`surface`) and where a round one ends (`limbs`), its flat pieces (`patch`), edges between samples (`rims`), colours as
//! spline coefficients (`colours`), and a compact copy of the input (`input_copy`).

pub(crate) mod tolerance;
mod sides;
pub(crate) mod sharpen_edges;
pub(crate) mod surface;
pub(crate) mod limbs;
pub(crate) mod patch;
pub(crate) mod rims;
pub(crate) mod colours;
pub(crate) mod input_copy;
