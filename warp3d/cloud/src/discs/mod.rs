//! Discs of points: their neighbours, planes and radii.
//!
//! In the order in which data flow: `cells` sorts points into a tree; `crowd` finds the neighbours of sixteen points at a time, and `rows`
//! makes their discs where nothing is unusual; elsewhere `fit` lays a plane through neighbours and `voronoi` says how far a point's part
//! of it reaches, and `hull` where a surface may end; `prepare` drives it all, and leaves out flying pixels.

pub(crate) mod cells;
pub(crate) mod crowd;
pub(crate) mod fit;
pub(crate) mod hull;
pub(crate) mod prepare;
pub(crate) mod rows;
pub(crate) mod voronoi;
