//! Where surfaces end between the samples, and what colour they have there.
//!
//! A reference pixel beside a depth edge blends two surfaces. With the next pixels inside as the pure colours, its share
//! of the other surface follows from its own colour, and both shares together say where between the two samples the
//! edge lies: the sum of coverage across an edge is its position. The pixel then gets the colour of its own surface
//! alone, and the edge its place. Where the two sides look alike or vary too much to tell, the edge is half way, until its
//! neighbours along the edge correct it.
//!
//! No colour leaves the range of its own surface: what the linked samples next to it have.
//!
//! Limits: edges are taken along rows and columns; a depth edge that is off by whole pixels is left as it is.

mod along;
mod clean;
mod shape;

use crate::surfaces::surface::{Limb, Surfaces};
use along::{UNKNOWN, deviation_of, spread_of, straightened};
pub(crate) use clean::clean;

/// Where edges lie between samples.
#[derive(Clone, Debug)]
pub(crate) struct Rims {
    /// From each sample to the next along x and y, the place of the edge between them, in 255ths.
    places: Vec<[u8; 2]>,
}

/// The outline of a quarter, from its sample on: how far it reaches along x and y, and its corner opposite the sample. From 0
/// to 1 towards the next samples.
pub(crate) struct Shape {
    pub(crate) reach: [f64; 2],
    pub(crate) inner: [f64; 2],
}

/// A cut between two neighbours and the samples next to them on their own sides.
struct Cut {
    nearer: Side,
    farther: Side,
}

/// The samples of one side of a cut: beside it, the next one inside, and the one after that if it is linked.
#[derive(Clone, Copy)]
struct Side {
    samples: [usize; 2],
    deeper: Option<usize>,
}

/// Where the colours place the edge in a cut, and how well they tell it.
struct EdgeEstimate {
    /// The share of the farther surface in the nearer pixel, and of the nearer in the farther one.
    shares: [f32; 2],
    /// The edge's place, from the nearer sample on, and its deviation, samples.
    place: f32,
    deviation: f32,
}

/// How far the farther surface goes on behind the nearer one, samples, so that rounding opens no hole: a few steps of the
/// edge's place, which has eight bits.
const BEHIND: f64 = 0.01;

/// How far quarters of linked samples reach: a little more than half, so that no crack opens between two planes.
const OVERLAP: f64 = 0.55;

/// Half way, in 255ths.
const HALF: u8 = 128;

/// Least squared difference of colour between two sides that separates them: two steps of an 8-bit picture in
/// linear light near white, in each of three channels.
const LEAST_CONTRAST2: f32 = 3.0 * 0.016 * 0.016;

/// Least jump of disparity, in tolerances, across which colours are taken apart: neighbours within three tolerances may
/// count as one surface when a pixel is resolved.
const SMALLEST_JUMP: f32 = 4.0;

/// By how much of its last step a side's colour goes on to the cut, where it changes smoothly. Without, smooth patterns lose
/// 0.4 dB; all of every step costs the edges of checkerboards 1 dB.
const GOES_ON: f32 = 0.7;

/// Largest step, squared, in parts of the squared contrast, that counts as smooth.
const SMOOTH2: f32 = 0.1;

/// Largest share of the other surface: the centre of a pixel lies on its own, so that half of it or more is its own.
const LARGEST_SHARE: f32 = 0.5;

impl Rims {
    /// Every edge half way.
    pub(crate) fn half_way(surfaces: &Surfaces) -> Self {
        Self {
            places: vec![[HALF; 2]; surfaces.disparity.len()],
        }
    }

    /// Finds the edges between `samples` and gives the samples beside them the colour of their own surface.
    pub(crate) fn unmixed(surfaces: &Surfaces, samples: &mut [[f32; 3]]) -> Self {
        let mut rims = Self::half_way(surfaces);
        // The colours stay as they are until all edges are found.
        let mut own = Vec::new();
        // The largest share of another surface so far: the worst edge decides the colour. An edge is beside its own sample and
        // the next one along a row or a column, so that a row of shares and one more are enough.
        let mut shares = vec![0.0f32; surfaces.size[0] + 1];
        let held = shares.len();
        let mut spreads = vec![[0; 2]; samples.len()];
        for (index, spreads) in spreads.iter_mut().enumerate() {
            shares[(index + held - 1) % held] = 0.0;
            for (axis, spread) in spreads.iter_mut().enumerate() {
                let Some(cut) = cut_after(surfaces, index, axis) else {
                    continue;
                };
                let first = cut.nearer.samples[0] == index;
                let limb = surfaces.limb(cut.nearer.samples[0], axis, first);
                let told = cut.told(samples, limb);
                let by_limb = limb.map(|limb| (limb.distance, spread_of(limb.deviation)));
                let by_colours = told.as_ref().map(|t| (t.place, spread_of(t.deviation)));
                let (place, place_spread) = by_colours.or(by_limb).unwrap_or((0.5, UNKNOWN));
                let from_here = if first { place } else { 1.0 - place };
                rims.places[index][axis] = (255.0 * from_here + 0.5) as u8;
                *spread = place_spread;
                let Some(told) = told else { continue };
                let [near_share, far_share] = told.shares;
                let sides = [
                    (cut.nearer.samples[0], cut.farther.samples[1], near_share),
                    (cut.farther.samples[0], cut.nearer.samples[1], far_share),
                ];
                for (sample, other, share) in sides {
                    if share > shares[sample % held] {
                        shares[sample % held] = share;
                        let colour = without(samples[sample], samples[other], share);
                        let range = own_range(surfaces, samples, sample);
                        own.push((sample, clamped(colour, range)));
                    }
                }
            }
        }
        own.into_iter()
            .for_each(|(sample, colour)| samples[sample] = colour);
        for (index, axis, place) in straightened(surfaces, &rims.places, &spreads) {
            rims.places[index][axis] = place;
        }
        rims
    }

