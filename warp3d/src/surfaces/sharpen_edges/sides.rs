//! To which of its two surfaces a sample inside a ramp belongs, and where that surface lies.
//!
//! Depth says that it is more likely the one that its ramp has come closer to. The picture says more: the sample
//! belongs with neighbours of its colour. So what is known outside the ramps spreads into them, the faster the more alike
//! neighbouring colours are, against a pull towards what depth says (a random walk with restarts; Grady 2006). Where
//! the picture shows no edge, the ramp is cut half way; where it shows one, there.
//!
//! Each line that crosses a ramp tells the disparity of both sides a little differently, and where a surface is narrower than
//! the blur no line meets it: a leaf's tip is too far away, and the wall between two leaves too near. So disparities spread
//! as well, among the samples of one side, from where lines end on something flat.
//!
//! Limits: an edge that is farther from the ramp's middle than its ends is not found; a thing that is narrower than the blur
//! everywhere keeps the depth that is left of it.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use resample_core::dispatch;
use resample_core::simd::{SimdLevel, Vectors};

use super::blocks::{Block, LANES, Lanes, NEIGHBOURS, Plane, blocks};
use super::choice::Choice;

/// Weight of a disparity where a ramp ends on something flat, and where it turns back at once, in parts of that of one neighbour
/// of the same colour. Guesses.
const FLAT_WEIGHT: f32 = 0.5;
const TURN_WEIGHT: f32 = 0.01;

/// Rounds in which sides spread, and then disparities, one sample a round.
const SIDE_ROUNDS: usize = 8;
const PLACE_ROUNDS: usize = 8;

/// How far both spread, samples.
pub(super) const REACH: usize = SIDE_ROUNDS + PLACE_ROUNDS;

/// Weight of what depth says, in parts of that of one neighbour of the same colour.
const PRIOR: f32 = 0.05;

/// Blocks of one task.
const TASK: usize = 256;

/// Gives the samples inside ramps the disparity of one of their surfaces. `disparity` and `choices` are of rows of `width`
/// samples with these `colours`.
pub(super) fn take_sides(
    disparity: &mut [f32],
    choices: &[Choice],
    colours: &[[f32; 3]],
    width: usize,
) {
    let level = SimdLevel::Auto.resolve();
    let blocks = blocks(level, choices, colours, width);
    let mut spread = Spread {
        plane: Plane::new(width, disparity.len() / width, |at| disparity[at]),
        found: vec![[0.0; LANES]; blocks.len()],
        blocks,
        level,
    };
    spread.round(Round::Lean);
    (0..SIDE_ROUNDS).for_each(|_| spread.round(Round::Between));
    // From here on a sample is on the side to which its disparity is nearer.
    spread.round(Round::Side);
    (0..PLACE_ROUNDS).for_each(|_| spread.round(Round::Place));
    spread.plane.give_back(disparity, width);
}

/// The number that a round finds.
#[derive(Clone, Copy)]
enum Round {
    /// Where depth says.
    Lean,
    /// Between the two sides, where the neighbours and the sample's own depth say.
    Between,
    /// The side.
    Side,
    /// On the sample's side, where its ramp and the neighbours of that side say.
    Place,
}

/// The samples inside ramps, among all disparities, and what a round finds for them.
struct Spread {
    plane: Plane,
    blocks: Vec<Block>,
    found: Vec<Lanes>,
    level: Vectors,
}

impl Spread {
    /// Gives each sample its next disparity, which depends on what all had before.
    fn round(&mut self, what: Round) {
        let (plane, level) = (&self.plane, self.level);
        let found = self.found.par_chunks_mut(TASK);
        found
            .zip(self.blocks.par_chunks(TASK))
            .for_each(|(found, blocks)| {
                dispatch!(level, simd => find(simd, what, plane, blocks, found));
            });
        for (block, found) in self.blocks.iter().zip(&self.found) {
            self.plane.take(block, found);
        }
    }
}

/// Finds the numbers of a round for some blocks. The arithmetic is that of single samples at any level: nothing is fused.
#[simd]
fn find<S: Simd>(simd: S, what: Round, plane: &Plane, blocks: &[Block], found: &mut [Lanes]) {
    for (found, block) in found.iter_mut().zip(blocks) {
        let sides = Sides::new(simd, block);
        let next = match what {
            Round::Lean => sides.at(block.lean(simd)),
            Round::Between => between(simd, &sides, block, plane),
            Round::Side => sides.nearer(sides.is_high(block.own(simd, plane))),
            Round::Place => on_side(simd, &sides, block, plane),
        };
        *found = next.into();
    }
}

/// The two surfaces of a block's samples, and the middle between them.
struct Sides<S: Simd> {
    low: f32x8<S>,
    high: f32x8<S>,
    middle: f32x8<S>,
}

impl<S: Simd> Sides<S> {
    #[inline(always)]
    fn new(simd: S, block: &Block) -> Self {
        let [low, high] = block.sides(simd);
        let middle = low;
        let mut sides = Self { low, high, middle };
        sides.middle = sides.at(f32x8::splat(simd, 0.0));
        sides
    }

    /// The disparity between the sides: at the first for -1, at the second for 1.
    #[inline(always)]
    fn at(&self, place: f32x8<S>) -> f32x8<S> {
        (self.low + self.high) * 0.5 + place * 0.5 * (self.high - self.low)
    }

    /// True for disparities that are nearer to the second side.
    #[inline(always)]
    fn is_high(&self, disparity: f32x8<S>) -> mask32x8<S> {
        disparity.simd_gt(self.middle)
    }

    /// The disparity of the second side where `is_high`, else of the first.
    #[inline(always)]
    fn nearer(&self, is_high: mask32x8<S>) -> f32x8<S> {
        is_high.select(self.high, self.low)
    }
}

#[inline(always)]
fn between<S: Simd>(simd: S, sides: &Sides<S>, block: &Block, plane: &Plane) -> f32x8<S> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let apart = (sides.high - sides.low).max(constant(f32::MIN_POSITIVE));
    let scale = constant(2.0) / apart;
    let mut sum = constant(PRIOR) * block.lean(simd);
    let mut total = constant(PRIOR);
    for k in 0..NEIGHBOURS.len() {
        let (beside, weight) = block.neighbour(simd, plane, k);
        let lean = (beside - sides.middle) * scale;
        sum += weight * lean.max(constant(-1.0)).min(constant(1.0));
        total += weight;
    }
    sides.at(sum / total)
}

#[inline(always)]
fn on_side<S: Simd>(simd: S, sides: &Sides<S>, block: &Block, plane: &Plane) -> f32x8<S> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let is_high = sides.is_high(block.own(simd, plane));
    let [low, high] = block.turn_weights(simd, [FLAT_WEIGHT, TURN_WEIGHT]);
    let mut total = is_high.select(high, low);
    let mut sum = total * sides.nearer(is_high);
    for k in 0..NEIGHBOURS.len() {
        let (beside, weight) = block.neighbour(simd, plane, k);
        let is_own = !(sides.is_high(beside) ^ is_high);
        let weight = is_own.select(weight, constant(0.0));
        sum += weight * beside;
        total += weight;
    }
    sum / total
}
