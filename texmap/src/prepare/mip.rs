//! Pyramids: a texture in linear light, and its ever coarser levels.
//!
//! Each level halves the one before with the binomial filter 1 3 3 1 (three 2-texel boxes after one another), along
//! each axis that is longer than one texel. A plain 2-texel box would let patterns just above the new level's limit
//! through almost whole; the longer filter suppresses them by the third power. What it blurs is known exactly: its
//! variance and fourth cumulant are kept with the level, and whoever gathers texels takes them off the footprint.
//!
//! Limits: an odd length is halved by a quadratic B-spline of the right width, whose mean is kept to about 1 percent
//! per texel and exactly over a flat texture.

use std::sync::Arc;

use glam::Vec4;

use crate::prepare::level::{LINEAR, halved, narrowed, padded, padded_rows, stride};
pub(crate) use crate::prepare::level::{Level, LevelTexels, UNIT, linear};
use crate::prepare::maps::{self, Rows};
use crate::prepare::texel_use::TexelUse;
use resample_mesh::scene::{Magnify, Texels, Texture, Wrap};

/// A texture as one or more materials use it, with all its levels.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    /// The full texture first; the last level is one texel.
    pub(crate) levels: Vec<Level>,
    /// Wrapping beyond the borders.
    pub(crate) wrap: [Wrap; 2],
    /// The reconstruction kernel of the full texture.
    pub(crate) magnify: Magnify,
}

impl Pyramid {
    /// Decodes the picture at a place among all pictures of a scene, and builds its levels.
    pub(crate) fn new(
        (pictures, place): (&[Texture], usize),
        usage: TexelUse,
        wrap: [Wrap; 2],
        magnify: Magnify,
    ) -> Self {
        let texture = &pictures[place];
        let size = [texture.width, texture.height];
        let (texels, stride) = decoded((pictures, texture), usage, wrap);
        let first = Level {
            size,
            stride,
            texels,
            scale: [1.0; 2],
            variance: [0.0; 2],
            kappa: [0.0; 2],
        };
        let mut levels = vec![first];
        while let Some(next) = levels
            .last()
            .filter(|level| level.size != [1, 1])
            .map(|l| halved(l, wrap))
        {
            levels.push(next);
        }
        Self {
            levels,
            wrap,
            magnify,
        }
    }
}

impl Pyramid {
    /// The mean of all texels: the last level.
    pub(crate) fn mean(&self) -> Vec4 {
        self.levels
            .last()
            .map_or(Vec4::ONE, |level| level.texel(0, 0, self.wrap))
    }

    /// Returns true if texels of both lie at the same places, level by level, with the same filters.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        // Levels and their filters follow from these.
        let size = |pyramid: &Self| pyramid.levels[0].size;
        size(self) == size(other) && self.wrap == other.wrap && self.magnify == other.magnify
    }
}

fn decoded(
    (pictures, texture): (&[Texture], &Texture),
    usage: TexelUse,
    wrap: [Wrap; 2],
) -> (LevelTexels, usize) {
    let finished = |[r, g, b, a]: [f32; 4]| match usage {
        TexelUse::Weighted => Vec4::new(r * a, g * a, b * a, a),
        _ => Vec4::new(r, g, b, 1.0),
    };
    let size = [texture.width, texture.height];
    let stride = stride(size[0]);
    let unorm = |texels| (LevelTexels::Unorm16(texels), stride);
    let by_rows = |rows: &Rows| unorm(padded_rows(rows, size, narrowed));
    match (&texture.texels, usage) {
        (_, TexelUse::Numbers) => by_rows(&maps::numbers(texture)),
        (_, TexelUse::WithOcclusion { picture }) => {
            by_rows(&maps::numbers_with(texture, &pictures[picture]))
        }
        (_, TexelUse::ColourWith { picture }) => {
            by_rows(&maps::colour_with(texture, &pictures[picture]))
        }
        (_, TexelUse::Normals { scale }) => by_rows(&maps::normals(texture, scale, wrap)),
        (
            of_base,
            TexelUse::Metals {
                picture,
                wrap,
                alpha,
            },
        ) => {
            let metals = maps::weighted_by_metal((texture, alpha), (&pictures[picture], wrap));
            match of_base {
                Texels::Srgb8(_) => by_rows(&metals),
                Texels::LinearF32(_) => {
                    let texels = padded_rows(&metals, size, |texel| texel);
                    (LevelTexels::Float(texels), stride)
                }
            }
        }
        (Texels::LinearF32(texels), _) => {
            let texel = |texel: &[f32; 4]| finished(*texel);
            (LevelTexels::Float(padded(texels, size, texel)), stride)
        }
        (Texels::Srgb8(texels), TexelUse::Opaque) if texels.len() >= SHARED => {
            (LevelTexels::Srgb8(Arc::clone(texels)), size[0])
        }
        (Texels::Srgb8(texels), _) => {
            let at = |code: u8| LINEAR[usize::from(code)];
            let texel = |&[r, g, b, a]: &[u8; 4]| {
                narrowed(finished([at(r), at(g), at(b), f32::from(a) / 255.0]))
            };
            unorm(padded(texels, size, texel))
        }
    }
}

/// The memory that the levels of a texture take, bytes; what they share with the scene is not counted.
#[cfg(feature = "input")]
pub(crate) fn bytes_of_levels(texture: &Texture, usage: TexelUse) -> u64 {
    let texels = (texture.width * texture.height) as u64;
    let is_shared = texels as usize >= SHARED && usage == TexelUse::Opaque;
    let (first, texel) = match (&texture.texels, usage) {
        (Texels::Srgb8(_), _) if is_shared => (0, size_of::<[u16; 4]>()),
        (Texels::LinearF32(_), TexelUse::Opaque | TexelUse::Weighted | TexelUse::Metals { .. }) => {
            (texels, size_of::<Vec4>())
        }
        _ => (texels, size_of::<[u16; 4]>()),
    };
    // Coarser levels have a quarter of the texels each.
    (first + texels / 3) * texel as u64
}

/// Texels of a picture that is read where it lies: 16 million of them are 128 MB as [`LevelTexels::Unorm16`].
const SHARED: usize = 1 << 24;