    /// How far the sample `index` reaches along x and y into the cut cell that lies towards `towards`, samples.
    fn reach(&self, surfaces: &Surfaces, index: usize, towards: [i32; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            if let Some(reach) = self.to_edge(surfaces, index, axis, towards[axis]) {
                return reach;
            }
            // Opposite a corner of another surface, as far as the next sample of its own does: two edges that meet there
            // leave nothing between them, wherever each was found.
            let aside = linked_towards(surfaces, index, 1 - axis, towards[1 - axis]);
            let opposite = aside.and_then(|next| self.to_edge(surfaces, next, axis, towards[axis]));
            opposite.map_or(OVERLAP, |reach| reach.max(OVERLAP))
        })
    }

    /// How far a sample reaches along an axis, samples; `None` where it is linked with the next one.
    pub(crate) fn to_edge(
        &self,
        surfaces: &Surfaces,
        index: usize,
        axis: usize,
        towards: i32,
    ) -> Option<f64> {
        let [width, height] = surfaces.size;
        let place = [index % width, index / width][axis];
        let (step, count) = ([1, width][axis], [width, height][axis]);
        let forwards = towards > 0;
        if place == if forwards { count - 1 } else { 0 } {
            return Some(0.5);
        }
        let (next, first) = if forwards {
            (index + step, index)
        } else {
            (index - step, index - step)
        };
        if surfaces.linked_on(first, axis) {
            return None;
        }
        if surfaces.disparity[next].is_nan() {
            return Some(0.5);
        }
        let place = f64::from(self.places[first][axis]) / 255.0;
        let reach = if forwards { place } else { 1.0 - place };
        if surfaces.nearer(next, index) {
            return Some((reach + BEHIND).min(1.0));
        }
        if surfaces.limb(index, axis, forwards).is_some() {
            return Some(reach);
        }
        // A surface that curves away goes on beyond its edge's place on the chord.
        let curved =
            surfaces.slope(index)[axis].abs() > surfaces.tolerance * surfaces.disparity[index];
        Some(if curved { reach.max(0.5) } else { reach })
    }
}

/// The next sample along an axis, if the two are linked.
fn linked_towards(surfaces: &Surfaces, index: usize, axis: usize, towards: i32) -> Option<usize> {
    let [before, behind] = [0, 1].map(|side| linked(surfaces, index)[2 * axis + side]);
    if towards > 0 { behind } else { before }
}

impl Cut {
    /// The edge's place by the colours, and by the limb there if the nearer surface has one; `None` where the colours do not
    /// separate the two sides.
    fn told(&self, colours: &[[f32; 3]], limb: Option<Limb>) -> Option<EdgeEstimate> {
        let [near, far] = [self.nearer, self.farther].map(|side| colours[side.samples[0]]);
        let insides = [self.nearer, self.farther].map(|side| colours[side.samples[1]]);
        let plain = difference(insides[0], insides[1]);
        let [near_inside, far_inside] = [self.nearer, self.farther]
            .map(|side| side.at_cut(colours, SMOOTH2 * dot(plain, plain)));
        let between = difference(near_inside, far_inside);
        let contrast2 = dot(between, between);
        if contrast2 < LEAST_CONTRAST2 {
            return None;
        }
        let near_share = dot(difference(near_inside, near), between) / contrast2;
        let far_share = dot(difference(far, far_inside), between) / contrast2;
        // A blend lies between the two; what is far outside is texture of its own.
        let plausible = |share: f32| (-0.25..=0.75).contains(&share);
        let change2 = |side: Side| {
            let step = dot(side.step(colours), between) / contrast2;
            step * step
        };
        (plausible(near_share) && plausible(far_share)).then(|| {
            let shares = [near_share, far_share].map(|s| s.clamp(0.0, LARGEST_SHARE));
            let told = EdgeEstimate {
                shares,
                place: (0.5 - shares[0] + shares[1]).clamp(0.0, 1.0),
                deviation: deviation_of(change2(self.nearer) + change2(self.farther)),
            };
            match limb {
                Some(limb) => told.with(limb),
                None => told,
            }
        })
    }
}

