//! Textured and lit meshes: scenes by formula and from the real data, and their pictures by brute force.

pub mod textured;
pub mod mesh_views;
pub mod texture_scenes;
pub mod textures;
pub mod surroundings;
pub mod shadows;
