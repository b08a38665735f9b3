//! Pyramids: a texture in linear light, and its ever coarser levels.
//!
//! Each level halves the one before with the binomial filter 1 3 3 1 (three 2-texel boxes after one another), along
//! each axis that is longer than one texel. A plain 2-texel box would let patterns just above the new level's limit
//! through almost whole; the longer filter suppresses them by the third power. What it blurs is known exactly: its
//! variance and fourth cumulant are kept with the level, and whoever gathers texels takes them off the footprint.
//!
//! Limits: an odd length is halved by a quadratic B-spline of the right width, whose mean is kept to about 1 percent
//! per texel and exactly over a flat texture.

use glam::Vec4;
use rayon::prelude::*;

use crate::scene::{Magnify, Texels, Texture, Wrap};
use resample_core::image::linear_from_srgb;

/// One level: linear light, rows from the top.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Width and height, texels.
    pub(crate) size: [usize; 2],
    pub(crate) texels: LevelTexels,
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
    /// Of all others.
    Float(Vec<Vec4>),
}

/// The largest number of [`LevelTexels::Unorm16`] stands for 1.
pub(crate) const UNIT: f32 = 65535.0;

/// A texture as one or more materials use it, with all its levels.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    /// The full texture first; the last level is one texel.
    pub(crate) levels: Vec<Level>,
    /// What lies beyond the borders.
    pub(crate) wrap: [Wrap; 2],
    /// The reconstruction kernel of the full texture.
    pub(crate) magnify: Magnify,
}

/// What a material makes of alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AlphaUse {
    /// Alpha counts as 1.
    Ignored,
    /// Colour is weighted by it: colour is premultiplied before it is filtered.
    Weights,
}

impl Pyramid {
    /// Decodes a texture and builds its levels.
    pub(crate) fn new(
        texture: &Texture,
        alpha: AlphaUse,
        wrap: [Wrap; 2],
        magnify: Magnify,
    ) -> Self {
        let texels = decoded(texture, alpha);
        let first = Level {
            size: [texture.width, texture.height],
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
        wrapped(row, self.size[1], wrap) * self.size[0]
    }
}

impl LevelTexels {
    /// The texel at a place.
    #[inline(always)]
    pub(crate) fn at(&self, place: usize) -> Vec4 {
        match self {
            Self::Unorm16(texels) => widened(texels[place]) * (1.0 / UNIT),
            Self::Float(texels) => texels[place],
        }
    }

