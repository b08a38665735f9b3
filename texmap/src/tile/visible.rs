//! Visibility: the triangle that each sub-pixel of a tile shows, the surfaces of those triangles, how many of them each pixel has, and
//! the edges between them.
//!
//! Where a cut-out triangle may be shown, each sub-pixel looks its alpha up first.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_mesh::scene::AlphaMode;

use crate::prepare::{LightKind, PreparedMesh};
use crate::project::surface::{Batch, Surface};
use crate::screen::{LANES, NONE, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH, WINDOW_PX};
use crate::texture::lookup::LookupPlan;
use crate::tile::task::{FrameView, Tile, subpixel_px};
use crate::tile::texels::look_up_planes;
use crate::visibility::edges::Edges;
use crate::visibility::runs::{changes, each_bit};
use crate::visibility::walk::{self, NextTriangle, crossing};
use crate::visibility::{CutOut, RasterTriangle, Visibility, each_vector, is_nearer};

/// The triangles that the sub-pixels of a tile show.
#[derive(Default)]
pub(crate) struct Visible {
    pub(crate) subpixels: Visibility,
    /// By place in the tile's list: those that are seen.
    pub(crate) surfaces: Vec<Option<Box<Surface>>>,
    /// By place in the tile's list: opaque and cut-out triangles.
    pub(crate) rasters: Vec<Option<RasterTriangle>>,
    /// Triangles that some sub-pixel shows, by their places in the view's list.
    pub(crate) drawn: Vec<u32>,
    /// By row of sub-pixels, from the second on: columns where it differs from the one above. Old where one triangle is
    /// all that is seen.
    pub(crate) changes: Vec<u32>,
}

/// Finds the triangle of each sub-pixel, and prepares the surfaces that are seen.
pub(crate) fn find_visible<'a>(tile: &Tile, visible: &'a mut Visible) -> &'a Visible {
    visible.subpixels.clear(tile.frame.filter);
    visible.surfaces.clear();
    visible.surfaces.resize(tile.list.len(), None);
    visible.drawn.clear();
    draw_triangles(tile, visible);
    prepare_surfaces(tile, visible);
    visible
}

/// Draws the triangles of the tile's list into the sub-pixels.
fn draw_triangles(tile: &Tile, visible: &mut Visible) {
    let FrameView {
        filter, near, simd, ..
    } = *tile.frame;
    let Visible {
        subpixels,
        surfaces,
        rasters,
        ..
    } = visible;
    rasters.clear();
    let mut translucent = Vec::new();
    for id in 0..tile.list.len() as u32 {
        let raster = RasterTriangle::new(&tile.triangle(id), tile.view.corner_px, filter);
        let is_translucent = tile.alpha_mode(id) == AlphaMode::Blend;
        let (opaque, behind) = raster.map_or((None, None), |raster| {
            if is_translucent {
                (None, Some((id, raster)))
            } else {
                (Some(raster), None)
            }
        });
        translucent.extend(behind);
        rasters.push(opaque);
    }
    if let Some(id) = alone(tile, rasters).filter(|_| translucent.is_empty()) {
        return subpixels.show_alone(id);
    }
    for (id, triangle) in (0..).zip(rasters.iter()) {
        let Some(triangle) = triangle else { continue };
        match tile.alpha_mode(id) {
            AlphaMode::Mask { cutoff } => {
                let cut = CutOut {
                    triangle,
                    id,
                    cutoff,
                };
                let surface = &mut surfaces[id as usize];
                dispatch!(simd, simd => draw_cut_rows(simd, tile, cut, subpixels, surface));
            }
            _ => subpixels.draw(triangle, id, (filter, near), simd),
        }
    }
    for (id, triangle) in &translucent {
        subpixels.list(triangle, *id, (filter, near), simd);
    }
    subpixels.sort_layers();
}

/// The opaque triangle that is all that the tile shows, if there is one.
fn alone(tile: &Tile, rasters: &[Option<RasterTriangle>]) -> Option<u32> {
    let mut drawn = (0..)
        .zip(rasters)
        .filter_map(|(id, raster)| Some((id, raster.as_ref()?)));
    let (id, triangle) = drawn.next().filter(|_| drawn.next().is_none())?;
    let covers = tile.alpha_mode(id) == AlphaMode::Opaque && triangle.covers_tile(tile.frame.near);
    covers.then_some(id)
}

