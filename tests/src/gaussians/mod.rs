//! Gaussians: scenes by formula, the slow twins of their drawing, and how much pixels jump while the view turns.

pub mod popping;
pub mod scenes;
pub mod twin;
pub mod viewers;
