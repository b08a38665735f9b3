//! Pixels that are computed directly: those whose whole filter lies on one plane gather texels, minified ones as points and, where a surface is lit, magnified ones as splats.
//!
//! Every other pixel is left to sub-pixels, each of which sums the splats of the texels around the place that it shows; the
//! pixel's Gaussian filters them down, so that each surface counts by its own coverage and nothing hidden counts. Both are
//! the same sum of texels to within the errors stated in their modules, so there is no seam between them.

use glam::Vec4;
use resample_core::simd::Vectors;

use crate::prepare::mip::Pyramid;
use crate::prepare::{MAPS, NORMALS};
use crate::project::surface::{MapPlanes, Surface, UvAt, UvPlanes};
use crate::screen::{SPAN_HEIGHT, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use crate::texture::ellipse::{Gathered, Laid, MOST_TOGETHER, PixelOnTexture};
use crate::texture::points::{gather, gather_minified, gather_together, is_minified};
use crate::tile::light::{LightBatch, NormalMap, Normals, SurfaceSample, lit, shaded};
use crate::tile::patches::{Patch, Patches};
use crate::tile::task::{Tile, centre_px};
use crate::tile::visible::{Cell, Cells, Visible};
use crate::visibility::edges::Edges;
use crate::visibility::filter::{AROUND, around};

/// The pixels of a tile that are computed directly, and those that are left to sub-pixels.
#[derive(Default)]
pub(crate) struct DirectPixels {
    /// Linear premultiplied; 0 where the pixel is left to sub-pixels or shows nothing.
    pub(crate) rgba: Vec<[f32; 4]>,
    /// Texels gathered.
    pub(crate) laid: Laid,
    /// Pixels of the tile that are computed directly and whose texels are magnified.
    pub(crate) magnified: Vec<u16>,
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
    let mut laid = Laid::default();
    let mut magnified = std::mem::take(&mut direct.magnified);
    magnified.clear();
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
        if let Some(maps) = &surface.maps {
            let splats = laid.splats;
            let sample = match patch {
                None => pixel_sample((tile, None), surface, at, &mut laid),
                Some(patch) => patch_sample(tile, surface, &patch, at, &mut laid),
            };
            let Some(sample) = sample else { return false };
            let normals = Normals::new(&sample, maps);
            // Sub-pixels see less of what varies.
            if tile.frame.filter.per_pixel > 1 && normals.outdo_lobe(tile, &sample) {
                return false;
            }
            light.add(tile, (place, 1.0), (&sample, &normals), rgba);
            if laid.splats > splats {
                magnified.push(place as u16);
            }
            return true;
        }
        let colour = match patch {
            // Without light the splats of sub-pixels, which neighbours share, take less time.
            None => pixel_colour((tile, gather_minified), surface, at, &mut laid),
            Some(patch) => patch_colour(tile, surface, &patch, at, &mut laid),
        };
        match colour {
            Some(colour) => rgba[place] = colour.to_array(),
            None => return false,
        }
        true
    });
    light.finish(tile, &mut direct.rgba);
    (direct.laid, direct.magnified) = (laid, magnified);
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
        (self.laid, self.looked_up) = (Laid::default(), 0);
        self.wanted.clear();
        self.wanted.resize(SPAN_WIDTH * SPAN_HEIGHT, false);
        self.from_subpixels.clear();
        self.magnified.clear();
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

// The textures of a surface at a pixel: its colour, or a sample to be lit by the surroundings.
//
// Takes a surface and a place, gives the means of its textures there. Maps that lie as the base texture does and have its size are
// gathered with it: texels at the same places have the same weights, which are computed once.

/// The look-up of a texture at a pixel; `None` where the texture has nothing there.
pub(crate) type Gather = fn(&PixelOnTexture, Vectors) -> Option<Gathered>;

/// The colour of a surface at a pixel ; `None` where its textures are not gathered.
pub(crate) fn pixel_colour(
    (tile, gather): (&Tile, Gather),
    surface: &Surface,
    at: [f32; 2],
    laid: &mut Laid,
) -> Option<Vec4> {
    let mut filtered = |planes: &Option<UvPlanes>| match planes {
        None => Some(Vec4::ONE),
        Some(planes) => {
            let gathered = gather(
                &tile.pixel_on(surface, (planes, planes.pyramid), at),
                tile.frame.simd,
            )?;
            *laid += gathered.laid;
            Some(gathered.rgba)
        }
    };
    let (base, emissive) = (filtered(&surface.base)?, filtered(&surface.emissive)?);
    Some(lit(tile, surface, at, base, emissive))
}

