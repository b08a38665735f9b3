//! A block of 4x4 pixels, walked front to back in slabs parallel to the picture.
//!
//! In a slab the optical depths of all Gaussians are summed, and with them colours and first moments along the ray; the slab is
//! composited as one. The order inside a slab is lost except for the moments, so a slab ends where the colours that it would mix
//! differ by too much, weighted by the light that reaches it: M sqrt(V) T <= error, with the optical depth M of the slab, the
//! variance V of its colours by optical depth, and the transmittance T before it. A Gaussian alone takes one slab, and so do
//! many of one colour.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use resample_core::narrow::single;
use resample_core::simd::{exp2, opacity_from_optical_depth};

use crate::gaussians::profile::{REACH, optical_depth, share_and_moment};
use crate::gaussians::project::LEAST_OPACITY;
use crate::gaussians::ray_form::RayForm;

/// Pixels of a block.
pub(crate) const LANES: usize = 16;

type Lanes = [f32; LANES];

/// Gaussians that are taken up before the slab's end is asked for again: it costs as much as summing one, and those taken up too
/// early only wait.
const TAKEN_AT_ONCE: usize = 8;

/// Settings that all blocks of a frame share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockSettings {
    /// Greatest error of colour of a slab's order, 0..1, before moments correct it.
    pub(crate) slab_error: f32,
    /// A block ends where the transmittance of all its pixels is below this.
    pub(crate) min_transmittance: f32,
}

/// The rays of a block.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockRays {
    /// Their places, px from the tile's centre.
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    /// The camera z between which something is seen.
    pub(crate) near: Lanes,
    pub(crate) far: Lanes,
}

/// A block that is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockPixels {
    /// Red, green, blue in the blend space times opacity.
    pub(crate) rgb: [Lanes; 3],
    pub(crate) transmittance: Lanes,
    /// Camera z times opacity.
    pub(crate) depth: Lanes,
    /// Camera z at which half of the light is lost; +infinity where that is nowhere.
    pub(crate) median: Lanes,
}

/// Counts of work.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BlockWork {
    /// Gaussians that a block's rays met.
    pub(crate) met: u64,
    /// Gaussians times slabs.
    pub(crate) summed: u64,
    pub(crate) slabs: u64,
}

/// The Gaussians of a tile in the order in which they begin.
pub(crate) trait Forms {
    /// The place in the list of the next one at or after `at` that may touch the block, and the camera z at which it begins.
    fn next(&mut self, block: usize, at: usize) -> Option<(usize, f32)>;
    /// One of them.
    fn form(&self, at: usize) -> &RayForm;
}

/// A Gaussian that the slabs have reached, for each ray.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// Optical depth of all of it.
    depth: Lanes,
    /// The same times the standard deviation along the ray.
    depth_sigma: Lanes,
    /// Camera z of its peak.
    peak: Lanes,
    /// 1 / standard deviation along the ray.
    sharpness: Lanes,
    /// Share and moment before the slab.
    share: Lanes,
    moment: Lanes,
    colour: [f32; 3],
}

/// The Gaussians that the slabs have reached and not left.
#[derive(Clone, Debug, Default)]
pub(crate) struct Active {
    slots: Vec<Slot>,
    free: Vec<u32>,
    /// Slot of each.
    slot: Vec<u32>,
    /// Between which camera z it lies, and its greatest optical depth over that length.
    low: Vec<f32>,
    high: Vec<f32>,
    rate: Vec<f32>,
    red: Vec<f32>,
    green: Vec<f32>,
    blue: Vec<f32>,
    /// Camera z at which it ends.
    end: Vec<f32>,
}

/// The square root of 3: a box of this half width has the standard deviation of the Gaussian.
const BOX: f32 = 1.732_050_8;

impl Active {
    fn clear(&mut self) {
        self.slots.clear();
        self.free.clear();
        self.slot.clear();
        for list in self.lists() {
            list.clear();
        }
    }

    fn lists(&mut self) -> [&mut Vec<f32>; 7] {
        [
            &mut self.low,
            &mut self.high,
            &mut self.rate,
            &mut self.red,
            &mut self.green,
            &mut self.blue,
            &mut self.end,
        ]
    }

    fn len(&self) -> usize {
        self.slot.len()
    }

    /// Camera z at which the last of them ends.
    fn last_end(&self) -> f32 {
        self.end.iter().copied().fold(f32::NEG_INFINITY, f32::max)
    }

