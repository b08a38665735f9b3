//! The hybrid's last step: the colour and the coverage of each pixel.
//!
//! A pixel away from edges looks its colour up where its centre lies. A pixel at an edge groups the places of the finer
//! lattice around it into surfaces, weights each by the pixel's Gaussian, and looks up one colour a surface, at the
//! centre of gravity of what is seen of it.

use glam::DVec2;
use rayon::prelude::*;
use resample_core::Camera;
use resample_core::point::PIXEL_SIGMA_PX;

use crate::Reference;
use crate::bands::BAND_ROWS;
use crate::colour::{Lookup, as_taken};
use crate::hybrid::{Hybrid, NO_SLOT, Prepared, Seen};
use crate::layer::Layer;
use crate::patch::{NO_PATCH, Patch};
use crate::warp::Warp;

/// Pixels on either side whose sub-pixels count: the Gaussian reaches three sigmas.
const REACH_PX: i32 = 1;

/// Two sides of an edge that have moved against each other by less than this, reference px, are partly shown as the
/// reference shows them. A guess: half the sigma of its pixels.
const UNMOVED_PX: f64 = 0.25;

/// Resolves one picture.
pub(crate) struct Resolver<'a> {
    hybrid: &'a Hybrid,
    reference: &'a Reference,
    prepared: &'a Prepared,
    warp: &'a Warp,
    size: [usize; 2],
    subpixels: usize,
    /// Gaussian weights along one axis of the sub-pixels of the window, from the first.
    weights: Vec<f32>,
}

/// One surface as a pixel sees it.
#[derive(Clone, Copy, Debug)]
struct Part {
    patch: Patch,
    id: u32,
    weight: f32,
    /// Weighted sum of the places, px from the pixel's centre.
    moment: [f32; 2],
    /// Largest weight of one place so far: the piece nearest to the centre stands for the surface.
    best: f32,
}

/// What a pixel becomes.
#[derive(Clone, Copy, Debug)]
struct Resolved {
    rgba: [f32; 4],
    depth: f32,
    resolution: f32,
    purity: f32,
}

impl<'a> Resolver<'a> {
    /// Everything that the pixels need.
    pub(crate) fn new(
        hybrid: &'a Hybrid,
        (reference, prepared): (&'a Reference, &'a Prepared),
        warp: &'a Warp,
        target: &Camera,
        subpixels: usize,
    ) -> Self {
        let count = subpixels * (2 * REACH_PX as usize + 1);
        let weight = |i: usize| {
            let offset = (i as f64 + 0.5) / subpixels as f64 - f64::from(REACH_PX) - 0.5;
            (-0.5 * (offset / PIXEL_SIGMA_PX).powi(2)).exp()
        };
        let total: f64 = (0..count).map(weight).sum();
        Self {
            hybrid,
            reference,
            prepared,
            warp,
            size: [target.width as usize, target.height as usize],
            subpixels,
            weights: (0..count).map(|i| (weight(i) / total) as f32).collect(),
        }
    }

    /// The picture.
    pub(crate) fn layer(&self) -> Layer {
        let width = self.size[0];
        let mut layer = Layer::empty(width * self.size[1]);
        let colours = layer.rgba.par_chunks_mut(width).zip(layer.depth.par_chunks_mut(width));
        let shares = layer.resolution.par_chunks_mut(width).zip(layer.purity.par_chunks_mut(width));
        colours.zip(shares).enumerate().for_each(|(y, ((rgba, depth), (resolution, purity)))| {
            for x in 0..width {
                let at_edge = self.hybrid.at_edge[y * width + x];
                let resolved = if at_edge { self.at_edge(x, y) } else { self.inside(x, y) };
                if let Some(resolved) = resolved {
                    rgba[x] = resolved.rgba;
                    depth[x] = resolved.depth;
                    (resolution[x], purity[x]) = (resolved.resolution, resolved.purity);
                }
            }
        });
        layer
    }

