//! Halving a level with the binomial filter, along each axis that is longer than one texel; see [`crate::prepare::mip`].

use glam::Vec4;
use rayon::prelude::*;

use crate::prepare::level::wrapped;
use crate::prepare::level::{Level, LevelTexels, narrowed, stride};
use resample_mesh::scene::Wrap;

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
        let start = fine.row_start(row, wrap[1]);
        for (texel, place) in source.iter_mut().zip(start..) {
            *texel = fine.texels.at(place);
        }
        for (texel, taps) in out.iter_mut().zip(columns) {
            for (&w, i) in taps.weights.iter().zip(taps.first..) {
                *texel += source[wrapped(i, fine.size[0], wrap[0])] * w;
            }
        }
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
