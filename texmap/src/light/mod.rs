//! Light from all around: the environment, and what a surface of metal and roughness reflects of it.

pub(crate) mod around;
pub(crate) mod blocked;
pub(crate) mod environment;
pub(crate) mod layers;
pub(crate) mod lobe;
pub(crate) mod physical;
mod reflectance;
pub(crate) mod suns;
pub(crate) mod tangents;

pub(crate) use environment::Environment;
