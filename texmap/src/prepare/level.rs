//! One level of a pyramid: its texels in linear light, and the filter that lies between it and the full texture.

use std::sync::{Arc, LazyLock};

use glam::Vec4;
use rayon::prelude::*;

use resample_core::image::linear_from_srgb;
use resample_mesh::scene::Wrap;

/// One level: linear light, rows from the top.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Width and height, texels.
    pub(crate) size: [usize; 2],
    pub(crate) texels: LevelTexels,
    /// Texels from one row to the next; at least the width.
    pub(crate) stride: usize,
    /// Texels of this level per texel of the full texture, along u and v; at most 1.
    pub(crate) scale: [f32; 2],
    /// Variance of the filter between this level and the full texture, in squared texels of this level.
    pub(crate) variance: [f32; 2],
    /// Fourth cumulant of the same filter, in texels of this level to the fourth power; not positive.
    pub(crate) kappa: [f32; 2],
}

/// Red, green, blue and alpha of a level, in linear light.
#[derive(Clone, Debug)]
pub(crate) enum LevelTexels {
    /// Of 8-bit pictures, in parts of [`UNIT`]: 8 bytes in place of 16, since look-ups wait for memory. A step is a
    /// twentieth of the darkest step of 8-bit sRGB.
    Unorm16(Vec<[u16; 4]>),
    /// A large picture as it is in the file, its alpha ignored: 4 bytes, decoded by a table.
    Srgb8(Arc<Vec<[u8; 4]>>),
    /// Of all others.
    Float(Vec<Vec4>),
}

/// The largest number of [`LevelTexels::Unorm16`] stands for 1.
pub(crate) const UNIT: f32 = 65535.0;

/// The texel inside 0..count that lies at `index`.
#[inline(always)]
pub(crate) fn wrapped(index: i32, count: usize, wrap: Wrap) -> usize {
    if (index as usize) < count {
        return index as usize;
    }
    let count_i = count as i32;
    match wrap {
        Wrap::Clamp => index.clamp(0, count_i - 1) as usize,
        Wrap::Repeat if count.is_power_of_two() => index as usize & (count - 1),
        Wrap::Repeat => index.rem_euclid(count_i) as usize,
        Wrap::Mirror => {
            let folded = index.rem_euclid(2 * count_i);
            folded.min(2 * count_i - 1 - folded) as usize
        }
    }
}

impl Level {
    /// The texel at column and row, which may lie beyond the borders.
    #[inline(always)]
    pub(crate) fn texel(&self, column: i32, row: i32, wrap: [Wrap; 2]) -> Vec4 {
        self.texels
            .at(self.row_start(row, wrap[1]) + wrapped(column, self.size[0], wrap[0]))
    }

    /// Where the texels of a row begin.
    #[inline(always)]
    pub(crate) fn row_start(&self, row: i32, wrap: Wrap) -> usize {
        wrapped(row, self.size[1], wrap) * self.stride
    }
}

impl LevelTexels {
    /// The texel at a place.
    #[inline(always)]
    pub(crate) fn at(&self, place: usize) -> Vec4 {
        match self {
            Self::Unorm16(texels) => widened(texels[place]) * (1.0 / UNIT),
            Self::Srgb8(texels) => linear(texels[place]),
            Self::Float(texels) => texels[place],
        }
    }
}

/// Linear light, alpha ignored.
#[inline(always)]
pub(crate) fn linear([r, g, b, _]: [u8; 4]) -> Vec4 {
    let at = |code: u8| LINEAR[usize::from(code)];
    Vec4::new(at(r), at(g), at(b), 1.0)
}

/// As floating point, still in parts of [`UNIT`].
#[inline(always)]
pub(crate) fn widened(texel: [u16; 4]) -> Vec4 {
    let [r, g, b, a] = texel;
    Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
}

/// In parts of [`UNIT`], rounded.
#[inline(always)]
pub(crate) fn narrowed(texel: Vec4) -> [u16; 4] {
    (texel * UNIT + Vec4::splat(0.5))
        .to_array()
        .map(|part| part as u16)
}

/// Linear light of 8-bit sRGB.
pub(crate) static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

/// Texels from one row to the next: a cache line more than a row has, since look-ups in rows that lie a power of two
/// apart drive one another from the cache.
pub(crate) fn stride(width: usize) -> usize {
    if width < 64 { width } else { width + 8 }
}

/// The texels of a picture, with room at the end of each row.
pub(crate) fn padded<T: Sync, U: Copy + Default + Send>(
    texels: &[T],
    [width, height]: [usize; 2],
    texel: impl Fn(&T) -> U + Sync,
) -> Vec<U> {
    let stride = stride(width);
    let mut padded = vec![U::default(); stride * height];
    padded
        .par_chunks_mut(stride)
        .zip(texels.par_chunks(width))
        .for_each(|(out, row)| {
            out.iter_mut()
                .zip(row)
                .for_each(|(out, from)| *out = texel(from));
        });
    padded
}
