//! The surfaces that a pixel near an edge sees, weighted by the pixel's Gaussian.

use resample_core::point::PIXEL_SIGMA_PX;

use super::Resolver;
use crate::bands::BAND_ROWS;
use crate::hybrid::{NO_SLOT, SlotPart, one_surface};
use crate::patch::{Patch, share_a_corner};

/// Pixels on either side whose sub-pixels count: the Gaussian reaches three sigmas.
const REACH_PX: i32 = 1;

/// Pixels of the window.
const WINDOW: usize = (2 * REACH_PX as usize + 1) * (2 * REACH_PX as usize + 1);

/// One surface as a pixel sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// The piece nearest to the pixel's centre stands for the surface.
    pub(super) patch: Patch,
    id: u32,
    /// Its share of the pixel's Gaussian.
    pub(super) weight: f32,
    /// Weighted sum of the places, px from the pixel's centre.
    pub(super) moment: [f32; 2],
    /// Largest weight of one place so far.
    best: f32,
    /// Where that place is: its pixel's slot in the window, and its number.
    best_place: [usize; 2],
}

/// The surfaces that a pixel sees.
pub(super) struct Parts {
    /// The surfaces, in no particular order.
    pub(super) list: Vec<Part>,
    /// Weight of all places inside the picture, and their weighted sum, px.
    pub(super) window: [f32; 3],
}

/// Gaussian weights of the places of one pixel of the window.
#[derive(Clone, Debug)]
struct WindowPixel {
    /// Weight, and weighted offset along x and y, of each place.
    places: Vec<[f32; 3]>,
    /// Their sums.
    total: [f32; 3],
    /// The place with the largest weight.
    best: usize,
}

/// Gaussian weights of the places of a window.
#[derive(Clone, Debug)]
pub(super) struct WindowWeights(Vec<WindowPixel>);

impl WindowWeights {
    /// For `subpixels` places along a pixel's side.
    pub(super) fn new(subpixels: usize) -> Self {
        let side = 2 * REACH_PX as usize + 1;
        let offset = |i: usize| (i as f64 + 0.5) / subpixels as f64 - f64::from(REACH_PX) - 0.5;
        let weight = |i: usize| (-0.5 * (offset(i) / PIXEL_SIGMA_PX).powi(2)).exp();
        let sum: f64 = (0..side * subpixels).map(weight).sum();
        let pixel = |k: usize| {
            let place = |p: usize| {
                let (i, j) = (k % side * subpixels + p % subpixels, k / side * subpixels + p / subpixels);
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
        let best = (0..places.len()).fold(0, |best, i| if places[i][0] > places[best][0] { i } else { best });
        Self { places, total, best }
    }

    /// Weight and moment of some places, and the one with the largest weight.
    #[inline(always)]
    fn sum(&self, mut bits: u64) -> ([f32; 3], usize) {
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

impl Resolver<'_> {
    /// The surfaces that the places around a pixel see.
    pub(super) fn parts(&self, x: usize, y: usize) -> Parts {
        let mut parts = Parts { list: Vec::with_capacity(4), window: [0.0; 3] };
        for (k, pixel) in self.weights.0.iter().enumerate() {
            let (dx, dy) = (k as i32 % 3 - REACH_PX, k as i32 / 3 - REACH_PX);
            let Some((band, slot)) = self.slot(x as i32 + dx, y as i32 + dy) else { continue };
            add(&mut parts.window, &pixel.total);
            for part in self.hybrid.parts[band].of_slot(slot) {
                self.add_part(&mut parts.list, part, pixel, [band, slot]);
            }
        }
        for part in &mut parts.list {
            let [band, place] = part.best_place;
            part.id = self.hybrid.fine[band][place].patch;
            part.patch = Patch::new(&self.prepared.surfaces, part.id);
        }
        parts
    }

    #[inline(always)]
    fn add_part(&self, list: &mut Vec<Part>, part: &SlotPart, pixel: &WindowPixel, [band, slot]: [usize; 2]) {
        let surfaces = &self.prepared.surfaces;
        let ([weight, x, y], best) = pixel.sum(part.places);
        let best_place = [band, slot * pixel.places.len() + best];
        let found = list.iter_mut().find(|p| {
            share_a_corner(surfaces, p.id, part.id) || one_surface(&p.patch, &part.patch, surfaces.tolerance)
        });
        match found {
            Some(p) => {
                p.weight += weight;
                p.moment = [p.moment[0] + x, p.moment[1] + y];
                if pixel.places[best][0] > p.best {
                    (p.best, p.best_place) = (pixel.places[best][0], best_place);
                    (p.id, p.patch) = (part.id, part.patch);
                }
            }
            None => list.push(Part {
                patch: part.patch,
                id: part.id,
                weight,
                moment: [x, y],
                best: pixel.places[best][0],
                best_place,
            }),
        }
    }

    /// Band and slot of a pixel; `None` outside the picture.
    #[inline(always)]
    fn slot(&self, x: i32, y: i32) -> Option<(usize, usize)> {
        let [width, height] = self.size;
        if x < 0 || y < 0 || x >= width as i32 || y >= height as i32 {
            return None;
        }
        let slot = self.hybrid.slot[y as usize * width + x as usize];
        (slot != NO_SLOT).then_some((y as usize / BAND_ROWS, slot as usize))
    }
}

#[inline(always)]
fn add(sum: &mut [f32; 3], value: &[f32; 3]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value;
    }
}
