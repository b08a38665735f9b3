//! The pixel's Gaussian over the places of the finer lattice around it.

use resample_core::point::PIXEL_SIGMA_PX;

/// Pixels on either side whose sub-pixels count: the Gaussian reaches three sigmas.
pub(super) const REACH_PX: i32 = 1;

/// Pixels of the window.
const WINDOW: usize = (2 * REACH_PX as usize + 1) * (2 * REACH_PX as usize + 1);

/// Gaussian weights of the places of one pixel of the window.
#[derive(Clone, Debug)]
pub(super) struct WindowPixel {
    /// Weight, and weighted offset along x and y, of each place.
    pub(super) places: Vec<[f32; 3]>,
    /// Their sums.
    pub(super) total: [f32; 3],
    /// The place with the largest weight.
    pub(super) best: usize,
}

/// Gaussian weights of the places of a window.
#[derive(Clone, Debug)]
pub(super) struct WindowWeights(pub(super) Vec<WindowPixel>);

impl WindowWeights {
    /// For `subpixels` places along a pixel's side.
    pub(super) fn new(subpixels: usize) -> Self {
        let side = 2 * REACH_PX as usize + 1;
        let offset = |i: usize| (i as f64 + 0.5) / subpixels as f64 - f64::from(REACH_PX) - 0.5;
        let weight = |i: usize| (-0.5 * (offset(i) / PIXEL_SIGMA_PX).powi(2)).exp();
        let sum: f64 = (0..side * subpixels).map(weight).sum();
        let pixel = |k: usize| {
            let place = |p: usize| {
                let (i, j) = (
                    k % side * subpixels + p % subpixels,
                    k / side * subpixels + p / subpixels,
                );
                let w = weight(i) * weight(j) / (sum * sum);
                [w as f32, (w * offset(i)) as f32, (w * offset(j)) as f32]
            };
            WindowPixel::new((0..subpixels * subpixels).map(place).collect())
        };
        Self((0..WINDOW).map(pixel).collect())
    }
}

impl WindowPixel {
    fn new(places: Vec<[f32; 3]>) -> Self {
        let mut total = [0.0; 3];
        places.iter().for_each(|place| add(&mut total, place));
        let best = (0..places.len()).fold(0, |best, i| {
            if places[i][0] > places[best][0] {
                i
            } else {
                best
            }
        });
        Self {
            places,
            total,
            best,
        }
    }

    /// Weight and moment of some places, and the one with the largest weight.
    #[inline(always)]
    pub(super) fn sum(&self, mut bits: u64) -> ([f32; 3], usize) {
        if bits.count_ones() as usize == self.places.len() {
            return (self.total, self.best);
        }
        let (mut sum, mut best) = ([0.0; 3], bits.trailing_zeros() as usize);
        while bits != 0 {
            let place = bits.trailing_zeros() as usize;
            add(&mut sum, &self.places[place]);
            if self.places[place][0] > self.places[best][0] {
                best = place;
            }
            bits &= bits - 1;
        }
        (sum, best)
    }
}

#[inline(always)]
pub(super) fn add(sum: &mut [f32; 3], value: &[f32; 3]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value;
    }
}
