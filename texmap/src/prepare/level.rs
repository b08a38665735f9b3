//! One level of a pyramid: its texels in linear light, and the filter that lies between it and the full texture.

use std::ops::Range;
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

/// 2^23: from here to 2^24 a float of 32 bits has no fraction, and its lowest bits are the whole number.
const WHOLE_FROM: f32 = 8_388_608.0;

/// In parts of [`UNIT`], rounded; what lies beyond 0 to 1 is cut off.
///
/// One addition rounds all four parts; a cast would convert them one by one.
#[inline(always)]
pub(crate) fn narrowed(texel: Vec4) -> [u16; 4] {
    let inside = texel.max(Vec4::ZERO).min(Vec4::ONE);
    (inside * UNIT + Vec4::splat(WHOLE_FROM))
        .to_array()
        .map(|part| (part.to_bits() & 0xffff) as u16)
}

/// Linear light of 8-bit sRGB.
pub(crate) static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

impl LevelTexels {
    /// Puts the texels from a place on into `out`.
    fn put(&self, start: usize, out: &mut [Vec4]) {
        let texels = start..start + out.len();
        match self {
            Self::Unorm16(all) => {
                for (out, texel) in out.iter_mut().zip(&all[texels]) {
                    *out = widened(*texel) * (1.0 / UNIT);
                }
            }
            Self::Srgb8(all) => {
                for (out, texel) in out.iter_mut().zip(&all[texels]) {
                    *out = linear(*texel);
                }
            }
            Self::Float(all) => out.copy_from_slice(&all[texels]),
        }
    }
}

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

/// As [`padded`], of a picture whose rows are made, some at a time: they stay in the cache until they are kept.
pub(crate) fn padded_rows<U: Copy + Default + Send>(
    made: &(dyn Fn(Range<usize>, &mut [Vec4]) + Sync),
    [width, height]: [usize; 2],
    kept: impl Fn(Vec4) -> U + Sync,
) -> Vec<U> {
    let stride = stride(width);
    let mut padded = vec![U::default(); stride * height];
    padded
        .par_chunks_mut(stride * BAND)
        .enumerate()
        .for_each_init(Vec::new, |texels, (band, out)| {
            let rows = band * BAND..height.min((band + 1) * BAND);
            texels.resize(rows.len() * width, Vec4::ZERO);
            made(rows, texels);
            for (out, row) in out.chunks_mut(stride).zip(texels.chunks_exact(width)) {
                for (out, texel) in out.iter_mut().zip(row) {
                    *out = kept(*texel);
                }
            }
        });
    padded
}

// Halving a level with the binomial filter, along each axis that is longer than one texel; see [`crate::prepare::mip`].

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

/// Rows of a level that one task makes: the rows of the finer level that it needs beside its own are a tenth.
const BAND: usize = 16;

/// The next coarser level.
pub(crate) fn halved(fine: &Level, wrap: [Wrap; 2]) -> Level {
    let filters = fine.size.map(AxisFilter::new);
    let size = filters.each_ref().map(|f| f.taps.len());
    let stride = stride(size[0]);
    let made = |band: usize| made_rows(fine, &filters, band, wrap);
    let texels = match fine.texels {
        LevelTexels::Float(_) => {
            LevelTexels::Float(in_bands([stride, size[1]], made, |texel| texel))
        }
        LevelTexels::Unorm16(_) | LevelTexels::Srgb8(_) => {
            LevelTexels::Unorm16(in_bands([stride, size[1]], made, narrowed))
        }
    };
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
        stride,
        texels,
        scale: [u[0], v[0]],
        variance: [u[1], v[1]],
        kappa: [u[2], v[2]],
    }
}

/// Fills a level of `stride` times `rows` texels, a band of rows at a time.
fn in_bands<T: Copy + Default + Send>(
    [stride, rows]: [usize; 2],
    made: impl Fn(usize) -> Vec<Vec4> + Sync,
    kept: impl Fn(Vec4) -> T + Sync,
) -> Vec<T> {
    let mut texels = vec![T::default(); stride * rows];
    texels
        .par_chunks_mut(stride * BAND)
        .enumerate()
        .for_each(|(band, out)| {
            let made = made(band);
            let width = made.len() / out.len().div_ceil(stride);
            for (out, made) in out.chunks_mut(stride).zip(made.chunks_exact(width)) {
                out.iter_mut()
                    .zip(made)
                    .for_each(|(out, texel)| *out = kept(*texel));
            }
        });
    texels
}

/// The rows of a band of the level above `fine`.
fn made_rows(fine: &Level, filters: &[AxisFilter; 2], band: usize, wrap: [Wrap; 2]) -> Vec<Vec4> {
    let [columns, rows] = filters.each_ref().map(|filter| &filter.taps);
    let rows = &rows[band * BAND..rows.len().min((band + 1) * BAND)];
    let ends = |taps: &Taps| taps.first + taps.weights.len() as i32;
    let first = rows.iter().map(|taps| taps.first).min().unwrap_or(0);
    let end = rows.iter().map(ends).max().unwrap_or(0);
    let width = columns.len();
    let mut narrow = vec![Vec4::ZERO; width * (end - first) as usize];
    let mut source = vec![Vec4::ZERO; fine.size[0]];
    for (out, row) in narrow.chunks_exact_mut(width).zip(first..) {
        fine.texels.put(fine.row_start(row, wrap[1]), &mut source);
        halve_row((&source, wrap[0]), columns, out);
    }
    let mut made = vec![Vec4::ZERO; width * rows.len()];
    for (out, taps) in made.chunks_exact_mut(width).zip(rows) {
        for (&w, i) in taps.weights.iter().zip(taps.first..) {
            let source = &narrow[(i - first) as usize * width..][..width];
            out.iter_mut()
                .zip(source)
                .for_each(|(texel, s)| *texel += *s * w);
        }
    }
    made
}
/// A row of half the width.
fn halve_row((source, wrap): (&[Vec4], Wrap), columns: &[Taps], out: &mut [Vec4]) {
    // Those of an even width are binomial, and all but the first and the last lie within it.
    let inner = match source.len() == 2 * columns.len() && source.len() > 2 {
        true => 1..columns.len() - 1,
        false => 0..0,
    };
    let windows = source[1..].windows(4).step_by(2);
    for (texel, window) in out[inner.clone()].iter_mut().zip(windows) {
        let [a, b, c, d] = [window[0], window[1], window[2], window[3]];
        *texel = a * 0.125 + b * 0.375 + c * 0.375 + d * 0.125;
    }
    for (at, (texel, taps)) in out.iter_mut().zip(columns).enumerate() {
        if inner.contains(&at) {
            continue;
        }
        for (&w, i) in taps.weights.iter().zip(taps.first..) {
            *texel += source[wrapped(i, source.len(), wrap)] * w;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_rounded_and_cut_off() {
        for code in 0..=u16::MAX {
            let part = f32::from(code) / UNIT;
            assert_eq!(narrowed(Vec4::splat(part)), [code; 4], "{code}");
        }
        let beyond = Vec4::new(-1.0, 2.0, f32::INFINITY, f32::NAN);
        assert_eq!(narrowed(beyond), [0, u16::MAX, u16::MAX, 0]);
        // 16,383.75 and 49,151.25 of 65,535.
        assert_eq!(
            narrowed(Vec4::new(0.25, 0.75, 0.0, 1.0)),
            [16_384, 49_151, 0, u16::MAX]
        );
    }
}