    fn inside(&self, x: usize, y: usize) -> Option<Resolved> {
        let id = self.hybrid.patch[y * self.size[0] + x];
        if id == NO_PATCH {
            return None;
        }
        let patch = Patch::new(&self.prepared.surfaces, id);
        let (rgb, depth, resolution) = self.look_up(&patch, DVec2::new(x as f64 + 0.5, y as f64 + 0.5))?;
        Some(Resolved { rgba: [rgb[0], rgb[1], rgb[2], 1.0], depth, resolution, purity: 1.0 })
    }

    fn look_up(&self, patch: &Patch, pos_in_screen: DVec2) -> Option<([f32; 3], f32, f32)> {
        let hit = patch.hit(self.warp, pos_in_screen)?;
        let lookup =
            Lookup { colours: &self.prepared.colours, surfaces: &self.prepared.surfaces, patch: *patch };
        let rgb = lookup.filtered(&hit);
        let depth = self.warp.at(hit.pos_in_reference, hit.disparity).depth as f32;
        let area = hit.reference_from_screen.determinant().abs();
        Some((rgb, depth, area.sqrt().min(1.0) as f32))
    }

    fn at_edge(&self, x: usize, y: usize) -> Option<Resolved> {
        let (parts, window) = self.parts(x, y);
        let inside = window[2];
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let mut sum = Resolved { rgba: [0.0; 4], depth: f32::INFINITY, resolution: 0.0, purity: 1.0 };
        let mut largest = 0.0;
        for part in &parts {
            let at = centre + self.shift(part, window, centre);
            let Some((rgb, depth, resolution)) = self.look_up(&part.patch, at) else { continue };
            for (s, v) in sum.rgba.iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *s += part.weight / inside * v;
            }
            if part.weight > largest {
                largest = part.weight;
                (sum.depth, sum.resolution) = (depth, resolution);
            }
        }
        if let Some((rgb, share)) = self.unmoved(&parts, centre) {
            // Between two sides that have not moved there is no gap, however the edge was placed.
            let alpha = sum.rgba[3] + share * (1.0 - sum.rgba[3]);
            for (s, v) in sum.rgba.iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *s += share * (alpha * v - *s);
            }
        }
        sum.purity = largest / inside / sum.rgba[3].max(f32::MIN_POSITIVE);
        sum.rgba[3] = sum.rgba[3].min(1.0);
        (largest > 0.0).then_some(sum)
    }

    /// The reference's own blend at an edge whose two sides have not moved against each other, and how far that is so.
    ///
    /// Seen from the same place, an edge looks as the reference shows it, mixed pixels and all, and nothing that was
    /// taken apart can be put together better.
    fn unmoved(&self, parts: &[Part], centre: DVec2) -> Option<([f32; 3], f32)> {
        if parts.len() < 2 {
            return None;
        }
        let hit = parts[0].patch.hit(self.warp, centre)?;
        let mut spread = 0.0f64;
        for part in &parts[1..] {
            let other = part.patch.hit(self.warp, centre)?;
            spread = spread.max(hit.pos_in_reference.distance(other.pos_in_reference));
        }
        let minification = hit.reference_from_screen.determinant().abs().sqrt();
        let known = known_at(self.reference, hit.pos_in_reference);
        // Minified, the filter mixes more than the reference's pixels did.
        let share = (1.0 - spread / UNMOVED_PX).max(0.0) * (2.0 - minification).clamp(0.0, 1.0);
        (known && share > 0.0).then(|| (as_taken(self.reference, hit.pos_in_reference), share as f32))
    }

    /// From the pixel's centre to where a surface's colour is looked up.
    ///
    /// Where the screen magnifies it is the centre of gravity of what is seen. Where it minifies, the lookup's own filter
    /// already leaves out what is not on the surface, and only the reference's share of the pixel's filter, 1/m^2 of
    /// its variance, is shifted.
    fn shift(&self, part: &Part, window: [f32; 3], centre: DVec2) -> DVec2 {
        // At the picture's border the window itself is lopsided, which shifts nothing.
        let gravity = |moment: [f32; 2], weight: f32| {
            DVec2::new(f64::from(moment[0]), f64::from(moment[1])) / f64::from(weight)
        };
        let moment = gravity(part.moment, part.weight) - gravity([window[0], window[1]], window[2]);
        let minification2 = part
            .patch
            .hit(self.warp, centre)
            .map_or(1.0, |hit| hit.reference_from_screen.determinant().abs());
        moment / minification2.max(1.0)
    }

    /// The surfaces that the places around a pixel see, and the moment and weight of all places inside the picture.
    fn parts(&self, x: usize, y: usize) -> (Vec<Part>, [f32; 3]) {
        let n = self.subpixels;
        let mut parts: Vec<Part> = Vec::new();
        let mut window = [0.0; 3];
        for dy in -REACH_PX..=REACH_PX {
            for dx in -REACH_PX..=REACH_PX {
                let Some(seen) = self.seen(x as i32 + dx, y as i32 + dy) else { continue };
                for (place, seen) in seen.iter().enumerate() {
                    let along = [dx, dy].map(|d| (d + REACH_PX) as usize * n);
                    let [i, j] = [along[0] + place % n, along[1] + place / n];
                    let offset = [i, j].map(|i| (i as f32 + 0.5) / n as f32 - REACH_PX as f32 - 0.5);
                    let weight = self.weights[i] * self.weights[j];
                    window =
                        [window[0] + weight * offset[0], window[1] + weight * offset[1], window[2] + weight];
                    if seen.patch != NO_PATCH {
                        self.add_place(&mut parts, seen.patch, weight, offset);
                    }
                }
            }
        }
        (parts, window)
    }

    fn add_place(&self, parts: &mut Vec<Part>, id: u32, weight: f32, offset: [f32; 2]) {
        let surfaces = &self.prepared.surfaces;
        let same_id = parts.iter().position(|p| p.id == id);
        let mut patch = None;
        let found = same_id.or_else(|| {
            let new = Patch::new(surfaces, id);
            patch = Some(new);
            parts.iter().position(|p| one_surface(&p.patch, &new, surfaces.tolerance))
        });
        match found {
            Some(i) => {
                let part = &mut parts[i];
                part.weight += weight;
                part.moment = [part.moment[0] + weight * offset[0], part.moment[1] + weight * offset[1]];
                if weight > part.best {
                    part.best = weight;
                    if let Some(patch) = patch {
                        (part.patch, part.id) = (patch, id);
                    }
                }
            }
            None => {
                let patch = patch.unwrap_or_else(|| Patch::new(surfaces, id));
                let moment = offset.map(|o| weight * o);
                parts.push(Part { patch, id, weight, moment, best: weight });
            }
        }
    }

    /// The finer lattice of a pixel; `None` outside the picture.
    fn seen(&self, x: i32, y: i32) -> Option<&[Seen]> {
        let [width, height] = self.size;
        if x < 0 || y < 0 || x >= width as i32 || y >= height as i32 {
            return None;
        }
        let slot = self.hybrid.slot[y as usize * width + x as usize];
        let count = self.subpixels * self.subpixels;
        (slot != NO_SLOT).then(|| {
            let first = slot as usize * count;
            &self.hybrid.fine[y as usize / BAND_ROWS][first..first + count]
        })
    }
}

/// Whether the reference knows a depth at the pixel that holds this place.
fn known_at(reference: &Reference, pos_in_reference: DVec2) -> bool {
    let size = DVec2::new(f64::from(reference.camera.width), f64::from(reference.camera.height));
    let at = pos_in_reference.clamp(DVec2::ZERO, size - 1.0);
    let depth = reference.depth[at.y as usize * reference.camera.width as usize + at.x as usize];
    depth > 0.0
}

/// Whether one piece lies on the plane of the other, as far away as it is.
fn one_surface(a: &Patch, b: &Patch, tolerance: f32) -> bool {
    let distance = (a.place - b.place).abs().max_element();
    let expected = a.disparity_at(b.place);
    (expected - b.disparity).abs() <= f64::from(tolerance) * (2.0 + distance) * b.disparity.abs()
}
