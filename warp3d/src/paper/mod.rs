//! The paper's methods.

pub(crate) mod nearest;
pub(crate) mod splat;
