//! Patches: pixels that see several triangles of one smooth surface, and are laid as points all the same.
//!
//! Over a finely divided surface texture coordinates are not one plane, but nearly. Under the pixel's filter the best
//! plane through them is known from their moments: the mean, and the means times the distance along x and y. What is
//! left, the mean square of the distance from that plane, says how far texels are from where the plane puts them. Where
//! that is less than [`MOST_PX`] and no colour jumps within the filter, the pixel gathers its texels from the plane.
//!
//! Takes what sub-pixels show, gives for each pixel its place on the texture and its light. Moments are taken of the
//! distance from a first plane that is near, so that f32 holds them; sixteen pixels of a row at once.
//!
//! Limits: opaque surfaces without vertex colours; the light's and the texture's means are multiplied.

use std::ops::Range;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::dispatch;
use resample_mesh::scene::AlphaMode;

use crate::project::surface::{Batch, Surface, UvAt, UvPlanes};
use crate::screen::{
    BORDER_PX, LANES, NONE, SPAN_HEIGHT, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH, value,
};
use crate::texture::ellipse::PixelOnTexture;
use crate::texture::magnified::is_small;
use crate::texture::points::is_minified;
use crate::tile::task::{Tile, centre_px, subpixel_px};
use crate::tile::visible::{Cell, Cells, Visible};
use crate::visibility::edges::Edges;
use crate::visibility::filter::{AROUND, PixelFilter, around};

/// Most that texels may be away from the plane, root mean square under the filter, px. A trade: a knot with a photo that is
/// minified loses up to 1.8 dB, one with noise wins up to 7; at half of it frames of the knot take 7 % longer.
const MOST_PX: f32 = 1.0 / 32.0;

/// Rows of pixels for which one reference serves: beyond, it says little about them. A guess; with twice as many a knot of
/// small triangles loses 0.3 dB.
const REFERENCE_ROWS: usize = 16;

/// The rounding error of the mean square of numbers far from 0, as beyond a seam of repeated textures.
const ROUNDING: f32 = 1e-6;

/// A pixel on a smooth surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// The triangle at the pixel's centre, by its place in the tile's list.
    pub(crate) id: u32,
    pub(crate) at: UvAt,
    /// Mean light, as a factor of colour.
    pub(crate) light: f32,
}

/// The patches of a tile and the storage to find them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    /// By pixel of the tile; empty if there are none.
    found: Vec<Option<Patch>>,
    candidates: Vec<bool>,
    /// By pixel of the span: the mesh that all its sub-pixels show, or [`NONE`].
    meshes: Vec<u32>,
    /// By sub-pixel: texture coordinates less those of the first plane, and light. Not a number elsewhere.
    u: Vec<f32>,
    v: Vec<f32>,
    light: Vec<f32>,
}

impl Patches {
    /// The patch at a pixel of the tile.
    pub(crate) fn at(&self, [x, y]: [usize; 2]) -> Option<Patch> {
        self.found.get(y * TILE_WIDTH + x).copied().flatten()
    }
}

/// The plane near which coordinates are expected, and the surface that it is taken from.
struct Reference<'a> {
    surface: &'a Surface,
    planes: &'a UvPlanes,
    at_px: [f32; 2],
    uv: UvAt,
}

/// Finds the patches among the pixels that see several triangles.
pub(crate) fn find_patches<'a>(
    tile: &Tile,
    (visible, cells, edges): (&Visible, &Cells, &Edges),
    patches: &'a mut Patches,
) -> &'a Patches {
    patches.found.clear();
    let under_filter = &cells.under_filter;
    // A single sub-pixel has no moments.
    if tile.frame.filter.per_pixel == 1 || !under_filter.contains(&Cell::Mixed) {
        return patches;
    }
    patches.meshes.clear();
    let smooth =
        (0..SPAN_WIDTH * SPAN_HEIGHT).map(|cell| smooth_mesh(tile, (visible, cells, edges), cell));
    patches.meshes.extend(smooth);
    patches.candidates.clear();
    for (pixel, cell) in under_filter.iter().enumerate() {
        let at = [pixel % TILE_WIDTH, pixel / TILE_WIDTH];
        let mesh = patches.meshes[around(at, AROUND / 2)];
        let is_one = || mesh != NONE && (0..AROUND).all(|k| patches.meshes[around(at, k)] == mesh);
        patches.candidates.push(*cell == Cell::Mixed && is_one());
    }
    while let Some(first) = patches.candidates.iter().position(|&candidate| candidate) {
        find_patches_like(tile, first, visible, patches);
    }
    patches
}

