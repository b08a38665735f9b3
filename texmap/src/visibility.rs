//! The depth prepass of one tile: which triangle each sub-pixel shows.
//!
//! A sub-pixel belongs to the nearest triangle that covers its position, so surfaces behind, however near, add
//! nothing. Where two triangles are equally near within the rounding of their depth keys, the one that stands first
//! in the scene wins everywhere, so coplanar surfaces do not mix in stripes. Translucent triangles are kept in lists,
//! all of them that lie before the opaque surface.

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::cull::ScreenTriangle;
use crate::edges::Crossing;
use crate::filter::PixelFilter;
use crate::plane::{Plane, moved, narrow};
use crate::span::{NONE, SPAN_PX};

/// Relative rounding of a depth key: three products and two sums in f32 of parts that may be a few times larger than
/// the key, each rounded by 2^-24.
const KEY_ROUNDING: f32 = 16.0 / 16_777_216.0;

/// What each sub-pixel of a tile shows: rows from the top, one sub-pixel for each pixel of the span in each row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// Place in the tile's list of triangles, or [`NONE`].
    pub(crate) ids: Vec<u32>,
    /// Depth keys: larger is nearer.
    pub(crate) keys: Vec<f32>,
    /// Translucent triangles: sub-pixel, depth key, place in the tile's list.
    pub(crate) layers: Vec<Layer>,
}

/// A translucent triangle at one sub-pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    pub(crate) subpixel: u32,
    pub(crate) key: f32,
    pub(crate) id: u32,
}

/// A triangle as one tile sees it, ready to be drawn.
pub(crate) struct RasterTriangle {
    lines: [Plane; 3],
    /// Whether a position on the line itself is inside.
    closed: [bool; 3],
    key: Plane,
    columns: [usize; 2],
    rows: [usize; 2],
}

/// Largest key that lies beyond the near plane.
#[derive(Clone, Copy)]
pub(crate) struct NearKey(pub(crate) f32);

impl RasterTriangle {
    /// `None` if the triangle's rectangle misses the tile.
    pub(crate) fn new(
        triangle: &ScreenTriangle,
        corner_px: [f64; 2],
        filter: &PixelFilter,
    ) -> Option<Self> {
        let range = |axis: usize, per_pixel: usize| {
            let place = |px: f64| (px - corner_px[axis]) * per_pixel as f64;
            let count = (SPAN_PX * per_pixel) as f64;
            // A sub-pixel lies between its column's number and the next, in either direction.
            let first = (place(triangle.bounds_px[axis]) - 1.0).clamp(0.0, count) as usize;
            let last = (place(triangle.bounds_px[axis + 2]) + 1.0)
                .ceil()
                .clamp(0.0, count) as usize;
            [first, last]
        };
        let (columns, rows) = (range(0, 1), range(1, filter.per_pixel));
        if columns[0] >= columns[1] || rows[0] >= rows[1] {
            return None;
        }
        let mut closed = [false; 3];
        let mut lines = [[0.0; 3]; 3];
        for (i, line) in triangle.lines.iter().enumerate() {
            let line = moved(*line, corner_px);
            let steepness = line.x.abs().max(line.y.abs());
            let size = if steepness > 0.0 {
                steepness
            } else {
                line.z.abs()
            };
            // Two triangles that share the line scale it by the same number.
            lines[i] = narrow(line / size);
            closed[i] = line.x > 0.0 || (line.x == 0.0 && line.y > 0.0);
        }
        Some(Self {
            lines,
            closed,
            key: narrow(moved(triangle.key, corner_px)),
            columns,
            rows,
        })
    }

    /// The depth key over the tile.
    pub(crate) fn key(&self) -> &Plane {
        &self.key
    }

    /// Where the way from `p` to `q`, having entered the triangle, leaves it, and the corner opposite the line that it
    /// crosses there; `None` if it ends inside.
    #[inline(always)]
    pub(crate) fn leaves(&self, p: [f32; 2], q: [f32; 2]) -> Option<(Crossing, usize)> {
        let mut first: Option<(Crossing, usize)> = None;
        for (corner, line) in self.lines.iter().enumerate() {
            let value = |at: [f32; 2]| line[0] * at[0] + line[1] * at[1] + line[2];
            let (here, there) = (value(p), value(q));
            if there < 0.0 && there < here {
                let t = (here / (here - there)).max(0.0);
                if first.is_none_or(|(before, _)| t < before.t) {
                    first = Some((
                        Crossing {
                            t,
                            across: [line[0], line[1]],
                        },
                        corner,
                    ));
                }
            }
        }
        first
    }

    /// Whether the way from `p` to `q` enters the triangle, not leaves it, where it crosses the line opposite `corner`.
    #[inline(always)]
    pub(crate) fn opens(&self, corner: usize, p: [f32; 2], q: [f32; 2]) -> bool {
        let line = &self.lines[corner];
        line[0] * (q[0] - p[0]) + line[1] * (q[1] - p[1]) > 0.0
    }

