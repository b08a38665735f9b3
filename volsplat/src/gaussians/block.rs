//! A block of 4x4 pixels, walked front to back in slabs parallel to the picture.
//!
//! In a slab the optical depths of all Gaussians are summed, and with them colours and first moments along the ray; the slab is
//! composited as one. The order inside a slab is lost except for the moments, so a slab ends where the colours that it would mix
//! differ by too much, weighted by the light that reaches it: M sqrt(V) T <= error, with the optical depth M of the slab
//! (the geometric mean of the block's mean and greatest), the variance V of its colours by optical depth, and the transmittance T before it. A Gaussian alone takes one slab, and so do
//! many of one colour, unless depth is asked for.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;
use resample_core::simd::{exp2, opacity_from_optical_depth};

use crate::gaussians::profile::{optical_depth, share_and_moment};
use crate::gaussians::project::LEAST_EXPONENT;
use crate::gaussians::ray_form::{RayForm, polynomial};

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
    /// Longest slab, as a share of its camera z; absent where no depth is asked for.
    pub(crate) longest: Option<f32>,
}

impl BlockSettings {
    /// The farthest end of a slab that begins at `z0`.
    fn farthest(&self, z0: f32) -> f32 {
        self.longest
            .map_or(f32::INFINITY, |share| z0 + share * z0.abs())
    }
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
}

/// The Gaussians of a tile in the order in which they begin.
pub(crate) trait Forms {
    /// The `at`-th one that may touch the block, and the camera z at which it begins.
    fn of_block(&mut self, block: usize, at: usize) -> Option<(&RayForm, f32)>;
}

/// A Gaussian that the slabs have reached, for each ray.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// Optical depth of all of it.
    depth: Lanes,
    /// The same times half its length along the ray.
    depth_reach: Lanes,
    /// Camera z of its peak.
    peak: Lanes,
    /// 1 / half its length along the ray.
    sharpness: Lanes,
    /// Share and moment before the slab.
    share: Lanes,
    moment: Lanes,
    colour: [f32; 3],
}

/// 16 Gaussians as the choice of a slab's end sees them: one number for the block's rays.
#[derive(Clone, Copy, Debug, Default)]
struct Briefs {
    /// Between which camera z it lies, taken as a box, and its optical depth over the box's length; 0 where a place is free.
    low: Lanes,
    high: Lanes,
    rate: Lanes,
    colour: [Lanes; 3],
    /// The colour's squared length.
    square: Lanes,
    /// Camera z at which it ends; +infinity where a place is free.
    end: Lanes,
    slot: [u32; LANES],
}

impl Briefs {
    /// Copies the one in lane `from` of others into a lane.
    #[inline(always)]
    fn copy_from(&mut self, lane: usize, others: &Self, from: usize) {
        self.low[lane] = others.low[from];
        self.high[lane] = others.high[from];
        self.rate[lane] = others.rate[from];
        for (to, of) in self.colour.iter_mut().zip(&others.colour) {
            to[lane] = of[from];
        }
        self.square[lane] = others.square[from];
        self.end[lane] = others.end[from];
        self.slot[lane] = others.slot[from];
    }

    #[inline(always)]
    fn copy_within(&mut self, from: usize, lane: usize) {
        self.low[lane] = self.low[from];
        self.high[lane] = self.high[from];
        self.rate[lane] = self.rate[from];
        for colour in &mut self.colour {
            colour[lane] = colour[from];
        }
        self.square[lane] = self.square[from];
        self.end[lane] = self.end[from];
        self.slot[lane] = self.slot[from];
    }
}

/// The Gaussians that the slabs have reached and not left.
#[derive(Clone, Debug, Default)]
pub(crate) struct Active {
    slots: Vec<Slot>,
    free: Vec<u32>,
    briefs: Vec<Briefs>,
    len: usize,
}

/// Half width of a box with the standard deviation of a profile, over the profile's half length.
const BOX: f32 = 0.774_596_7;

impl Active {
    fn clear(&mut self) {
        self.slots.clear();
        self.free.clear();
        self.briefs.clear();
        self.len = 0;
    }

    /// Camera z at which the last of them ends.
    #[inline(always)]
    fn last_end(&self) -> f32 {
        let mut last = f32::NEG_INFINITY;
        for at in 0..self.len {
            last = last.max(self.briefs[at / LANES].end[at % LANES]);
        }
        last
    }

    /// Takes those out that end before `z`.
    #[inline(always)]
    fn retire<S: Simd>(&mut self, simd: S, z: f32) {
        for group in (0..self.briefs.len()).rev() {
            let ends = f32x16::from_slice(simd, &self.briefs[group].end);
            if !ends.simd_le(f32x16::splat(simd, z)).any_true() {
                continue;
            }
            for lane in (0..LANES).rev() {
                if self.briefs[group].end[lane] <= z {
                    self.take_out(group, lane);
                }
            }
        }
    }

