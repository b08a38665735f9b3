//! Pixels whose textures are looked up once for each triangle, which counts by its coverage.
//!
//! Pixels with something translucent are left to sub-pixels.

use glam::Vec4;

use super::look_ups::gather_of;
use crate::options::Method;
use crate::screen::padded_tile::TILE_WIDTH;
use crate::tile::cells::{Cell, Cells};
use crate::tile::pixel_light::LightBatch;
use crate::tile::pixel_textures::{pixel_colour, pixel_sample};
use crate::tile::points::{DirectPixels, PixelLookUps};
use crate::tile::task::{Tile, centre_px};
use crate::tile::visible::Visible;
use crate::visibility::edges::Edges;
use crate::visibility::fragments::{Fragment, Fragments};

/// The stage that takes the place of points in a method; `None` in the default one.
pub(crate) fn pixel_look_ups(method: Method) -> Option<PixelLookUps> {
    (method != Method::Hybrid).then_some(look_up)
}

/// Looks the texture up for each triangle of each pixel; leaves pixels with something translucent to sub-pixels.
fn look_up<'a>(
    tile: &Tile,
    (visible, cells, edges): (&Visible, &Cells, &Edges),
    direct: &'a mut DirectPixels,
) -> &'a DirectPixels {
    let method = tile.frame.options.method;
    let gather = gather_of(method);
    let seen_by = (tile.frame.filter, tile.frame.simd);
    let mut texels = 0;
    let mut light = LightBatch::default();
    let (mut by_row, mut fragments) = (Fragments::default(), Vec::new());
    direct.fill(cells, |rgba, pixel, cell| {
        match cell {
            Cell::Layered => return false,
            Cell::Plane(id) => {
                fragments.clear();
                fragments.push(Fragment {
                    id,
                    weight: 1.0,
                    at: centre_px(pixel),
                });
            }
            _ => {
                let shown = (&visible.subpixels.ids[..], edges);
                by_row.collect(seen_by, shown, pixel, &mut fragments);
            }
        }
        let place = pixel[1] * TILE_WIDTH + pixel[0];
        let mut sum = Vec4::ZERO;
        for fragment in &fragments {
            let Some(surface) = &visible.surfaces[fragment.id as usize] else {
                continue;
            };
            if surface.maps.is_some() {
                let gather = (tile, Some(gather));
                if let Some(sample) = pixel_sample(gather, surface, fragment.at, &mut texels) {
                    light.add(tile, (place, fragment.weight), &sample, rgba);
                }
                continue;
            }
            // Where no texel is near, as between the points of a magnified texture, nothing is seen.
            let colour = pixel_colour((tile, gather), surface, fragment.at, &mut texels)
                .unwrap_or(Vec4::ZERO);
            sum += fragment.weight * colour;
        }
        rgba[place] = (Vec4::from(rgba[place]) + sum).to_array();
        true
    });
    light.finish(tile, &mut direct.rgba);
    match method {
        Method::Point => direct.points = texels,
        _ => direct.looked_up = texels,
    }
    direct
}