/// Prepares the surfaces that are seen, and lists their triangles.
fn prepare_surfaces(tile: &Tile, visible: &mut Visible) {
    let filter = tile.frame.filter;
    let Visible {
        subpixels,
        surfaces,
        drawn,
        changes: changed,
        ..
    } = visible;
    if let Some(id) = subpixels.alone {
        surfaces[id as usize] = Some(tile.surface(id, subpixel_px(filter, 0)));
        return drawn.push(tile.list[id as usize]);
    }
    let mut seen = vec![false; tile.list.len()];
    let mut note = |at: usize, id: u32| {
        if id != NONE && !std::mem::replace(&mut seen[id as usize], true) {
            let surface = &mut surfaces[id as usize];
            surface.get_or_insert_with(|| tile.surface(id, subpixel_px(filter, at)));
            drawn.push(tile.list[id as usize]);
        }
    };
    let ids = &subpixels.ids;
    changes(tile.frame.simd, ids, &filter.above, changed);
    (0..SPAN_WIDTH).for_each(|at| note(at, ids[at]));
    for (pair, &bits) in filter.above.iter().zip(&*changed) {
        each_bit(bits).for_each(|k| note(pair.here + k, ids[pair.here + k]));
    }
    let layers = subpixels.layers.iter();
    layers.for_each(|layer| note(layer.subpixel as usize, layer.id));
}

/// Draws a cut-out triangle where it is nearer than the surface stored there, and not cut out.
#[simd]
fn draw_cut_rows<S: Simd>(
    simd: S,
    tile: &Tile,
    cut: CutOut,
    subpixels: &mut Visibility,
    surface: &mut Option<Box<Surface>>,
) {
    let filter = tile.frame.filter;
    let mut plan = LookupPlan::default();
    let mut texels = [[Vec4::ZERO; LANES]];
    let mut alphas = [0.0; LANES];
    each_vector(
        simd,
        cut.triangle,
        (filter, tile.frame.near),
        #[inline(always)]
        |[row, column], inside, key| {
            let at = row * SPAN_WIDTH + column;
            let before = f32x16::from_slice(simd, &subpixels.keys[at..at + LANES]);
            let ahead = inside & is_nearer(simd, key, before);
            let bits = ahead.to_bitmask();
            if bits == 0 {
                return;
            }
            let first = bits.trailing_zeros() as usize;
            let first_px = filter.position_px(column + first, row);
            let count = 64 - bits.leading_zeros() as usize - first;
            let batch = Batch::along(simd, first_px, count);
            let surface = surface
                .get_or_insert_with(|| tile.surface(cut.id, subpixel_px(filter, at + first)));
            match &surface.base {
                None => texels[0] = [Vec4::ONE; LANES],
                Some(planes) => {
                    let textures = [(0, &tile.frame.scene.pyramids[planes.pyramid])];
                    let out = (&mut plan, &mut texels[..]);
                    look_up_planes(simd, tile, (surface, planes, &textures), &batch, out);
                }
            }
            for k in 0..count {
                alphas[first + k] = surface.factor(batch.at(k)).w * texels[0][k].w;
            }
            let alpha = f32x16::from_slice(simd, &alphas);
            let seen = ahead & alpha.simd_ge(f32x16::splat(simd, cut.cutoff));
            subpixels.show(simd, at, cut.id, (seen, key));
        },
    );
}

/// The surfaces in the sub-pixels of a pixel, or of all pixels that a filter reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    Empty,
    /// One triangle, by its place in the tile's list.
    Plane(u32),
    /// Several opaque things.
    Mixed,
    /// Something translucent.
    Layered,
}

/// The cells of a tile.
#[derive(Default)]
pub(crate) struct Cells {
    /// By pixel of the span: of its own sub-pixels. Empty where one triangle is all that the tile shows.
    pub(crate) own: Vec<Cell>,
    along: Vec<Cell>,
    /// By pixel of the tile: of all pixels that its filter reaches.
    pub(crate) under_filter: Vec<Cell>,
}

/// Finds the cells of a tile from what its sub-pixels show.
pub(crate) fn find_cells<'a>(
    per_pixel: usize,
    visible: &Visible,
    cells: &'a mut Cells,
) -> &'a Cells {
    cells.own.clear();
    cells.under_filter.clear();
    if let Some(id) = visible.subpixels.alone {
        cells
            .under_filter
            .resize(TILE_WIDTH * TILE_HEIGHT, Cell::Plane(id));
        return cells;
    }
    let rows = visible.subpixels.ids.chunks_exact(per_pixel * SPAN_WIDTH);
    // The rows of a pixel but the first one are compared with those above.
    for (y, rows) in rows.enumerate() {
        let below = &visible.changes[y * per_pixel..][..per_pixel - 1];
        let changed = below.iter().fold(0, |all, bits| all | bits);
        cells
            .own
            .extend((0..SPAN_WIDTH).map(|column| match rows[column] {
                _ if changed >> column & 1 == 1 => Cell::Mixed,
                NONE => Cell::Empty,
                id => Cell::Plane(id),
            }));
    }
    for layer in &visible.subpixels.layers {
        let (column, row) = (
            layer.subpixel as usize % SPAN_WIDTH,
            layer.subpixel as usize / SPAN_WIDTH,
        );
        cells.own[row / per_pixel * SPAN_WIDTH + column] = Cell::Layered;
    }
    join_cells(cells);
    cells
}

