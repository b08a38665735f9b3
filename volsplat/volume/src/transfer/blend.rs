//! The value of a ray that its pixel shows.

/// The value of a ray that its pixel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Blend {
    /// Emission and absorption: each sample behind those before it.
    #[default]
    Emission,
    /// The greatest scalar, classified: its opacity over one opacity unit is the pixel's.
    Maximum,
    /// The least scalar inside the volume, classified alike.
    Minimum,
    /// The mean of the scalars inside the volume, classified alike.
    Average,
    /// A surface of one scalar.
    Isosurface(Isosurface),
}

/// A surface of one scalar. It is lit as the shading says.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Isosurface {
    /// The scalar, finite.
    pub value: f64,
    /// Linear red, green, blue; `None` is the transfer function's colour of the scalar.
    pub colour: Option<[f32; 3]>,
    /// Opacity of the surface each time that a ray crosses it; above 0, at most 1.
    pub opacity: f32,
}
