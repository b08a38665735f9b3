//! Scenes without their pictures, or with a grid of texels in their place, to see the surface or the density of its texels.
//!
//! Takes a scene and a choice, returns a scene. The grid is a picture of the same size as the one that it replaces: a thin
//! line every [`CELL`] texels, a strong one every [`CELLS`] cells, so that small cells on the screen mean many texels.
//! Limits: a picture beyond 8 bits is replaced by one of 8; a mesh without texture coordinates has no grid.

use std::sync::Arc;

use resample_mesh::scene::{AlphaMode, Material, Scene, Texels, Texture};

/// The pictures of a scene's surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Textures {
    /// As the file has them
    #[default]
    Shown,
    /// Left out: surfaces have the colours of their materials and vertices
    LeftOut,
    /// A line every 32 texels in place of each picture of colours, a strong one every 256: the density of texels
    Grid,
}

/// Texels from one thin line to the next.
const CELL: usize = 32;

/// Cells from one strong line to the next.
const CELLS: usize = 8;

/// Widths of the two kinds of lines, texels.
const THIN: usize = 2;
const STRONG: usize = 6;

/// sRGB colours of the surface and its lines: dark on light under any light. A guess.
const PAPER: [u8; 4] = [225, 225, 218, 255];
const INK: [u8; 4] = [20, 60, 130, 255];

impl Textures {
    /// The scene with these textures.
    ///
    /// ```
    /// use texmap::{Scene, Textures};
    ///
    /// let bare = Textures::LeftOut.applied_to(Scene::default());
    /// assert!(bare.textures.is_empty());
    /// ```
    #[must_use]
    pub fn applied_to(self, mut scene: Scene) -> Scene {
        match self {
            Self::Shown => return scene,
            Self::LeftOut => scene.textures.clear(),
            Self::Grid => scene.textures.iter_mut().for_each(|texture| {
                texture.texels = Texels::Srgb8(Arc::new(grid(texture)));
            }),
        }
        for material in &mut scene.materials {
            leave_out(material, self);
        }
        scene
    }
}

/// Takes the pictures from a material: all of them, or all but that of its colour, which then stands alone.
fn leave_out(material: &mut Material, textures: Textures) {
    // Light that a picture gave has no place without it.
    if material.emissive_texture.take().is_some() {
        material.emissive = [0.0; 3];
    }
    if let Some(physical) = &mut material.physical {
        // The factors of a map are 1 as a rule, which alone would be metal all over.
        let metal = match physical.metal_roughness_texture {
            Some(_) => 0.0,
            None => physical.metal,
        };
        physical.metal = metal;
    }
    // The first is that of the base colour.
    for used in material.textures_mut().into_iter().skip(1) {
        *used = None;
    }
    match textures {
        Textures::Grid if material.base_texture.is_some() => {
            material.base_colour = [1.0; 4];
            material.alpha = AlphaMode::Opaque;
        }
        Textures::Shown | Textures::LeftOut | Textures::Grid => material.base_texture = None,
    }
}

/// The lines, as large as a texture.
fn grid(texture: &Texture) -> Vec<[u8; 4]> {
    let is_line = |place: usize| {
        let strong = place % (CELL * CELLS) < STRONG;
        strong || place % CELL < THIN
    };
    let columns: Vec<bool> = (0..texture.width).map(is_line).collect();
    let mut texels = Vec::with_capacity(texture.width * texture.height);
    for row in 0..texture.height {
        let whole = is_line(row);
        texels.extend(columns.iter().map(|&column| match whole || column {
            true => INK,
            false => PAPER,
        }));
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat2, DVec2};
    use resample_mesh::scene::{Magnify, TextureUse, Wrap};

    fn scene() -> Scene {
        let use_of = TextureUse {
            texture: 0,
            uv_set: 0,
            uv_linear: DMat2::IDENTITY,
            uv_offset: DVec2::ZERO,
            wrap: [Wrap::Repeat; 2],
            magnify: Magnify::Linear,
        };
        Scene {
            textures: vec![Texture {
                name: String::new(),
                width: 300,
                height: 40,
                texels: Texels::LinearF32(vec![[0.5; 4]; 300 * 40]),
            }],
            materials: vec![Material {
                base_colour: [0.5, 0.25, 0.125, 1.0],
                base_texture: Some(use_of),
                emissive: [1.0; 3],
                emissive_texture: Some(use_of),
                ..Material::default()
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn pictures_that_are_left_out_leave_the_colours_of_the_material() {
        let plain = Textures::LeftOut.applied_to(scene());
        let material = &plain.materials[0];
        assert!(plain.textures.is_empty() && material.base_texture.is_none());
        assert_eq!(material.base_colour, [0.5, 0.25, 0.125, 1.0]);
        assert_eq!(
            (material.emissive, material.emissive_texture),
            ([0.0; 3], None)
        );
    }

    #[test]
    fn a_grid_has_a_line_every_32_texels_and_a_strong_one_every_256() {
        let gridded = Textures::Grid.applied_to(scene());
        assert_eq!(gridded.materials[0].base_colour, [1.0; 4]);
        let Texels::Srgb8(texels) = &gridded.textures[0].texels else {
            panic!("8 bits");
        };
        let row = &texels[10 * 300..11 * 300];
        let inked: Vec<usize> = (0..300).filter(|&x| row[x] == INK).collect();
        let strong = (0..6).chain(256..262);
        let thin = (1..10)
            .filter(|k| k % 8 != 0)
            .flat_map(|k| [32 * k, 32 * k + 1]);
        let mut expected: Vec<usize> = strong.chain(thin).filter(|&x| x < 300).collect();
        expected.sort_unstable();
        assert_eq!(inked, expected);
    }
}
