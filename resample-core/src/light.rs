//! The balance of light on a surface, the same in every renderer.

/// Share of its colour that a surface reflects whatever its direction.
pub const AMBIENT: f32 = 0.3;

/// Share that depends on the angle between its normal and the light.
pub const DIFFUSE: f32 = 1.0 - AMBIENT;
