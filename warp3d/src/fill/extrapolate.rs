//! Colours for what lies beyond the frames of the references: the nearest known pixels go on, ever more blurred.
//!
//! A pixel lies beyond if it would be outside every reference's picture, were it as far away as the nearest known pixel.
//! Nothing hides it, so no side of a rim tells more of it than another. Each such pixel becomes a mean over a disc that
//! grows with its distance; what the disc meets beyond is taken from the known pixel that is nearest to it.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::{DAffine3, DVec2};
use rayon::prelude::*;
use resample_core::narrow::index32;
use resample_core::simd::Vectors;
use resample_core::{Camera, dispatch};

use crate::view::layer::Layer;

/// Places of the disc.
const PLACES: usize = 48;

/// Radius of the disc: this part of the distance to the nearest known pixel, and this many px at least. Guesses: of 0.4 to
/// 1.2 and 3 to 6, these lose least on two of three real pairs and 0.4 dB to the best on the third.
pub(crate) const GROWTH: f64 = 1.1;
const LEAST_RADIUS_PX: f64 = 6.0;

/// Turn from one place of the disc to the next, rad: the golden angle, which fills a disc evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// The cameras of a picture.
#[derive(Clone, Debug)]
pub(crate) struct View<'a> {
    /// That of the new picture.
    pub(crate) camera: &'a Camera,
    /// Those of the references.
    pub(crate) references: Vec<Camera>,
    /// The vectors in which places are computed.
    pub(crate) level: Vectors,
}

/// The number of no pixel.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// Colour and depth of those of the `holes` of `layer` that lie beyond; `None` for all others.
pub(crate) fn beyond(
    layer: &Layer,
    view: &View<'_>,
    known: &[bool],
    holes: &[usize],
) -> Vec<Option<([f32; 3], f32)>> {
    let width = view.camera.width as usize;
    let nearest = nearest_known(known, width);
    let disc = Disc::new([width, layer.rgba.len() / width], view.level);
    let to_world = view.camera.camera_from_world.inverse();
    let of = |&at: &usize| {
        let from = nearest[at];
        if from == NOWHERE {
            return None;
        }
        let depth = layer.depth[from as usize];
        is_beyond(view, &to_world, at, depth).then(|| (mean(layer, &nearest, &disc, at), depth))
    };
    holes.par_iter().map(of).collect()
}

/// Returns true if no reference shows the place at this depth behind a pixel. `to_world` leads there from the new camera.
fn is_beyond(view: &View<'_>, to_world: &DAffine3, at: usize, depth: f32) -> bool {
    let width = view.camera.width as usize;
    let pos_in_screen = DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
    let (origin, direction) = view.camera.ray_in_camera(pos_in_screen);
    // What is infinitely far away lies where something very far away lies.
    let in_camera = origin + f64::from(depth.min(f32::MAX)) * direction;
    let in_world = to_world.transform_point3(in_camera);
    !view.references.iter().any(|reference| {
        let pos = reference.camera_from_world.transform_point3(in_world);
        let at = reference.screen_from_camera(pos);
        let size = DVec2::new(f64::from(reference.width), f64::from(reference.height));
        pos.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmple(size).all()
    })
}

/// Places of a disc of radius 1 over a picture, with weights that fall to its rim.
pub(crate) struct Disc {
    x: [f64; PLACES],
    y: [f64; PLACES],
    weights: [f32; PLACES],
    /// Width and height of the picture, px.
    size: [usize; 2],
    level: Vectors,
}

impl Disc {
    /// The disc over a picture of this size.
    pub(crate) fn new(size: [usize; 2], level: Vectors) -> Self {
        let square = |k: usize| (k as f64 + 0.5) / PLACES as f64;
        let offset = |k: usize| square(k).sqrt() * DVec2::from_angle(k as f64 * GOLDEN_ANGLE);
        Self {
            x: std::array::from_fn(|k| offset(k).x),
            y: std::array::from_fn(|k| offset(k).y),
            weights: std::array::from_fn(|k| (-square(k)).exp() as f32),
            size,
            level,
        }
    }

    /// The distance between two pixels.
    pub(crate) fn distance(&self, a: usize, b: usize) -> f64 {
        self.place(a).distance(self.place(b))
    }

    fn place(&self, at: usize) -> DVec2 {
        DVec2::new((at % self.size[0]) as f64, (at / self.size[0]) as f64)
    }

    /// The pixels that hold the places around a pixel, nearest to them inside the picture, with their weights.
    #[inline(always)]
    pub(crate) fn around(&self, at: usize, radius: f64) -> impl Iterator<Item = (usize, f32)> {
        let middle = self.place(at);
        let pixels = dispatch!(self.level, simd => pixels_of(simd, self, middle, radius));
        let pixels = pixels.into_iter().map(|pixel| pixel as usize);
        pixels.zip(self.weights)
    }
}

#[simd]
fn pixels_of<S: Simd>(_simd: S, disc: &Disc, middle: DVec2, radius: f64) -> [u32; PLACES] {
    // The low bits of a whole number and this one together are those of the whole number, and no cast keeps vectors waiting.
    const WHOLE: f64 = (1u64 << 52) as f64;
    let [width, height] = disc.size.map(|count| count as f64);
    let mut pixels = [0; PLACES];
    for ((pixel, x), y) in pixels.iter_mut().zip(&disc.x).zip(&disc.y) {
        let column = (middle.x + radius * x + 0.5).max(0.0).min(width - 1.0);
        let row = (middle.y + radius * y + 0.5).max(0.0).min(height - 1.0);
        *pixel = (row.floor() * width + column.floor() + WHOLE).to_bits() as u32;
    }
    pixels
}