impl EdgeEstimate {
    /// With what depth tells of the place, each by its deviation. The two shares move with the place: they are its coverage.
    fn with(&self, limb: Limb) -> Self {
        let [here, there] = [self.deviation, limb.deviation].map(|d| 1.0 / (d * d));
        let place = (here * self.place + there * limb.distance) / (here + there);
        let [near, far] = self.shares;
        let moved = 0.5 * (place - self.place);
        Self {
            shares: [near - moved, far + moved].map(|s| s.clamp(0.0, LARGEST_SHARE)),
            place,
            deviation: (here + there).sqrt().recip(),
        }
    }
}

impl Side {
    /// How the colour changes inside, towards the cut.
    fn step(&self, colours: &[[f32; 3]]) -> [f32; 3] {
        self.deeper.map_or([0.0; 3], |deeper| {
            difference(colours[self.samples[1]], colours[deeper])
        })
    }

    /// The colour of the side at the cut, continued if its step is at most this long, squared.
    fn at_cut(&self, colours: &[[f32; 3]], smooth2: f32) -> [f32; 3] {
        let (mut colour, step) = (colours[self.samples[1]], self.step(colours));
        if dot(step, step) <= smooth2 {
            for (to, step) in colour.iter_mut().zip(step) {
                *to += GOES_ON * step;
            }
        }
        colour
    }
}

/// The cut between `index` and the next sample along an axis, if there is one with a linked sample on either side.
fn cut_after(surfaces: &Surfaces, index: usize, axis: usize) -> Option<Cut> {
    let width = surfaces.size[0];
    let step = [1, width][axis];
    let place = [index % width, index / width][axis];
    let inside = place >= 1 && place + 2 < surfaces.size[axis];
    if !inside || surfaces.linked_on(index, axis) {
        return None;
    }
    let next = index + step;
    let known = !surfaces.disparity[index].is_nan() && !surfaces.disparity[next].is_nan();
    if !known || !surfaces.linked_on(index - step, axis) || !surfaces.linked_on(next, axis) {
        return None;
    }
    // A small jump is a bend of one surface to a pixel that sees both sides of it: nothing is mixed there.
    let jump = (surfaces.disparity[index] - surfaces.disparity[next]).abs();
    if jump
        <= SMALLEST_JUMP
            * surfaces.tolerance
            * surfaces.disparity[index].max(surfaces.disparity[next])
    {
        return None;
    }
    let linked = |first: usize, is_inside: bool| is_inside && surfaces.linked_on(first, axis);
    let here = Side {
        samples: [index, index - step],
        deeper: linked(index.saturating_sub(2 * step), place >= 2).then(|| index - 2 * step),
    };
    let there = Side {
        samples: [next, next + step],
        deeper: linked(next + step, place + 3 < surfaces.size[axis]).then(|| next + 2 * step),
    };
    let (nearer, farther) = if surfaces.nearer(index, next) {
        (here, there)
    } else {
        (there, here)
    };
    Some(Cut { nearer, farther })
}

/// Least and greatest channels of a sample and of the samples that it is linked with, and those that these are.
fn own_range(surfaces: &Surfaces, samples: &[[f32; 3]], sample: usize) -> [[f32; 3]; 2] {
    let mut range = [samples[sample]; 2];
    let mut include = |at: usize| {
        for (c, v) in samples[at].iter().enumerate() {
            range[0][c] = range[0][c].min(*v);
            range[1][c] = range[1][c].max(*v);
        }
    };
    for near in linked(surfaces, sample).into_iter().flatten() {
        include(near);
        linked(surfaces, near)
            .into_iter()
            .flatten()
            .for_each(&mut include);
    }
    range
}

/// The neighbours that a sample is linked with.
fn linked(surfaces: &Surfaces, sample: usize) -> [Option<usize>; 4] {
    let [width, height] = surfaces.size;
    let (x, y) = (sample % width, sample / width);
    let before = |first: bool, step: usize, axis: usize| {
        let at = (!first).then(|| sample - step)?;
        surfaces.linked_on(at, axis).then_some(at)
    };
    let behind = |last: bool, step: usize, axis: usize| {
        (!last && surfaces.linked_on(sample, axis)).then_some(sample + step)
    };
    [
        before(x == 0, 1, 0),
        behind(x + 1 == width, 1, 0),
        before(y == 0, width, 1),
        behind(y + 1 == height, width, 1),
    ]
}

/// A colour moved into a range.
fn clamped(colour: [f32; 3], [least, most]: [[f32; 3]; 2]) -> [f32; 3] {
    [0, 1, 2].map(|c| colour[c].clamp(least[c], most[c]))
}

/// The colour that is left when a share of another one is taken out.
fn without(mixed: [f32; 3], other: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|c| ((mixed[c] - share * other[c]) / (1.0 - share)).max(0.0))
}

fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
