//! Looks at the light of places, sixteen pixels at a time.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16};
use glam::Vec3;

use crate::light::around::LookUps;
use crate::light::blocked::BlockedLight;
use crate::light::blocked::bvh::Vector;
use crate::light::blocked::grids::{self, Grid, Grids};
use crate::light::blocked::place::{COUNTS, HARMONICS, PlaceLight, SIDES, STARTS};
use crate::light::blocked::sun_rays::sun_visible;
use crate::light::suns::{MOST, Sun};
use crate::screen::{LANES, Lanes, Plane, SPAN_WIDTH, value};
use resample_core::narrow::{cell, index32};

/// Perceptual roughness up to which lobes see the sharpest map of visibility, and how many maps they climb for a roughness of 1 more. A lobe of GGX has half of
/// its light within 2 atan(roughness^2) of its middle, a cell of the sharpest map is 13 degrees wide, and of each next one twice that: the cell is as wide
/// as the lobe at 0.3 and, two maps on, at 0.55.
const SHARP: f32 = 0.42;
const MAPS_PER_ROUGHNESS: f32 = 8.0;

/// A triangle with places, as one tile sees it.
#[derive(Clone, Debug)]
pub(crate) struct LitTriangle {
    /// Shares of its first two corners, over w.
    pub(crate) shares: [Plane; 2],
    pub(crate) grid: Grid,
    /// Positions and normals towards the eye, for rays to suns; `None` where there is no sun.
    pub(crate) corners: Option<[(Vec3, Vec3); 3]>,
}

/// The light of pixels: each of sixteen lanes takes that of one of the pixels that are kept here. Sub-pixels of one pixel share it.
pub(crate) struct PixelLights {
    pixels: [PixelLight; SPAN_WIDTH],
    /// By lane: the place of its pixel.
    of_lane: [usize; LANES],
}

/// The light of a pixel.
#[derive(Clone, Copy)]
struct PixelLight {
    /// Row of the pixel; `NOT_KEPT` if it is another surface's.
    row: usize,
    places: [u32; 3],
    shares: [f32; 3],
    position: Vec3,
    /// Numbers below are known.
    is_found: bool,
    harmonics: [[f32; 4]; HARMONICS],
    /// Shares of the light of each sun, and of a lobe's, that arrive; the last below 0 as long as it is not known.
    suns: [f32; MOST],
    visible: f32,
}

/// No row of pixels.
const NOT_KEPT: usize = usize::MAX;

impl Default for PixelLights {
    fn default() -> Self {
        let none = PixelLight {
            row: NOT_KEPT,
            places: [0; 3],
            shares: [0.0; 3],
            position: Vec3::ZERO,
            is_found: false,
            harmonics: [[0.0; 4]; HARMONICS],
            suns: [1.0; MOST],
            visible: -1.0,
        };
        Self {
            pixels: [none; SPAN_WIDTH],
            of_lane: [0; LANES],
        }
    }
}

impl PixelLights {
    /// Forgets all pixels: another surface follows.
    #[inline(always)]
    pub(crate) fn forget(&mut self) {
        for pixel in &mut self.pixels {
            pixel.row = NOT_KEPT;
        }
    }

    /// Puts a pixel by itself into a lane.
    #[inline(always)]
    pub(crate) fn put_pixel(&mut self, lane: usize, on: &OnTriangle, at_px: [f32; 2]) {
        self.of_lane[lane] = lane;
        self.pixels[lane].find(on, NOT_KEPT, at_px);
    }

    /// Puts a sub-pixel of the surface into a lane.
    #[inline(always)]
    pub(crate) fn put_subpixel(&mut self, lane: usize, on: &OnTriangle, [x, y]: [f32; 2]) {
        let column = cell(x).min(SPAN_WIDTH - 1);
        let row = cell(y);
        self.of_lane[lane] = column;
        if self.pixels[column].row != row {
            self.pixels[column].find(on, row, [column as f32 + 0.5, row as f32 + 0.5]);
        }
    }

