//! Slow twins of the volume renderer, in f64 and by definition: no formula is shared with the code that they test.
//!
//! `rays`, `field`, `trilinear` and `march` are rays and fields; `light`, `clip`, `cells` and `coefficients` their parts; `samples` and
//! `kernel_sheets` draw the paper's orders; `sheets`, `channels`, `statistic`, `isosurface` and `segments` draw the field.

pub mod rays;
pub mod field;
pub mod trilinear;
pub mod march;
pub mod light;
pub mod clip;
pub mod cells;
pub mod coefficients;
pub mod samples;
pub mod kernel_sheets;
pub mod sheets;
pub mod channels;
pub mod statistic;
pub mod isosurface;
pub mod segments;
