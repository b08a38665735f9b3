//! Arguments of the commands that draw no picture of a file of their own.

pub(crate) mod info;
pub(crate) mod compare;
pub(crate) mod join;
pub(crate) mod view;
pub(crate) mod trade;
pub(crate) mod bench;
pub(crate) mod completions;
