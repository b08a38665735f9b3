//! Splats: the texels around each sub-pixel that some pixel is made from, summed there; and sub-pixels to pixels.
//!
//! Sub-pixels of one triangle are computed together, sixteen at once. Where the place of an edge is known, sub-pixels are
//! corrected before translucent surfaces cover them.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;
use fearless_simd_macros::simd;
use glam::{Vec3, Vec4};
use resample_core::dispatch;

use crate::project::surface::Surface;
use crate::screen::{LANES, NONE, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use crate::tile::light::{BatchBuffers, shade_batch};
use crate::tile::points::DirectPixels;
use crate::tile::task::Tile;
use crate::tile::visible::Visible;
use crate::visibility::TranslucentLayer;
use crate::visibility::edges::Edges;
use crate::visibility::filter::PixelFilter;
use crate::visibility::runs::{ByTriangle, Run};

/// Pixels that are filtered together: four of four channels fill one 512-bit vector.
const GROUP_PX: usize = 4;

/// The groups of pixels of a tile that are made from sub-pixels.
type Groups = [[bool; TILE_WIDTH / GROUP_PX]; TILE_HEIGHT];

/// The pixels of a tile.
type Pixels = [[Vec4; TILE_WIDTH]; TILE_HEIGHT];

/// The colours of the sub-pixels of a tile.
#[derive(Default)]
pub(crate) struct SubpixelColours {
    /// Linear premultiplied. Old where no pixel is made from sub-pixels.
    rgba: Vec<[f32; 4]>,
    /// Splats that were laid.
    pub(crate) splats: u64,
    by_triangle: ByTriangle,
    layers: Layers,
    batches: BatchBuffers,
    /// By edge: the difference in colour across it.
    jumps: Vec<Vec4>,
}

/// Colours of the sub-pixels that some pixel wants: splats, and translucent surfaces over those behind.
pub(crate) fn lay_splats<'a>(
    tile: &Tile,
    (visible, edges, direct): (&Visible, &Edges, &DirectPixels),
    colours: &'a mut SubpixelColours,
) -> &'a SubpixelColours {
    colours.splats = 0;
    if direct.from_subpixels.is_empty() {
        return colours;
    }
    let (simd, wanted) = (tile.frame.simd, &direct.wanted[..]);
    colours.splats +=
        4 * dispatch!(simd, simd => lay_opaque(simd, tile, (visible, wanted), colours));
    correct_edges(edges, (wanted, tile.frame.filter.per_pixel), colours);
    if !visible.subpixels.layers.is_empty() {
        colours.splats +=
            4 * dispatch!(simd, simd => lay_layers(simd, tile, (visible, wanted), colours));
    }
    colours
}

/// The pixels of the tile: sub-pixels are filtered down to those that are made from them, the others are as they are.
pub(crate) fn resolve(
    tile: &Tile,
    direct: &DirectPixels,
    colours: &SubpixelColours,
) -> Vec<[f32; 4]> {
    let mut rgba = direct.rgba.clone();
    let place = |pixel: u16| {
        [
            usize::from(pixel) % TILE_WIDTH,
            usize::from(pixel) / TILE_WIDTH,
        ]
    };
    let mut wanted = [[false; TILE_WIDTH / GROUP_PX]; TILE_HEIGHT];
    for [x, y] in direct.from_subpixels.iter().copied().map(place) {
        wanted[y][x / GROUP_PX] = true;
    }
    let mut pixels = [[Vec4::ZERO; TILE_WIDTH]; TILE_HEIGHT];
    let filter = tile.frame.filter;
    dispatch!(tile.frame.simd, simd => filter_groups(simd, filter, &colours.rgba, &wanted, &mut pixels));
    for &pixel in &direct.from_subpixels {
        let [x, y] = place(pixel);
        // The corrections at edges are exact only in their sum, and may leave a remainder of either sign.
        let sum = pixels[y][x].max(Vec4::ZERO);
        rgba[usize::from(pixel)] = sum.truncate().extend(sum.w.min(1.0)).to_array();
    }
    rgba
}

/// Lays the splats of every wanted sub-pixel; how many sub-pixels there were.
#[simd]
fn lay_opaque<S: Simd>(
    simd: S,
    tile: &Tile,
    (visible, wanted): (&Visible, &[bool]),
    colours: &mut SubpixelColours,
) -> u64 {
    let SubpixelColours {
        rgba,
        by_triangle,
        batches,
        ..
    } = colours;
    let ids = &visible.subpixels.ids;
    by_triangle.clear();
    rgba.clear();
    rgba.resize(ids.len(), [0.0; 4]);
    let rows = ids.chunks_exact(tile.frame.filter.per_pixel * SPAN_WIDTH);
    let mut first = 0;
    for (rows, wanted) in rows.zip(wanted.chunks_exact(SPAN_WIDTH)) {
        for ids in rows.chunks_exact(SPAN_WIDTH) {
            by_triangle.push_row(ids, wanted, [first; 2]);
            first += SPAN_WIDTH as u32;
        }
    }
    let runs = by_triangle.sort(visible.surfaces.len());
    let out = (&mut rgba[..], &mut [][..]);
    lay_runs(simd, tile, (&visible.surfaces, runs), batches, out)
}

