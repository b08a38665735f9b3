//! Light from all around: the environment, and what a surface of metal and roughness reflects of it.

mod around;
mod environment;
mod lobes;
pub(crate) mod physical;
mod reflectance;
mod small_lights;
mod stretched;
mod studio;
mod suns;
pub(crate) mod tangents;

pub(crate) use environment::Environment;