/// The mesh that all sub-pixels of a cell show, if it is of a kind that patches may be made of.
fn smooth_mesh(
    tile: &Tile,
    (visible, cells, edges): (&Visible, &Cells, &Edges),
    cell: usize,
) -> u32 {
    let per_pixel = tile.frame.filter.per_pixel;
    let surfaces = &visible.surfaces[..];
    match cells.own[cell] {
        Cell::Plane(id) => smooth_mesh_of(tile, surfaces, id),
        Cell::Mixed if edges.of_cell(cell).is_empty() => {
            let subpixels = (0..per_pixel)
                .map(|row| (cell / SPAN_WIDTH * per_pixel + row) * SPAN_WIDTH + cell % SPAN_WIDTH);
            let mut mesh = None;
            for at in subpixels {
                let of_subpixel = smooth_mesh_of(tile, surfaces, visible.subpixels.ids[at]);
                if of_subpixel == NONE || mesh.is_some_and(|mesh| mesh != of_subpixel) {
                    return NONE;
                }
                mesh = Some(of_subpixel);
            }
            mesh.unwrap_or(NONE)
        }
        _ => NONE,
    }
}

/// The mesh of what a sub-pixel shows if it is of a kind that patches may be made of.
fn smooth_mesh_of(tile: &Tile, surfaces: &[Option<Box<Surface>>], id: u32) -> u32 {
    let Some(Some(surface)) = surfaces.get(id as usize) else {
        return NONE;
    };
    let material = surface.material(tile.frame.scene);
    let plain = material.alpha == AlphaMode::Opaque
        && surface.base.is_some()
        && surface.colours.is_none()
        && (surface.emissive.is_none() || material.emissive_per_base.is_some())
        && material.maps_lie_as_base();
    if plain { surface.mesh } else { NONE }
}

/// Finds the patches on the mesh that the pixel `first` shows, and takes its candidates away.
fn find_patches_like(tile: &Tile, first: usize, visible: &Visible, patches: &mut Patches) {
    let (ids, surfaces) = (&visible.subpixels.ids[..], &visible.surfaces[..]);
    let filter = tile.frame.filter;
    let centre = |pixel: usize| around([pixel % TILE_WIDTH, pixel / TILE_WIDTH], AROUND / 2);
    let mesh = patches.meshes[centre(first)];
    let mut rows = [0u16; TILE_HEIGHT];
    let top = first / TILE_WIDTH;
    let bottom = (top + REFERENCE_ROWS).min(TILE_HEIGHT);
    for pixel in first..bottom * TILE_WIDTH {
        if patches.candidates[pixel] && patches.meshes[centre(pixel)] == mesh {
            patches.candidates[pixel] = false;
            rows[pixel / TILE_WIDTH] |= 1 << (pixel % TILE_WIDTH);
        }
    }
    let middle = |pixel: usize| {
        let cell = centre(pixel);
        (cell / SPAN_WIDTH * filter.per_pixel + filter.per_pixel / 2) * SPAN_WIDTH
            + cell % SPAN_WIDTH
    };
    let Some(Some(surface)) = surfaces.get(ids[middle(first)] as usize) else {
        return;
    };
    let Some(planes) = &surface.base else { return };
    let at_px = subpixel_px(filter, middle(first));
    let reference = Reference {
        surface,
        planes,
        at_px,
        uv: surface.uv_at(planes, at_px),
    };
    // Where its texels are not gathered there, those of the others are not likely to be.
    let is_lit = surface.maps.is_some();
    let is_gathered = |at: &UvAt| is_gathered_at(tile, at, (planes.pyramid, is_lit));
    if !is_gathered(&reference.uv) {
        return;
    }
    patches.found.resize(TILE_WIDTH * TILE_HEIGHT, None);
    let simd = tile.frame.simd;
    dispatch!(simd, simd => fill_fields(simd, tile, &reference, (ids, surfaces), top..bottom + 2 * BORDER_PX, patches));
    for (y, wanted) in rows
        .into_iter()
        .enumerate()
        .filter(|(_, wanted)| *wanted != 0)
    {
        let mut moments = Moments::default();
        dispatch!(simd, simd => take_moments(simd, filter, y, patches, &mut moments));
        for x in (0..TILE_WIDTH).filter(|x| wanted >> x & 1 == 1) {
            let id = ids[middle(y * TILE_WIDTH + x)];
            let pixel_px = centre_px([x, y]);
            let uv = moments.uv(x, &reference, pixel_px, filter);
            let patch = uv.map(|at| Patch {
                id,
                at,
                light: moments.light[x],
            });
            patches.found[y * TILE_WIDTH + x] = patch.filter(|patch| is_gathered(&patch.at));
        }
    }
}

