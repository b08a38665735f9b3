//! The input for resolving a picture: the visible pieces, the reference and the map to the screen.

use glam::{DVec2, DVec3};
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::simd::Vectors;
use resample_core::{Camera, Projection};

use crate::hybrid::{How, Hybrid};
use crate::project::prepared::Prepared;
use crate::resolve::colour::Lookup;
use crate::surfaces::patch::Patch;
use crate::view::layer::{Layer, Purpose};
use crate::view::warp::Warp;

/// Resolves one picture.
pub(crate) struct Resolver<'a> {
    pub(super) hybrid: &'a Hybrid,
    pub(super) prepared: &'a Prepared,
    pub(super) warp: &'a Warp,
    /// The terms of x, y, 1 and disparity in the homogeneous screen position.
    pub(super) columns: [DVec3; 4],
    pub(super) size: [usize; 2],
    pub(super) level: Vectors,
    pub(super) weights: WindowWeights,
    /// True if surfaces end before infinity.
    pub(super) has_front: bool,
    /// The purpose of the picture.
    pub(super) purpose: Purpose,
    /// Where the reference's own pixels are, if the target is its camera.
    pub(super) home: Option<Home>,
}

impl<'a> Resolver<'a> {
    /// Everything that the pixels need.
    pub(crate) fn new(
        hybrid: &'a Hybrid,
        prepared: &'a Prepared,
        warp: &'a Warp,
        target: &Camera,
        how: How,
    ) -> Self {
        let [x, y, one] = warp.pixel_columns();
        Self {
            hybrid,
            prepared,
            warp,
            columns: [x, y, one, warp.disparity_column()],
            size: [target.width as usize, target.height as usize],
            level: how.level,
            weights: WindowWeights::new(how.subpixels),
            has_front: target.projection == Projection::Perspective,
            purpose: how.purpose,
            home: Home::new(&prepared.camera, prepared.surfaces.largest, warp),
        }
    }

    /// A lookup on the plane of `patch`.
    #[inline(always)]
    pub(super) fn lookup(&self, patch: &Patch) -> Lookup<'_> {
        Lookup {
            colours: &self.prepared.colours,
            surfaces: &self.prepared.surfaces,
            patch: *patch,
        }
    }
}

// The pixel's Gaussian over the places of the finer lattice around it.

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

// A view from the reference's own camera: known pixels come back as they are.
//
// A pixel beside unknown depth is partly covered by what is known, so anywhere else it is partly transparent. At home its
// colour is known whole. The same holds where the target is a part of the reference's picture, cut at whole pixels.

/// A reference whose samples move by no more than this on the screen is at home, px. From 0 to this the known pixels fade
/// from as they are to as they are drawn; a guess, small against what the spline resolves.
const HOME_PX: f64 = 0.02;

/// A target whose pixels are those of the reference.
pub(crate) struct Home {
    /// From a pixel of the reference to that of the target, px.
    offset: [i64; 2],
    /// How much it is at home, above 0 to 1.
    share: f32,
}

impl Home {
    /// `None` where a sample of `reference` of any disparity up to `largest` moves farther than [`HOME_PX`].
    pub(super) fn new(reference: &Camera, largest: f32, warp: &Warp) -> Option<Self> {
        let size = DVec2::new(f64::from(reference.width), f64::from(reference.height));
        let shift = |share: DVec2, disparity: f64| {
            let pos = share * size;
            warp.at(pos, disparity).pos_in_screen() - pos
        };
        let offset = shift(DVec2::splat(0.5), f64::from(largest)).round();
        let mut moved = 0.0f64;
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]] {
            for disparity in [0.0, f64::from(largest)] {
                let away = (shift(corner.into(), disparity) - offset).length();
                // Parallel rays have no place at depth 0: NaN is no home.
                moved = if away >= 0.0 {
                    moved.max(away)
                } else {
                    f64::INFINITY
                };
            }
        }
        (moved < HOME_PX).then(|| Self {
            offset: [offset.x as i64, offset.y as i64],
            share: (1.0 - moved / HOME_PX) as f32,
        })
    }

    /// Puts the known pixels of the reference into `layer`.
    pub(super) fn give_back(&self, prepared: &Prepared, width: usize, layer: &mut Layer) {
        let columns = i64::from(prepared.camera.width);
        let height = layer.rgba.len() / width;
        for at in 0..prepared.surfaces.disparity.len() {
            let z = prepared.depth(at);
            let x = at as i64 % columns + self.offset[0];
            let y = at as i64 / columns + self.offset[1];
            let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
            if !inside || !(z > 0.0) {
                continue;
            }
            let to = y as usize * width + x as usize;
            let rgb = prepared.colours.taken.get(at);
            for (found, known) in layer.rgba[to].iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                *found += self.share * (known - *found);
            }
            layer.resolution[to] += self.share * (1.0 - layer.resolution[to]);
            if let Some(mix) = layer.mixes.get_mut(to) {
                mix.purity += self.share * (1.0 - mix.purity);
            }
            if layer.depth[to].is_infinite() {
                layer.depth[to] = z;
            }
        }
    }
}