/// The weighted mean of what the disc around a pixel meets.
fn mean(layer: &Layer, nearest: &[u32], disc: &Disc, at: usize) -> [f32; 3] {
    let radius = (GROWTH * disc.distance(at, nearest[at] as usize)).max(LEAST_RADIUS_PX);
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (pixel, weight) in disc.around(at, radius) {
        let known = nearest[pixel] as usize;
        for (sum, value) in sum.iter_mut().zip(layer.rgba[known]) {
            *sum += weight * value;
        }
        total += weight;
    }
    sum.map(|v| v / total)
}

/// The nearest known pixel of each pixel, exactly (Felzenszwalb and Huttenlocher 2012); [`NOWHERE`] if there is none.
pub(crate) fn nearest_known(known: &[bool], width: usize) -> Vec<u32> {
    let count = known.len();
    // In each column: the nearest known pixel above or below.
    let mut rows = vec![NOWHERE; count];
    let mut above: &[u32] = &[];
    let lines = rows.chunks_exact_mut(width).zip(known.chunks_exact(width));
    for (y, (line, known)) in lines.enumerate() {
        let own = index32(y);
        if y == 0 {
            let marked = line.iter_mut().zip(known);
            marked.for_each(|(row, &known)| *row = if known { own } else { NOWHERE });
        } else {
            let marked = line.iter_mut().zip(known).zip(above);
            marked.for_each(|((row, &known), &above)| *row = if known { own } else { above });
        }
        above = line;
    }
    let mut lines = rows.chunks_exact_mut(width).enumerate().rev();
    let mut below: &[u32] = lines.next().map_or(&[], |(_, line)| line);
    for (y, line) in lines {
        let own = index32(y);
        for (row, &found) in line.iter_mut().zip(below) {
            // Nowhere is farther away than any row.
            let is_nearer = found.abs_diff(own) < row.abs_diff(own);
            *row = if is_nearer { found } else { *row };
        }
        below = line;
    }
    let mut nearest = vec![NOWHERE; count];
    let lines = nearest
        .par_chunks_mut(width)
        .zip(rows.par_chunks(width))
        .enumerate();
    lines.for_each(|(y, (to, rows))| along_row(y, rows, to));
    nearest
}

/// Of the nearest known pixels of each column, the nearest one of each pixel of row `y`.
fn along_row(y: usize, rows: &[u32], to: &mut [u32]) {
    let is_known = |x: usize| rows[x] == y as u32;
    let mut columns = Vec::new();
    let mut first = 0;
    while first < rows.len() {
        // Between two known pixels of the row nothing outside is nearer than they are.
        let mut end = first + 1;
        if is_known(first) {
            to[first] = (y * rows.len() + first) as u32;
            if end < rows.len() && is_known(end) {
                first = end;
                continue;
            }
        }
        while end < rows.len() && !is_known(end) {
            end += 1;
        }
        between(y, rows, first..(end + 1).min(rows.len()), to, &mut columns);
        first = end;
    }
}

/// The same for some columns of the row. `lower` is storage: columns that are the nearest from some place on, and the places.
fn between(
    y: usize,
    rows: &[u32],
    columns: Range<usize>,
    to: &mut [u32],
    lower: &mut Vec<(usize, f64)>,
) {
    let square = |x: usize| (f64::from(rows[x]) - y as f64).powi(2) + (x as f64).powi(2);
    lower.clear();
    for x in columns.clone().filter(|&x| rows[x] != NOWHERE) {
        let mut begin = f64::NEG_INFINITY;
        while let Some(&(last, from)) = lower.last() {
            begin = (square(x) - square(last)) / (2.0 * (x - last) as f64);
            if begin > from {
                break;
            }
            lower.pop();
            begin = f64::NEG_INFINITY;
        }
        lower.push((x, begin));
    }
    let mut at = 0;
    for x in columns {
        while lower.get(at + 1).is_some_and(|(_, from)| *from <= x as f64) {
            at += 1;
        }
        if let Some(&(column, _)) = lower.get(at) {
            to[x] = rows[column] * rows.len() as u32 + column as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_known_pixel_is_found_as_by_trying_all() {
        let (width, height) = (23, 17);
        for step in [3, 41, 97, 1000] {
            let known = |i: usize| (i * 7 + 5).is_multiple_of(step);
            let marks: Vec<bool> = (0..width * height).map(known).collect();
            let found = nearest_known(&marks, width);
            for (at, &from) in found.iter().enumerate() {
                let away2 = |i: usize| {
                    (i % width).abs_diff(at % width).pow(2)
                        + (i / width).abs_diff(at / width).pow(2)
                };
                let least = (0..width * height).filter(|&i| known(i)).map(away2).min();
                let expected = (from != NOWHERE).then(|| away2(from as usize));
                assert_eq!(expected, least, "step {step}, pixel {at}");
            }
        }
    }
}
