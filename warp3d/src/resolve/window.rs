//! The pixel's Gaussian over the places of the finer lattice around it.

use resample_core::point::PIXEL_SIGMA_PX;

/// Pixels on either side whose sub-pixels count: the Gaussian reaches three sigmas.
pub(super) const REACH_PX: i32 = 1;

/// Pixels of the window.
const WINDOW: usize = (2 * REACH_PX as usize + 1) * (2 * REACH_PX as usize + 1);

/// Places that are summed at once.
const GROUP: usize = 4;

/// Gaussian weights of the places of one pixel of the window.
#[derive(Clone, Debug)]
pub(super) struct WindowPixel {
    /// For each group of places, the sums over each of its subsets.
    groups: Vec<[Subset; 1 << GROUP]>,
    /// One bit for each place.
    whole: u64,
    /// The sum over all places.
    pub(super) total: Subset,
}

/// Some places of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Subset {
    /// Weight, and weighted offset along x and y.
    pub(super) sum: [f32; 3],
    /// The largest weight of a place, and that place, the first of several.
    pub(super) best: (f32, u32),
}

impl Subset {
    #[inline(always)]
    fn join(&mut self, other: &Self) {
        add(&mut self.sum, &other.sum);
        if other.best.0 > self.best.0 {
            self.best = other.best;
        }
    }
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
            let places: Vec<_> = (0..subpixels * subpixels).map(place).collect();
            WindowPixel::new(&places)
        };
        Self((0..WINDOW).map(pixel).collect())
    }
}

impl WindowPixel {
    fn new(places: &[[f32; 3]]) -> Self {
        let subset = |group: usize, bits: usize| {
            let mut subset = Subset::default();
            for place in (0..GROUP).filter(|place| bits >> place & 1 != 0) {
                let place = group * GROUP + place;
                if let Some(&sum) = places.get(place) {
                    let best = (sum[0], place as u32);
                    subset.join(&Subset { sum, best });
                }
            }
            subset
        };
        let of_group = |group: usize| {
            let mut subsets = [Subset::default(); 1 << GROUP];
            for (bits, to) in subsets.iter_mut().enumerate() {
                *to = subset(group, bits);
            }
            subsets
        };
        let mut pixel = Self {
            groups: (0..places.len().div_ceil(GROUP)).map(of_group).collect(),
            whole: u64::MAX >> (64 - places.len()),
            total: Subset::default(),
        };
        for group in &pixel.groups {
            pixel.total.join(&group[(1 << GROUP) - 1]);
        }
        pixel
    }

    /// The sum over some places, one bit each.
    #[inline(always)]
    pub(super) fn sum(&self, bits: u64) -> Subset {
        if bits == self.whole {
            return self.total;
        }
        let mut sum = Subset::default();
        for (k, group) in self.groups.iter().enumerate() {
            sum.join(&group[(bits >> (GROUP * k)) as usize & ((1 << GROUP) - 1)]);
        }
        sum
    }
}

#[inline(always)]
pub(super) fn add(sum: &mut [f32; 3], value: &[f32; 3]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value;
    }
}
