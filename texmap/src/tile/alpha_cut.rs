//! Visibility of cut-out triangles: each sub-pixel that one may show looks its alpha up first.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::Vec4;
use resample_core::dispatch;

use crate::project::batch::Batch;
use crate::project::surface::Surface;
use crate::screen::lanes::LANES;
use crate::screen::padded_tile::SPAN_WIDTH;
use crate::texture::lookup_plan::Places;
use crate::tile::{Tile, subpixel_px};
use crate::visibility::{CutOut, Visibility, each_vector, is_nearer};

impl Tile<'_> {
    /// Draws a triangle where it is nearer than the surface stored there, and not cut out.
    pub(crate) fn draw_cut(
        &self,
        cut: CutOut,
        visibility: &mut Visibility,
        surface: &mut Option<Box<Surface>>,
    ) {
        dispatch!(self.frame.simd, simd => draw_cut_rows(simd, self, cut, visibility, surface));
    }
}

#[simd]
fn draw_cut_rows<S: Simd>(
    simd: S,
    tile: &Tile,
    cut: CutOut,
    visibility: &mut Visibility,
    surface: &mut Option<Box<Surface>>,
) {
    let filter = tile.frame.filter;
    let mut places = Places::default();
    let mut texels = [[Vec4::ZERO; LANES]];
    let mut alphas = [0.0; LANES];
    each_vector(
        simd,
        cut.triangle,
        (filter, tile.frame.near),
        #[inline(always)]
        |[row, column], inside, key| {
            let at = row * SPAN_WIDTH + column;
            let before = f32x16::from_slice(simd, &visibility.keys[at..at + LANES]);
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
                    let out = (&mut places, &mut texels[..]);
                    tile.look_up_planes(simd, (surface, planes, &textures), &batch, out);
                }
            }
            for k in 0..count {
                alphas[first + k] = surface.factor(batch.at(k)).w * texels[0][k].w;
            }
            let alpha = f32x16::from_slice(simd, &alphas);
            let seen = ahead & alpha.simd_ge(f32x16::splat(simd, cut.cutoff));
            visibility.show(simd, at, cut.id, (seen, key));
        },
    );
}
