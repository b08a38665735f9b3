//! The planes beside colour: depth, normal, coverage, selection, texel density, numbers and coordinates.
//!
//! All of them speak of the nearest surface at each sub-pixel, whatever its alpha, and weigh it by the pixel's filter:
//! a triangle is read once a pixel, at the mean of its sub-pixels' positions. Numbers and coordinates have no mean: they are those of the triangle that
//! covers most of the pixel. The pixels of a row of the
//! tile are computed together, triangle by triangle.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, mask32x16};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::{Image, Plane, Projection, dispatch, narrow};

use crate::options::{PlaneKind, RenderOptions};
use crate::project::surface::Surface;
use crate::screen::{IOTA, Plane as Linear, TILE_HEIGHT, TILE_WIDTH, Window};
use crate::tile::points::DirectPixels;
use crate::tile::task::{Tile, TileImage, centre_px};
use crate::tile::visible::{Cell, Cells, Visible};
use crate::visibility::Visibility;
use crate::visibility::edges::Edges;
use crate::visibility::fragments::{Fragments, LEAST_WEIGHT};

/// A number for each pixel of a row of the tile.
type Row = [f32; TILE_WIDTH];

/// Planes of a row of pixels. All but `coverage` are multiplied by the share of the pixel that is covered.
#[derive(Default)]
struct RowPlanes {
    coverage: Row,
    depth: Row,
    normal: [Row; 3],
    texels: Row,
    /// Of the triangle that covers most of a pixel: how much, the mesh, the material and the place on its texture.
    most: Row,
    mesh: Row,
    material: Row,
    uv: [Row; 2],
}

/// A triangle in the pixels of a row: its share of each, and where that lies, px from the corner of the tile's border.
struct TriangleShare<'a, S: Simd> {
    surface: &'a Surface,
    key: Linear,
    weight: f32x16<S>,
    at: [f32x16<S>; 2],
    /// One over the size of the base texture.
    per_texel: [f32; 2],
}

/// Storage of the planes of a tile.
#[derive(Default)]
pub(crate) struct PlaneBuffers {
    /// By sub-pixel: the nearest triangle. Only where there are layers.
    nearest: Vec<u32>,
    fragments: Fragments,
}

/// The planes that the options ask for: one after another, each pixel by pixel.
pub(crate) fn planes(
    tile: &Tile,
    (visible, cells, edges, direct): (&Visible, &Cells, &Edges, &DirectPixels),
    buffers: &mut PlaneBuffers,
) -> Vec<f32> {
    let mut points = [1.0; TILE_WIDTH * TILE_HEIGHT];
    let of_splats = direct.from_subpixels.iter().chain(&direct.magnified);
    of_splats.for_each(|&pixel| points[usize::from(pixel)] = 0.0);
    let PlaneBuffers { nearest, fragments } = buffers;
    fragments.clear();
    let seen = Seen {
        visible,
        cells: &cells.under_filter,
        edges,
        nearest: nearest_ids(visible, nearest),
    };
    let names = channels(tile.frame.options);
    let mut planes = vec![0.0; names.len() * TILE_WIDTH * TILE_HEIGHT];
    for y in 0..TILE_HEIGHT {
        let mut row = RowPlanes::default();
        dispatch!(tile.frame.simd, simd => fill_row(simd, tile, (&seen, y), fragments, &mut row));
        let first = y * TILE_WIDTH;
        let points: &Row = points[first..].first_chunk().expect("a row of the tile");
        for (k, (kind, _)) in names.iter().enumerate() {
            let out = &mut planes[k * TILE_WIDTH * TILE_HEIGHT + first..][..TILE_WIDTH];
            row.write(*kind, points, out);
        }
    }
    planes
}

/// The surfaces that planes speak of.
struct Seen<'a> {
    visible: &'a Visible,
    /// By pixel of the tile.
    cells: &'a [Cell],
    edges: &'a Edges,
    /// By sub-pixel: the nearest triangle, whatever its alpha.
    nearest: &'a [u32],
}

/// The nearest triangle of each sub-pixel, whatever its alpha.
fn nearest_ids<'a>(visible: &'a Visible, nearest: &'a mut Vec<u32>) -> &'a [u32] {
    let Visibility { ids, layers, .. } = &visible.subpixels;
    if layers.is_empty() {
        return ids;
    }
    nearest.clear();
    nearest.extend(ids);
    // Layers are sorted, the nearest last.
    for layer in layers {
        nearest[layer.subpixel as usize] = layer.id;
    }
    nearest
}

/// One over the width and the height of a surface's base texture.
fn per_texel(tile: &Tile, surface: &Surface) -> [f32; 2] {
    surface.base.map_or([1.0; 2], |base| {
        let [width, height] = tile.frame.scene.pyramids[base.pyramid].levels[0].size;
        [1.0 / width as f32, 1.0 / height as f32]
    })
}