    /// Takes those out that end before `z`.
    fn retire(&mut self, z: f32) {
        let mut at = 0;
        while at < self.len() {
            if self.end[at] <= z {
                self.free.push(self.slot.swap_remove(at));
                for list in self.lists() {
                    list.swap_remove(at);
                }
            } else {
                at += 1;
            }
        }
    }

    fn push(&mut self, slot: Slot, [low, high, end]: [f32; 3], depth: f32) {
        let place = match self.free.pop() {
            Some(place) => {
                self.slots[place as usize] = slot;
                place
            }
            None => {
                self.slots.push(slot);
                self.slots.len() as u32 - 1
            }
        };
        self.slot.push(place);
        let [red, green, blue] = slot.colour;
        let values = [low, high, depth / (high - low), red, green, blue, end];
        for (list, value) in self.lists().into_iter().zip(values) {
            list.push(value);
        }
    }

    /// The error of the order of a slab, M sqrt(V), to the power of a half: it grows about in proportion to the slab's length.
    #[inline(always)]
    fn mixing<S: Simd>(&self, simd: S, z0: f32, z1: f32) -> f32 {
        let splat = |value: f32| f32x16::splat(simd, value);
        let zero = splat(0.0);
        let (mut mass, mut squares, mut sums) = (zero, zero, [zero; 3]);
        for first in (0..self.len()).step_by(LANES) {
            let (low, high) = (
                self.part(simd, &self.low, first),
                self.part(simd, &self.high, first),
            );
            let within = splat(z1).max(low).min(high) - splat(z0).max(low).min(high);
            let depth = self.part(simd, &self.rate, first) * within;
            mass += depth;
            let colours = [&self.red, &self.green, &self.blue];
            for k in 0..3 {
                let colour = self.part(simd, colours[k], first);
                sums[k] = depth.mul_add(colour, sums[k]);
                squares = (depth * colour).mul_add(colour, squares);
            }
        }
        let mass = mass.reduce_sum();
        let [r, g, b] = sums;
        let (r, g, b) = (r.reduce_sum(), g.reduce_sum(), b.reduce_sum());
        let variance = mass * squares.reduce_sum() - (r * r + g * g + b * b);
        (mass * variance.max(0.0).sqrt()).sqrt()
    }

    /// 16 numbers of a list from `first` on; 0 beyond its end.
    #[inline(always)]
    fn part<S: Simd>(&self, simd: S, list: &[f32], first: usize) -> f32x16<S> {
        match list.get(first..first + LANES) {
            Some(part) => f32x16::from_slice(simd, part),
            None => {
                let mut part = [0.0; LANES];
                part[..list.len() - first].copy_from_slice(&list[first..]);
                f32x16::from_slice(simd, &part)
            }
        }
    }

    /// The camera z of a slab's end, at most `limit`.
    #[inline(always)]
    fn slab_end<S: Simd>(&self, simd: S, z0: f32, limit: f32, most: f32) -> f32 {
        let (mut low, mut at_low) = (z0, -most);
        let (mut high, mut at_high) = (limit, self.mixing(simd, z0, limit) - most);
        if at_high <= 0.0 {
            return limit;
        }
        // False position, which the near-linear measure suits; the bracket halves at least every other step.
        for step in 0..6 {
            let share = if step % 2 == 0 {
                -at_low / (at_high - at_low)
            } else {
                0.5
            };
            let z = low + share.clamp(0.05, 0.95) * (high - low);
            let at = self.mixing(simd, z0, z) - most;
            if at.abs() < 0.1 * most {
                return z;
            }
            if at < 0.0 {
                (low, at_low) = (z, at);
            } else {
                (high, at_high) = (z, at);
            }
        }
        0.5 * (low + high)
    }
}

/// Draws a block.
#[inline(always)]
pub(crate) fn draw<S: Simd>(
    simd: S,
    (block, rays): (usize, &BlockRays),
    forms: &mut impl Forms,
    settings: &BlockSettings,
    active: &mut Active,
    work: &mut BlockWork,
) -> BlockPixels {
    active.clear();
    let mut pixels = Pixels::new(simd);
    let mut z0 = rays.near.iter().copied().fold(f32::INFINITY, f32::min);
    let mut next = forms.next(block, 0);
    loop {
        // A slab may be this wrong where this share of the light reaches it.
        let most = (settings.slab_error / pixels.greatest_transmittance()).sqrt();
        let mut taken = 0;
        while let Some((at, begin)) = next {
            if taken % TAKEN_AT_ONCE == 0 && active.mixing(simd, z0, begin) >= most {
                break;
            }
            taken += 1;
            work.met += activate(simd, forms.form(at), rays, active);
            next = forms.next(block, at + 1);
        }
        if active.len() == 0 {
            break;
        }
        let begin = next.map_or(f32::INFINITY, |(_, begin)| begin);
        let limit = begin.min(active.last_end());
        let z1 = active.slab_end(simd, z0, limit, most).max(above(z0));
        pixels.add(simd, [z0, z1], rays, active);
        work.slabs += 1;
        work.summed += active.len() as u64;
        active.retire(z1);
        z0 = z1;
        if pixels.greatest_transmittance() < settings.min_transmittance {
            break;
        }
    }
    pixels.taken()
}

