//! Pixels inside one surface: eight neighbours at a time are traced back to the reference, in f64, and looked up.
//!
//! The formulas are those of [`Patch::hit`] and [`Footprint`], written for eight pixels: with the piece's plane, the
//! homogeneous screen position is linear in the place on it, so two equations in two unknowns give the place, and their
//! inverse the footprint. Only the constants and the place subtract nearly equal numbers, and they are f64; the
//! footprint, and the weights of the samples around the place, are f32.
//!
//! [`Footprint`]: crate::resolve::colour::Footprint

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f64x8, i32x8, mask32x4};
use fearless_simd_macros::simd;
use glam::DVec2;

use super::resolver::Resolver;
use crate::project::narrow;
use crate::project::prepared::Prepared;
use crate::resolve::colour::{
    BENT_VARIANCE, EightFilters, EightWeights, FILTERS, Footprint, LEAST_VARIANCE, Lookup, NOWHERE,
    Taps, Weights, by_place, eight_axes, eight_samples, held, small_form, through,
};
use crate::surfaces::patch::Patch;
use crate::surfaces::surface::{ANTI, KINDS, NO_PATCH, Surfaces, cell_of, is_triangle};
use crate::view::layer::Row;

/// Pixels that are traced at once.
const LANES: usize = 8;

/// Pixels that are prepared together: as many as a word of flags holds.
pub(super) const RUN: usize = 64;

/// 0 to 7.
const STEPS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// One number a pixel of a run.
type Lane = [f32; RUN];

/// The piece that a run of pixels sees, and the place on it.
pub(super) struct Run {
    pieces: [u32; RUN],
    /// The pieces' planes: place x and y, disparity, slope x and y.
    planes: [Lane; 5],
    /// The finite places, one bit a pixel.
    finite: u64,
    /// Position in the reference, px.
    place: [[f64; RUN]; 2],
    /// The sample above and to the left of the place.
    base: [[i32; RUN]; 2],
    /// Camera z of the target.
    depth: Lane,
    /// Where the filter is wide: its longer axis, and the minifications along and across it, squared.
    axes: [Lane; 4],
    /// Variance of the filter along its longer axis, reference px^2.
    variance: Lane,
    /// Its number, as [`eight_samples`] has it.
    sample: [u32; RUN],
    /// Weights of four samples along x and y.
    weights: [Taps; RUN],
    /// Slopes of the weights along x, and along y times the covariance, px^2.
    turned: [Taps; RUN],
    /// Those that eight wide filters are prepared in.
    filters: EightFilters,
    /// How well the reference resolves the pixel.
    resolution: Lane,
}

impl Run {
    pub(super) fn new() -> Self {
        let zero = [0.0; RUN];
        Self {
            pieces: [NO_PATCH; RUN],
            // A pixel without a piece gets any plane in front.
            planes: [zero, zero, [1.0; RUN], zero, zero],
            finite: 0,
            place: [[0.0; RUN]; 2],
            base: [[0; RUN]; 2],
            depth: zero,
            axes: [zero; 4],
            variance: zero,
            sample: [NOWHERE; RUN],
            weights: [[0.0; 8]; RUN],
            turned: [[0.0; 8]; RUN],
            filters: EightFilters::NONE,
            resolution: zero,
        }
    }

