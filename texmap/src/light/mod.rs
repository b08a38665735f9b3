//! Light from all around: the environment, and what a surface of metal and roughness reflects of it.

mod around;
mod environment;
pub(crate) mod physical;
mod reflectance;
mod suns;
pub(crate) mod tangents;

pub(crate) use environment::Environment;
