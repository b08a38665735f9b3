//! The planner: from an error or a time that was asked for to settings, for this scene and these cameras.
//!
//! 1. ladder: the settings that may be chosen, from cheap to exact, and the default among them (`ladder`);
//! 2. pilot: a small preview of some pictures shows where they have contrast; small windows stand there (`windows`), in
//!    which the exact setting and the candidates are drawn (`pilot`);
//! 3. search: the default first, then up the ladder until a setting keeps the bound, or down it while one does
//!    (`search`); errors of whole pictures are predicted from those of windows with a margin (`estimate`);
//!    for a time, the least measured error among all that fit (`in_time`);
//! 4. the scene that was read is drawn with the setting that was chosen, and the choice is explained (`explain`).
//!
//! The choice for an error reads no clock: it is the same on every machine, and so is the picture. The choice for a time
//! measures the windows by the clock, and needs no calibration. Limits: the error of a picture by its windows is an
//! estimate with a margin, not a proof.

mod ladder;
mod windows;
mod candidate;
mod effort;
mod pilot;
mod compared;
mod estimate;
mod search;
mod in_time;
mod explain;
mod plan;

pub(crate) use self::ladder::ends;
pub(crate) use self::plan::keeping;
pub use self::plan::{Planned, planned};
