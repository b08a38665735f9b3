//! Discs on the screen.
//!
//! In the order in which data flow: `sizes` are what all agree on; `view` is the camera as discs meet it; `groups` are runs of discs; `bounds` say where they may
//! be seen, `listed` in which tiles, and `choice` which of their discs a tile needs; `project` puts the discs of a tile on the screen
//! as `splat`s, nearest first; `blend` sums them in blocks of 4x4 pixels; `tile` drives it all.

pub(crate) mod blend;
pub(crate) mod bounds;
pub(crate) mod choice;
pub(crate) mod groups;
pub(crate) mod listed;
pub(crate) mod project;
pub(crate) mod sizes;
pub(crate) mod splat;
pub(crate) mod tile;
pub(crate) mod view;