    /// Finds the light of all lanes' pixels that is not known yet.
    #[inline(always)]
    pub(crate) fn find<S: Simd>(
        &mut self,
        simd: S,
        blocked: &BlockedLight,
        suns: &[Sun],
        count: usize,
    ) {
        let mut is_new = false;
        for &place in &self.of_lane[..count] {
            let pixel = &mut self.pixels[place];
            if !pixel.is_found {
                pixel.mix(simd, &blocked.lights);
                is_new = true;
            }
        }
        if !is_new || suns.is_empty() {
            return;
        }
        let mut position = [[0.0; LANES]; 3];
        for (lane, &place) in self.of_lane[..count].iter().enumerate() {
            let own = self.pixels[place].position;
            (position[0][lane], position[1][lane], position[2][lane]) = (own.x, own.y, own.z);
        }
        for (k, sun) in suns.iter().enumerate().take(MOST) {
            let mut visible = [1.0; LANES];
            let from = Vector::load(simd, &position);
            sun_visible(simd, &blocked.tree, sun, from).store_slice(&mut visible);
            for (lane, &place) in self.of_lane[..count].iter().enumerate() {
                self.pixels[place].suns[k] = visible[lane];
            }
        }
    }

    /// The share of a sun's light that arrives.
    #[inline(always)]
    pub(crate) fn sun<S: Simd>(&self, simd: S, sun: usize, count: usize) -> f32x16<S> {
        let mut visible = [1.0; LANES];
        for (visible, &place) in visible[..count].iter_mut().zip(&self.of_lane) {
            *visible = self.pixels[place].suns[sun];
        }
        f32x16::from_slice(simd, &visible)
    }

    /// Irradiance over pi, by the basis' functions.
    #[inline(always)]
    pub(crate) fn irradiance<S: Simd>(
        &self,
        simd: S,
        basis: &[Lanes; HARMONICS],
        count: usize,
        out: &mut [f32x16<S>; 3],
    ) {
        let mut light = [[0.0; LANES]; 3];
        for lane in 0..count {
            let harmonics = &self.pixels[self.of_lane[lane]].harmonics;
            let mut sum = f32x4::splat(simd, 0.0);
            for m in 0..HARMONICS {
                let own = f32x4::from_slice(simd, &harmonics[m]);
                sum = own.mul_add(f32x4::splat(simd, basis[m][lane]), sum);
            }
            (light[0][lane], light[1][lane], light[2][lane]) = (sum[0], sum[1], sum[2]);
        }
        let zero = f32x16::splat(simd, 0.0);
        out[0] = f32x16::from_slice(simd, &light[0]).max(zero);
        out[1] = f32x16::from_slice(simd, &light[1]).max(zero);
        out[2] = f32x16::from_slice(simd, &light[2]).max(zero);
    }

    /// The shares of light that arrive from around directions; sub-pixels of a pixel see what its first one sees.
    #[inline(always)]
    pub(crate) fn visible<S: Simd>(
        &mut self,
        simd: S,
        lights: &[PlaceLight],
        towards: &LookUps,
        count: usize,
    ) -> f32x16<S> {
        let mut visible = [1.0; LANES];
        for (lane, visible) in visible[..count].iter_mut().enumerate() {
            let pixel = &mut self.pixels[self.of_lane[lane]];
            if pixel.visible < 0.0 {
                let around = (towards.on_square(lane), towards.roughness(lane));
                pixel.visible = pixel.look(lights, around);
            }
            *visible = pixel.visible;
        }
        f32x16::from_slice(simd, &visible)
    }
}

/// A triangle and the grids of places.
#[derive(Clone, Copy)]
pub(crate) struct OnTriangle<'a> {
    pub(crate) grids: &'a Grids,
    pub(crate) triangle: &'a LitTriangle,
    pub(crate) over_w: &'a Plane,
    /// Rays begin this far from surfaces, world units.
    pub(crate) above: f32,
}

/// A place by the shares of its corners, so far above the surface that their normals mean.
fn above_surface(corners: &[(Vec3, Vec3); 3], shares: [f32; 3], above: f32) -> Vec3 {
    let [a, b, c] = corners;
    let flat = a.0 * shares[0] + b.0 * shares[1] + c.0 * shares[2];
    let normal = a.1 * shares[0] + b.1 * shares[1] + c.1 * shares[2];
    flat + grids::lift(flat, *corners, shares) + normal.normalize_or_zero() * above
}

