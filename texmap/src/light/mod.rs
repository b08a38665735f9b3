//! Light from all around: the environment, and what a surface of metal and roughness reflects of it.

mod environment;
mod inputs;
mod lobes;
mod octahedron;
pub(crate) mod physical;
mod reflectance;
mod studio;
mod suns;
pub(crate) mod tangents;

pub(crate) use environment::Environment;
