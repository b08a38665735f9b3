//! Pixels that are computed directly: those whose whole filter lies on one plane, minified, gather texels as points.
//!
//! Every other pixel is left to sub-pixels, each of which sums the splats of the texels around the place that it shows; the
//! pixel's Gaussian filters them down, so that each surface counts by its own coverage and nothing hidden counts. Both are
//! the same sum of texels to within the errors stated in their modules, so there is no seam between them.

use crate::screen::padded_tile::{SPAN_HEIGHT, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use crate::texture::points::gather_minified;
use crate::tile::cells::{Cell, Cells};
use crate::tile::patches::Patches;
use crate::tile::pixel_light::LightBatch;
use crate::tile::pixel_textures::{patch_colour, patch_sample, pixel_colour, pixel_sample};
use crate::tile::task::{Tile, centre_px};
use crate::tile::visible::Visible;
use crate::visibility::edges::Edges;
use crate::visibility::filter::{AROUND, around};

/// The pixels of a tile that are computed directly, and those that are left to sub-pixels.
#[derive(Default)]
pub(crate) struct DirectPixels {
    /// Linear premultiplied; 0 where the pixel is left to sub-pixels or shows nothing.
    pub(crate) rgba: Vec<[f32; 4]>,
    /// Texels gathered as points.
    pub(crate) points: u64,
    /// Texels looked up.
    pub(crate) looked_up: u64,
    /// Pixels of the tile that are left to sub-pixels.
    pub(crate) from_subpixels: Vec<u16>,
    /// By pixel of the span: whether its sub-pixels' colours are needed.
    pub(crate) wanted: Vec<bool>,
}

/// A stage in the place of points: it looks textures up at every pixel.
pub(crate) type PixelLookUps =
    for<'a> fn(&Tile, (&Visible, &Cells, &Edges), &'a mut DirectPixels) -> &'a DirectPixels;

/// Gathers points at every pixel that sees one minified plane, and leaves the others to sub-pixels.
pub(crate) fn lay_points<'a>(
    tile: &Tile,
    (visible, cells, patches): (&Visible, &Cells, &Patches),
    direct: &'a mut DirectPixels,
) -> &'a DirectPixels {
    let mut light = LightBatch::default();
    let mut points = 0;
    direct.fill(cells, |rgba, pixel, cell| {
        let (id, patch) = match (cell, patches.at(pixel)) {
            (Cell::Plane(id), _) => (id, None),
            (_, Some(patch)) => (patch.id, Some(patch)),
            _ => return false,
        };
        let Some(surface) = &visible.surfaces[id as usize] else {
            return false;
        };
        let at = centre_px(pixel);
        let place = pixel[1] * TILE_WIDTH + pixel[0];
        if surface.maps.is_some() {
            let sample = match patch {
                None => pixel_sample((tile, None), surface, at, &mut points),
                Some(patch) => patch_sample(tile, surface, &patch, at, &mut points),
            };
            return sample.is_some_and(|sample| {
                light.add(tile, (place, 1.0), &sample, rgba);
                true
            });
        }
        let colour = match patch {
            None => pixel_colour((tile, gather_minified), surface, at, &mut points),
            Some(patch) => patch_colour(tile, surface, &patch, at, &mut points),
        };
        match colour {
            Some(colour) => rgba[place] = colour.to_array(),
            None => return false,
        }
        true
    });
    light.finish(tile, &mut direct.rgba);
    direct.points = points;
    direct
}

impl DirectPixels {
    /// Calls `done` with the colours for every pixel that shows something; those for which it says no are left to sub-pixels.
    pub(crate) fn fill(
        &mut self,
        cells: &Cells,
        mut done: impl FnMut(&mut [[f32; 4]], [usize; 2], Cell) -> bool,
    ) {
        self.rgba.clear();
        self.rgba.resize(TILE_WIDTH * TILE_HEIGHT, [0.0; 4]);
        (self.points, self.looked_up) = (0, 0);
        self.wanted.clear();
        self.wanted.resize(SPAN_WIDTH * SPAN_HEIGHT, false);
        self.from_subpixels.clear();
        for y in 0..TILE_HEIGHT {
            for x in 0..TILE_WIDTH {
                let cell = cells.under_filter[y * TILE_WIDTH + x];
                if cell != Cell::Empty && !done(&mut self.rgba, [x, y], cell) {
                    self.from_subpixels.push((y * TILE_WIDTH + x) as u16);
                    (0..AROUND).for_each(|k| self.wanted[around([x, y], k)] = true);
                }
            }
        }
    }
}