    /// Calls `hit` with sub-pixel and key wherever the triangle covers a sub-pixel beyond the near plane.
    #[inline(always)]
    fn scan(&self, filter: &PixelFilter, near: NearKey, mut hit: impl FnMut(usize, f32)) {
        for row in self.rows[0]..self.rows[1] {
            let y = filter.y_px(row);
            let x0 = filter.offset_px[row % filter.per_pixel];
            for column in self.columns[0]..self.columns[1] {
                let x = column as f32 + x0;
                let value = |p: &Plane| p[0] * x + p[1] * y + p[2];
                let e = [
                    value(&self.lines[0]),
                    value(&self.lines[1]),
                    value(&self.lines[2]),
                ];
                let inside = |i: usize| e[i] > 0.0 || (e[i] == 0.0 && self.closed[i]);
                if inside(0) && inside(1) && inside(2) {
                    let key = value(&self.key);
                    if key <= near.0 {
                        hit(row * SPAN_PX + column, key);
                    }
                }
            }
        }
    }
}

/// Draws a triangle row by row, a row of sub-pixels at a time.
#[simd]
fn draw_rows<S: Simd>(
    _: S,
    visibility: &mut Visibility,
    triangle: &RasterTriangle,
    id: u32,
    filter: &PixelFilter,
    near: NearKey,
) {
    let [first, last] = triangle.columns;
    let [l0, l1, l2] = triangle.lines;
    let [c0, c1, c2] = triangle.closed;
    let key_plane = triangle.key;
    for row in triangle.rows[0]..triangle.rows[1] {
        let y = filter.y_px(row);
        let x0 = filter.offset_px[row % filter.per_pixel];
        let ids = &mut visibility.ids[row * SPAN_PX + first..row * SPAN_PX + last];
        let keys = &mut visibility.keys[row * SPAN_PX + first..row * SPAN_PX + last];
        // No branch inside: every sub-pixel of the row is looked at, and what it shows is chosen.
        for (k, (shown, before)) in ids.iter_mut().zip(keys).enumerate() {
            let x = (first + k) as i32 as f32 + x0;
            let (e0, e1, e2) = (at(&l0, x, y), at(&l1, x, y), at(&l2, x, y));
            let inside = ((e0 > 0.0) | ((e0 == 0.0) & c0))
                & ((e1 > 0.0) | ((e1 == 0.0) & c1))
                & ((e2 > 0.0) | ((e2 == 0.0) & c2));
            let key = at(&key_plane, x, y);
            let seen = inside & (key <= near.0) & (key > *before + key.abs() * KEY_ROUNDING);
            *shown = if seen { id } else { *shown };
            *before = if seen { key } else { *before };
        }
    }
}

#[inline(always)]
fn at(plane: &Plane, x: f32, y: f32) -> f32 {
    plane[0] * x + plane[1] * y + plane[2]
}

impl Visibility {
    /// Forgets the last tile.
    pub(crate) fn clear(&mut self, filter: &PixelFilter) {
        let count = SPAN_PX * SPAN_PX * filter.per_pixel;
        self.ids.clear();
        self.ids.resize(count, NONE);
        self.keys.clear();
        self.keys.resize(count, f32::NEG_INFINITY);
        self.layers.clear();
    }

    /// Draws a triangle where it is nearer than the surface stored there.
    pub(crate) fn draw(
        &mut self,
        triangle: &RasterTriangle,
        id: u32,
        filter: &PixelFilter,
        near: NearKey,
        simd: Vectors,
    ) {
        dispatch!(simd, simd => draw_rows(simd, self, triangle, id, filter, near));
    }

    /// As [`Visibility::draw`], where `shows` says that the sub-pixel is not cut out.
    pub(crate) fn draw_cut(
        &mut self,
        triangle: &RasterTriangle,
        id: u32,
        filter: &PixelFilter,
        near: NearKey,
        mut shows: impl FnMut(usize) -> bool,
    ) {
        let (ids, keys) = (&mut self.ids, &mut self.keys);
        triangle.scan(filter, near, |at, key| {
            let before = keys[at];
            if key > before + key.abs() * KEY_ROUNDING && shows(at) {
                ids[at] = id;
                keys[at] = key;
            }
        });
    }

    /// Lists a translucent triangle wherever it lies before the opaque surface.
    pub(crate) fn list(
        &mut self,
        triangle: &RasterTriangle,
        id: u32,
        filter: &PixelFilter,
        near: NearKey,
    ) {
        let (keys, layers) = (&self.keys, &mut self.layers);
        triangle.scan(filter, near, |at, key| {
            if key > keys[at] {
                layers.push(Layer {
                    subpixel: at as u32,
                    key,
                    id,
                });
            }
        });
    }

    /// Orders the layers by sub-pixel, the farthest first; equally far ones in the order of the scene.
    pub(crate) fn sort_layers(&mut self) {
        self.layers.sort_by(|a, b| {
            a.subpixel
                .cmp(&b.subpixel)
                .then(a.key.total_cmp(&b.key))
                .then(a.id.cmp(&b.id))
        });
    }
}
