//! The balance of light on a surface, the same in every renderer.
//!
//! The two shares add up to 1, so that a surface that faces the light keeps its colour. The split is a habit of volume
//! renderers, not derived.

/// Share of its colour that a surface reflects whatever its direction.
pub const AMBIENT: f32 = 0.3;

/// Share that depends on the angle between its normal and the light.
pub const DIFFUSE: f32 = 1.0 - AMBIENT;
