//! The hybrid's last step: the colour and the coverage of each pixel.
//!
//! A pixel away from edges looks its colour up where its centre lies. A pixel at an edge groups the places of the finer
//! lattice around it into surfaces, weights each by the pixel's Gaussian, and looks up one colour a surface, at the
//! centre of gravity of what is seen of it.

pub(crate) mod colour;

mod inside;
mod parts;
mod resolver;

use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use glam::DVec2;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::{Camera, dispatch};

use crate::hybrid::{How, Hybrid};
use crate::project::prepared::Prepared;
use crate::resolve::colour::as_taken;
use crate::stats::FrameStats;
use crate::surfaces::patch::{Hit, Patch, PlaneMap};
use crate::view::layer::{Layer, Mix, Purpose, Row, before_infinity};
use crate::view::warp::Warp;
use inside::{RUN, Run};
use parts::{Part, Parts};
use resolver::Resolver;

/// Two sides of an edge that have moved against each other by less than this, reference px, are partly shown as the
/// reference shows them. A guess: half the sigma of its pixels.
const UNMOVED_PX: f64 = 0.25;

/// A surface with this share of a pixel's weight has it all, and its centre of gravity is the pixel's, up to rounding.
const NEARLY_ALL: f32 = 0.999_99;

/// A surface with more than this share of a pixel counts as its front: less is rounding at a rim. A guess.
const IN_FRONT: f32 = 0.05;

/// The result of a pixel.
#[derive(Clone, Copy, Debug)]
struct Resolved {
    rgba: [f32; 4],
    depth: f32,
    resolution: f32,
    mix: Mix,
}

/// Draws `prepared` from `target` into the buffers `to`: `hybrid` finds what the pixels see, then they are resolved.
pub(crate) fn render(
    hybrid: &mut Hybrid,
    prepared: &Prepared,
    target: &Camera,
    how: How,
    to: Layer,
    stats: &mut FrameStats,
) -> Layer {
    let warp = Warp::new(&prepared.camera, target);
    hybrid.draw(prepared, &warp, target, how, stats);
    let clock = StageClock::start();
    let layer = Resolver::new(hybrid, prepared, &warp, target, how).layer(to);
    stats.stages.resolve += clock.stop();
    layer
}

impl Resolver<'_> {
    /// The picture, in the buffers `to`.
    fn layer(&self, to: Layer) -> Layer {
        let width = self.size[0];
        let mut layer = to.reused(width * self.size[1]);
        let colours = layer
            .rgba
            .par_chunks_mut(width)
            .zip(layer.depth.par_chunks_mut(width));
        let mixes: Vec<&mut [Mix]> = match self.purpose {
            Purpose::Picture => (0..self.size[1]).map(|_| Default::default()).collect(),
            Purpose::Part => {
                layer.mixes.resize(width * self.size[1], Mix::ONE);
                layer.mixes.chunks_mut(width).collect()
            }
        };
        let shares = layer.resolution.par_chunks_mut(width).zip(mixes);
        let rows = colours.zip(shares).enumerate();
        let seen = rows.map(|(y, ((rgba, depth), (resolution, mixes)))| {
            let to = Row {
                rgba,
                depth,
                resolution,
                mixes,
            };
            dispatch!(self.level, simd => row(simd, self, y, to))
        });
        let seen = seen.sum();
        match &self.home {
            Some(home) => home.give_back(self.prepared, width, &mut layer),
            None if self.purpose == Purpose::Picture => layer.seen = Some(seen),
            None => {}
        }
        layer
    }

    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, patch: &Patch, hit: &Hit) -> ([f32; 3], f32, f32) {
        let rgb = self.lookup(patch).filtered(simd, hit);
        let depth = self.warp.at(hit.pos_in_reference, hit.disparity).depth as f32;
        (rgb, depth, minification2(hit).sqrt().min(1.0) as f32)
    }

    #[inline(always)]
    fn at_edge<S: Simd>(
        &self,
        simd: S,
        (x, y): (usize, usize),
        parts: &mut Parts,
    ) -> Option<Resolved> {
        self.find_parts(x, y, parts);
        let inside = parts.window[0];
        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let mut sum = Resolved {
            rgba: [0.0; 4],
            depth: f32::INFINITY,
            resolution: 0.0,
            mix: Mix::ONE,
        };
        let mut largest = 0.0;
        for (part, (plane, at_centre)) in parts.list.iter().zip(&parts.traced) {
            let shift = shift(part, parts.window, at_centre.as_ref());
            let hit = if shift == DVec2::ZERO {
                *at_centre
            } else {
                plane.hit(centre + shift)
            };
            let Some(hit) = hit else { continue };
            let (rgb, depth, resolution) = self.look_up(simd, &plane.patch, &hit);
            for (s, v) in sum.rgba.iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *s += part.weight / inside * v;
            }
            if part.weight > IN_FRONT * inside {
                sum.mix.front = sum.mix.front.min(depth);
            }
            if part.weight > largest {
                largest = part.weight;
                (sum.depth, sum.resolution) = (depth, resolution);
            }
        }
        if let Some((rgb, share)) = self.unmoved(&parts.traced) {
            // Between two sides that have not moved there is no gap, however the edge was placed.
            let alpha = sum.rgba[3] + share * (1.0 - sum.rgba[3]);
            for (s, v) in sum.rgba.iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *s += share * (alpha * v - *s);
            }
        }
        sum.mix.purity = largest / inside / sum.rgba[3].max(f32::MIN_POSITIVE);
        sum.rgba[3] = sum.rgba[3].min(1.0);
        (largest > 0.0).then_some(sum)
    }

    /// The reference's own blend at an edge whose two sides have not moved against each other, and how far that is so.
    ///
    /// Seen from the same place, an edge looks as the reference shows it, mixed pixels and all, and nothing that was
    /// taken apart can be put together better.
    fn unmoved(&self, traced: &[(PlaneMap, Option<Hit>)]) -> Option<([f32; 3], f32)> {
        let [(_, first), others @ ..] = traced else {
            return None;
        };
        if others.is_empty() {
            return None;
        }
        let hit = first.as_ref()?;
        let mut spread = 0.0f64;
        for (_, other) in others {
            spread = spread.max(
                hit.pos_in_reference
                    .distance(other.as_ref()?.pos_in_reference),
            );
        }
        // Minified, the filter mixes more than the reference's pixels did.
        let unminified = (2.0 - minification2(hit).sqrt()).clamp(0.0, 1.0);
        let share = (1.0 - spread / UNMOVED_PX).max(0.0) * unminified;
        let known = known_at(self.prepared, hit.pos_in_reference);
        (known && share > 0.0)
            .then(|| (as_taken(self.prepared, hit.pos_in_reference), share as f32))
    }
}