/// The colour of a smooth surface at a pixel.
fn patch_colour(
    tile: &Tile,
    surface: &Surface,
    patch: &Patch,
    at_px: [f32; 2],
    laid: &mut Laid,
) -> Option<Vec4> {
    let footprint = PatchFootprint::new(tile, surface, patch, at_px);
    let of = |planes: &Option<UvPlanes>| planes.as_ref().map(|planes| planes.pyramid);
    let base = footprint.gathered(of(&surface.base), [1.0; 2], laid)?;
    let material = surface.material(tile.frame.scene);
    let per_base = material.emissive_per_base.unwrap_or([1.0; 2]);
    let emissive = footprint.gathered(of(&surface.emissive), per_base, laid)?;
    Some(shaded(tile, surface, at_px, patch.light, base, emissive))
}

/// The means of the base texture and of those maps (by their pyramids) that are alike; `None` where the base texture is
/// not gathered.
fn gathered_as_base(
    tile: &Tile,
    pixel: &PixelOnTexture,
    maps: [Option<usize>; MAPS],
    laid: &mut Laid,
) -> Option<(Vec4, [Option<Vec4>; MAPS])> {
    let mut pyramids = [pixel.pyramid; MOST_TOGETHER];
    let mut colours = [Vec4::ZERO; MOST_TOGETHER];
    let mut places = [None; MAPS];
    let mut count = 1;
    for (place, map) in places.iter_mut().zip(maps) {
        let map: Option<&Pyramid> = map.map(|map| &tile.frame.scene.pyramids[map]);
        if let Some(map) = map.filter(|map| map.is_alike(pixel.pyramid)) {
            (pyramids[count], *place) = (map, Some(count));
            count += 1;
        }
    }
    let simd = tile.frame.simd;
    let found = gather_together(pixel, &pyramids[..count], simd, &mut colours)?;
    *laid += found;
    Some((colours[0], places.map(|place| Some(colours[place?]))))
}

/// The means of the textures of a smooth surface at a pixel.
fn patch_sample<'a>(
    tile: &Tile,
    surface: &'a Surface,
    patch: &Patch,
    at_px: [f32; 2],
    laid: &mut Laid,
) -> Option<SurfaceSample<'a>> {
    let material = surface.material(tile.frame.scene);
    let footprint = PatchFootprint::new(tile, surface, patch, at_px);
    let of = |planes: &Option<UvPlanes>| planes.as_ref().map(|planes| planes.pyramid);
    let maps_of_light = &material.physical.as_ref()?.maps;
    let like_base = maps_of_light.each_ref().map(|map| {
        let map = map.as_ref().filter(|map| map.per_base == Some([1.0; 2]))?;
        Some(map.pyramid)
    });
    let (base, mut maps) = match of(&surface.base) {
        Some(pyramid) => {
            let pixel = footprint.pixel(pyramid, [1.0; 2]);
            gathered_as_base(tile, &pixel, like_base, laid)?
        }
        None => (Vec4::ONE, [None; MAPS]),
    };
    let per_base = material.emissive_per_base.unwrap_or([1.0; 2]);
    let emissive = footprint.gathered(of(&surface.emissive), per_base, laid)?;
    for (texel, map) in maps.iter_mut().zip(maps_of_light) {
        if let (None, Some(map)) = (*texel, map) {
            let per_base = map.per_base.unwrap_or([1.0; 2]);
            *texel = Some(footprint.gathered(Some(map.pyramid), per_base, laid)?);
        }
    }
    let maps = maps.map(|texel| texel.unwrap_or(Vec4::ZERO));
    let normals = match &maps_of_light[NORMALS] {
        Some(map) => {
            let per_base = map.per_base.unwrap_or([1.0; 2]);
            filtered_normals(&footprint.pixel(map.pyramid, per_base))
        }
        None => NormalMap::Minified,
    };
    Some(SurfaceSample {
        surface,
        at_px,
        base,
        emissive,
        maps,
        normals,
    })
}

