//! A reference's own colours and depths, exactly as they were given, in few bytes.
//!
//! Colours of a file of 8 or 16 bits have at most that many values, and are kept as the numbers of these. A depth follows from
//! the sample's disparity up to a unit in its last place, and which it is takes three bits beside the sample's links; those that were
//! changed while surfaces were found are listed.

use fearless_simd::f32x4;
use fearless_simd::prelude::*;
use rayon::prelude::*;
use resample_core::Projection;

use crate::surfaces::surface::{DEPTH, Surfaces};

/// How a depth follows from the disparity: as its inverse, a unit in the last place above or below it, or not at all.
const INVERSE: u8 = 0;
const ABOVE: u8 = DEPTH;
const BELOW: u8 = 2 * DEPTH;
const UNKNOWN: u8 = 3 * DEPTH;
const LISTED: u8 = 4 * DEPTH;

/// All of these bits.
const BITS: u8 = 7 * DEPTH;

/// Depths that one task looks at.
const DEPTHS_OF_TASK: usize = 1 << 16;

/// The depths of a reference.
#[derive(Clone, Debug)]
pub(crate) struct TakenDepths {
    projection: Projection,
    /// Depths that do not follow from disparities, by sample.
    listed: Vec<(u32, f32)>,
}

/// Camera z of a disparity.
fn inverse(projection: Projection, disparity: f32) -> f32 {
    match projection {
        Projection::Perspective => 1.0 / disparity,
        Projection::Orthographic => disparity,
    }
}

/// How a depth follows from its `inverse`.
fn relation(depth: f32, inverse: f32) -> u8 {
    let [wanted, found] = [depth, inverse].map(f32::to_bits);
    match wanted.wrapping_sub(found) {
        _ if depth.is_nan() => UNKNOWN,
        0 => INVERSE,
        1 => ABOVE,
        u32::MAX => BELOW,
        _ => LISTED,
    }
}

impl TakenDepths {
    /// Keeps the `depths` that were given. The links of `surfaces` get the bits that tell a depth from its disparity.
    pub(crate) fn new(projection: Projection, depths: &[f32], surfaces: &mut Surfaces) -> Self {
        let links = surfaces.links.par_chunks_mut(DEPTHS_OF_TASK);
        let disparities = surfaces.disparity.par_chunks(DEPTHS_OF_TASK);
        let parts = links
            .zip(disparities)
            .zip(depths.par_chunks(DEPTHS_OF_TASK))
            .enumerate();
        let listed = parts.flat_map_iter(|(part, ((links, disparities), depths))| {
            let mut listed = Vec::new();
            for (i, (links, depth)) in links.iter_mut().zip(depths).enumerate() {
                let relation = relation(*depth, inverse(projection, disparities[i]));
                *links = *links & !BITS | relation;
                if relation == LISTED {
                    listed.push(((part * DEPTHS_OF_TASK + i) as u32, *depth));
                }
            }
            listed
        });
        Self {
            projection,
            listed: listed.collect(),
        }
    }

    /// Camera z of a sample, as it was given.
    pub(crate) fn get(&self, surfaces: &Surfaces, index: usize) -> f32 {
        let inverse = inverse(self.projection, surfaces.disparity[index]);
        match surfaces.links[index] & BITS {
            INVERSE => inverse,
            ABOVE => f32::from_bits(inverse.to_bits() + 1),
            BELOW => f32::from_bits(inverse.to_bits() - 1),
            LISTED => self.listed(index),
            _ => f32::NAN,
        }
    }

    fn listed(&self, index: usize) -> f32 {
        let place = self
            .listed
            .binary_search_by_key(&(index as u32), |&(index, _)| index);
        place.map_or(f32::NAN, |place| self.listed[place].1)
    }
}

// Colours as numbers of their values, where these are few.

/// Colours that one task looks at. A task begins with a table for all values of a channel of 16 bits.
const COLOURS_OF_TASK: usize = 1 << 20;

/// The colours of a reference.
#[derive(Clone, Debug)]
pub(crate) enum TakenColours {
    /// Up to 256 values, as of a file with 8 bits a channel.
    Bytes(Coded<u8>),
    /// Up to 65536 values.
    Words(Coded<u16>),
    /// Any others.
    Floats(Vec<[f32; 3]>),
}