/// Lays the translucent layers of every wanted sub-pixel over what lies behind, the farthest first; how many there were.
#[simd]
fn lay_layers<S: Simd>(
    simd: S,
    tile: &Tile,
    (visible, wanted): (&Visible, &[bool]),
    colours: &mut SubpixelColours,
) -> u64 {
    let SubpixelColours {
        rgba,
        by_triangle,
        layers,
        batches,
        ..
    } = colours;
    let per_pixel = tile.frame.filter.per_pixel;
    let mut count = 0;
    let mut rest: &[TranslucentLayer] = &visible.subpixels.layers;
    // Layers of a row of pixels are few enough to be kept.
    for (y, wanted) in wanted.chunks_exact(SPAN_WIDTH).enumerate() {
        by_triangle.clear();
        layers.clear();
        for row in y * per_pixel..(y + 1) * per_pixel {
            let first = row * SPAN_WIDTH;
            let is_beyond =
                |layer: &TranslucentLayer| layer.subpixel as usize >= first + SPAN_WIDTH;
            let of_row = rest.iter().position(is_beyond).unwrap_or(rest.len());
            layers.add_row(first, &rest[..of_row]);
            rest = &rest[of_row..];
        }
        for (place, row) in layers.rows.iter().enumerate() {
            let places = [row.first, place * SPAN_WIDTH].map(|at| at as u32);
            by_triangle.push_row(&row.ids, wanted, places);
        }
        layers
            .colours
            .resize(layers.rows.len() * SPAN_WIDTH, [0.0; 4]);
        if tile.frame.scene.has_glass {
            layers.through.resize(layers.colours.len(), [1.0; 3]);
        }
        let runs = by_triangle.sort(visible.surfaces.len());
        let out = (&mut layers.colours[..], &mut layers.through[..]);
        count += lay_runs(simd, tile, (&visible.surfaces, runs), batches, out);
        match layers.through.is_empty() {
            true => layers.blend(rgba),
            false => layers.blend_through(tile.frame.options.background, rgba),
        }
    }
    count
}

/// Computes the colours of runs, sixteen sub-pixels of a triangle at a time, and the shares of light that are seen through them unless that
/// list is empty; how many there were.
#[inline(always)]
fn lay_runs<S: Simd>(
    simd: S,
    tile: &Tile,
    (surfaces, runs): (&[Option<Box<Surface>>], &[Run]),
    buffers: &mut BatchBuffers,
    (colours, through): (&mut [[f32; 4]], &mut [[f32; 3]]),
) -> u64 {
    let iota = u32x16::from_slice(
        simd,
        &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
    );
    let mut out = [Vec4::ZERO; LANES];
    // Room for a vector that begins at the last.
    let (mut subpixels, mut places) = ([0; 2 * LANES], [0; 2 * LANES]);
    let mut all = 0;
    for runs in runs.chunk_by(|a, b| a.id == b.id) {
        let Some(surface) = &surfaces[runs[0].id as usize] else {
            continue;
        };
        buffers.begin_surface();
        let mut count = 0;
        for (k, run) in runs.iter().enumerate() {
            let mut done = 0;
            while done < run.len {
                let end = count..count + LANES;
                (iota + u32x16::splat(simd, run.subpixel + done))
                    .store_slice(&mut subpixels[end.clone()]);
                (iota + u32x16::splat(simd, run.place + done)).store_slice(&mut places[end]);
                let taken = (LANES - count).min((run.len - done) as usize);
                count += taken;
                done += taken as u32;
                if count < LANES && (done < run.len || k + 1 < runs.len()) {
                    continue;
                }
                let batch = tile.frame.filter.batch(simd, &subpixels, count);
                shade_batch(tile, simd, (surface, &batch), buffers, &mut out);
                for (&place, colour) in places[..count].iter().zip(out) {
                    colours[place as usize] = colour.to_array();
                }
                if !through.is_empty() {
                    for (k, &place) in places[..count].iter().enumerate() {
                        through[place as usize] = match &buffers.through {
                            Some(through) => through[k],
                            None => [1.0 - out[k].w; 3],
                        };
                    }
                }
                all += count as u64;
                count = 0;
            }
        }
    }
    all
}

