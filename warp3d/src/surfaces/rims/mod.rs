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

mod shape;

use crate::surfaces::limbs::Limb;
use crate::surfaces::surface::Surfaces;

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
pub(crate) const LEAST_CONTRAST2: f32 = 3.0 * 0.016 * 0.016;

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

// Samples beside softened edges get the colour of their own surface.
//
// A soft edge is a pixel or two off, and photographs are soft themselves: what lies on one side by its depth may be of the
// other's colour, and would stay behind as a speck when the two move apart. The two samples next to a cut are held against
// the third, which counts as pure: as far as they are between its colour and that of the other side, they are taken apart, and
// where they are more of the other side's, they become as the third.
//
// Limits: what is more than two samples off stays; a texture that is like the other side loses two samples.

/// Least share of the other side that is taken out: less is texture and noise.
const LEAST_SHARE: f32 = 0.2;

/// Gives the unmixed `samples` beside cuts of softened depth the colours of their own surfaces.
pub(crate) fn clean(surfaces: &Surfaces, samples: &mut [[f32; 3]]) {
    // The colours stay as they are until all are found.
    let mut found: Vec<(usize, f32, [f32; 3])> = Vec::new();
    let beside = (0..samples.len()).filter(|&index| surfaces.clearance[index] == 0);
    for (index, axis) in beside.flat_map(|index| [(index, 0), (index, 1)]) {
        let Some(cut) = cut_after(surfaces, index, axis) else {
            continue;
        };
        let sides = [cut.nearer, cut.farther];
        let pure = sides.map(|side| side.deeper.unwrap_or(side.samples[1]));
        for (side, (own, other)) in sides.iter().zip([(pure[0], pure[1]), (pure[1], pure[0])]) {
            let between = difference(samples[other], samples[own]);
            let contrast2 = dot(between, between);
            if contrast2 < LEAST_CONTRAST2 {
                continue;
            }
            for sample in side.samples.into_iter().filter(|&sample| sample != own) {
                let off = difference(samples[sample], samples[own]);
                let share = dot(off, between) / contrast2;
                let aside2 = dot(off, off) - share * share * contrast2;
                if share > LEAST_SHARE && aside2 <= SMOOTH2 * contrast2 {
                    let colour = if share > LARGEST_SHARE {
                        samples[own]
                    } else {
                        without(samples[sample], samples[other], share)
                    };
                    found.push((sample, share, colour));
                }
            }
        }
    }
    // The worst edge decides the colour.
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for (sample, _, colour) in found {
        samples[sample] = colour;
    }
}

// Edges go on from row to row, so that neighbours along an edge tell its place, too.
//
// A straight line is fitted to the places where the edge crosses up to seven rows (or columns), weighted by how well
// their colours tell them, and each place moves onto the line in its own row. A place that colours do not tell has even chances from one
// sample to the next, so its neighbours decide it; a place that they tell well moves little.
//
// Limits: a corner is rounded by what its colours leave open.

/// Rows on either side that count.
const REACH: i32 = 3;

/// Deviation of a place of which nothing is known but that it lies from 0 to 1, 1 / sqrt(12), in 255ths.
pub(crate) const UNKNOWN: u8 = 74;

/// Deviation of the best of places, samples: how far the Gaussian of a pixel departs from the sum of coverage. A guess.
const SHARPEST: f32 = 0.04;

/// How far an edge departs from a straight line one row further, samples: the deviation of a circle of 25 samples' radius.
/// From 0.02 to 0.1 all scenes agree within 0.1 dB.
const BEND: f64 = 0.02;

/// Deviation of a place, samples, between sides whose colours change from sample to sample by the square root of this
/// part of the contrast.
fn deviation_of(change2: f32) -> f32 {
    (SHARPEST * SHARPEST + change2).sqrt()
}

/// The same in 255ths, at most [`UNKNOWN`].
fn spread_of(deviation: f32) -> u8 {
    (255.0 * deviation).min(f32::from(UNKNOWN)) as u8
}

/// The sums of a weighted straight line.
#[derive(Default)]
struct Line([f64; 5]);

impl Line {
    /// A place `row` rows further.
    fn add(&mut self, row: i32, place: f64, spread: u8) {
        let row = f64::from(row);
        let (spread, bend) = (f64::from(spread) / 255.0, BEND * row * row);
        let weight = 1.0 / (spread * spread + bend * bend);
        let terms = [1.0, row, row * row, place, row * place];
        for (sum, term) in self.0.iter_mut().zip(terms) {
            *sum += weight * term;
        }
    }

    /// Its place in row 0; `None` of a single place.
    fn place(&self) -> Option<f64> {
        let [one, row, row2, place, row_place] = self.0;
        let determinant = one * row2 - row * row;
        (determinant > 1e-9 * one * row2).then(|| (place * row2 - row * row_place) / determinant)
    }
}

