//! The paper's methods.

pub(crate) mod nearest;
pub(crate) mod epipole;
pub(crate) mod splat;