/// Area of the reference that a pixel covers, px^2.
fn minification2(hit: &Hit) -> f64 {
    hit.reference_from_screen.determinant().abs()
}

/// From the pixel's centre to where a surface's colour is looked up.
///
/// Where the screen magnifies it is the centre of gravity of what is seen. Where it minifies, the lookup's own filter
/// already leaves out what is not on the surface, and only the reference's share of the pixel's filter, 1/m^2 of
/// its variance, is shifted.
fn shift(part: &Part, window: [f32; 3], at_centre: Option<&Hit>) -> DVec2 {
    if part.weight > NEARLY_ALL * window[0] {
        return DVec2::ZERO;
    }
    // At the picture's border the window itself is lopsided, which shifts nothing.
    let gravity = |moment: [f32; 2], weight: f32| {
        DVec2::new(f64::from(moment[0]), f64::from(moment[1])) / f64::from(weight)
    };
    let moment = gravity(part.moment, part.weight) - gravity([window[1], window[2]], window[0]);
    moment / at_centre.map_or(1.0, minification2).max(1.0)
}

/// Resolves a row of the picture; number of its pixels in which something is seen.
#[simd]
fn row<S: Simd>(simd: S, resolver: &Resolver<'_>, y: usize, mut row: Row<'_>) -> u64 {
    let width = resolver.size[0];
    row.clear();
    let mut run = Run::new();
    for first in (0..width).step_by(RUN) {
        run.resolve(simd, resolver, (first, y), &mut row);
    }
    let mut parts = Parts::default();
    for x in resolver.hybrid.at_edge.columns(y, width) {
        if let Some(resolved) = resolver.at_edge(simd, (x, y), &mut parts) {
            row.rgba[x] = resolved.rgba;
            row.depth[x] = resolved.depth;
            row.resolution[x] = resolved.resolution;
            if row.asks_for_mixes() {
                row.mixes[x] = resolved.mix;
            }
        }
    }
    if resolver.has_front {
        before_infinity(row.depth);
    }
    if resolver.purpose == Purpose::Picture && resolver.home.is_none() {
        row.weigh();
    }
    row.seen()
}

/// Returns true if the reference knows a depth at the pixel that holds this place.
fn known_at(prepared: &Prepared, pos_in_reference: DVec2) -> bool {
    let [width, height] = prepared.surfaces.size;
    let last = DVec2::new(width as f64, height as f64) - 1.0;
    let at = pos_in_reference.clamp(DVec2::ZERO, last);
    prepared.depth(at.y as usize * width + at.x as usize) > 0.0
}