impl PixelLight {
    /// Finds the places around a position of the tile.
    #[inline(always)]
    fn find(&mut self, on: &OnTriangle, row: usize, at_px: [f32; 2]) {
        (self.row, self.is_found, self.visible) = (row, false, -1.0);
        let LitTriangle {
            shares,
            grid: Grid { start, steps },
            ..
        } = on.triangle;
        let w = 1.0 / value(on.over_w, at_px);
        let first = within(value(&shares[0], at_px) * w, 1.0);
        let second = within(value(&shares[1], at_px) * w, 1.0 - first);
        let (x, y) = (first * *steps as f32, second * *steps as f32);
        let i = index32(cell(x)).min(steps - 1);
        let j = index32(cell(y)).min(steps - 1 - i);
        let (x, y) = (x - i as f32, y - j as f32);
        let index = |i: u32, j: u32| on.grids.indices[(start + grids::at(*steps, i, j)) as usize];
        let (right, above) = (index(i + 1, j), index(i, j + 1));
        (self.places, self.shares) = if x + y <= 1.0 || i + j + 2 > *steps {
            ([index(i, j), right, above], [1.0 - x - y, x, y])
        } else {
            (
                [index(i + 1, j + 1), right, above],
                [x + y - 1.0, 1.0 - y, 1.0 - x],
            )
        };
        if let Some(corners) = &on.triangle.corners {
            self.position = above_surface(corners, [first, second, 1.0 - first - second], on.above);
        }
    }

    /// Mixes the light of its places, without those that do not count.
    #[inline(always)]
    fn mix<S: Simd>(&mut self, simd: S, lights: &[PlaceLight]) {
        let [a, b, c] = self.places;
        let of = [
            &lights[a as usize],
            &lights[b as usize],
            &lights[c as usize],
        ];
        let mut counted = self.shares;
        for (counted, of) in counted.iter_mut().zip(of) {
            *counted *= of.harmonics[0][COUNTS];
        }
        let sum = counted[0] + counted[1] + counted[2];
        if sum > 1e-3 {
            for (share, counted) in self.shares.iter_mut().zip(counted) {
                *share = counted / sum;
            }
        }
        for (m, mixed) in self.harmonics.iter_mut().enumerate() {
            let mut sum = f32x4::splat(simd, 0.0);
            for (of, share) in of.iter().zip(self.shares) {
                let own = f32x4::from_slice(simd, &of.harmonics[m]);
                sum = own.mul_add(f32x4::splat(simd, share), sum);
            }
            sum.store_slice(mixed);
        }
        self.is_found = true;
    }

    /// The share of light that arrives from around a direction, within a lobe of a roughness.
    fn look(&self, lights: &[PlaceLight], (towards, roughness): ([f32; 2], f32)) -> f32 {
        let level = (roughness - SHARP) * MAPS_PER_ROUGHNESS;
        let level = level.max(0.0).min((SIDES.len() - 1) as f32);
        let first = cell(level).min(SIDES.len() - 2);
        let between = level - first as f32;
        let taps = [Taps::new(first, towards), Taps::new(first + 1, towards)];
        let mut sum = 0.0;
        for (place, share) in self.places.iter().zip(self.shares) {
            let map = &lights[*place as usize].visible;
            let (sharp, blurred) = (taps[0].of(map), taps[1].of(map));
            sum += (sharp + (blurred - sharp) * between) * share;
        }
        sum * (1.0 / 255.0)
    }
}

/// A share between 0 and `most`: a pixel beyond the edge takes the light at the edge. What is no number is 0.
#[inline(always)]
fn within(share: f32, most: f32) -> f32 {
    if share > 0.0 { share.min(most) } else { 0.0 }
}

/// Where to look in a map of visibility.
struct Taps {
    first: usize,
    stride: usize,
    right: f32,
    lower: f32,
}

impl Taps {
    #[inline(always)]
    fn new(map: usize, [x, y]: [f32; 2]) -> Self {
        let side = SIDES[map];
        let (x, y) = (x * side as f32 + 0.5, y * side as f32 + 0.5);
        // A place that is no number is at the corner.
        let (column, row) = (cell(x).min(side), cell(y).min(side));
        Self {
            first: STARTS[map] + row * (side + 2) + column,
            stride: side + 2,
            right: within(x - column as f32, 1.0),
            lower: within(y - row as f32, 1.0),
        }
    }

    #[inline(always)]
    fn of(&self, map: &[u8]) -> f32 {
        let at = |k: usize| f32::from(map[k]);
        let (a, b) = (at(self.first), at(self.first + 1));
        let below = self.first + self.stride;
        let (c, d) = (at(below), at(below + 1));
        let (upper, lower) = (a + (b - a) * self.right, c + (d - c) * self.right);
        upper + (lower - upper) * self.lower
    }
}