/// The `places` that have a spread, each moved onto the straight line through it and its neighbours: sample, axis, place.
fn straightened(
    surfaces: &Surfaces,
    places: &[[u8; 2]],
    spreads: &[[u8; 2]],
) -> Vec<(usize, usize, u8)> {
    let mut moved = Vec::new();
    for (index, spread) in spreads.iter().enumerate() {
        for axis in (0..2).filter(|&axis| spread[axis] != 0) {
            let edge = Edge {
                surfaces,
                spreads,
                axis,
            };
            if let Some(place) = edge.line(places, index).place() {
                let place = (255.0 * place.clamp(0.0, 1.0) + 0.5) as u8;
                moved.push((index, axis, place));
            }
        }
    }
    moved
}

/// The edges that cross rows (axis 0) or columns (axis 1).
struct Edge<'a> {
    surfaces: &'a Surfaces,
    spreads: &'a [[u8; 2]],
    axis: usize,
}

impl Edge<'_> {
    /// The line through the place after the sample `index` and those next to it along the edge.
    fn line(&self, places: &[[u8; 2]], index: usize) -> Line {
        let axis = self.axis;
        let place = |at: usize| f64::from(places[at][axis]) / 255.0;
        let mut line = Line::default();
        line.add(0, place(index), self.spreads[index][axis]);
        for side in [-1, 1] {
            let (mut at, mut offset) = (index, 0);
            for row in 1..=REACH {
                let Some((next, shift)) = self.next(at, side) else {
                    break;
                };
                (at, offset) = (next, offset + shift);
                let there = place(at) + f64::from(offset);
                line.add(side * row, there, self.spreads[at][axis]);
            }
        }
        line
    }

    /// Where the edge after the sample `index` crosses the next row or the one before, and by how many samples that is
    /// shifted.
    fn next(&self, index: usize, side: i32) -> Option<(usize, i32)> {
        let axis = self.axis;
        let [width, height] = self.surfaces.size;
        let (across, along) = ([1, width][axis], [width, 1][axis]);
        let row = [index / width, index % width][axis] as i32 + side;
        let column = [index % width, index / width][axis] as i32;
        if row < 0 || row >= [height, width][axis] as i32 {
            return None;
        }
        let beside = moved(index, side, along);
        [0, 1, -1].into_iter().find_map(|shift| {
            let is_inside = (1..self.surfaces.size[axis] as i32 - 2).contains(&(column + shift));
            let next = || moved(beside, shift, across);
            (is_inside && self.is_one(index, next(), shift)).then(|| (next(), shift))
        })
    }

    /// Returns true if the cuts after two samples of neighbouring rows, the second shifted by some samples, are one edge: of one
    /// nearer surface, on the same side.
    fn is_one(&self, index: usize, next: usize, shift: i32) -> bool {
        let (surfaces, axis) = (self.surfaces, self.axis);
        let across = [1, surfaces.size[0]][axis];
        let ends_here = |first: usize| surfaces.nearer(first, first + across);
        if self.spreads[next][axis] == 0 || ends_here(next) != ends_here(index) {
            return false;
        }
        let own = |first: usize| first + if ends_here(index) { 0 } else { across };
        let (from, to) = (own(index), own(next));
        let linked = |a: usize, b: usize, axis: usize| surfaces.linked_on(a.min(b), axis);
        // Shifted, the two are linked by way of the nearer surface's sample between them.
        if shift == 0 {
            linked(from, to, 1 - axis)
        } else if (shift > 0) == ends_here(index) {
            let between = moved(to, -shift, across);
            linked(from, between, 1 - axis) && linked(between, to, axis)
        } else {
            let between = moved(from, shift, across);
            linked(from, between, axis) && linked(between, to, 1 - axis)
        }
    }
}

/// A sample some steps further.
fn moved(index: usize, steps: i32, step: usize) -> usize {
    index.wrapping_add_signed(steps as isize * step as isize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_is_not_told_lies_on_its_neighbours_line() {
        let mut line = Line::default();
        line.add(0, 0.5, UNKNOWN);
        for row in [-2, -1, 1, 2] {
            line.add(
                row,
                0.2 + 0.1 * f64::from(row),
                spread_of(deviation_of(0.0)),
            );
        }
        let place = line.place().expect("five places");
        assert!((place - 0.2).abs() < 0.01, "{place}");
        // Places on one line stay there, whatever their spread.
        let mut straight = Line::default();
        for row in -3..=3 {
            straight.add(row, 0.4 - 0.3 * f64::from(row), (31 + 7 * row) as u8);
        }
        let place = straight.place().expect("seven places");
        assert!((place - 0.4).abs() < 1e-12, "{place}");
        let mut alone = Line::default();
        alone.add(0, 0.5, UNKNOWN);
        assert!(alone.place().is_none());
    }
}