    /// Texels as these are kept.
    fn alike(&self, texels: Vec<Vec4>) -> Self {
        match self {
            Self::Unorm16(_) => Self::Unorm16(texels.into_par_iter().map(narrowed).collect()),
            Self::Float(_) => Self::Float(texels),
        }
    }
}

/// As floating point, still in parts of [`UNIT`].
#[inline(always)]
pub(crate) fn widened(texel: [u16; 4]) -> Vec4 {
    let [r, g, b, a] = texel;
    Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
}

/// In parts of [`UNIT`], rounded.
#[inline(always)]
fn narrowed(texel: Vec4) -> [u16; 4] {
    (texel * UNIT + Vec4::splat(0.5))
        .to_array()
        .map(|part| part as u16)
}

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

fn decoded(texture: &Texture, alpha: AlphaUse) -> LevelTexels {
    let finished = |[r, g, b, a]: [f32; 4]| match alpha {
        AlphaUse::Ignored => Vec4::new(r, g, b, 1.0),
        AlphaUse::Weights => Vec4::new(r * a, g * a, b * a, a),
    };
    match &texture.texels {
        Texels::LinearF32(texels) => {
            LevelTexels::Float(texels.iter().map(|&t| finished(t)).collect())
        }
        Texels::Srgb8(texels) => {
            let linear: Vec<f32> = (0..=255u8)
                .map(|code| linear_from_srgb(f32::from(code) / 255.0))
                .collect();
            let at = |code: u8| linear[usize::from(code)];
            let texel = |&[r, g, b, a]: &[u8; 4]| {
                narrowed(finished([at(r), at(g), at(b), f32::from(a) / 255.0]))
            };
            LevelTexels::Unorm16(texels.par_iter().map(texel).collect())
        }
    }
}

/// The weights of one coarse texel: the first fine texel and what each one from there on counts.
struct Taps {
    first: i32,
    weights: Vec<f32>,
}

/// The halving of one axis.
struct AxisFilter {
    taps: Vec<Taps>,
    ratio: f64,
    variance: f64,
    kappa: f64,
}

impl AxisFilter {
    fn new(count: usize) -> Self {
        let coarse = count.div_ceil(2);
        let ratio = count as f64 / coarse as f64;
        let mut filter = Self {
            taps: Vec::new(),
            ratio,
            variance: 0.0,
            kappa: 0.0,
        };
        for j in 0..coarse {
            let centre = (j as f64 + 0.5) * ratio;
            let (first, weights) = if count == 1 {
                (0, vec![1.0])
            } else if 2 * coarse == count {
                (2 * j as i32 - 1, vec![0.125, 0.375, 0.375, 0.125])
            } else {
                spline_taps(centre, ratio)
            };
            let moment = |power: i32| -> f64 {
                let distance = |k: usize| f64::from(first) + k as f64 + 0.5 - centre;
                weights
                    .iter()
                    .enumerate()
                    .map(|(k, w)| w * distance(k).powi(power))
                    .sum()
            };
            let (mean, second, fourth) = (moment(1), moment(2), moment(4));
            filter.variance += (second - mean * mean) / coarse as f64;
            filter.kappa += (fourth - 3.0 * second * second) / coarse as f64;
            filter.taps.push(Taps {
                first,
                weights: weights.iter().map(|&w| w as f32).collect(),
            });
        }
        filter
    }
}

/// A quadratic B-spline of width 3 `ratio` at `centre` (fine texels), sampled at the fine texels and normalised.
fn spline_taps(centre: f64, ratio: f64) -> (i32, Vec<f64>) {
    let first = (centre - 1.5 * ratio - 0.5).ceil();
    let last = (centre + 1.5 * ratio - 0.5).floor();
    let weight = |i: f64| {
        let t = ((i + 0.5 - centre) / ratio).abs();
        if t < 0.5 {
            0.75 - t * t
        } else {
            0.5 * (1.5 - t).max(0.0).powi(2)
        }
    };
    let raw: Vec<f64> = (0..=(last - first) as usize)
        .map(|k| weight(first + k as f64))
        .collect();
    let sum: f64 = raw.iter().sum();
    (first as i32, raw.iter().map(|w| w / sum).collect())
}

fn halved(fine: &Level, wrap: [Wrap; 2]) -> Level {
    let filters = fine.size.map(AxisFilter::new);
    let size = filters.each_ref().map(|f| f.taps.len());
    let mut narrow = vec![Vec4::ZERO; size[0] * fine.size[1]];
    narrow
        .par_chunks_mut(size[0])
        .enumerate()
        .for_each(|(row, out)| {
            let start = row * fine.size[0];
            for (texel, taps) in out.iter_mut().zip(&filters[0].taps) {
                for (&w, i) in taps.weights.iter().zip(taps.first..) {
                    *texel += fine.texels.at(start + wrapped(i, fine.size[0], wrap[0])) * w;
                }
            }
        });
    let mut texels = vec![Vec4::ZERO; size[0] * size[1]];
    texels
        .par_chunks_mut(size[0])
        .zip(&filters[1].taps)
        .for_each(|(out, taps)| {
            for (&w, i) in taps.weights.iter().zip(taps.first..) {
                let source = &narrow[wrapped(i, fine.size[1], wrap[1]) * size[0]..][..size[0]];
                out.iter_mut()
                    .zip(source)
                    .for_each(|(texel, s)| *texel += *s * w);
            }
        });
    let axis = |k: usize| {
        let AxisFilter {
            ratio,
            variance,
            kappa,
            ..
        } = &filters[k];
        let scale = f64::from(fine.scale[k]) / ratio;
        let variance = (f64::from(fine.variance[k]) + variance) / (ratio * ratio);
        let kappa = (f64::from(fine.kappa[k]) + kappa) / ratio.powi(4);
        [scale as f32, variance as f32, kappa as f32]
    };
    let (u, v) = (axis(0), axis(1));
    Level {
        size,
        texels: fine.texels.alike(texels),
        scale: [u[0], v[0]],
        variance: [u[1], v[1]],
        kappa: [u[2], v[2]],
    }
}
