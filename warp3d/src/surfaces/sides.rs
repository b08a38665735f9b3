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

/// Weight of a disparity where a ramp ends on something flat, and where it turns back at once, in parts of that of one neighbour
/// of the same colour. Guesses.
const FLAT_WEIGHT: f32 = 0.5;
const TURN_WEIGHT: f32 = 0.01;

/// Rounds in which sides spread, and then disparities, one sample a round.
const SIDE_ROUNDS: usize = 8;
const PLACE_ROUNDS: usize = 8;

/// How far both spread, samples.
pub(super) const SIDES_REACH: usize = SIDE_ROUNDS + PLACE_ROUNDS;

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

// The two surfaces of which a sample inside a ramp is one.

/// The side of a sample inside a ramp.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choice {
    /// The largest step of the ramp, relative to the larger end. 0: the sample is in no ramp.
    pub(super) step: f32,
    /// Disparity on the surface of less and on that of more disparity.
    pub(super) sides: [f32; 2],
    /// How far depth leans to the second one: from -1 at the first surface to 1 at the second.
    pub(super) lean: f32,
    /// True if the surface turns back at once: what the ramp tells of its disparity is little.
    pub(super) turns: [bool; 2],
}

impl Choice {
    /// Returns true if the sample is inside a ramp.
    pub(super) fn is_inside(&self) -> bool {
        self.step > 0.0
    }

    /// That of two ramps whose step is larger.
    pub(super) fn or_steeper(self, other: Self) -> Self {
        if other.step > self.step { other } else { self }
    }

    /// The same with the surface of less disparity first.
    pub(super) fn ordered(self) -> Self {
        let Self {
            sides: [a, b],
            turns: [u, v],
            ..
        } = self;
        if a <= b {
            return self;
        }
        Self {
            sides: [b, a],
            lean: -self.lean,
            turns: [v, u],
            ..self
        }
    }
}

// The samples inside ramps by eights along a row, so that a round of spreading takes eight at once.
//
// A block has the two surfaces of its samples and the weights of their neighbours; the disparities of all samples lie in a plane
// with a rim of unknown ones, so that a neighbour's place needs no check.

/// Samples of a block.
pub(super) const LANES: usize = 8;

/// A number of each sample of a block.
pub(super) type Lanes = [f32; LANES];

/// Difference of two colours, after a square root, that halves the weight of one for the other, squared: 0.05 is well above
/// the noise of photographs, and below most edges.
const HALVING2: f32 = 0.05 * 0.05;

/// Steps along x and y to the eight neighbours.
const NEIGHBOURS: [[isize; 2]; 8] = [
    [-1, -1],
    [0, -1],
    [1, -1],
    [-1, 0],
    [1, 0],
    [-1, 1],
    [0, 1],
    [1, 1],
];

/// A number of each sample.
#[inline(always)]
fn lanes<T>(of: impl Fn(usize) -> T) -> [T; LANES] {
    std::array::from_fn(of)
}

/// Samples side by side of which some are inside ramps.
pub(super) struct Block {
    /// The place of its first sample in a plane.
    first: usize,
    is_inside: [bool; LANES],
    /// Disparity on the surface of less and on that of more.
    low: Lanes,
    high: Lanes,
    /// How far depth leans to the second one.
    lean: Lanes,
    /// Bit 0: the first surface turns back at once. Bit 1: the second one.
    turns: [u8; LANES],
    /// Weights of each of the neighbours, in 255ths.
    weights: [[u8; LANES]; 8],
}

/// A number for each sample, with a rim of NaN.
pub(super) struct Plane {
    values: Vec<f32>,
    stride: usize,
}

impl Plane {
    /// Of the values of `height` rows of `width` samples.
    pub(super) fn new(width: usize, height: usize, value: impl Fn(usize) -> f32 + Sync) -> Self {
        let stride = width.next_multiple_of(LANES) + 2;
        let mut values = vec![f32::NAN; stride * (height + 2)];
        let rows = values[stride..].par_chunks_mut(stride).take(height);
        rows.enumerate().for_each(|(y, row)| {
            for (x, to) in row[1..=width].iter_mut().enumerate() {
                *to = value(y * width + x);
            }
        });
        Self { values, stride }
    }

    /// The values from a place on.
    #[inline(always)]
    fn from(&self, first: usize) -> &[f32] {
        &self.values[first..first + LANES]
    }

    /// Those beside a block's, `k` of the neighbours away.
    #[inline(always)]
    fn beside(&self, first: usize, k: usize) -> &[f32] {
        let [dx, dy] = NEIGHBOURS[k];
        self.from(first.wrapping_add_signed(dy * self.stride as isize + dx))
    }

