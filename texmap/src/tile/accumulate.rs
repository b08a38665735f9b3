//! Accumulate and resolve: the texels of what a tile shows become the colours of its pixels.
//!
//! A pixel whose whole filter lies on one plane, minified, gathers texels as points. Every other pixel is made from
//! sub-pixels, each of which sums the splats of the texels around the place that it shows; the pixel's Gaussian
//! filters them down, so that each surface counts by its own coverage and nothing hidden counts. Both are the same
//! sum of texels to within the errors stated in their modules, so there is no seam between them.
//!
//! The other methods look the texture up once for each triangle in each pixel, and count it by its coverage. Pixels
//! with something translucent are made from sub-pixels in every method.

use glam::Vec4;
use resample_mesh::scene::AlphaMode;

use crate::options::Method;
use crate::project::patch::Patch;
use crate::project::pixel::{Gathered, PixelOnTexture};
use crate::project::surface::{Surface, UvPlanes};
use crate::screen::padded_tile::{BORDER_PX, SPAN_HEIGHT, SPAN_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use crate::texture::backward::{look_up_bilinear, look_up_ewa, look_up_nearest, look_up_trilinear};
use crate::texture::points::{gather_minified, gather_points};
use crate::tile::cells::OnPatch;
use crate::tile::pixel_light::Waiting;
use crate::tile::{Cell, Tile, TileImage, TileWork};
use crate::visibility::filter::{AROUND, around};
use crate::visibility::fragments::Fragment;

impl Tile<'_> {
    /// Gathers points at every pixel that sees one minified plane, and leaves the others to sub-pixels.
    pub(crate) fn lay_points(&self, work: &mut TileWork, image: &mut TileImage) {
        let mut waiting = Waiting::default();
        self.each_pixel(work, |work, pixel, cell| {
            let (id, patch) = match (cell, work.patches.at(pixel)) {
                (Cell::Plane(id), _) => (id, None),
                (_, Some(patch)) => (patch.id, Some(patch)),
                _ => return false,
            };
            let Some(surface) = &work.surfaces[id as usize] else {
                return false;
            };
            let at = centre_px(pixel);
            let place = pixel[1] * TILE_WIDTH + pixel[0];
            if surface.maps.is_some() {
                let shown = match patch {
                    None => self.pixel_shown(surface, at, &mut image.points),
                    Some(patch) => self.patch_shown(surface, &patch, at, &mut image.points),
                };
                return shown.is_some_and(|shown| {
                    self.wait(&mut waiting, (place, 1.0), &shown, image);
                    true
                });
            }
            let colour = match patch {
                None => self.pixel_colour(surface, at, &mut image.points),
                Some(patch) => self.patch_colour(surface, &patch, at, &mut image.points),
            };
            match colour {
                Some(colour) => image.rgba[place] = colour.to_array(),
                None => return false,
            }
            true
        });
        self.light_waiting(&mut waiting, image);
    }

    /// Looks the texture up for each triangle of each pixel; leaves pixels with something translucent to sub-pixels.
    pub(crate) fn look_up(&self, work: &mut TileWork, image: &mut TileImage) {
        let mut texels = 0;
        let mut waiting = Waiting::default();
        work.by_row.clear();
        self.each_pixel(work, |work, pixel, cell| {
            match cell {
                Cell::Layered => return false,
                Cell::Plane(id) => {
                    work.fragments.clear();
                    work.fragments.push(Fragment {
                        id,
                        weight: 1.0,
                        at: centre_px(pixel),
                    });
                }
                _ => work.by_row.collect(
                    (self.frame.filter, self.frame.simd),
                    (&work.visibility.ids, &work.edges),
                    pixel,
                    &mut work.fragments,
                ),
            }
            let place = pixel[1] * TILE_WIDTH + pixel[0];
            let mut sum = Vec4::ZERO;
            for fragment in &work.fragments {
                let Some(surface) = &work.surfaces[fragment.id as usize] else {
                    continue;
                };
                if surface.maps.is_some() {
                    if let Some(shown) = self.pixel_shown(surface, fragment.at, &mut texels) {
                        self.wait(&mut waiting, (place, fragment.weight), &shown, image);
                    }
                    continue;
                }
                // Where no texel is near, as between the points of a magnified texture, nothing is seen.
                let colour = self
                    .pixel_colour(surface, fragment.at, &mut texels)
                    .unwrap_or(Vec4::ZERO);
                sum += fragment.weight * colour;
            }
            image.rgba[place] = (Vec4::from(image.rgba[place]) + sum).to_array();
            true
        });
        self.light_waiting(&mut waiting, image);
        if self.frame.options.method == Method::Point {
            image.points += texels;
        } else {
            image.splats += texels;
        }
    }

    /// Calls `done` for every pixel that shows something; those for which it says no are left to sub-pixels.
    fn each_pixel(
        &self,
        work: &mut TileWork,
        mut done: impl FnMut(&mut TileWork, [usize; 2], Cell) -> bool,
    ) {
        work.wanted.clear();
        work.wanted.resize(SPAN_WIDTH * SPAN_HEIGHT, false);
        work.from_subpixels.clear();
        for y in 0..TILE_HEIGHT {
            for x in 0..TILE_WIDTH {
                let cell = work.seen[y * TILE_WIDTH + x];
                if cell != Cell::Empty && !done(work, [x, y], cell) {
                    work.from_subpixels.push((y * TILE_WIDTH + x) as u16);
                    (0..AROUND).for_each(|k| work.wanted[around([x, y], k)] = true);
                }
            }
        }
    }

    /// The colour of a surface at a pixel by the method of the frame; `None` where the method has none.
    fn pixel_colour(&self, surface: &Surface, at: [f32; 2], texels: &mut u64) -> Option<Vec4> {
        let mut filtered = |planes: &Option<UvPlanes>| match planes {
            None => Some(Vec4::ONE),
            Some(planes) => {
                let gathered = self.pixel_texture(surface, (planes, planes.pyramid), at)?;
                *texels += u64::from(gathered.texels);
                Some(gathered.rgba)
            }
        };
        let (base, emissive) = (filtered(&surface.base)?, filtered(&surface.emissive)?);
        Some(self.lit(surface, at, base, emissive))
    }

    /// The colour of a smooth surface at a pixel.
    fn patch_colour(
        &self,
        surface: &Surface,
        patch: &Patch,
        at_px: [f32; 2],
        texels: &mut u64,
    ) -> Option<Vec4> {
        let on_patch = OnPatch::new(self, surface, patch, at_px);
        let of = |planes: &Option<UvPlanes>| planes.as_ref().map(|planes| planes.pyramid);
        let base = on_patch.gathered(of(&surface.base), [1.0; 2], texels)?;
        let material = surface.material(self.frame.scene);
        let per_base = material.emissive_per_base.unwrap_or([1.0; 2]);
        let emissive = on_patch.gathered(of(&surface.emissive), per_base, texels)?;
        Some(self.shaded(surface, at_px, patch.light, base, emissive))
    }

    pub(crate) fn pixel_texture(
        &self,
        surface: &Surface,
        (planes, pyramid): (&UvPlanes, usize),
        at: [f32; 2],
    ) -> Option<Gathered> {
        let pixel = self.pixel_on(surface, (planes, pyramid), at);
        let simd = self.frame.simd;
        match self.frame.options.method {
            Method::Hybrid => gather_minified(&pixel, simd),
            Method::Point => gather_points(&pixel, simd),
            Method::BackwardNearest => Some(look_up_nearest(&pixel)),
            Method::BackwardBilinear => Some(look_up_bilinear(&pixel)),
            Method::BackwardTrilinear => Some(look_up_trilinear(&pixel)),
            Method::BackwardEwa => Some(look_up_ewa(&pixel, simd)),
        }
    }

    /// A pixel on a texture of a surface.
    pub(crate) fn pixel_on(
        &self,
        surface: &Surface,
        (planes, pyramid): (&UvPlanes, usize),
        at: [f32; 2],
    ) -> PixelOnTexture<'_> {
        PixelOnTexture {
            pyramid: &self.frame.scene.pyramids[pyramid],
            at: surface.uv_at(planes, at),
            over_w_slope: surface.over_w_slope(at),
        }
    }

    /// The value of a pixel or sub-pixel on a surface: filtered textures times factors, lit, premultiplied.
    #[inline(always)]
    fn lit(&self, surface: &Surface, at: [f32; 2], base: Vec4, emissive: Vec4) -> Vec4 {
        self.shaded(
            surface,
            at,
            surface.light_at(&self.view, at),
            base,
            emissive,
        )
    }

    /// As [`Tile::lit`], where the light that is reflected is known.
    #[inline(always)]
    pub(crate) fn shaded(
        &self,
        surface: &Surface,
        at: [f32; 2],
        light: f32,
        base: Vec4,
        emissive: Vec4,
    ) -> Vec4 {
        let material = surface.material(self.frame.scene);
        let factor = surface.factor(at);
        // Textures of materials with alpha are premultiplied; what their factor's alpha makes of it is still to do.
        let (weight, alpha) = match material.alpha {
            AlphaMode::Opaque => (1.0, 1.0),
            AlphaMode::Mask { .. } => (if base.w > 0.0 { 1.0 / base.w } else { 0.0 }, 1.0),
            AlphaMode::Blend => (factor.w, (factor.w * base.w).min(1.0)),
        };
        let emitted = surface.emissive_colour * emissive * alpha;
        (factor * base * (weight * light) + emitted)
            .truncate()
            .extend(alpha)
    }
}

/// Position of the centre of pixel (x, y) of the tile, from the corner of its border.
pub(crate) fn centre_px([x, y]: [usize; 2]) -> [f32; 2] {
    [(x + BORDER_PX) as f32 + 0.5, (y + BORDER_PX) as f32 + 0.5]
}
