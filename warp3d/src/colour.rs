//! The colour of a surface at a place in the reference, filtered as the new screen asks.
//!
//! Where the screen magnifies, the cubic spline through the reference's samples, which is sharp and adds no variance.
//! Where it minifies m times, the screen's Gaussian less what the reference's own pixels already blur:
//! sigma^2 (m^2 - 1) in reference px^2, along each axis of the footprint. Small variances are taken by a five-point rule
//! on cubic lookups, large ones by a Gaussian sum over the samples, and in between by a blend of both, so that one
//! family runs through all scales. Only samples on the same surface count.

use glam::{DMat2, DVec2};
use resample_core::point::PIXEL_SIGMA_PX;

use crate::Reference;
use crate::patch::{Hit, Patch};
use crate::surface::Surfaces;

/// From this variance on (reference px^2) a Gaussian sum over the samples themselves is a filter: its ripple,
/// 2 exp(-2 pi^2 v), is 0.5 % and is normalised away.
const SAMPLED_VARIANCE: f64 = 0.3;

/// Gaussians are cut at this many sigmas; the rest is normalised.
const REACH_SIGMAS: f64 = 3.0;

/// What cutting takes from the variance of a Gaussian of two dimensions, q exp(-q) / (1 - exp(-q)) with
/// q = REACH_SIGMAS^2 / 2, given back by widening it before.
const CUT_WIDENS_ELLIPSE: f64 = 1.0 / (1.0 - 0.050_6);

/// The same in one dimension: 2 t phi(t) / (2 Phi(t) - 1) with t = REACH_SIGMAS.
const CUT_WIDENS_LINE: f64 = 1.0 / (1.0 - 0.026_7);

/// Largest sigma along an axis of a footprint, reference px: bounds the cost where a surface is seen nearly edge-on.
const MAX_SIGMA_PX: f64 = 32.0;

/// What colours are looked up in.
#[derive(Clone, Debug)]
pub(crate) struct Colours {
    /// Linear red, green, blue, and one unused value, so that a sample is one vector.
    pub(crate) samples: Vec<[f32; 4]>,
    /// Coefficients of the cubic spline through them.
    pub(crate) coefficients: Vec<[f32; 4]>,
}

/// A lookup: where, on which plane, on which surfaces.
#[derive(Clone, Copy)]
pub(crate) struct Lookup<'a> {
    /// The samples' colours.
    pub(crate) colours: &'a Colours,
    /// Their surfaces.
    pub(crate) surfaces: &'a Surfaces,
    /// The plane on which samples count.
    pub(crate) patch: Patch,
}

/// Axes of the filter in the reference: unit directions with their variances, px^2, the larger first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    along: DVec2,
    across: DVec2,
    variance: [f64; 2],
}

impl Footprint {
    /// The screen's Gaussian in the reference, less the reference's own.
    pub(crate) fn new(reference_from_screen: DMat2) -> Self {
        let (a, b) = (reference_from_screen.x_axis, reference_from_screen.y_axis);
        let [xx, xy, yy] = [a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y];
        let half_trace = 0.5 * (xx + yy);
        let spread = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        let (large, small) = (half_trace + spread, half_trace - spread);
        // The longer of the two equivalent forms of the eigenvector.
        let along = if xx >= yy { DVec2::new(large - yy, xy) } else { DVec2::new(xy, large - xx) };
        let along = along.try_normalize().unwrap_or(DVec2::X);
        let variance = [large, small].map(|minification2| {
            let sigma2 = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX;
            (sigma2 * (minification2 - 1.0)).clamp(0.0, MAX_SIGMA_PX * MAX_SIGMA_PX)
        });
        Self { along, across: along.perp(), variance }
    }
}

