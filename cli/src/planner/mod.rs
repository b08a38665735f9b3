//! The planner: from an error or a time that was asked for to settings, for this scene and these cameras.
//!
//! 1. ladder: the settings that may be chosen (`ladder`);
//! 2. pilot: windows of the pictures (`windows`), as many as the run can afford (`look`, `subsample_windows`), with
//!    the exact setting (`pilot`);
//! 3. search: rungs of the ladder in the same windows, while they are worth their cost (`budget`); their errors with a
//!    margin (`estimate`), their cost from counts (`model`), and the best that keeps the bound (`search`);
//! 4. the scene that was read is drawn with the setting that was chosen.
//!
//! The choice for an error reads no clock: it is the same on every machine, and so is the picture. Proven bounds (early
//! termination, level of detail) are used as such: each gets a share of the error, and the rest is measured together
//! with them. Limits: the error of a picture by its windows is an estimate with a margin, not a proof.

mod asked;
mod budget;
mod calibration;
mod estimate;
mod explain;
mod fixed_cost;
mod found;
mod ladder;
mod look;
mod model;
mod pilot;
mod plan;
mod search;
mod subsample_windows;
mod windows;

pub(crate) use self::calibration::{cache_file, measured, saved};
pub use self::plan::{Planned, planned};
