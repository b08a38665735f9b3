//! Light from all around: the environment, and what a surface of metal and roughness reflects of it.

mod around;
mod bumps;
mod environment;
mod inputs;
mod lobes;
mod met;
mod octahedron;
pub(crate) mod physical;
mod reflectance;
mod stretched;
mod studio;
mod suns;
pub(crate) mod tangents;

pub(crate) use environment::Environment;