    /// Takes what was `found` for the samples of a block that are inside ramps.
    #[inline(always)]
    pub(super) fn take(&mut self, block: &Block, found: &Lanes) {
        let to = &mut self.values[block.first..block.first + LANES];
        for l in 0..LANES {
            to[l] = if block.is_inside[l] { found[l] } else { to[l] };
        }
    }

    /// Writes the values to rows of `width` samples.
    pub(super) fn give_back(&self, to: &mut [f32], width: usize) {
        let rows = self.values[self.stride..].par_chunks(self.stride);
        to.par_chunks_mut(width)
            .zip(rows)
            .for_each(|(to, row)| to.copy_from_slice(&row[1..=width]));
    }
}

impl Block {
    /// Disparity on the surface of less and on that of more.
    #[inline(always)]
    pub(super) fn sides<S: Simd>(&self, simd: S) -> [f32x8<S>; 2] {
        [&self.low, &self.high].map(|side| f32x8::from_slice(simd, side))
    }

    /// How far depth leans to the second one.
    #[inline(always)]
    pub(super) fn lean<S: Simd>(&self, simd: S) -> f32x8<S> {
        f32x8::from_slice(simd, &self.lean)
    }

    /// The samples' own disparities.
    #[inline(always)]
    pub(super) fn own<S: Simd>(&self, simd: S, plane: &Plane) -> f32x8<S> {
        f32x8::from_slice(simd, plane.from(self.first))
    }

    /// The weight of each of the two surfaces where it is flat, or turns back at once.
    #[inline(always)]
    fn turn_weights<S: Simd>(&self, simd: S, [flat, turn]: [f32; 2]) -> [f32x8<S>; 2] {
        [1, 2].map(|bit| {
            let of = |turns: u8| if turns & bit != 0 { turn } else { flat };
            f32x8::from_slice(simd, &self.turns.map(of))
        })
    }

    /// The disparities of one of the neighbours, and their weights, 0 where nothing is known.
    #[inline(always)]
    pub(super) fn neighbour<S: Simd>(
        &self,
        simd: S,
        plane: &Plane,
        k: usize,
    ) -> (f32x8<S>, f32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let beside = f32x8::from_slice(simd, plane.beside(self.first, k));
        let weight = f32x8::from_slice(simd, &self.weights[k].map(f32::from));
        let is_known = beside.simd_eq(beside);
        (
            is_known.select(beside, zero),
            is_known.select(weight / 255.0, zero),
        )
    }
}

/// The blocks of rows of `width` samples with these `choices` and `colours`.
pub(super) fn blocks(
    level: Vectors,
    choices: &[Choice],
    colours: &[[f32; 3]],
    width: usize,
) -> Vec<Block> {
    let height = choices.len() / width;
    // As a display shows them.
    let shown = [0, 1, 2].map(|c| Plane::new(width, height, |at| colours[at][c].max(0.0).sqrt()));
    let of_row = |(y, row): (usize, &[Choice])| {
        let blocks = row.chunks(LANES).enumerate();
        let blocks = blocks.filter(|(_, choices)| choices.iter().any(Choice::is_inside));
        let first = (y + 1) * shown[0].stride + 1;
        let blocks = blocks.map(|(k, choices)| {
            let first = first + k * LANES;
            dispatch!(level, simd => block(simd, choices, first, &shown))
        });
        blocks.collect::<Vec<_>>()
    };
    let rows = choices.par_chunks(width).enumerate();
    rows.flat_map_iter(of_row).collect()
}

/// A block whose first sample has the place `first`.
#[simd]
fn block<S: Simd>(simd: S, choices: &[Choice], first: usize, shown: &[Plane; 3]) -> Block {
    let choice = lanes(|l| choices.get(l).copied().unwrap_or_default());
    Block {
        first,
        is_inside: lanes(|l| choice[l].is_inside()),
        low: lanes(|l| choice[l].sides[0]),
        high: lanes(|l| choice[l].sides[1]),
        lean: lanes(|l| choice[l].lean),
        turns: lanes(|l| u8::from(choice[l].turns[0]) + 2 * u8::from(choice[l].turns[1])),
        weights: std::array::from_fn(|k| weights(simd, shown, first, k)),
    }
}

/// The weights of one of the neighbours by the colours; 0 where there is none.
#[inline(always)]
fn weights<S: Simd>(simd: S, shown: &[Plane; 3], first: usize, k: usize) -> [u8; LANES] {
    let [r, g, b] = [0, 1, 2].map(|c| {
        let [own, beside] = [shown[c].from(first), shown[c].beside(first, k)];
        let apart = f32x8::from_slice(simd, own) - f32x8::from_slice(simd, beside);
        apart * apart
    });
    let ratio = (r + g + b) / HALVING2;
    let weight: Lanes = (f32x8::splat(simd, 255.0) / (ratio * ratio + 1.0) + 0.5).into();
    // A colour that is no number says nothing, nor does one outside: a cast makes 0 of it.
    weight.map(|weight| weight as u8)
}
