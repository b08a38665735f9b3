//! The colours of a reference as surfaces have them: the reference's own, except a few beside edges.

use fearless_simd::prelude::*;
use fearless_simd::{i32x8, u32x8};
use rayon::prelude::*;

use crate::surfaces::input_copy::TakenColours;
use crate::surfaces::surface::{RECOLOURED, Surfaces};

/// Samples that one task looks at.
const PART: usize = 1 << 16;

/// The colours that are looked up.
#[derive(Clone, Debug)]
pub(crate) struct Colours {
    /// Coefficients of the cubic spline through the samples.
    pub(crate) coefficients: Coefficients,
    /// The reference's own.
    pub(crate) taken: TakenColours,
    /// Samples that have another colour than the reference, in order, and that colour.
    recoloured: Vec<(u32, [f32; 3])>,
}

impl Colours {
    /// With the samples' colours as they are unmixed, where they differ from those `taken`; `surfaces` record which.
    /// Coefficients are still to be found.
    pub(crate) fn new(
        samples: Vec<[f32; 3]>,
        taken: TakenColours,
        surfaces: &mut Surfaces,
    ) -> Self {
        let links = surfaces.links.par_chunks_mut(PART);
        let parts = links.zip(samples.par_chunks(PART)).enumerate();
        let recoloured = parts.flat_map_iter(|(part, (links, samples))| {
            let mut recoloured = Vec::new();
            for (i, (links, sample)) in links.iter_mut().zip(samples).enumerate() {
                let index = part * PART + i;
                if *sample != taken.get(index) {
                    recoloured.push((index as u32, *sample));
                    *links |= RECOLOURED;
                }
            }
            recoloured
        });
        Self {
            recoloured: recoloured.collect(),
            coefficients: Coefficients::new(samples),
            taken,
        }
    }

    /// The colour of a sample, which is the reference's own unless its links say otherwise.
    #[inline(always)]
    pub(crate) fn sample(&self, index: usize, links: u8) -> [f32; 3] {
        if links & RECOLOURED == 0 {
            return self.taken.get(index);
        }
        let place = self
            .recoloured
            .binary_search_by_key(&(index as u32), |&(index, _)| index);
        place.map_or_else(|_| self.taken.get(index), |place| self.recoloured[place].1)
    }
}

/// Linear red, green and blue of each sample.
#[derive(Clone, Debug)]
pub(crate) struct Coefficients(Vec<[f32; 3]>);

impl Coefficients {
    /// Entries behind the samples, so that vectors can be loaded at the last ones.
    const MORE: usize = 2;

    fn new(mut samples: Vec<[f32; 3]>) -> Self {
        samples.reserve_exact(Self::MORE);
        samples.extend([[0.0; 3]; Self::MORE]);
        Self(samples)
    }

    /// Number of samples.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.0.len() - Self::MORE
    }

    /// The samples.
    pub(crate) fn samples_mut(&mut self) -> &mut [[f32; 3]] {
        let count = self.len();
        &mut self.0[..count]
    }

    /// The numbers of four samples, and four more.
    #[inline(always)]
    pub(crate) fn sixteen(&self, first: usize) -> &[f32] {
        &self.0.as_flattened()[3 * first..3 * first + 16]
    }

    /// The numbers of a sample, and one more.
    #[inline(always)]
    pub(crate) fn four(&self, sample: usize) -> &[f32] {
        &self.0.as_flattened()[3 * sample..3 * sample + 4]
    }
}

/// The number of a sample beside which there are not sixteen.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// The numbers of eight samples by their columns and rows, [`NOWHERE`] for those that have not one column and row of samples
/// before them and two behind.
#[inline(always)]
pub(crate) fn eight_samples<S: Simd>(simd: S, [x, y]: [i32x8<S>; 2], size: [usize; 2]) -> u32x8<S> {
    let constant = |v: i32| i32x8::splat(simd, v);
    let [width, height] = [size[0] as i32, size[1] as i32];
    let behind = x.simd_lt(constant(width - 2)) & y.simd_lt(constant(height - 2));
    let inside = x.simd_gt(constant(0)) & y.simd_gt(constant(0)) & behind;
    let index: i32x8<S> = inside.select(y * constant(width) + x, constant(NOWHERE as i32));
    index.bitcast()
}