/// Filters the sub-pixels of the wanted groups of pixels.
#[simd]
fn filter_groups<S: Simd>(
    _: S,
    filter: &PixelFilter,
    colours: &[[f32; 4]],
    wanted: &Groups,
    pixels: &mut Pixels,
) {
    const NUMBERS: usize = 4 * GROUP_PX;
    for y in 0..TILE_HEIGHT {
        for group in (0..TILE_WIDTH / GROUP_PX).filter(|&group| wanted[y][group]) {
            let first = y * filter.per_pixel * SPAN_WIDTH + group * GROUP_PX;
            let mut sums = [0.0; NUMBERS];
            for window in &filter.rows {
                let colours =
                    colours[first + window.row * SPAN_WIDTH + window.column..].as_flattened();
                for (k, weight) in window.weights.iter().enumerate() {
                    for (sum, colour) in sums.iter_mut().zip(&colours[4 * k..4 * k + NUMBERS]) {
                        *sum += colour * weight;
                    }
                }
            }
            for (pixel, sum) in pixels[y][group * GROUP_PX..]
                .iter_mut()
                .zip(sums.chunks_exact(4))
            {
                *pixel = Vec4::from_slice(sum);
            }
        }
    }
}

/// Adds to the colours of neighbouring sub-pixels what the place of the edge between them makes of the jump.
fn correct_edges(
    edges: &Edges,
    (wanted, per_pixel): (&[bool], usize),
    colours: &mut SubpixelColours,
) {
    let SubpixelColours { rgba, jumps, .. } = colours;
    let wanted = |at: u32| {
        wanted[at as usize / SPAN_WIDTH / per_pixel * SPAN_WIDTH + at as usize % SPAN_WIDTH]
    };
    jumps.clear();
    jumps.extend(
        edges
            .all
            .iter()
            .map(|edge| match edge.between.map(&wanted) {
                [true, true] => {
                    let [p, q] = edge.between.map(|at| Vec4::from(rgba[at as usize]));
                    p - q
                }
                _ => Vec4::ZERO,
            }),
    );
    for (edge, jump) in edges.all.iter().zip(jumps) {
        for (at, share) in edge.between.into_iter().zip(edge.shares) {
            let colour = &mut rgba[at as usize];
            *colour = (Vec4::from(*colour) + *jump * share).to_array();
        }
    }
}

/// Translucent layers of some rows of sub-pixels before their colours lie over those behind: the n-th farthest of each
/// sub-pixel are rows, as sub-pixels are.
#[derive(Clone, Debug, Default)]
struct Layers {
    /// Row by row, the farthest layers first.
    rows: Vec<LayerRow>,
    /// Premultiplied, a span for each of the rows.
    colours: Vec<[f32; 4]>,
    /// The shares of light behind that are seen through them, if there is glass; else alpha says it.
    through: Vec<[f32; 3]>,
}

/// Layers of one rank.
#[derive(Clone, Copy, Debug)]
struct LayerRow {
    /// The first sub-pixel of the row.
    first: usize,
    /// Triangles, by their places in the tile's list.
    ids: [u32; SPAN_WIDTH],
}

impl Layers {
    /// Forgets all layers.
    fn clear(&mut self) {
        self.rows.clear();
        self.colours.clear();
        self.through.clear();
    }

    /// Adds the layers of the row whose first sub-pixel is `first`, sorted by sub-pixel, the farthest first.
    fn add_row(&mut self, first: usize, layers: &[TranslucentLayer]) {
        let start = self.rows.len();
        for layers in layers.chunk_by(|a, b| a.subpixel == b.subpixel) {
            for (rank, layer) in layers.iter().enumerate() {
                if start + rank == self.rows.len() {
                    self.rows.push(LayerRow {
                        first,
                        ids: [NONE; SPAN_WIDTH],
                    });
                }
                self.rows[start + rank].ids[layer.subpixel as usize - first] = layer.id;
            }
        }
    }

    /// Lays the layers over what lies behind; those that were not computed are transparent.
    fn blend(&self, behind: &mut [[f32; 4]]) {
        for (row, fronts) in self.rows.iter().zip(self.colours.chunks_exact(SPAN_WIDTH)) {
            let behind = &mut behind[row.first..row.first + SPAN_WIDTH];
            for (behind, front) in behind.iter_mut().zip(fronts) {
                let front = Vec4::from(*front);
                *behind = (front + (1.0 - front.w) * Vec4::from(*behind)).to_array();
            }
        }
    }

    /// As [`Layers::blend`], through glass of any colour.
    ///
    /// Alpha is one number: where nothing lies behind, it is what no colour is seen through, and what is seen of the background beyond that is added.
    fn blend_through(&self, background: [f32; 3], behind: &mut [[f32; 4]]) {
        let background = Vec3::from(background);
        let colours = self.colours.chunks_exact(SPAN_WIDTH);
        let fronts = colours.zip(self.through.chunks_exact(SPAN_WIDTH));
        for (row, (fronts, through)) in self.rows.iter().zip(fronts) {
            let behind = &mut behind[row.first..row.first + SPAN_WIDTH];
            for (behind, (front, through)) in behind.iter_mut().zip(fronts.iter().zip(through)) {
                let (front, back) = (Vec4::from(*front), Vec4::from(*behind));
                let (through, all) = (Vec3::from(*through), 1.0 - front.w);
                let tint = (through - Vec3::splat(all)) * background * (1.0 - back.w);
                let seen = front.truncate() + through * back.truncate() + tint;
                *behind = seen.extend(front.w + all * back.w).to_array();
            }
        }
    }
}
