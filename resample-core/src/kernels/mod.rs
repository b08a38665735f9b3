//! Kernels and footprints: takes a sample's kernel and the view, returns its footprint on the screen.
//!
//! `kernel` is the function around a sample, `table` and `section` its values and sections, `conic` an ellipse, `footprint` the kernel's
//! image under a view and the choice between it and `point`, its circular stand-in. `index_table` is the paper's table of
//! footprints.

pub mod kernel;
pub mod table;
pub mod section;
pub mod conic;
pub mod footprint;
pub mod point;
pub mod index_table;
