//! The colours of a reference as surfaces have them: the reference's own, but for a few beside edges.

use crate::surface::{RECOLOURED, Surfaces};

/// What colours are looked up in.
#[derive(Clone, Debug)]
pub(crate) struct Colours {
    /// Coefficients of the cubic spline through the samples: linear red, green, blue, and one unused value, so that a
    /// sample is one vector.
    pub(crate) coefficients: Vec<[f32; 4]>,
    /// Samples that have another colour than the reference, in order, and that colour.
    recoloured: Vec<(u32, [f32; 3])>,
}

impl Colours {
    /// With the samples' colours as they are unmixed, where they differ from those `taken`; `surfaces` are told which.
    /// Coefficients are still to be found.
    pub(crate) fn new(samples: Vec<[f32; 4]>, taken: &[[f32; 3]], surfaces: &mut Surfaces) -> Self {
        let mut recoloured = Vec::new();
        for (index, (sample, taken)) in samples.iter().zip(taken).enumerate() {
            let [r, g, b, _] = *sample;
            if [r, g, b] != *taken {
                recoloured.push((index as u32, [r, g, b]));
                surfaces.links[index] |= RECOLOURED;
            }
        }
        Self {
            coefficients: samples,
            recoloured,
        }
    }

    /// The colour of a sample, which is that `taken` unless its links say otherwise.
    #[inline(always)]
    pub(crate) fn sample(&self, index: usize, taken: &[[f32; 3]], links: u8) -> [f32; 3] {
        if links & RECOLOURED == 0 {
            return taken[index];
        }
        let place = self
            .recoloured
            .binary_search_by_key(&(index as u32), |&(index, _)| index);
        place.map_or(taken[index], |place| self.recoloured[place].1)
    }
}
