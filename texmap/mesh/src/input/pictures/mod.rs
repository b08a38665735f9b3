//! Pictures beside a mesh: textures, and the light around the scene.

pub(crate) mod picture;
pub(crate) mod surroundings;
