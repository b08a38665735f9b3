//! Surfaces of a reference: takes its picture and depth, once, returns joined samples with edges between them.
//!
//! In the order of preparing: the roughness of the depth (`tolerance`), soft edges (`sharpen_edges`), single missing samples (`gaps`),
//! samples of one surface (`surface`) and the numbers of its flat pieces (`piece`, `patch`), edges between samples (`rims`), colours
//! beside edges (`colour_samples`), spline coefficients (`spline`), and a compact copy of the input (`input_copy`).

pub(crate) mod tolerance;
pub(crate) mod sharpen_edges;
pub(crate) mod gaps;
pub(crate) mod piece;
pub(crate) mod surface;
pub(crate) mod patch;
pub(crate) mod rims;
pub(crate) mod colour_samples;
pub(crate) mod spline;
pub(crate) mod input_copy;