    /// Takes one out; the last one comes to its place.
    #[inline(always)]
    fn take_out(&mut self, group: usize, lane: usize) {
        self.free.push(self.briefs[group].slot[lane]);
        self.len -= 1;
        let (from_group, from) = (self.len / LANES, self.len % LANES);
        let (kept, moved) = self.briefs.split_at_mut(from_group);
        let last = &mut moved[0];
        match kept.get_mut(group) {
            Some(to) => to.copy_from(lane, last, from),
            None => last.copy_within(from, lane),
        }
        last.rate[from] = 0.0;
        last.end[from] = f32::INFINITY;
        if from == 0 {
            self.briefs.pop();
        }
    }

    /// A place for a Gaussian's rays.
    #[inline(always)]
    fn new_slot(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.slots.push(Slot::default());
            self.slots.len() as u32 - 1
        })
    }

    #[inline(always)]
    fn push(&mut self, slot: u32, [low, high]: [f32; 2], depth: f32, colour: [f32; 3]) {
        let (group, lane) = (self.len / LANES, self.len % LANES);
        if lane == 0 {
            self.briefs.push(Briefs {
                end: [f32::INFINITY; LANES],
                ..Briefs::default()
            });
        }
        self.len += 1;
        let to = &mut self.briefs[group];
        let (middle, half) = (0.5 * (low + high), 0.5 * BOX * (high - low));
        let half = half.max(middle.abs() * 1e-6).max(f32::MIN_POSITIVE);
        to.low[lane] = middle - half;
        to.high[lane] = middle + half;
        to.rate[lane] = depth / (2.0 * half);
        let [r, g, b] = colour;
        for (lanes, value) in to.colour.iter_mut().zip(colour) {
            lanes[lane] = value;
        }
        to.square[lane] = r * r + g * g + b * b;
        to.end[lane] = high;
        to.slot[lane] = slot;
    }

    /// The error of the order of a slab, M sqrt(V), to the power of a half: it grows about in proportion to the slab's length.
    #[simd]
    fn mixing<S: Simd>(&self, simd: S, z0: f32, z1: f32) -> f32 {
        let zero = f32x16::splat(simd, 0.0);
        let (z0, z1) = (f32x16::splat(simd, z0), f32x16::splat(simd, z1));
        let (mut mass, mut squares, mut red, mut green, mut blue) = (zero, zero, zero, zero, zero);
        for part in &self.briefs {
            let low = f32x16::from_slice(simd, &part.low);
            let high = f32x16::from_slice(simd, &part.high);
            let within = z1.max(low).min(high) - z0.max(low).min(high);
            let depth = f32x16::from_slice(simd, &part.rate) * within;
            mass += depth;
            red = depth.mul_add(f32x16::from_slice(simd, &part.colour[0]), red);
            green = depth.mul_add(f32x16::from_slice(simd, &part.colour[1]), green);
            blue = depth.mul_add(f32x16::from_slice(simd, &part.colour[2]), blue);
            squares = depth.mul_add(f32x16::from_slice(simd, &part.square), squares);
        }
        let mass = mass.reduce_sum();
        let (r, g, b) = (red.reduce_sum(), green.reduce_sum(), blue.reduce_sum());
        let variance = mass * squares.reduce_sum() - (r * r + g * g + b * b);
        (mass * variance.max(0.0).sqrt()).sqrt()
    }

    /// The camera z of a slab's end, at most `limit`.
    #[simd]
    fn slab_end<S: Simd>(&self, simd: S, z0: f32, limit: f32, most: f32) -> f32 {
        let (mut low, mut at_low) = (z0, -most);
        let (mut high, mut at_high) = (limit, self.mixing(simd, z0, limit) - most);
        if at_high <= 0.2 * most {
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
            if at.abs() < 0.2 * most {
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
    let mut at = 0;
    loop {
        // A slab may be this wrong where this share of the light reaches it.
        let most = (settings.slab_error / pixels.greatest_transmittance()).sqrt();
        let mut taken = 0;
        let begin = loop {
            let Some((form, begin)) = forms.of_block(block, at) else {
                break f32::INFINITY;
            };
            if active.len == 0 {
                // Nothing lies before it.
                z0 = z0.max(begin);
            }
            let is_asked = taken % TAKEN_AT_ONCE == 0;
            if begin > settings.farthest(z0) || is_asked && active.mixing(simd, z0, begin) >= most {
                break begin;
            }
            taken += 1;
            at += 1;
            work.met += activate(simd, form, rays, active);
        };
        if active.len == 0 {
            break;
        }
        let limit = if begin < f32::INFINITY {
            begin
        } else {
            active.last_end()
        };
        let limit = limit.min(settings.farthest(z0));
        let z1 = active.slab_end(simd, z0, limit, most).max(above(z0));
        pixels.add(simd, [z0, z1], rays, active);
        work.summed += active.len as u64;
        active.retire(simd, z1);
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
#[simd]
fn activate<S: Simd>(simd: S, form: &RayForm, rays: &BlockRays, active: &mut Active) -> u64 {
    /// log2 of e, halved, for exp(-q / 2).
    const HALF_LOG2_E: f32 = 0.5 * std::f32::consts::LOG2_E;
    let splat = |value: f32| f32x16::splat(simd, value);
    let x = f32x16::from_slice(simd, &rays.x);
    let y = f32x16::from_slice(simd, &rays.y);
    let root = polynomial(simd, &form.density, x, y).sqrt();
    let over_root = splat(1.0) / root;
    let over = over_root * over_root;
    let q = polynomial(simd, &form.distance, x, y) * over;
    let exponent = splat(form.log2_opacity) - q.max(splat(0.0)) * HALF_LOG2_E;
    let seen = exponent.simd_ge(splat(LEAST_EXPONENT));
    if !seen.any_true() {
        return 0;
    }
    let opacity = exp2(simd, exponent.min(splat(0.0)));
    let depth = seen.select(optical_depth(simd, opacity), splat(0.0));
    let [p0, px, py] = form.peak;
    let peak = x.mul_add(splat(px), y.mul_add(splat(py), splat(p0))) * over;
    let sharpness = (root * form.sharpness).min(splat(form.sharpest));
    let reach = (over_root * (1.0 / form.sharpness)).max(splat(1.0 / form.sharpest));
    let low = seen.select(peak - reach, splat(f32::INFINITY)).reduce_min();
    let high = seen
        .select(peak + reach, splat(f32::NEG_INFINITY))
        .reduce_max();
    let place = active.new_slot();
    let slot = &mut active.slots[place as usize];
    let near = f32x16::from_slice(simd, &rays.near);
    let before = (near - peak) * sharpness;
    if before.simd_gt(splat(-1.0)).any_true() {
        let (share, moment) = share_and_moment(simd, before.max(splat(-1.0)).min(splat(1.0)));
        share.store_slice(&mut slot.share);
        moment.store_slice(&mut slot.moment);
    } else {
        slot.share = [0.0; LANES];
        slot.moment = [0.0; LANES];
    }
    depth.store_slice(&mut slot.depth);
    (depth * reach).store_slice(&mut slot.depth_reach);
    peak.store_slice(&mut slot.peak);
    sharpness.store_slice(&mut slot.sharpness);
    slot.colour = form.colour;
    // Between the mean and the greatest, so that small ones count where they are.
    let typical = (depth.reduce_sum() * depth.reduce_max() * (1.0 / LANES as f32)).sqrt();
    active.push(place, [low, high], typical, form.colour);
    1
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
    /// A function of its own: inside a greater one the sums do not stay in registers.
    #[simd]
    fn of(simd: S, [z0, z1]: [f32; 2], rays: &BlockRays, active: &mut Active) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        let begin = f32x16::splat(simd, z0);
        // A slab before the begin of a ray adds nothing to it, and leaves the shares that lie before the begin as they are.
        let end = f32x16::splat(simd, z1)
            .min(f32x16::from_slice(simd, &rays.far))
            .max(f32x16::from_slice(simd, &rays.near));
        let (mut sum, mut sum_z) = (zero, zero);
        let (mut red, mut green, mut blue) = (zero, zero, zero);
        let (mut red_z, mut green_z, mut blue_z) = (zero, zero, zero);
        let Active {
            slots, briefs, len, ..
        } = active;
        for at in 0..*len {
            let place = briefs[at / LANES].slot[at % LANES];
            let slot = &mut slots[place as usize];
            let peak = f32x16::from_slice(simd, &slot.peak);
            let x = ((end - peak) * f32x16::from_slice(simd, &slot.sharpness))
                .max(f32x16::splat(simd, -1.0))
                .min(f32x16::splat(simd, 1.0));
            let (share, moment) = share_and_moment(simd, x);
            let part = (share - f32x16::from_slice(simd, &slot.share)).max(zero);
            let bent = moment - f32x16::from_slice(simd, &slot.moment);
            let depth = part * f32x16::from_slice(simd, &slot.depth);
            let depth_z =
                (peak - begin).mul_add(depth, bent * f32x16::from_slice(simd, &slot.depth_reach));
            share.store_slice(&mut slot.share);
            moment.store_slice(&mut slot.moment);
            let [r, g, b] = slot.colour;
            let (r, g, b) = (
                f32x16::splat(simd, r),
                f32x16::splat(simd, g),
                f32x16::splat(simd, b),
            );
            sum += depth;
            sum_z += depth_z;
            red = r.mul_add(depth, red);
            green = g.mul_add(depth, green);
            blue = b.mul_add(depth, blue);
            red_z = r.mul_add(depth_z, red_z);
            green_z = g.mul_add(depth_z, green_z);
            blue_z = b.mul_add(depth_z, blue_z);
        }
        Self {
            depth: sum,
            rgb: [red, green, blue],
            depth_z: sum_z,
            rgb_z: [red_z, green_z, blue_z],
        }
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
