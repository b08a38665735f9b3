//! The uses of a picture: how its texels become the numbers that are filtered.

use resample_mesh::scene::{TextureUse, Wrap};

/// The use of a picture in a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TexelUse {
    /// Colour; alpha counts as 1.
    Opaque,
    /// Colour that is weighted by alpha: it is premultiplied before it is filtered.
    Weighted,
    /// Numbers as they are in the file; alpha is the square of green.
    Numbers,
    /// As [`TexelUse::Numbers`], with the red of another picture of the same size.
    WithOcclusion {
        /// Its place in the scene.
        picture: usize,
    },
    /// Base colour times metal, and in alpha roughness times metal: see [`crate::prepare::maps`].
    Metals {
        /// The place of the picture of roughness and metal in the scene.
        picture: usize,
        /// Wrapping beyond that picture's borders.
        wrap: [Wrap; 2],
        /// True if the colour is weighted by alpha.
        alpha: Weighting,
    },
    /// Linear colour, and the alpha of a picture of the same size, which may be its own.
    ColourWith {
        /// The place of the picture of the alpha in the scene.
        picture: usize,
    },
    /// Normals in tangent space, whose x and y are scaled: see [`crate::prepare::maps`].
    Normals {
        /// Factor of x and y.
        scale: f32,
    },
}

/// Returns true if a colour is weighted by its alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Weighting {
    /// Alpha counts as 1.
    Even,
    /// Premultiplied.
    ByAlpha,
}

/// A picture as a material uses it, and what becomes of its texels.
pub(crate) type Used = (TextureUse, TexelUse);