/// Colours by the numbers of their values.
#[derive(Clone, Debug)]
pub(crate) struct Coded<C> {
    codes: Vec<[C; 3]>,
    values: Vec<f32>,
}

/// The number of a value.
pub(crate) trait Code: Copy + Default + Send + Sync + Into<usize> {
    /// How many there are.
    const COUNT: usize;
    fn new(number: usize) -> Self;
}

impl Code for u8 {
    const COUNT: usize = 1 << 8;
    #[inline(always)]
    fn new(number: usize) -> Self {
        number as Self
    }
}

impl Code for u16 {
    const COUNT: usize = 1 << 16;
    #[inline(always)]
    fn new(number: usize) -> Self {
        number as Self
    }
}

/// Values in the order in which they were met, by their bits.
struct Values {
    met: Vec<u32>,
    /// By a hash, the number of a value that was met, plus 1.
    slots: Vec<u32>,
    most: usize,
}

impl Values {
    fn new(most: usize) -> Self {
        Self {
            met: Vec::new(),
            slots: vec![0; 4 * most],
            most,
        }
    }

    /// The number of a value; `None` if it is one too many.
    #[inline(always)]
    fn number(&mut self, bits: u32) -> Option<usize> {
        // The golden ratio's digits spread neighbouring numbers (Knuth).
        let mut slot = bits.wrapping_mul(0x9e37_79b1) as usize >> (32 - self.slots.len().ilog2());
        loop {
            match self.slots[slot] {
                0 => break,
                number if self.met[number as usize - 1] == bits => {
                    return Some(number as usize - 1);
                }
                _ => slot = (slot + 1) % self.slots.len(),
            }
        }
        if self.met.len() == self.most {
            return None;
        }
        self.met.push(bits);
        self.slots[slot] = self.met.len() as u32;
        Some(self.met.len() - 1)
    }
}

impl<C: Code> Coded<C> {
    /// `None` where there are more values than codes.
    fn new(colours: &[[f32; 3]]) -> Option<Self> {
        let mut codes = vec![[C::default(); 3]; colours.len()];
        let parts = codes
            .par_chunks_mut(COLOURS_OF_TASK)
            .zip(colours.par_chunks(COLOURS_OF_TASK));
        let met: Option<Vec<Vec<u32>>> = parts
            .map(|(codes, colours)| {
                let mut values = Values::new(C::COUNT);
                for (code, colour) in codes.iter_mut().zip(colours) {
                    for (code, value) in code.iter_mut().zip(colour) {
                        *code = C::new(values.number(value.to_bits())?);
                    }
                }
                Some(values.met)
            })
            .collect();
        let met = met?;
        let mut all = met.concat();
        all.sort_unstable();
        all.dedup();
        if all.len() > C::COUNT {
            return None;
        }
        codes
            .par_chunks_mut(COLOURS_OF_TASK)
            .zip(&met)
            .for_each(|(codes, met)| {
                let place = |bits| C::new(all.partition_point(|other| other < bits));
                let places: Vec<C> = met.iter().map(place).collect();
                for code in codes.as_flattened_mut() {
                    *code = places[(*code).into()];
                }
            });
        let mut values: Vec<f32> = all.into_iter().map(f32::from_bits).collect();
        values.resize(C::COUNT, 0.0);
        Some(Self { codes, values })
    }

    #[inline(always)]
    fn get(&self, index: usize) -> [f32; 3] {
        let [r, g, b] = self.codes[index];
        let value = |code: C| self.values[code.into()];
        [value(r), value(g), value(b)]
    }
}

impl TakenColours {
    /// Keeps `colours`, and gives them back to be changed.
    pub(crate) fn new(colours: Vec<[f32; 3]>) -> (Self, Vec<[f32; 3]>) {
        if let Some(coded) = Coded::new(&colours) {
            return (Self::Bytes(coded), colours);
        }
        match Coded::new(&colours) {
            Some(coded) => (Self::Words(coded), colours),
            None => (Self::Floats(colours.clone()), colours),
        }
    }

