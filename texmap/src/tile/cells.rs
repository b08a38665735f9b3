//! Means of textures at pixels of surfaces that reflect their surroundings.
//!
//! Takes a surface and a place, gives the means of its textures. Maps that lie as the base texture does and have its size are
//! gathered with it: texels at the same places have the same weights, which are computed once.

use glam::Vec4;

use crate::options::Method;
use crate::prepare::mip::Pyramid;
use crate::prepare::{MAPS, NORMALS};
use crate::project::patch::Patch;
use crate::project::pixel::PixelOnTexture;
use crate::project::surface::{MapPlanes, Surface, UvAt, UvPlanes};
use crate::texture::points::{gather_minified, gather_together, is_minified};
use crate::texture::sums::MOST_TOGETHER;
use crate::tile::Tile;
use crate::tile::pixel_light::Shown;

impl Tile<'_> {
    /// The means of the base texture and of those maps (by their pyramids) that are alike; `None` where the base texture is
    /// magnified.
    fn gathered_as_base(
        &self,
        pixel: &PixelOnTexture,
        maps: [Option<usize>; MAPS],
        texels: &mut u64,
    ) -> Option<(Vec4, [Option<Vec4>; MAPS])> {
        let mut pyramids = [pixel.pyramid; MOST_TOGETHER];
        let mut colours = [Vec4::ZERO; MOST_TOGETHER];
        let mut places = [None; MAPS];
        let mut count = 1;
        for (place, map) in places.iter_mut().zip(maps) {
            let map: Option<&Pyramid> = map.map(|map| &self.frame.scene.pyramids[map]);
            if let Some(map) = map.filter(|map| map.is_alike(pixel.pyramid)) {
                (pyramids[count], *place) = (map, Some(count));
                count += 1;
            }
        }
        let simd = self.frame.simd;
        *texels += u64::from(gather_together(
            pixel,
            &pyramids[..count],
            simd,
            &mut colours,
        )?);
        Some((colours[0], places.map(|place| Some(colours[place?]))))
    }

    /// The means of the textures of a smooth surface at a pixel.
    pub(crate) fn patch_shown<'a>(
        &self,
        surface: &'a Surface,
        patch: &Patch,
        at_px: [f32; 2],
        texels: &mut u64,
    ) -> Option<Shown<'a>> {
        let material = surface.material(self.frame.scene);
        let on_patch = OnPatch::new(self, surface, patch, at_px);
        let of = |planes: &Option<UvPlanes>| planes.as_ref().map(|planes| planes.pyramid);
        let maps_of_light = material.physical.as_ref().map(|physical| &physical.maps);
        let maps_of_light = maps_of_light.map_or([None; MAPS], Clone::clone);
        let like_base = maps_of_light.map(|map| {
            let map = map.filter(|map| map.per_base == Some([1.0; 2]))?;
            Some(map.pyramid)
        });
        let (base, mut maps) = match of(&surface.base) {
            Some(pyramid) => {
                let pixel = on_patch.pixel(pyramid, [1.0; 2]);
                self.gathered_as_base(&pixel, like_base, texels)?
            }
            None => (Vec4::ONE, [None; MAPS]),
        };
        let per_base = material.emissive_per_base.unwrap_or([1.0; 2]);
        let emissive = on_patch.gathered(of(&surface.emissive), per_base, texels)?;
        for (texel, map) in maps.iter_mut().zip(maps_of_light) {
            if let (None, Some(map)) = (*texel, map) {
                let per_base = map.per_base.unwrap_or([1.0; 2]);
                *texel = Some(on_patch.gathered(Some(map.pyramid), per_base, texels)?);
            }
        }
        let maps = maps.map(|texel| texel.unwrap_or(Vec4::ZERO));
        Some(Shown {
            surface,
            at_px,
            base,
            emissive,
            maps,
            magnified: None,
        })
    }

    /// The means of the textures of a surface at a pixel, by the method of the frame.
    pub(crate) fn pixel_shown<'a>(
        &self,
        surface: &'a Surface,
        at_px: [f32; 2],
        texels: &mut u64,
    ) -> Option<Shown<'a>> {
        let filtered =
            |planes: Option<&UvPlanes>, pyramid: Option<usize>, texels: &mut u64| match planes {
                None => Some(Vec4::ONE),
                Some(planes) => {
                    let pyramid = pyramid.unwrap_or(planes.pyramid);
                    let gathered = self.pixel_texture(surface, (planes, pyramid), at_px)?;
                    *texels += u64::from(gathered.texels);
                    Some(gathered.rgba)
                }
            };
        let emissive = filtered(surface.emissive.as_ref(), None, texels)?;
        let of_surface = surface.maps.as_ref()?;
        let (base, mut maps) = match &surface.base {
            Some(planes) if self.frame.options.method == Method::Hybrid => {
                let like_base = of_surface.maps.each_ref().map(|map| match map {
                    Some(MapPlanes::LikeBase { pyramid }) => Some(*pyramid),
                    _ => None,
                });
                let pixel = self.pixel_on(surface, (planes, planes.pyramid), at_px);
                self.gathered_as_base(&pixel, like_base, texels)?
            }
            planes => (filtered(planes.as_ref(), None, texels)?, [None; MAPS]),
        };
        let mut magnified = None;
        for (k, texel) in maps.iter_mut().enumerate() {
            let planes = match &of_surface.maps[k] {
                None => continue,
                Some(MapPlanes::Own(planes)) => Some(&**planes),
                Some(MapPlanes::LikeBase { .. }) => surface.base.as_ref(),
            };
            let pyramid = of_surface.maps[k].as_ref().map(MapPlanes::pyramid);
            if texel.is_none() {
                *texel = Some(filtered(planes, pyramid, texels)?);
            }
            if k == NORMALS
                && let (Some(planes), Some(pyramid)) = (planes, pyramid)
            {
                magnified = self.magnified(surface, planes, pyramid, at_px);
            }
        }
        Some(Shown {
            surface,
            at_px,
            base,
            emissive,
            maps: maps.map(|texel| texel.unwrap_or(Vec4::ZERO)),
            magnified,
        })
    }

    /// Texels across a pixel, squared, where a look-up takes them from the full texture.
    fn magnified(
        &self,
        surface: &Surface,
        planes: &UvPlanes,
        pyramid: usize,
        at_px: [f32; 2],
    ) -> Option<f32> {
        let at = surface.uv_at(planes, at_px);
        let pixel = PixelOnTexture {
            pyramid: &self.frame.scene.pyramids[pyramid],
            at,
            over_w_slope: [0.0; 2],
        };
        let [ux, uy, vx, vy] = at.jacobian;
        let long2 = (ux * ux + vx * vx).max(uy * uy + vy * vy);
        (!is_minified(&pixel, 1.0)).then_some(long2)
    }
}

/// A pixel on a smooth surface and its footprint on textures.
pub(crate) struct OnPatch<'a> {
    tile: &'a Tile<'a>,
    uv: UvAt,
    over_w_slope: [f32; 2],
}

impl<'a> OnPatch<'a> {
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
        texels: &mut u64,
    ) -> Option<Vec4> {
        let Some(pyramid) = pyramid else {
            return Some(Vec4::ONE);
        };
        let pixel = self.pixel(pyramid, per_base);
        let gathered = gather_minified(&pixel, self.tile.frame.simd)?;
        *texels += u64::from(gathered.texels);
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