/// The least camera z of a slab's end, so that every slab has a length.
fn above(z: f32) -> f32 {
    z + (z.abs() * 1e-6).max(f32::MIN_POSITIVE)
}

/// Takes up a Gaussian; returns 1 if a ray meets it.
#[inline(always)]
fn activate<S: Simd>(simd: S, form: &RayForm, rays: &BlockRays, active: &mut Active) -> u64 {
    /// log2 of e, halved, for exp(-q / 2).
    const HALF_LOG2_E: f32 = 0.5 * std::f32::consts::LOG2_E;
    let splat = |value: f32| f32x16::splat(simd, value);
    let x = f32x16::from_slice(simd, &rays.x);
    let y = f32x16::from_slice(simd, &rays.y);
    let density = quadratic(simd, &form.density, x, y);
    let over = splat(1.0) / density;
    let q = quadratic(simd, &form.distance, x, y) * over;
    let exponent = splat(form.log2_opacity) - q.max(splat(0.0)) * HALF_LOG2_E;
    let least = splat(single(LEAST_OPACITY.log2()));
    let seen = exponent.simd_ge(least);
    if !seen.any_true() {
        return 0;
    }
    let opacity = exp2(simd, exponent.min(splat(0.0)));
    let depth = seen.select(optical_depth(simd, opacity), splat(0.0));
    let [p0, px, py] = form.peak;
    let peak = x.mul_add(splat(px), y.mul_add(splat(py), splat(p0))) * over;
    let sharpness = (density * form.sharpness).min(splat(form.sharpest)).sqrt();
    let sigma = splat(1.0) / sharpness;
    let (first, last) = (
        seen.select(peak, splat(f32::INFINITY)).reduce_min(),
        seen.select(peak, splat(f32::NEG_INFINITY)).reduce_max(),
    );
    let widest = seen.select(sigma, splat(0.0)).reduce_max();
    let mut slot = Slot {
        colour: form.colour,
        ..Slot::default()
    };
    let near = f32x16::from_slice(simd, &rays.near);
    let before = ((near - peak) * sharpness)
        .max(splat(-REACH))
        .min(splat(REACH));
    let (share, moment) = share_and_moment(simd, before);
    depth.store_slice(&mut slot.depth);
    (depth * sigma).store_slice(&mut slot.depth_sigma);
    peak.store_slice(&mut slot.peak);
    sharpness.store_slice(&mut slot.sharpness);
    share.store_slice(&mut slot.share);
    moment.store_slice(&mut slot.moment);
    let low = first - BOX * widest;
    let high = (last + BOX * widest).max(above(low));
    active.push(slot, [low, high, last + REACH * widest], depth.reduce_max());
    1
}

#[inline(always)]
fn quadratic<S: Simd>(simd: S, c: &[f32; 6], x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    let splat = |value: f32| f32x16::splat(simd, value);
    let along_x = x.mul_add(splat(c[3]), y.mul_add(splat(c[4]), splat(c[1])));
    let along_y = y.mul_add(splat(c[5]), splat(c[2]));
    x.mul_add(along_x, y.mul_add(along_y, splat(c[0])))
}

/// The pixels of a block while its slabs are composited.
struct Pixels<S: Simd> {
    rgb: [f32x16<S>; 3],
    transmittance: f32x16<S>,
    depth: f32x16<S>,
    median: f32x16<S>,
    greatest: f32,
}