/// The means of the textures of a surface at a pixel, each gathered by `gather`; by points, alike ones together.
pub(crate) fn pixel_sample<'a>(
    (tile, look_up): (&Tile, Option<Gather>),
    surface: &'a Surface,
    at_px: [f32; 2],
    laid: &mut Laid,
) -> Option<SurfaceSample<'a>> {
    let alone = look_up.unwrap_or(gather);
    let filtered = |planes: Option<&UvPlanes>, pyramid: Option<usize>, laid: &mut Laid| match planes
    {
        None => Some(Vec4::ONE),
        Some(planes) => {
            let pyramid = pyramid.unwrap_or(planes.pyramid);
            let gathered = alone(
                &tile.pixel_on(surface, (planes, pyramid), at_px),
                tile.frame.simd,
            )?;
            *laid += gathered.laid;
            Some(gathered.rgba)
        }
    };
    let emissive = filtered(surface.emissive.as_ref(), None, laid)?;
    let of_surface = surface.maps.as_ref()?;
    let (base, mut maps) = match &surface.base {
        Some(planes) if look_up.is_none() => {
            let like_base = of_surface.maps.each_ref().map(|map| match map {
                Some(MapPlanes::LikeBase { pyramid }) => Some(*pyramid),
                _ => None,
            });
            let pixel = tile.pixel_on(surface, (planes, planes.pyramid), at_px);
            gathered_as_base(tile, &pixel, like_base, laid)?
        }
        planes => (filtered(planes.as_ref(), None, laid)?, [None; MAPS]),
    };
    let mut normals = NormalMap::Minified;
    for (k, texel) in maps.iter_mut().enumerate() {
        let planes = match &of_surface.maps[k] {
            None => continue,
            Some(MapPlanes::Own(planes)) => Some(&**planes),
            Some(MapPlanes::LikeBase { .. }) => surface.base.as_ref(),
        };
        let pyramid = of_surface.maps[k].as_ref().map(MapPlanes::pyramid);
        if texel.is_none() {
            *texel = Some(filtered(planes, pyramid, laid)?);
        }
        if k == NORMALS
            && let (Some(planes), Some(pyramid)) = (planes, pyramid)
        {
            let pixel = tile.pixel_on(surface, (planes, pyramid), at_px);
            normals = match look_up {
                None => filtered_normals(&pixel),
                Some(_) => normals_of_look_up(&pixel),
            };
        }
    }
    Some(SurfaceSample {
        surface,
        at_px,
        base,
        emissive,
        maps: maps.map(|texel| texel.unwrap_or(Vec4::ZERO)),
        normals,
    })
}

/// A normal map whose texels are gathered.
fn filtered_normals(pixel: &PixelOnTexture) -> NormalMap {
    if is_minified(pixel) {
        return NormalMap::Minified;
    }
    let squares = pixel.at.jacobian.map(|j| j * j);
    NormalMap::Magnified {
        side2: 0.5 * squares.iter().sum::<f32>(),
    }
}

/// A normal map that is looked up: from the full texture where it is magnified.
fn normals_of_look_up(pixel: &PixelOnTexture) -> NormalMap {
    if is_minified(pixel) {
        return NormalMap::Minified;
    }
    let [ux, uy, vx, vy] = pixel.at.jacobian;
    NormalMap::LookedUp {
        long2: (ux * ux + vx * vx).max(uy * uy + vy * vy),
    }
}

/// A pixel on a smooth surface and its footprint on textures.
struct PatchFootprint<'a> {
    tile: &'a Tile<'a>,
    uv: UvAt,
    over_w_slope: [f32; 2],
}

impl<'a> PatchFootprint<'a> {
    pub(crate) fn new(
        tile: &'a Tile<'a>,
        surface: &Surface,
        patch: &Patch,
        at_px: [f32; 2],
    ) -> Self {
        let over_w_slope = surface.over_w_slope(at_px);
        // The mean under the filter differs from the value at the centre by half the second derivative times the variance.
        let bent = [0, 1].map(|k| tile.frame.filter.variance_px2[k] * over_w_slope[k]);
        let UvAt { u, v, jacobian } = patch.at;
        let [ux, uy, vx, vy] = jacobian;
        let uv = UvAt {
            u: u + ux * bent[0] + uy * bent[1],
            v: v + vx * bent[0] + vy * bent[1],
            jacobian,
        };
        Self {
            tile,
            uv,
            over_w_slope,
        }
    }

    /// The mean of a texture with the coordinates of the base texture, and so many texels to one of that; white without a
    /// texture.
    pub(crate) fn gathered(
        &self,
        pyramid: Option<usize>,
        per_base: [f32; 2],
        laid: &mut Laid,
    ) -> Option<Vec4> {
        let Some(pyramid) = pyramid else {
            return Some(Vec4::ONE);
        };
        let pixel = self.pixel(pyramid, per_base);
        let gathered = gather(&pixel, self.tile.frame.simd)?;
        *laid += gathered.laid;
        Some(gathered.rgba)
    }

    /// The pixel on such a texture.
    fn pixel(&self, pyramid: usize, [su, sv]: [f32; 2]) -> PixelOnTexture<'a> {
        let UvAt { u, v, jacobian } = self.uv;
        let [ux, uy, vx, vy] = jacobian;
        PixelOnTexture {
            pyramid: &self.tile.frame.scene.pyramids[pyramid],
            at: UvAt {
                u: u * su,
                v: v * sv,
                jacobian: [ux * su, uy * su, vx * sv, vy * sv],
            },
            over_w_slope: self.over_w_slope,
        }
    }
}
