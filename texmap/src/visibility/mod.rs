//! The depth prepass of one tile: which triangle each sub-pixel shows.
//!
//! A sub-pixel belongs to the nearest triangle that covers its position, so surfaces behind, however near, add
//! nothing. Where two triangles are equally near within the rounding of their depth keys, the one that stands first
//! in the scene wins everywhere, so coplanar surfaces do not mix in stripes. Translucent triangles are kept in lists,
//! all of them that lie before the opaque surface. After the prepass: columns where the surface changes and runs of one triangle
//! (`runs`), the filter of a pixel (`filter`), the exact place of a change (`edges`), and the share that each triangle has of a pixel
//! (`fragments`).

pub(crate) mod runs;
pub(crate) mod filter;
pub(crate) mod edges;
pub(crate) mod walk;
pub(crate) mod fragments;

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16, u32x16};
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_core::simd::Vectors;

use crate::project::cull::ScreenTriangle;
use crate::screen::{IOTA, LANES, NONE, Plane, SPAN_HEIGHT, SPAN_WIDTH, moved, narrow, value};
use crate::visibility::edges::Crossing;
use crate::visibility::filter::PixelFilter;

/// Relative rounding of a depth key: three products and two sums in f32 of parts that may be a few times larger than
/// the key, each rounded by 2^-24.
const KEY_ROUNDING: f32 = 16.0 / 16_777_216.0;

/// The triangle of each sub-pixel of a tile: rows from the top, one sub-pixel for each pixel of the span in each row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// Place in the tile's list of triangles, or [`NONE`].
    pub(crate) ids: Vec<u32>,
    /// Depth keys: larger is nearer.
    pub(crate) keys: Vec<f32>,
    /// The triangle that is all that is seen, if there is one; keys are not set then.
    pub(crate) alone: Option<u32>,
    /// Translucent triangles: sub-pixel, depth key, place in the tile's list.
    pub(crate) layers: Vec<TranslucentLayer>,
}

/// A translucent triangle at one sub-pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TranslucentLayer {
    pub(crate) subpixel: u32,
    pub(crate) key: f32,
    pub(crate) id: u32,
}

/// A triangle as one tile sees it, ready to be drawn.
pub(crate) struct RasterTriangle {
    lines: [Plane; 3],
    /// True where a position on the line itself is inside.
    closed: [bool; 3],
    key: Plane,
    columns: [usize; 2],
    rows: [usize; 2],
}

