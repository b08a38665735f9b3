//! The commands, one file each: from typed options to calls and a report.

pub(crate) mod built_in;

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod demo;
pub(crate) mod info;
pub(crate) mod join;
pub(crate) mod thumbnails;
pub(crate) mod trade;