/// Joins the cells of the tile's span to the cells that the filter of each pixel reaches.
fn join_cells(cells: &mut Cells) {
    let Cells {
        own,
        along,
        under_filter,
    } = cells;
    if own.iter().all(|&cell| cell == own[0]) {
        return under_filter.resize(TILE_WIDTH * TILE_HEIGHT, own[0]);
    }
    along.clear();
    for row in own.chunks_exact(SPAN_WIDTH) {
        along.extend(
            row.windows(WINDOW_PX)
                .map(|window| window[1..].iter().fold(window[0], joined)),
        );
    }
    let below = |first: usize| (1..WINDOW_PX).map(move |k| first + k * TILE_WIDTH);
    under_filter.extend(
        (0..TILE_WIDTH * TILE_HEIGHT)
            .map(|at| below(at).fold(along[at], |cell, k| joined(cell, &along[k]))),
    );
}

/// Joins two neighbouring cells.
fn joined(a: Cell, b: &Cell) -> Cell {
    match (a, *b) {
        (a, b) if a == b => a,
        (Cell::Layered, _) | (_, Cell::Layered) => Cell::Layered,
        _ => Cell::Mixed,
    }
}

/// Finds the edges between sub-pixels across which colour may jump.
pub(crate) fn find_edges<'a>(tile: &Tile, visible: &Visible, edges: &'a mut Edges) -> &'a Edges {
    let Visible {
        subpixels, rasters, ..
    } = visible;
    if subpixels.alone.is_some() {
        edges.clear();
        return edges;
    }
    let mesh = TileMesh { tile, rasters };
    let seen_by = (tile.frame.filter, tile.frame.simd);
    edges.find(seen_by, &subpixels.ids, |pair| crossing(&mesh, pair));
    edges
}

/// The triangles of a tile as a surface to walk over.
struct TileMesh<'a> {
    tile: &'a Tile<'a>,
    rasters: &'a [Option<RasterTriangle>],
}

impl walk::Mesh for TileMesh<'_> {
    fn triangle(&self, id: u32) -> Option<&RasterTriangle> {
        self.rasters.get(id as usize)?.as_ref()
    }

    fn meet(&self, [a, b]: [u32; 2]) -> bool {
        let tile = self.tile;
        let (Some(&of_a), Some(&of_b)) = (tile.list.get(a as usize), tile.list.get(b as usize))
        else {
            return false;
        };
        let triangles = &tile.frame.in_view.triangles;
        let (a, b) = (&triangles[of_a as usize], &triangles[of_b as usize]);
        let mesh = &tile.frame.scene.meshes[a.mesh as usize];
        if a.mesh != b.mesh || a.facing != b.facing || tile.is_flat(mesh) {
            return false;
        }
        let [x, y, z] = mesh.triangles[a.triangle as usize];
        let others = mesh.triangles[b.triangle as usize];
        others.contains(&x) | others.contains(&y) | others.contains(&z)
    }

    fn beyond(&self, id: u32, corner: usize, expected: u32) -> Option<NextTriangle> {
        let seen = self.tile.seen(id);
        let mesh = &self.tile.frame.scene.meshes[seen.mesh as usize];
        let next = mesh.neighbours[seen.triangle as usize][corner]?;
        let id = self.tile.place(seen.mesh, next.triangle, expected)?;
        let line = |triangle: u32, corner: usize| {
            let corners = mesh.triangles[triangle as usize];
            [corners[(corner + 1) % 3], corners[(corner + 2) % 3]]
        };
        let [a, b] = line(seen.triangle, corner);
        let jumps = self.tile.is_flat(mesh)
            || ![[a, b], [b, a]].contains(&line(next.triangle, next.corner()));
        Some(NextTriangle {
            id,
            corner: next.corner(),
            jumps,
        })
    }
}

impl Tile<'_> {
    /// Returns true if each triangle of a mesh has a light of its own.
    fn is_flat(&self, mesh: &PreparedMesh) -> bool {
        mesh.normals.is_empty()
            && self.frame.scene.materials[mesh.material].light != LightKind::None
    }

    /// Place in the tile's list of a triangle of the scene; likely it is `expected`.
    fn place(&self, mesh: u32, triangle: u32, expected: u32) -> Option<u32> {
        let key = |&index: &u32| {
            let seen = &self.frame.in_view.triangles[index as usize];
            (seen.mesh, seen.triangle)
        };
        let wanted = (mesh, triangle);
        if self.list.get(expected as usize).map(key) == Some(wanted) {
            return Some(expected);
        }
        // Lists keep the order of the scene.
        let place = self.list.binary_search_by_key(&wanted, key).ok()?;
        Some(place as u32)
    }
}