/// Returns true if the texels of a surface, which is lit or not, are gathered at a place.
fn is_gathered_at(tile: &Tile, at: &UvAt, (pyramid, is_lit): (usize, bool)) -> bool {
    let pyramid = &tile.frame.scene.pyramids[pyramid];
    let pixel = PixelOnTexture {
        pyramid,
        at: *at,
        over_w_slope: [0.0; 2],
    };
    is_minified(&pixel) || is_lit && is_small(&pixel)
}

/// Fills the fields with what every sub-pixel of the reference's mesh shows, in rows of pixels of the span.
#[simd]
fn fill_fields<S: Simd>(
    simd: S,
    tile: &Tile,
    reference: &Reference,
    (ids, surfaces): (&[u32], &[Option<Box<Surface>>]),
    rows: Range<usize>,
    patches: &mut Patches,
) {
    let filter = tile.frame.filter;
    let count = SPAN_WIDTH * SPAN_HEIGHT * filter.per_pixel + LANES;
    for field in [&mut patches.u, &mut patches.v, &mut patches.light] {
        field.clear();
        field.resize(count, f32::NAN);
    }
    let splat = |x: f32| f32x16::splat(simd, x);
    let nothing = splat(f32::NAN);
    for row in rows.start * filter.per_pixel..rows.end * filter.per_pixel {
        let start = row * SPAN_WIDTH;
        let mut column = 0;
        while column < SPAN_WIDTH {
            let id = ids[start + column];
            let mut end = column + 1;
            while end < SPAN_WIDTH && ids[start + end] == id {
                end += 1;
            }
            let surface = surfaces.get(id as usize).and_then(Option::as_deref);
            let fields = surface
                .filter(|surface| surface.mesh == reference.surface.mesh)
                .and_then(|surface| Some((surface, surface.base.as_ref()?)));
            let mut done = column;
            while done < end {
                let range = start + done..start + done + LANES;
                match fields {
                    Some(fields) => {
                        let first_px = filter.position_px(done, row);
                        let batch = Batch::along(simd, first_px, end - done);
                        let [u, v] = distances(simd, fields, &batch, reference);
                        u.store_slice(&mut patches.u[range.clone()]);
                        v.store_slice(&mut patches.v[range.clone()]);
                        batch
                            .light(simd, (fields.0, &tile.view))
                            .store_slice(&mut patches.light[range]);
                    }
                    None => nothing.store_slice(&mut patches.u[range]),
                }
                done += LANES;
            }
            column = end;
        }
    }
}

/// Texture coordinates of a batch, less those of the reference's plane.
#[inline(always)]
fn distances<S: Simd>(
    simd: S,
    (surface, planes): (&Surface, &UvPlanes),
    batch: &Batch,
    reference: &Reference,
) -> [f32x16<S>; 2] {
    let splat = |x: f32| f32x16::splat(simd, x);
    let w = splat(1.0) / batch.on(simd, &surface.over_w);
    let [ux, uy, vx, vy] = reference.uv.jacobian;
    let dx = f32x16::from_slice(simd, &batch.x) - splat(reference.at_px[0]);
    let dy = f32x16::from_slice(simd, &batch.y) - splat(reference.at_px[1]);
    let start = |axis: usize| (planes.start[axis] - reference.planes.start[axis]) as f32;
    let u = batch.on(simd, &planes.u) * w + splat(start(0) - reference.uv.u);
    let v = batch.on(simd, &planes.v) * w + splat(start(1) - reference.uv.v);
    [
        u - (splat(ux) * dx + splat(uy) * dy),
        v - (splat(vx) * dx + splat(vy) * dy),
    ]
}