impl Lookup<'_> {
    /// The filtered colour at a hit.
    pub(crate) fn filtered(&self, hit: &Hit) -> [f32; 3] {
        let footprint = Footprint::new(hit.reference_from_screen);
        let [large, small] = footprint.variance;
        let at = hit.pos_in_reference;
        if large < 1e-3 {
            return first_three(self.cubic(at));
        }
        if large < SAMPLED_VARIANCE {
            return first_three(self.five_points(at, &footprint));
        }
        let blend = (small / SAMPLED_VARIANCE).min(1.0) as f32;
        let mut sum = [0.0; 4];
        if blend < 1.0 {
            add(&mut sum, self.line(at, footprint.along, large), 1.0 - blend);
        }
        if blend > 0.0 {
            add(&mut sum, self.ellipse(at, &footprint), blend);
        }
        first_three(sum)
    }

    /// Variances below [`SAMPLED_VARIANCE`] along both axes.
    fn five_points(&self, at: DVec2, footprint: &Footprint) -> [f32; 4] {
        // sqrt(3 v) at the largest v: the three-point Gauss rule there, a second difference below.
        let step = (3.0 * SAMPLED_VARIANCE).sqrt();
        let sides = footprint.variance.map(|v| (0.5 * v / (step * step)) as f32);
        let mut sum = [0.0; 4];
        add(&mut sum, self.cubic(at), 1.0 - 2.0 * (sides[0] + sides[1]));
        for (direction, weight) in [(footprint.along, sides[0]), (footprint.across, sides[1])] {
            if weight > 0.0 {
                add(&mut sum, self.cubic(at + step * direction), weight);
                add(&mut sum, self.cubic(at - step * direction), weight);
            }
        }
        sum
    }

    /// A Gaussian along one direction, of cubic lookups.
    fn line(&self, at: DVec2, along: DVec2, variance: f64) -> [f32; 4] {
        let step = (3.0 * SAMPLED_VARIANCE).sqrt();
        let variance = CUT_WIDENS_LINE * variance;
        let count = (REACH_SIGMAS * variance.sqrt() / step).floor() as i32;
        let weight = |i: i32| (-0.5 * (f64::from(i) * step).powi(2) / variance).exp() as f32;
        let total: f32 = (-count..=count).map(weight).sum();
        let mut sum = [0.0; 4];
        for i in -count..=count {
            add(&mut sum, self.cubic(at + f64::from(i) * step * along), weight(i) / total);
        }
        sum
    }

    /// A Gaussian sum over the samples.
    fn ellipse(&self, at: DVec2, footprint: &Footprint) -> [f32; 4] {
        let [large, small] = footprint.variance.map(|v| CUT_WIDENS_ELLIPSE * v.max(SAMPLED_VARIANCE));
        let (e, f) = (footprint.along, footprint.across);
        let [xx, xy, yy] = [
            large * e.x * e.x + small * f.x * f.x,
            large * e.x * e.y + small * f.x * f.y,
            large * e.y * e.y + small * f.y * f.y,
        ];
        let reach = DVec2::new(xx.sqrt(), yy.sqrt()) * REACH_SIGMAS;
        let scale = -0.5 / (large * small);
        let [width, height] = self.surfaces.size;
        let range = |centre: f64, reach: f64, size: usize| {
            let first = (centre - 0.5 - reach).ceil().max(0.0) as usize;
            let last = (centre - 0.5 + reach).floor().min(size as f64 - 1.0);
            first..if last < 0.0 { first } else { (last as usize + 1).max(first) }
        };
        let (columns, rows) = (range(at.x, reach.x, width), range(at.y, reach.y, height));
        let clear = self.clear_around(at, reach.x.max(reach.y).ceil() as usize);
        let mut sum = [0.0; 4];
        let mut total = 0.0;
        for y in rows {
            let dy = y as f64 + 0.5 - at.y;
            for x in columns.clone() {
                let dx = x as f64 + 0.5 - at.x;
                let exponent = scale * (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy);
                let index = y * width + x;
                if exponent < -0.5 * REACH_SIGMAS * REACH_SIGMAS || !(clear || self.counts(x, y, index)) {
                    continue;
                }
                let weight = (exponent as f32).exp();
                add(&mut sum, self.colours.samples[index], weight);
                total += weight;
            }
        }
        if total > 0.0 { sum.map(|v| v / total) } else { self.cubic(at) }
    }

    /// The cubic reconstruction at a place.
    fn cubic(&self, at: DVec2) -> [f32; 4] {
        let corner = at - 0.5;
        // A place that rounding has put just before a sample is at it: otherwise the row before the first is asked for.
        let base = (corner + 1e-6).floor();
        let (wx, wy) = (spline((corner.x - base.x).max(0.0)), spline((corner.y - base.y).max(0.0)));
        let [width, height] = self.surfaces.size;
        // Only where four rows and columns exist, and no cut is among them.
        let inside =
            base.x >= 1.0 && base.y >= 1.0 && base.x + 2.0 < width as f64 && base.y + 2.0 < height as f64;
        if inside {
            let (x, y) = (base.x as usize, base.y as usize);
            if self.surfaces.clearance[y * width + x] >= 3 {
                return self.cubic_inside(x, y, wx, wy);
            }
        }
        self.cubic_at_rim(base, wx, wy)
    }

    fn cubic_inside(&self, x: usize, y: usize, wx: [f32; 4], wy: [f32; 4]) -> [f32; 4] {
        let width = self.surfaces.size[0];
        let mut sum = [0.0; 4];
        for (row, w) in wy.into_iter().enumerate() {
            let first = (y + row - 1) * width + x - 1;
            let mut along = [0.0; 4];
            for (sample, w) in self.colours.coefficients[first..first + 4].iter().zip(wx) {
                add(&mut along, *sample, w);
            }
            add(&mut sum, along, w);
        }
        sum
    }

    /// Samples that are missing or on another surface are continued from their own.
    fn cubic_at_rim(&self, base: DVec2, wx: [f32; 4], wy: [f32; 4]) -> [f32; 4] {
        let [width, height] = self.surfaces.size;
        let tap = |dx: i64, dy: i64| {
            let (x, y) = (base.x as i64 + dx - 1, base.y as i64 + dy - 1);
            let inside = x >= 0 && y >= 0 && x < width as i64 && y < height as i64;
            let index = (y * width as i64 + x) as usize;
            (inside && self.counts(x as usize, y as usize, index)).then(|| self.colours.coefficients[index])
        };
        let rows =
            [0, 1, 2, 3].map(|dy| continued([0, 1, 2, 3].map(|dx| tap(dx, dy))).map(|row| weighted(row, wx)));
        match continued(rows) {
            Some(column) => weighted(column, wy),
            None => self.nearest(base),
        }
    }

    /// The colour of the patch's own sample, where nothing else is near.
    fn nearest(&self, base: DVec2) -> [f32; 4] {
        let [width, height] = self.surfaces.size;
        let clamp = |v: f64, size: usize| v.clamp(0.0, size as f64 - 1.0) as usize;
        let place = if base.distance(self.patch.place) < 4.0 { base } else { self.patch.place - 0.5 };
        let near = self.surfaces_index(clamp(place.x, width), clamp(place.y, height));
        let own = self
            .surfaces_index(clamp(self.patch.place.x - 0.5, width), clamp(self.patch.place.y - 0.5, height));
        let known = |i: usize| !self.surfaces.disparity[i].is_nan();
        self.colours.samples[if known(own) { own } else { near }]
    }

    fn surfaces_index(&self, x: usize, y: usize) -> usize {
        y * self.surfaces.size[0] + x
    }

    /// Whether no cut is within `reach` samples.
    fn clear_around(&self, at: DVec2, reach: usize) -> bool {
        let [width, height] = self.surfaces.size;
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width as f64 && at.y < height as f64;
        inside && usize::from(self.surfaces.clearance[at.y as usize * width + at.x as usize]) > reach + 1
    }

    /// Whether a sample lies on the patch's plane, as far from the patch as it is.
    fn counts(&self, x: usize, y: usize, index: usize) -> bool {
        let offset = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.patch.place;
        let expected = self.patch.disparity + self.patch.slope.dot(offset);
        let found = f64::from(self.surfaces.disparity[index]);
        let allowed = f64::from(self.surfaces.tolerance) * (2.0 + offset.abs().max_element());
        (found - expected).abs() <= allowed * found.abs()
    }
}