/// The depth key of a triangle over the tile.
fn key_of(tile: &Tile, visible: &Visible, id: u32) -> Linear {
    // Translucent triangles are not kept.
    match &visible.rasters[id as usize] {
        Some(raster) => *raster.key(),
        None => tile.key_plane(id),
    }
}

/// Sums what row `y` of the tile's pixels shows.
#[simd]
fn fill_row<S: Simd>(
    simd: S,
    tile: &Tile,
    (seen, y): (&Seen, usize),
    fragments: &mut Fragments,
    row: &mut RowPlanes,
) {
    let projection = tile.frame.camera.projection;
    let visible = seen.visible;
    let bit = |x: usize| 1u64 << x;
    let cells: [Cell; TILE_WIDTH] = std::array::from_fn(|x| seen.cells[y * TILE_WIDTH + x]);
    let columns = f32x16::from_slice(simd, &IOTA);
    let [x, y_px] = centre_px([0, y]).map(|at| f32x16::splat(simd, at));
    let zero = f32x16::splat(simd, 0.0);
    // Pixels that see one triangle.
    let plane = |&x: &usize| matches!(cells[x], Cell::Plane(_));
    let mut planes: u64 = (0..TILE_WIDTH).filter(plane).map(bit).sum();
    while planes != 0 {
        let cell = cells[planes.trailing_zeros() as usize];
        let alike: u64 = (0..TILE_WIDTH).filter(|&x| cells[x] == cell).map(bit).sum();
        planes &= !alike;
        let Cell::Plane(id) = cell else { continue };
        let alike = mask32x16::from_bitmask(simd, alike);
        if let Some(surface) = &visible.surfaces[id as usize] {
            let share = TriangleShare {
                surface,
                key: key_of(tile, visible, id),
                weight: alike.select(f32x16::splat(simd, 1.0), zero),
                at: [columns + x, y_px],
                per_texel: per_texel(tile, surface),
            };
            row.add(simd, projection, &share);
        }
    }
    let several = |cell: Cell| matches!(cell, Cell::Mixed | Cell::Layered);
    let several: u64 = (0..TILE_WIDTH)
        .filter(|&x| several(cells[x]))
        .map(bit)
        .sum();
    if several == 0 {
        return;
    }
    let mixed = mask32x16::from_bitmask(simd, several);
    let nearest = (seen.nearest, seen.edges);
    for sums in fragments.sums((tile.frame.filter, tile.frame.simd), nearest, y) {
        let Some(surface) = &visible.surfaces[sums.id as usize] else {
            continue;
        };
        let weight = f32x16::from_slice(simd, &sums.weight);
        let mixed = mixed & weight.simd_gt(f32x16::splat(simd, LEAST_WEIGHT));
        if mixed.all_false() {
            continue;
        }
        let scale = f32x16::splat(simd, 1.0) / weight;
        let share = TriangleShare {
            surface,
            key: key_of(tile, visible, sums.id),
            weight: mixed.select(weight, zero),
            at: [0, 1].map(|k: usize| f32x16::from_slice(simd, &sums.at[k]) * scale),
            per_texel: per_texel(tile, surface),
        };
        row.add(simd, projection, &share);
    }
}