    /// Resolves the pixels of row `y` from `first` on, the first of a word of flags, that are not at edges.
    #[inline(always)]
    pub(super) fn resolve<S: Simd>(
        &mut self,
        simd: S,
        resolver: &Resolver<'_>,
        (first, y): (usize, usize),
        row: &mut Row<'_>,
    ) {
        let present = self.gather(resolver, (first, y));
        self.finite = 0;
        for lane in (0..RUN).step_by(LANES) {
            if present >> lane & 0xff != 0 {
                let at = [(first + lane) as f64 + 0.5, y as f64 + 0.5];
                self.trace(simd, resolver, lane, at);
            }
        }
        let mut bits = present & self.finite;
        // Pixels whose filter is wide, which are taken eight together.
        let (mut wide, mut count) = ([0; FILTERS], 0);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            if self.variance[lane] < BENT_VARIANCE as f32 {
                let colour = self.bent(simd, resolver, lane);
                self.put(simd, (first, lane), colour, row);
            } else if EightFilters::can_hold(self.axes[2][lane]) {
                wide[count] = lane;
                count += 1;
                if count == FILTERS {
                    self.through(simd, resolver, (first, &wide), row);
                    count = 0;
                }
            } else {
                let colour = self.wide(simd, resolver, lane);
                self.put(simd, (first, lane), colour, row);
            }
        }
        if count > 0 {
            self.through(simd, resolver, (first, &wide[..count]), row);
        }
    }

    /// Stores the colour of the pixel `lane` of the run from `first` on.
    #[inline(always)]
    fn put<S: Simd>(
        &self,
        simd: S,
        (first, lane): (usize, usize),
        colour: f32x4<S>,
        row: &mut Row<'_>,
    ) {
        let x = first + lane;
        // A spline may overshoot below 0, where there is no light.
        let colour = colour.max(f32x4::splat(simd, 0.0));
        let colour_bits = mask32x4::from_bitmask(simd, 0b0111);
        let covered = colour_bits.select(colour, f32x4::splat(simd, 1.0));
        covered.store_slice(&mut row.rgba[x]);
        row.depth[x] = self.depth[lane];
        row.resolution[x] = self.resolution[lane];
    }

    /// Resolves up to eight pixels, `lanes` of the run from `first` on, whose filters are wide.
    #[simd]
    fn through<S: Simd>(
        &mut self,
        simd: S,
        resolver: &Resolver<'_>,
        (first, lanes): (usize, &[usize]),
        row: &mut Row<'_>,
    ) {
        let (mut at, mut axes) = ([[0.0f64; FILTERS]; 2], [[1.0f64; FILTERS]; 4]);
        for (k, &lane) in lanes.iter().enumerate() {
            for (to, from) in at.iter_mut().zip(&self.place) {
                to[k] = from[lane];
            }
            for (to, from) in axes.iter_mut().zip(&self.axes) {
                to[k] = f64::from(from[lane]);
            }
        }
        let load = |v: &[f64; FILTERS]| f64x8::simd_from(simd, *v);
        let [x, y, large, small] = [
            load(&axes[0]),
            load(&axes[1]),
            load(&axes[2]),
            load(&axes[3]),
        ];
        let at = [load(&at[0]), load(&at[1])];
        let Prepared {
            surfaces, colours, ..
        } = resolver.prepared;
        let axes = ([x, y], [large, small]);
        self.filters.prepare(simd, at, axes, surfaces.size);
        for (k, &lane) in lanes.iter().enumerate() {
            let lookup = || resolver.lookup(&Patch::new(surfaces, self.pieces[lane]));
            let colour = through(simd, (&self.filters, k), (colours, surfaces), lookup);
            self.put(simd, (first, lane), colour, row);
        }
    }

    /// Looks up the planes; which pixels there are, one bit each.
    // On its own: within the vector code it would share its registers with all of that.
    #[inline(never)]
    fn gather(&mut self, resolver: &Resolver<'_>, (first, y): (usize, usize)) -> u64 {
        let width = resolver.size[0];
        let count = RUN.min(width - first);
        let seen = &resolver.hybrid.patch[y * width + first..][..count];
        let at_edge = resolver.hybrid.at_edge.word(first, y);
        let mut present = 0;
        for (lane, &piece) in seen.iter().enumerate() {
            if piece == NO_PATCH || at_edge >> lane & 1 != 0 {
                continue;
            }
            present |= 1 << lane;
            self.pieces[lane] = piece;
            let plane = plane_of(&resolver.prepared.surfaces, piece);
            for (to, value) in self.planes.iter_mut().zip(plane) {
                to[lane] = value;
            }
        }
        present
    }

    #[inline(always)]
    fn bent<S: Simd>(&self, simd: S, resolver: &Resolver<'_>, lane: usize) -> f32x4<S> {
        let Prepared {
            surfaces, colours, ..
        } = resolver.prepared;
        let (sample, taps) = (self.sample[lane], &self.weights[lane]);
        if Lookup::is_clear(surfaces, sample) {
            let weights = Weights {
                taps,
                // Skip the rotated taps when no filter applies.
                turned: (self.variance[lane] >= LEAST_VARIANCE as f32)
                    .then_some(&self.turned[lane]),
            };
            let (samples, width) = (&colours.coefficients, surfaces.size[0]);
            let first = sample as usize - width - 1;
            let colour = weights.sum(simd, samples, first, width);
            return held(simd, colour, self.resolution[lane], (samples, first, width));
        }
        let patch = Patch::new(surfaces, self.pieces[lane]);
        let base = [0, 1].map(|axis| f64::from(self.base[axis][lane]));
        resolver
            .lookup(&patch)
            .cubic_at_rim(simd, base.into(), taps)
    }

    #[inline(always)]
    fn wide<S: Simd>(&self, simd: S, resolver: &Resolver<'_>, lane: usize) -> f32x4<S> {
        let patch = Patch::new(&resolver.prepared.surfaces, self.pieces[lane]);
        let [x, y, large, small] = [0, 1, 2, 3].map(|i| f64::from(self.axes[i][lane]));
        let footprint = Footprint::of_axes(DVec2::new(x, y), [large, small]);
        let at = DVec2::new(self.place[0][lane], self.place[1][lane]);
        resolver.lookup(&patch).wide(simd, at, &footprint)
    }

    /// Traces eight pixels from `lane` on, the first at `[x, y]` on the screen.
    #[inline(always)]
    fn trace<S: Simd>(&mut self, simd: S, resolver: &Resolver<'_>, lane: usize, [x, y]: [f64; 2]) {
        let constant = |v: f64| f64x8::splat(simd, v);
        let load = |i: usize| {
            let (low, high) = f32x8::from_slice(simd, &self.planes[i][lane..lane + LANES]).widen();
            low.combine(high)
        };
        let (place_x, place_y, disparity, slope_x, slope_y) =
            (load(0), load(1), load(2), load(3), load(4));
        let [column_x, column_y, column_one, column_d] = &resolver.columns;
        let (x, y) = (constant(x) + f64x8::from_slice(simd, &STEPS), constant(y));
        // The homogeneous screen position on each plane: origin, and what a step along x and y adds.
        let origin = |x: f64, y: f64, one: f64, d: f64| {
            let near = place_y.mul_add(constant(y), constant(one));
            disparity.mul_add(constant(d), place_x.mul_add(constant(x), near))
        };
        let (ox, oy, oz) = (
            origin(column_x.x, column_y.x, column_one.x, column_d.x),
            origin(column_x.y, column_y.y, column_one.y, column_d.y),
            origin(column_x.z, column_y.z, column_one.z, column_d.z),
        );
        let step = |c: f64, slope: f64x8<S>, d: f64| slope.mul_add(constant(d), constant(c));
        let (ax, ay, az) = (
            step(column_x.x, slope_x, column_d.x),
            step(column_x.y, slope_x, column_d.y),
            step(column_x.z, slope_x, column_d.z),
        );
        let (bx, by, bz) = (
            step(column_y.x, slope_y, column_d.x),
            step(column_y.y, slope_y, column_d.y),
            step(column_y.z, slope_y, column_d.z),
        );
        // (a - screen a.z) u + (b - screen b.z) v = screen o.z - o, in x and y.
        let (m00, m01, right_x) = (ax - x * az, bx - x * bz, x * oz - ox);
        let (m10, m11, right_y) = (ay - y * az, by - y * bz, y * oz - oy);
        let inverse = constant(1.0) / (m00 * m11 - m01 * m10);
        let u = (right_x * m11 - m01 * right_y) * inverse;
        let v = (m00 * right_y - right_x * m10) * inverse;
        let scale = v.mul_add(bz, u.mul_add(az, oz)) * inverse;
        let map = [
            narrow(m11 * scale),
            narrow(-(m10 * scale)),
            narrow(-(m01 * scale)),
            narrow(m00 * scale),
        ];
        let disparity = slope_y.mul_add(v, slope_x.mul_add(u, disparity));
        let place = [place_x + u, place_y + v];
        let (row, divisor) = resolver.warp.depth_terms();
        let depth = place[1].mul_add(constant(row[1]), constant(row[2]));
        let depth = place[0].mul_add(constant(row[0]), depth);
        let depth = disparity.mul_add(constant(row[3]), depth);
        let depth = depth / disparity.mul_add(constant(divisor[1]), constant(divisor[0]));
        narrow(depth).store_slice(&mut self.depth[lane..lane + LANES]);
        let known = place[0].is_finite() & place[1].is_finite();
        self.finite |= known.to_bitmask() << lane;
        let size = resolver.prepared.surfaces.size;
        self.weigh(simd, (lane, size), place, map);
    }

    /// The weights of the samples around eight places, seen through `map`.
    #[inline(always)]
    fn weigh<S: Simd>(
        &mut self,
        simd: S,
        (lane, size): (usize, [usize; 2]),
        place: [f64x8<S>; 2],
        map: [f32x8<S>; 4],
    ) {
        let [ax, ay, bx, by] = map;
        let area = (ax * by - ay * bx).abs().sqrt();
        let resolution = area.min(f32x8::splat(simd, 1.0));
        resolution.store_slice(&mut self.resolution[lane..lane + LANES]);
        let (variance, [xx, xy, yy]) = small_form(simd, map);
        variance.store_slice(&mut self.variance[lane..lane + LANES]);
        let bent = variance.simd_lt(f32x8::splat(simd, BENT_VARIANCE as f32));
        if !bent.all_true() {
            // Seen edge-on, a number may not fit.
            let [ax, ay, bx, by] = map;
            let most = f32x8::splat(simd, 1e9);
            let held = [
                ax.min(most).max(-most),
                ay.min(most).max(-most),
                bx.min(most).max(-most),
                by.min(most).max(-most),
            ];
            for (value, to) in eight_axes(simd, held).into_iter().zip(&mut self.axes) {
                value.store_slice(&mut to[lane..lane + LANES]);
            }
        }
        let (mut values, mut slopes) = ([variance; 8], [variance; 8]);
        let mut bases = [i32x8::splat(simd, 0); 2];
        for (axis, (at, own)) in place.into_iter().zip([xx, yy]).enumerate() {
            let corner = at - f64x8::splat(simd, 0.5);
            // A place that rounding has put just before a sample is at it: otherwise the row before the first is asked for.
            let base = (corner + f64x8::splat(simd, 1e-6)).floor();
            let t = narrow(corner - base).max(f32x8::splat(simd, 0.0));
            bases[axis] = narrow(base).to_int();
            at.store_slice(&mut self.place[axis][lane..lane + LANES]);
            bases[axis].store_slice(&mut self.base[axis][lane..lane + LANES]);
            let spline = EightWeights::new(simd, t);
            for k in 0..4 {
                values[4 * axis + k] = spline.widened(simd, k, own);
                slopes[4 * axis + k] = spline.slope[k];
            }
        }
        let samples = eight_samples(simd, bases, size);
        samples.store_slice(&mut self.sample[lane..lane + LANES]);
        let weights = &mut self.weights[lane..lane + LANES];
        for (to, taps) in weights.iter_mut().zip(by_place(values)) {
            taps.store_slice(to);
        }
        let filtered = variance.simd_ge(f32x8::splat(simd, LEAST_VARIANCE as f32));
        if filtered.any_true() {
            for along_y in &mut slopes[4..] {
                *along_y *= xy;
            }
            let turned = &mut self.turned[lane..lane + LANES];
            for (to, taps) in turned.iter_mut().zip(by_place(slopes)) {
                taps.store_slice(to);
            }
        }
    }
}

