//! The look of a volume: what a caller chooses of it, before any work.
//!
//! `transfer` functions map scalars to colours and opacities, `palette` colours labels, `clip` keeps a part, a `scene` joins volumes
//! with their looks, and `options` holds every other choice. `visible_values` asks which values a transfer function shows.

mod sample_options;
pub mod transfer;
pub(crate) mod palette;
pub mod clip;
pub mod scene;
pub mod options;