impl RowPlanes {
    /// Adds a triangle where its weight is above 0.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, projection: Projection, share: &TriangleShare<S>) {
        let splat = |x: f32| f32x16::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let TriangleShare {
            surface,
            weight,
            at: [x, y],
            per_texel,
            ..
        } = *share;
        let seen = weight.simd_gt(zero);
        let sum = |row: &mut Row, value: f32x16<S>| {
            let more = seen.select(weight * value, zero);
            (f32x16::from_slice(simd, row) + more).store_slice(row);
        };
        let at = |plane: &Linear| splat(plane[0]) * x + splat(plane[1]) * y + splat(plane[2]);
        sum(&mut self.coverage, one);
        let key = at(&share.key);
        let depth = match projection {
            Projection::Perspective => one / key,
            Projection::Orthographic => zero - key,
        };
        sum(&mut self.depth, depth);
        let normal = [0, 1, 2].map(|k: usize| at(&surface.normal[k]));
        let length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        let per_length = one / length2.sqrt();
        // Zero where the normals cancel.
        let finite = per_length.simd_lt(splat(f32::INFINITY));
        let per_length = finite.select(per_length, zero);
        for (row, n) in self.normal.iter_mut().zip(normal) {
            sum(row, n * per_length);
        }
        let larger = weight.simd_gt(f32x16::from_slice(simd, &self.most));
        let keep = |row: &mut Row, value: f32x16<S>| {
            let kept = larger.select(value, f32x16::from_slice(simd, row));
            kept.store_slice(row);
        };
        keep(&mut self.most, weight);
        keep(&mut self.mesh, splat(surface.mesh as f32));
        keep(&mut self.material, splat(surface.material as f32));
        if surface.base.is_none() {
            self.uv.iter_mut().for_each(|row| keep(row, zero));
        }
        if let Some(base) = &surface.base {
            let w = one / at(&surface.over_w);
            let (u, v) = (at(&base.u) * w, at(&base.v) * w);
            let slope = |plane: &Linear, at: f32x16<S>, axis: usize| {
                (splat(plane[axis]) - at * splat(surface.over_w[axis])) * w
            };
            let area = slope(&base.u, u, 0) * slope(&base.v, v, 1)
                - slope(&base.u, u, 1) * slope(&base.v, v, 0);
            sum(&mut self.texels, area.abs());
            for ((row, at), (start, per_texel)) in self
                .uv
                .iter_mut()
                .zip([u, v])
                .zip(base.start.iter().zip(per_texel))
            {
                keep(row, (at + splat(narrow::single(*start))) * splat(per_texel));
            }
        }
    }

    /// Writes one channel of a plane; `points` is 1 at pixels made of points.
    fn write(&self, kind: Channel, points: &Row, out: &mut [f32]) {
        for (x, out) in out.iter_mut().enumerate() {
            let coverage = self.coverage[x];
            let shown = match kind {
                Channel::Depth => self.depth[x] / coverage,
                Channel::Normal(axis) => self.normal[axis][x],
                Channel::Coverage => coverage.min(1.0),
                Channel::Selection => points[x],
                Channel::Texels => self.texels[x] / coverage,
                Channel::Mesh => self.mesh[x],
                Channel::Material => self.material[x],
                Channel::Coordinate(axis) => self.uv[axis][x],
            };
            *out = if coverage > kind.least_coverage() {
                shown
            } else {
                kind.empty()
            };
        }
    }
}

/// One channel of a plane.
#[derive(Clone, Copy)]
enum Channel {
    Depth,
    Normal(usize),
    Coverage,
    Selection,
    Texels,
    Mesh,
    Material,
    Coordinate(usize),
}

impl Channel {
    /// The coverage from which on a pixel shows a surface: for what has no mean, nothing may cover more of it.
    fn least_coverage(self) -> f32 {
        match self {
            Self::Mesh | Self::Material | Self::Coordinate(_) => 0.5,
            _ => 0.0,
        }
    }

    /// The value where nothing is seen.
    fn empty(self) -> f32 {
        match self {
            Self::Depth => f32::INFINITY,
            Self::Mesh | Self::Material => -1.0,
            _ => 0.0,
        }
    }
}

/// The channels of the planes that the options ask for, in order, with their names.
fn channels(options: &RenderOptions) -> Vec<(Channel, &'static str)> {
    let of = |kind| match kind {
        PlaneKind::Depth => vec![(Channel::Depth, "Z")],
        PlaneKind::Normal => vec![
            (Channel::Normal(0), "normal.X"),
            (Channel::Normal(1), "normal.Y"),
            (Channel::Normal(2), "normal.Z"),
        ],
        PlaneKind::Coverage => vec![(Channel::Coverage, "coverage")],
        PlaneKind::Selection => vec![(Channel::Selection, "selection")],
        PlaneKind::Texels => vec![(Channel::Texels, "texels")],
        PlaneKind::Mesh => vec![(Channel::Mesh, "mesh")],
        PlaneKind::Material => vec![(Channel::Material, "material")],
        PlaneKind::Coordinates => vec![
            (Channel::Coordinate(0), "uv.U"),
            (Channel::Coordinate(1), "uv.V"),
        ],
    };
    let kinds = PlaneKind::ALL.into_iter().filter(|&kind| options.has(kind));
    kinds.flat_map(of).collect()
}

/// Adds to the picture the planes that the options ask for.
pub(crate) fn add_planes(
    image: &mut Image,
    options: &RenderOptions,
    window: &Window,
    tiles: &[TileImage],
) {
    let [width, height] = window.size;
    for (k, (channel, name)) in channels(options).into_iter().enumerate() {
        let mut values = vec![channel.empty(); width * height];
        let rows = values.par_chunks_mut(width.max(1)).enumerate();
        rows.for_each(|(y, row)| {
            let (tiles, y) = window.row(tiles, y);
            let start = (k * TILE_HEIGHT + y) * TILE_WIDTH;
            for (part, tile) in row.chunks_mut(TILE_WIDTH).zip(tiles) {
                if let Some(planes) = tile.planes.get(start..start + part.len()) {
                    part.copy_from_slice(planes);
                }
            }
        });
        match channel {
            Channel::Depth => image.depth = Some(values),
            _ => image.planes.push(Plane {
                name: name.into(),
                values,
            }),
        }
    }
}
