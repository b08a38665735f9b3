//! The textures of a surface, looked up at a batch of sub-pixels.
//!
//! Textures that lie as the base texture does share its look-ups.

use fearless_simd::prelude::*;
use glam::Vec4;
use resample_mesh::scene::Magnify;

use crate::prepare::MAPS;
use crate::prepare::mip::Pyramid;
use crate::project::surface::{Batch, MapPlanes, Surface, UvPlanes};
use crate::screen::LANES;
use crate::texture::lookup::{LookupPlan, reconstructed};
use crate::texture::taps::{look_up, look_up_at_borders};
use crate::tile::task::Tile;

/// Textures that a surface may have: base, emissive, and the maps of light.
const TEXTURES: usize = FIRST_MAP + MAPS;

/// Their places.
pub(crate) const BASE: usize = 0;
pub(crate) const EMISSIVE: usize = 1;
pub(crate) const FIRST_MAP: usize = 2;

/// The colours of a surface's textures at a batch of sub-pixels.
pub(crate) struct Texels {
    /// By texture; white where there is no base texture or no emissive one.
    pub(crate) colours: [[Vec4; LANES]; TEXTURES],
    /// Where the base texture is looked up.
    pub(crate) base: LookupPlan,
    /// By map of light: where it is looked up, if not where the base texture is.
    pub(crate) maps: [LookupPlan; MAPS],
}

impl Default for Texels {
    fn default() -> Self {
        Self {
            colours: [[Vec4::ZERO; LANES]; TEXTURES],
            base: LookupPlan::default(),
            maps: std::array::from_fn(|_| LookupPlan::default()),
        }
    }
}

/// Looks up the textures of a surface.
#[inline(always)]
pub(crate) fn look_up_batch<S: Simd>(
    simd: S,
    tile: &Tile,
    (surface, batch): (&Surface, &Batch),
    texels: &mut Texels,
) {
    let Texels {
        colours,
        base,
        maps,
    } = texels;
    let count = batch.count;
    let pyramids = &tile.frame.scene.pyramids;
    match &surface.base {
        None => colours[BASE][..count].fill(Vec4::ONE),
        Some(planes) => {
            let mut together = [(BASE, &pyramids[planes.pyramid]); TEXTURES];
            let mut textures = 1;
            for (k, map) in surface.maps_of_light().iter().enumerate() {
                if let Some(MapPlanes::LikeBase { pyramid }) = map {
                    together[textures] = (FIRST_MAP + k, &pyramids[*pyramid]);
                    textures += 1;
                }
            }
            let together = &together[..textures];
            look_up_planes(
                simd,
                tile,
                (surface, planes, together),
                batch,
                (base, colours),
            );
        }
    }
    match &surface.emissive {
        None => colours[EMISSIVE][..count].fill(Vec4::ONE),
        Some(planes) => {
            let alone = [(EMISSIVE, &pyramids[planes.pyramid])];
            // Nothing else needs these plan.
            let out = (&mut maps[0], &mut colours[..]);
            look_up_planes(simd, tile, (surface, planes, &alone), batch, out);
        }
    }
    for (k, map) in surface.maps_of_light().iter().enumerate() {
        if let Some(MapPlanes::Own(planes)) = map {
            let alone = [(FIRST_MAP + k, &pyramids[planes.pyramid])];
            let out = (&mut maps[k], &mut colours[..]);
            look_up_planes(simd, tile, (surface, planes, &alone), batch, out);
        }
    }
}

/// Looks up textures that lie alike on a surface.
#[inline(always)]
pub(crate) fn look_up_planes<S: Simd>(
    simd: S,
    tile: &Tile,
    (surface, planes, pyramids): (&Surface, &UvPlanes, &[(usize, &Pyramid)]),
    batch: &Batch,
    (plan, colours): (&mut LookupPlan, &mut [[Vec4; LANES]]),
) {
    let side_px = tile.frame.filter.spacing_px;
    let pyramid = &tile.frame.scene.pyramids[planes.pyramid];
    plan.set(simd, (surface, planes), batch, (pyramid, side_px));
    for (slot, _) in pyramids {
        colours[*slot] = [Vec4::ZERO; LANES];
    }
    let nearest = pyramid.magnify == Magnify::Nearest;
    if nearest || planes.borders.any() {
        let mut left = (1u32 << batch.count) - 1;
        while left != 0 {
            let k = left.trailing_zeros() as usize;
            left &= left - 1;
            if (nearest && plan.is_plain(k)) || plan.sees_border(k, planes) {
                plan.count[k] = 0.0;
                let uv = surface.uv_at(planes, batch.at(k));
                if plan.is_plain(k) {
                    for (slot, pyramid) in pyramids {
                        colours[*slot][k] = reconstructed(pyramid, uv.u, uv.v);
                    }
                } else {
                    let footprint = (&uv, side_px, &planes.borders);
                    look_up_at_borders(simd, pyramids, footprint, (&mut *colours, k));
                }
            }
        }
    }
    look_up(simd, pyramids, (plan, batch.count), colours);
}
