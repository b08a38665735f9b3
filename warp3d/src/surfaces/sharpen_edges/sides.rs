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

use rayon::prelude::*;

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

/// Weight of a disparity where a ramp ends on something flat, and where it turns back at once, in parts of that of one neighbour
/// of the same colour. Guesses.
const FLAT_WEIGHT: f32 = 0.5;
const TURN_WEIGHT: f32 = 0.01;

impl Choice {
    /// The disparity between the sides: at the first for -1, at the second for 1.
    fn at(&self, place: f32) -> f32 {
        let [low, high] = self.sides;
        0.5 * (low + high) + 0.5 * place * (high - low)
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

/// Rounds in which sides spread, and then disparities, one sample a round.
const SIDE_ROUNDS: usize = 8;
const PLACE_ROUNDS: usize = 8;

/// How far both spread, samples.
pub(super) const REACH: usize = SIDE_ROUNDS + PLACE_ROUNDS;

/// Weight of what depth says, in parts of that of one neighbour of the same colour.
const PRIOR: f32 = 0.05;

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

/// A sample inside a ramp.
struct Inside {
    at: u32,
    /// Weights of the neighbours, in 255ths.
    weights: [u8; 8],
}

/// The samples around which sides and disparities spread.
#[derive(Clone, Copy)]
struct Around<'a> {
    choices: &'a [Choice],
    disparity: &'a [f32],
    width: usize,
}

/// Gives the samples inside ramps the disparity of one of their surfaces. `disparity` and `choices` are of rows of `width`
/// samples with these `colours`.
pub(super) fn take_sides(
    disparity: &mut [f32],
    choices: &[Choice],
    colours: &[[f32; 3]],
    width: usize,
) {
    let inside = |(at, choice): (usize, &Choice)| {
        (choice.step > 0.0).then(|| Inside {
            at: at as u32,
            weights: weights(colours, width, at),
        })
    };
    let samples: Vec<Inside> = choices.par_iter().enumerate().filter_map(inside).collect();
    let mut found = vec![0.0f32; samples.len()];
    let mut round = |disparity: &mut [f32], next: &(dyn Fn(&Inside, Around<'_>) -> f32 + Sync)| {
        let around = Around {
            choices,
            disparity: &*disparity,
            width,
        };
        found
            .par_iter_mut()
            .zip(&samples)
            .for_each(|(found, sample)| *found = next(sample, around));
        for (sample, found) in samples.iter().zip(&found) {
            disparity[sample.at as usize] = *found;
        }
    };
    round(disparity, &|sample, around| {
        let choice = around.choice(sample);
        choice.at(choice.lean)
    });
    for _ in 0..SIDE_ROUNDS {
        round(disparity, &|sample, around| around.between(sample));
    }
    // From here on a sample is on the side to which its disparity is nearer.
    round(disparity, &|sample, around| {
        around.choice(sample).sides[around.side(sample)]
    });
    for _ in 0..PLACE_ROUNDS {
        round(disparity, &|sample, around| around.on_side(sample));
    }
}

impl<'a> Around<'a> {
    fn choice(&self, sample: &Inside) -> &'a Choice {
        &self.choices[sample.at as usize]
    }

    /// The side to which a sample's disparity is nearer.
    fn side(&self, sample: &Inside) -> usize {
        usize::from(self.disparity[sample.at as usize] > self.choice(sample).at(0.0))
    }

    /// The disparities of the eight neighbours, and their weights, 0 where nothing is known.
    fn neighbours(&self, sample: &Inside) -> [(f32, f32); 8] {
        let (at, width) = (sample.at as usize, self.width as isize);
        let last = self.disparity.len() - 1;
        std::array::from_fn(|k| {
            let [dx, dy] = NEIGHBOURS[k];
            // A place outside has no weight.
            let place = at.wrapping_add_signed(dy * width + dx).min(last);
            let (beside, weight) = (self.disparity[place], f32::from(sample.weights[k]) / 255.0);
            if beside.is_nan() {
                (0.0, 0.0)
            } else {
                (beside, weight)
            }
        })
    }

    /// Between the two sides, where the neighbours and the sample's own depth say.
    fn between(&self, sample: &Inside) -> f32 {
        let choice = self.choice(sample);
        let [low, high] = choice.sides;
        let (middle, scale) = (choice.at(0.0), 2.0 / (high - low).max(f32::MIN_POSITIVE));
        let (mut sum, mut total) = (PRIOR * choice.lean, PRIOR);
        for (beside, weight) in self.neighbours(sample) {
            sum += weight * ((beside - middle) * scale).clamp(-1.0, 1.0);
            total += weight;
        }
        choice.at(sum / total)
    }

    /// On the sample's side, where its ramp and the neighbours of that side say.
    fn on_side(&self, sample: &Inside) -> f32 {
        let (choice, side) = (self.choice(sample), self.side(sample));
        let middle = choice.at(0.0);
        let own = if choice.turns[side] {
            TURN_WEIGHT
        } else {
            FLAT_WEIGHT
        };
        let (mut sum, mut total) = (own * choice.sides[side], own);
        for (beside, weight) in self.neighbours(sample) {
            let weight = if (beside > middle) == (side == 1) {
                weight
            } else {
                0.0
            };
            sum += weight * beside;
            total += weight;
        }
        sum / total
    }
}

/// The weights of a sample's neighbours by their colours; 0 where there is none.
fn weights(colours: &[[f32; 3]], width: usize, at: usize) -> [u8; 8] {
    let height = colours.len() / width;
    let (x, y) = (at % width, at / width);
    let display = |at: usize| colours[at].map(|v| v.max(0.0).sqrt());
    let own = display(at);
    NEIGHBOURS.map(|[dx, dy]| {
        let place = x.checked_add_signed(dx).zip(y.checked_add_signed(dy));
        let inside = place.filter(|&(x, y)| x < width && y < height);
        inside.map_or(0, |(x, y)| {
            let other = display(y * width + x);
            let difference2: f32 = (0..3).map(|c| (own[c] - other[c]).powi(2)).sum();
            let ratio = difference2 / HALVING2;
            // A colour that is no number says nothing: a cast makes 0 of it.
            (255.0 / (1.0 + ratio * ratio) + 0.5) as u8
        })
    })
}