/// Means under the filters of a row of pixels.
#[derive(Default)]
struct Moments {
    light: [f32; TILE_WIDTH],
    /// Of u and of v: the value, its products with the distance along x and y, its square.
    of_uv: [[[f32; TILE_WIDTH]; 4]; 2],
}

#[simd]
fn take_moments<S: Simd>(
    simd: S,
    filter: &PixelFilter,
    y: usize,
    patches: &Patches,
    moments: &mut Moments,
) {
    let zero = f32x16::splat(simd, 0.0);
    let (mut of_u, mut of_v, mut light) = ([zero; 4], [zero; 4], zero);
    for window in &filter.rows {
        let row = y * filter.per_pixel + window.row;
        let [x0, dy] = filter.centred_px(window.row, window.column);
        for (k, &weight) in window.weights.iter().enumerate() {
            let at = row * SPAN_WIDTH + window.column + k;
            let (u, v) = (
                f32x16::from_slice(simd, &patches.u[at..at + LANES]),
                f32x16::from_slice(simd, &patches.v[at..at + LANES]),
            );
            let weights = f32x16::splat(simd, weight);
            let along_x = f32x16::splat(simd, weight * (x0 + k as f32));
            let along_y = f32x16::splat(simd, weight * dy);
            of_u[0] = u.mul_add(weights, of_u[0]);
            of_u[1] = u.mul_add(along_x, of_u[1]);
            of_u[2] = u.mul_add(along_y, of_u[2]);
            of_u[3] = (u * u).mul_add(weights, of_u[3]);
            of_v[0] = v.mul_add(weights, of_v[0]);
            of_v[1] = v.mul_add(along_x, of_v[1]);
            of_v[2] = v.mul_add(along_y, of_v[2]);
            of_v[3] = (v * v).mul_add(weights, of_v[3]);
            let lights = f32x16::from_slice(simd, &patches.light[at..at + LANES]);
            light = lights.mul_add(weights, light);
        }
    }
    light.store_slice(&mut moments.light);
    for k in 0..4 {
        of_u[k].store_slice(&mut moments.of_uv[0][k]);
        of_v[k].store_slice(&mut moments.of_uv[1][k]);
    }
}

impl Moments {
    /// Where pixel `x` of the row lies on the texture; `None` where that is no plane.
    fn uv(
        &self,
        x: usize,
        reference: &Reference,
        centre_px: [f32; 2],
        filter: &PixelFilter,
    ) -> Option<UvAt> {
        let offset = [0, 1].map(|k| centre_px[k] - reference.at_px[k]);
        let of = |axis: usize| {
            let [mean, along_x, along_y, square] = [0, 1, 2, 3].map(|k| self.of_uv[axis][k][x]);
            let [sx, sy] = [
                along_x / filter.variance_px2[0],
                along_y / filter.variance_px2[1],
            ];
            let rest = square - mean * mean - sx * along_x - sy * along_y;
            let [jx, jy] = [
                reference.uv.jacobian[2 * axis],
                reference.uv.jacobian[2 * axis + 1],
            ];
            let start = [reference.uv.u, reference.uv.v][axis];
            let here = start + value(&[jx, jy, mean], offset);
            (here, [jx + sx, jy + sy], rest.max(square * ROUNDING))
        };
        let ((u, [ux, uy], u_rest), (v, [vx, vy], v_rest)) = (of(0), of(1));
        let area = ux * vy - uy * vx;
        // The smaller of the two eigenvalues of J J^T, or less: what a pixel is at least long, texels squared.
        let least = area * area / (ux * ux + uy * uy + vx * vx + vy * vy);
        (u_rest + v_rest <= MOST_PX * MOST_PX * least).then_some(UvAt {
            u,
            v,
            jacobian: [ux, uy, vx, vy],
        })
    }
}
