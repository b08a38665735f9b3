//! Arguments of volumes, one group of `--help` a file.
//!
//! `order` infers the order of compositing from options that only one order has.

pub(crate) mod file;
pub(crate) mod reading;
pub(crate) mod scene;
pub(crate) mod transfer;
pub(crate) mod blend;
pub(crate) mod clip;
pub(crate) mod render;
pub(crate) mod order;