/// The reference's picture at a place, across all surfaces: the cubic of Keys (1981), which needs no coefficients.
pub(crate) fn as_taken(reference: &Reference, pos_in_reference: DVec2) -> [f32; 3] {
    let corner = pos_in_reference - 0.5;
    let base = corner.floor();
    let (wx, wy) = (keys(corner.x - base.x), keys(corner.y - base.y));
    let size = [reference.camera.width, reference.camera.height].map(i64::from);
    let mut sum = [0.0; 3];
    for (dy, wy) in (-1..).zip(wy) {
        for (dx, wx) in (-1..).zip(wx) {
            let x = (base.x as i64 + dx).clamp(0, size[0] - 1);
            let y = (base.y as i64 + dy).clamp(0, size[1] - 1);
            let sample = reference.colour[(y * size[0] + x) as usize];
            sum = std::array::from_fn(|c| sum[c] + wx * wy * sample[c]);
        }
    }
    sum.map(|v| v.max(0.0))
}

/// Weights of four samples around a place `t` past the second (Keys 1981, a = -1/2).
fn keys(t: f64) -> [f32; 4] {
    let t = t as f32;
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// Missing taps of four, continued from the others; `None` if all are missing.
fn continued(taps: [Option<[f32; 4]>; 4]) -> Option<[[f32; 4]; 4]> {
    // Beyond a natural end the spline goes on straight.
    let beyond = |a: [f32; 4], b: [f32; 4]| std::array::from_fn(|c| 2.0 * a[c] - b[c]);
    let inner = |here: usize, next: usize, after: usize, other: usize| {
        let straight = || Some(beyond(taps[next]?, taps[after]?));
        taps[here].or_else(straight).or(taps[next]).or(taps[other]).or(taps[after])
    };
    let inner = [inner(1, 2, 3, 0)?, inner(2, 1, 0, 3)?];
    let first = taps[0].unwrap_or_else(|| beyond(inner[0], inner[1]));
    let last = taps[3].unwrap_or_else(|| beyond(inner[1], inner[0]));
    Some([first, inner[0], inner[1], last])
}

fn weighted(taps: [[f32; 4]; 4], weights: [f32; 4]) -> [f32; 4] {
    let mut sum = [0.0; 4];
    for (tap, weight) in taps.into_iter().zip(weights) {
        add(&mut sum, tap, weight);
    }
    sum
}

fn add(sum: &mut [f32; 4], value: [f32; 4], weight: f32) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += weight * v;
    }
}

/// The colour; a spline may overshoot below 0, where there is no light.
fn first_three([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r.max(0.0), g.max(0.0), b.max(0.0)]
}

/// Weights of the cubic B-spline for four coefficients around a place `t` past the second.
fn spline(t: f64) -> [f32; 4] {
    let t = t as f32;
    let (t2, t3) = (t * t, t * t * t);
    let s = 1.0 - t;
    let sixth = 1.0 / 6.0;
    [
        sixth * s * s * s,
        sixth * (3.0 * t3 - 6.0 * t2 + 4.0),
        sixth * (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0),
        sixth * t3,
    ]
}
