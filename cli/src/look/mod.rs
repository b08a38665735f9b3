//! The look of a volume: takes typed options and the facts of the data, returns transfer functions, light and blending.
//!
//! `blend` and `suggested` decide blending, light and unit; `transfer`, `channel_look` and `colours` make the functions of one volume, of
//! several channels and of colour voxels; `clip` keeps a part; `transfer_plot` draws the function over the histogram.

pub(crate) mod blend;
pub(crate) mod suggested;
pub(crate) mod transfer;
pub(crate) mod channel_look;
pub(crate) mod colours;
pub(crate) mod clip;
pub(crate) mod transfer_plot;
