//! The pose of a document: places its nodes at a time of an animation, and deforms meshes by skins and morph targets.
//!
//! `nodes` multiplies the transforms, `animation` interpolates keys, `deform` moves vertices.

pub(crate) mod nodes;
pub(crate) mod animation;
pub(crate) mod deform;
