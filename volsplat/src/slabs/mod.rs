//! Sheets: slabs parallel to the picture, what both pipelines that draw in them share.

pub(crate) mod channel;
pub(crate) mod integrals;
pub(crate) mod lanes;
pub(crate) mod projection;
pub(crate) mod section;
pub(crate) mod settings;
pub(crate) mod table;
pub(crate) mod view;
