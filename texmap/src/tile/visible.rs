//! Visibility: the triangle that each sub-pixel of a tile shows, and the surfaces of those triangles.
//!
//! Where a cut-out triangle may be shown, each sub-pixel looks its alpha up first.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;
use resample_mesh::scene::AlphaMode;

use crate::project::batch::Batch;
use crate::project::surface::Surface;
use crate::screen::lanes::LANES;
use crate::screen::padded_tile::{NONE, SPAN_WIDTH};
use crate::texture::lookup_plan::LookupPlan;
use crate::tile::task::{FrameView, Tile, subpixel_px};
use crate::tile::texels::look_up_planes;
use crate::visibility::changes::{changes, each_bit};
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