/// The plane of a piece: place x and y, disparity, slope x and y. As [`Patch::new`] has it, if from another of its corners;
/// corners that are joined are so alike that f32 subtracts them without rounding.
#[inline(always)]
fn plane_of(surfaces: &Surfaces, piece: u32) -> [f32; 5] {
    let width = surfaces.size[0];
    let cell = cell_of(piece);
    let kind = piece % KINDS;
    if !is_triangle(piece) {
        let patch = Patch::new(surfaces, piece);
        let (place, slope) = (patch.place, patch.slope);
        return [place.x, place.y, patch.disparity, slope.x, slope.y].map(|v| v as f32);
    }
    let cy = surfaces.cell_rows.row(cell);
    let cx = cell - cy * (width + 1);
    let first = (cy - 1) * width + cx - 1;
    let (above, below) = (
        &surfaces.disparity[first..first + 2],
        &surfaces.disparity[first + width..first + width + 2],
    );
    let ([a, b], [c, d]) = ([above[0], above[1]], [below[0], below[1]]);
    // Selected, not branched on: on flat ground rounding alone decides how a cell is joined.
    let (upper, anti) = (kind.is_multiple_of(2), kind >= ANTI);
    let from_b = anti & !upper;
    [
        cx as f32 - if from_b { -0.5 } else { 0.5 },
        cy as f32 - 0.5,
        if from_b { b } else { a },
        if upper { b - a } else { d - c },
        if upper != anti { d - b } else { c - a },
    ]
}
