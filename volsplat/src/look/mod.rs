//! The look of a volume: the choices of a caller, before any work.
//!
//! `transfer` functions map scalars to colours and opacities, `palette` colours labels, `clip` keeps a part, a `scene` joins volumes
//! with their looks, and `options` holds every other choice, with those of the paper's samples in `sample_options`.

pub mod transfer;
pub(crate) mod palette;
pub mod clip;
pub mod scene;
mod sample_options;
pub mod options;