/// Sums of a slab, for each ray.
struct Sums<S: Simd> {
    depth: f32x16<S>,
    rgb: [f32x16<S>; 3],
    /// First moments along z from the slab's begin, of the optical depth and of the colours.
    depth_z: f32x16<S>,
    rgb_z: [f32x16<S>; 3],
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn of(simd: S, [z0, z1]: [f32; 2], rays: &BlockRays, active: &mut Active) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        let begin = f32x16::splat(simd, z0);
        let end = f32x16::splat(simd, z1).min(f32x16::from_slice(simd, &rays.far));
        let mut sums = Self {
            depth: zero,
            rgb: [zero; 3],
            depth_z: zero,
            rgb_z: [zero; 3],
        };
        let Active { slots, slot, .. } = active;
        for place in slot.iter() {
            let slot = &mut slots[*place as usize];
            let peak = f32x16::from_slice(simd, &slot.peak);
            let x = ((end - peak) * f32x16::from_slice(simd, &slot.sharpness))
                .max(f32x16::splat(simd, -REACH))
                .min(f32x16::splat(simd, REACH));
            let (share, moment) = share_and_moment(simd, x);
            let part = (share - f32x16::from_slice(simd, &slot.share)).max(zero);
            let bent = moment - f32x16::from_slice(simd, &slot.moment);
            let depth = part * f32x16::from_slice(simd, &slot.depth);
            let depth_z =
                (peak - begin).mul_add(depth, bent * f32x16::from_slice(simd, &slot.depth_sigma));
            share.store_slice(&mut slot.share);
            moment.store_slice(&mut slot.moment);
            sums.depth += depth;
            sums.depth_z += depth_z;
            for k in 0..3 {
                let colour = f32x16::splat(simd, slot.colour[k]);
                sums.rgb[k] = colour.mul_add(depth, sums.rgb[k]);
                sums.rgb_z[k] = colour.mul_add(depth_z, sums.rgb_z[k]);
            }
        }
        sums
    }
}

impl<S: Simd> Pixels<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            rgb: [zero; 3],
            transmittance: f32x16::splat(simd, 1.0),
            depth: zero,
            median: f32x16::splat(simd, f32::INFINITY),
            greatest: 1.0,
        }
    }

    fn greatest_transmittance(&self) -> f32 {
        self.greatest
    }

    /// Composites a slab behind what is there.
    ///
    /// Of optical depth t that is spread evenly over the slab's length h, with a colour that changes evenly along it, the eye
    /// sees (1 - exp(-t)) times the mean colour, and g(t) times the change: g is the integral of v exp(-t (v + 1/2)) over -1/2 to
    /// 1/2, which is -exp(-t/2) (t/12 + t^3/480 + ..).
    #[inline(always)]
    fn add(&mut self, simd: S, [z0, z1]: [f32; 2], rays: &BlockRays, active: &mut Active) {
        let splat = |value: f32| f32x16::splat(simd, value);
        let sums = Sums::of(simd, [z0, z1], rays, active);
        let t = sums.depth;
        let opacity = opacity_from_optical_depth(simd, t);
        let over = splat(1.0) / t.max(splat(1e-30));
        let even = opacity * over;
        let mean_z = sums.depth_z * over;
        let half = (splat(1.0) - opacity).sqrt();
        let bend = half * t * (t * t).mul_add(splat(1.0 / 40.0), splat(1.0));
        let bend = bend.min(even) * (1.0 / (z1 - z0));
        let left = self.transmittance;
        for k in 0..3 {
            let late = sums.rgb_z[k] - mean_z * sums.rgb[k];
            let seen = even * sums.rgb[k] - bend * late;
            self.rgb[k] = left.mul_add(seen.max(splat(0.0)), self.rgb[k]);
        }
        let z = mean_z + z0;
        self.depth = (left * opacity).mul_add(z, self.depth);
        self.transmittance = left - left * opacity;
        let halved = left.simd_gt(splat(0.5)) & self.transmittance.simd_le(splat(0.5));
        self.median = halved.select(z, self.median);
        let open = splat(z1).simd_lt(f32x16::from_slice(simd, &rays.far));
        self.greatest = open.select(self.transmittance, splat(0.0)).reduce_max();
    }

    #[inline(always)]
    fn taken(&self) -> BlockPixels {
        let mut taken = BlockPixels {
            rgb: [[0.0; LANES]; 3],
            transmittance: [0.0; LANES],
            depth: [0.0; LANES],
            median: [0.0; LANES],
        };
        for (lanes, colour) in taken.rgb.iter_mut().zip(&self.rgb) {
            colour.store_slice(lanes);
        }
        self.transmittance.store_slice(&mut taken.transmittance);
        self.depth.store_slice(&mut taken.depth);
        self.median.store_slice(&mut taken.median);
        taken
    }
}