/// A triangle that is seen where its alpha reaches a cutoff.
#[derive(Clone, Copy)]
pub(crate) struct CutOut<'a> {
    pub(crate) triangle: &'a RasterTriangle,
    pub(crate) id: u32,
    pub(crate) cutoff: f32,
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
        let range = |axis: usize, span: usize, per_pixel: usize| {
            let place = |px: f32| (f64::from(px) - corner_px[axis]) * per_pixel as f64;
            let count = (span * per_pixel) as f64;
            // A sub-pixel lies between its column's number and the next, in either direction.
            let first = (place(triangle.seen.bounds_px[axis]) - 1.0).clamp(0.0, count) as usize;
            let last = (place(triangle.seen.bounds_px[axis + 2]) + 1.0)
                .ceil()
                .clamp(0.0, count) as usize;
            [first, last]
        };
        let (columns, rows) = (
            range(0, SPAN_WIDTH, 1),
            range(1, SPAN_HEIGHT, filter.per_pixel),
        );
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
        let new = Self {
            lines,
            closed,
            key: narrow(moved(triangle.key, corner_px)),
            columns,
            rows,
        };
        Some(new).filter(|new| !new.misses_tile())
    }

    /// Returns true if the whole tile lies outside one of the lines, whatever their rounding.
    fn misses_tile(&self) -> bool {
        let outside = |line: &Plane| {
            TILE_CORNERS
                .iter()
                .all(|&at| value(line, at) < -slack(line))
        };
        self.lines.iter().any(outside)
    }

    /// Returns true if it covers every sub-pixel of the tile, whatever the rounding of its lines.
    pub(crate) fn covers_tile(&self, near: NearKey) -> bool {
        TILE_CORNERS.iter().all(|&at| {
            let clear = |line: &Plane| value(line, at) > slack(line);
            self.lines.iter().all(clear) && value(&self.key, at) + slack(&self.key) < near.0
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
        for (corner, (line, closed)) in self.lines.iter().zip(self.closed).enumerate() {
            let value = |at: [f32; 2]| line[0] * at[0] + line[1] * at[1] + line[2];
            let (here, there) = (value(p), value(q));
            let beyond = there < 0.0 || (there == 0.0 && !closed);
            if beyond && there < here {
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

    /// Returns true if the way from `p` to `q` enters the triangle, not leaves it, where it crosses the line opposite `corner`.
    #[inline(always)]
    pub(crate) fn opens(&self, corner: usize, p: [f32; 2], q: [f32; 2]) -> bool {
        let line = &self.lines[corner];
        line[0] * (q[0] - p[0]) + line[1] * (q[1] - p[1]) > 0.0
    }
}

/// Calls `hit` with row, column, what lies inside, and keys, for sixteen sub-pixels of a row at a time, wherever the
/// triangle covers one of them beyond the near plane.
#[inline(always)]
pub(crate) fn each_vector<S: Simd>(
    simd: S,
    triangle: &RasterTriangle,
    (filter, near): (&PixelFilter, NearKey),
    mut hit: impl FnMut([usize; 2], mask32x16<S>, f32x16<S>),
) {
    let [first, last] = triangle.columns;
    let splat = |x: f32| f32x16::splat(simd, x);
    let key_plane = &triangle.key;
    let (zero, near) = (splat(0.0), splat(near.0));
    let mut column = first;
    while column < last {
        let columns = splat(column as f32) + f32x16::from_slice(simd, &IOTA);
        // What lies beyond the row's end belongs to the next one, which stays as it is.
        let of_row = columns.simd_lt(splat(last as f32));
        for row in triangle.rows[0]..triangle.rows[1] {
            let y = filter.y_px(row);
            let x = columns + splat(filter.offset_px[row % filter.per_pixel]);
            let mut inside = of_row;
            for i in 0..3 {
                let line = &triangle.lines[i];
                let value = splat(line[0]) * x + splat(line[1] * y) + splat(line[2]);
                inside &= if triangle.closed[i] {
                    value.simd_ge(zero)
                } else {
                    value.simd_gt(zero)
                };
            }
            if inside.all_false() {
                continue;
            }
            let key = splat(key_plane[0]) * x + splat(key_plane[1] * y) + splat(key_plane[2]);
            hit([row, column], inside & key.simd_le(near), key);
        }
        column += LANES;
    }
}

/// Where keys are nearer than those before, by more than their rounding.
#[inline(always)]
pub(crate) fn is_nearer<S: Simd>(simd: S, key: f32x16<S>, before: f32x16<S>) -> mask32x16<S> {
    key.simd_gt(before + key.abs() * f32x16::splat(simd, KEY_ROUNDING))
}

/// Draws a triangle.
#[simd]
fn draw_rows<S: Simd>(
    simd: S,
    visibility: &mut Visibility,
    triangle: &RasterTriangle,
    id: u32,
    seen_by: (&PixelFilter, NearKey),
) {
    each_vector(
        simd,
        triangle,
        seen_by,
        #[inline(always)]
        |[row, column], inside, key| {
            let at = row * SPAN_WIDTH + column;
            let before = f32x16::from_slice(simd, &visibility.keys[at..at + LANES]);
            let seen = inside & is_nearer(simd, key, before);
            visibility.show(simd, at, id, (seen, key));
        },
    );
}

/// Lists a translucent triangle.
#[simd]
fn list_rows<S: Simd>(
    simd: S,
    visibility: &mut Visibility,
    triangle: &RasterTriangle,
    id: u32,
    seen_by: (&PixelFilter, NearKey),
) {
    let (keys, layers) = (&visibility.keys, &mut visibility.layers);
    each_vector(
        simd,
        triangle,
        seen_by,
        #[inline(always)]
        |[row, column], inside, key| {
            let at = row * SPAN_WIDTH + column;
            let before = f32x16::from_slice(simd, &keys[at..at + LANES]);
            let mut bits = (inside & key.simd_gt(before)).to_bitmask();
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                layers.push(TranslucentLayer {
                    subpixel: (at + lane) as u32,
                    key: key[lane],
                    id,
                });
            }
        },
    );
}

/// The corners of the span.
const TILE_CORNERS: [[f32; 2]; 4] = {
    let (width, height) = (SPAN_WIDTH as f32, SPAN_HEIGHT as f32);
    [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]]
};

/// More than the rounding of a plane's values over the tile: of the largest parts of a sum of three, each rounded a few
/// times by 2^-24.
fn slack(plane: &Plane) -> f32 {
    1e-5 * (SPAN_WIDTH as f32 * plane[0].abs()
        + SPAN_HEIGHT as f32 * plane[1].abs()
        + plane[2].abs())
}

impl Visibility {
    /// Forgets the last tile.
    pub(crate) fn clear(&mut self, filter: &PixelFilter) {
        // A vector may begin at the last sub-pixel of all.
        let count = SPAN_WIDTH * SPAN_HEIGHT * filter.per_pixel + LANES;
        self.ids.clear();
        self.ids.resize(count, NONE);
        self.keys.clear();
        self.keys.resize(count, f32::NEG_INFINITY);
        self.layers.clear();
        self.alone = None;
    }

    /// Shows one triangle everywhere.
    pub(crate) fn show_alone(&mut self, id: u32) {
        self.ids.fill(id);
        self.alone = Some(id);
    }

    /// Draws a triangle where it is nearer than the surface stored there.
    pub(crate) fn draw(
        &mut self,
        triangle: &RasterTriangle,
        id: u32,
        seen_by: (&PixelFilter, NearKey),
        simd: Vectors,
    ) {
        dispatch!(simd, simd => draw_rows(simd, self, triangle, id, seen_by));
    }

    /// Lists a translucent triangle wherever it lies before the opaque surface.
    pub(crate) fn list(
        &mut self,
        triangle: &RasterTriangle,
        id: u32,
        seen_by: (&PixelFilter, NearKey),
        simd: Vectors,
    ) {
        dispatch!(simd, simd => list_rows(simd, self, triangle, id, seen_by));
    }

    /// Shows a triangle at those of sixteen sub-pixels that are marked.
    #[inline(always)]
    pub(crate) fn show<S: Simd>(
        &mut self,
        simd: S,
        at: usize,
        id: u32,
        (seen, key): (mask32x16<S>, f32x16<S>),
    ) {
        let (ids, keys) = (
            &mut self.ids[at..at + LANES],
            &mut self.keys[at..at + LANES],
        );
        let before = f32x16::from_slice(simd, keys);
        seen.select(key, before).store_slice(keys);
        let shown = u32x16::from_slice(simd, ids);
        seen.select(u32x16::splat(simd, id), shown).store_slice(ids);
    }

    /// Orders the layers by sub-pixel, the farthest first; equally far ones in the order of the scene.
    pub(crate) fn sort_layers(&mut self) {
        if self.layers.is_empty() {
            return;
        }
        let mut ends = vec![0u32; self.ids.len() + 1];
        self.layers
            .iter()
            .for_each(|layer| ends[layer.subpixel as usize + 1] += 1);
        for at in 1..ends.len() {
            ends[at] += ends[at - 1];
        }
        let starts = ends.clone();
        let mut sorted = self.layers.clone();
        for layer in &self.layers {
            let end = &mut ends[layer.subpixel as usize];
            sorted[*end as usize] = *layer;
            *end += 1;
        }
        for range in starts.windows(2).filter(|range| range[1] - range[0] > 1) {
            sorted[range[0] as usize..range[1] as usize]
                .sort_by(|a, b| a.key.total_cmp(&b.key).then(a.id.cmp(&b.id)));
        }
        self.layers = sorted;
    }
}