    /// The colour of a sample.
    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Bytes(coded) => coded.get(index),
            Self::Words(coded) => coded.get(index),
            Self::Floats(colours) => colours[index],
        }
    }

    /// The same as a vector, whose fourth number says nothing.
    #[inline(always)]
    pub(crate) fn vector<S: Simd>(&self, simd: S, index: usize) -> f32x4<S> {
        if let Self::Floats(colours) = self
            && let Some(four) = colours.as_flattened().get(3 * index..3 * index + 4)
        {
            return f32x4::from_slice(simd, four);
        }
        let [r, g, b] = self.get(index);
        f32x4::simd_from(simd, [r, g, b, 0.0])
    }
}

#[cfg(test)]
mod tests {
    use resample_core::{Camera, LookAt};

    use super::*;
    use crate::options::SurfaceTolerance;

    #[test]
    fn depths_come_back_bit_by_bit() {
        let pose = LookAt {
            position: [0.0, 0.0, 0.0].into(),
            target: [0.0, 0.0, 1.0].into(),
            up: [0.0, -1.0, 0.0].into(),
        };
        let camera = Camera::perspective(&pose, 0.8, [300, 200]).expect("a camera");
        let odd = [f32::INFINITY, 0.0, -1.0, 1e-42, 1e-39, 3e38, f32::MAX];
        let mut state = 1u32;
        let mut depths: Vec<f32> = (0..300 * 200)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                1.0 + (state >> 8) as f32 / 1e6
            })
            .collect();
        depths.iter_mut().step_by(97).for_each(|z| *z = f32::NAN);
        depths[1000..1000 + odd.len()].copy_from_slice(&odd);
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let camera = Camera {
                projection,
                ..camera
            };
            let tolerance = SurfaceTolerance::Relative(0.9);
            let mut surfaces = Surfaces::new(&camera, depths.clone(), tolerance);
            let links = surfaces.links.clone();
            let taken = TakenDepths::new(projection, &depths, &mut surfaces);
            for (index, &z) in depths.iter().enumerate() {
                let found = taken.get(&surfaces, index);
                assert!(
                    found.to_bits() == z.to_bits() || (z.is_nan() && found.is_nan()),
                    "sample {index}: {found} for {z}"
                );
                assert_eq!(
                    surfaces.links[index] & !BITS,
                    links[index],
                    "other bits stay"
                );
            }
            assert!(
                taken.listed.len() <= odd.len(),
                "{} are listed",
                taken.listed.len()
            );
        }
    }

    fn kept(colours: &[[f32; 3]]) -> TakenColours {
        let (taken, given) = TakenColours::new(colours.to_vec());
        for (index, colour) in colours.iter().enumerate() {
            assert_eq!(taken.get(index).map(f32::to_bits), colour.map(f32::to_bits));
            assert_eq!(given[index].map(f32::to_bits), colour.map(f32::to_bits));
        }
        taken
    }

    #[test]
    fn colours_come_back_bit_by_bit_however_many_values_they_have() {
        // More than one part, whose first values differ.
        let of = |count: usize| -> Vec<[f32; 3]> {
            let value = |i: usize| (i / 7 % count) as f32 / count as f32;
            (0..COLOURS_OF_TASK + 5000)
                .map(|i| [value(i), value(i + 3), value(i * 5)])
                .collect()
        };
        let mut few = of(250);
        few[COLOURS_OF_TASK + 17] = [f32::NAN, -0.0, f32::INFINITY];
        assert!(matches!(kept(&few), TakenColours::Bytes(_)));
        assert!(matches!(kept(&of(256)), TakenColours::Bytes(_)));
        assert!(matches!(kept(&of(257)), TakenColours::Words(_)));
        assert!(matches!(kept(&of(65_536)), TakenColours::Words(_)));
        assert!(matches!(kept(&of(65_537)), TakenColours::Floats(_)));
        assert!(matches!(kept(&[]), TakenColours::Bytes(_)));
    }

    #[test]
    fn parts_that_have_few_values_each_may_have_many_together() {
        let colours: Vec<[f32; 3]> = (0..3 * COLOURS_OF_TASK)
            .map(|i| [(i / COLOURS_OF_TASK * 100 + i % 100) as f32; 3])
            .collect();
        assert!(matches!(kept(&colours), TakenColours::Words(_)));
    }
}
