//! Pixels inside one surface: four neighbours at a time are traced back to the reference, in f64, and looked up.
//!
//! The formulas are those of [`Patch::hit`] and [`Footprint`], written for four pixels: with the piece's plane, the
//! homogeneous screen position is linear in the place on it, so two equations in two unknowns give the place, and their
//! inverse the footprint. Only the constants subtract nearly equal numbers, and they are f64.
//!
//! [`Footprint`]: crate::colour::Footprint

use fearless_simd::f64x4;
use fearless_simd::prelude::*;
use glam::{DMat2, DVec2};
use resample_core::point::PIXEL_SIGMA_PX;

use super::resolver::{Resolver, Row};
use crate::colour::{BENT_VARIANCE, LEAST_VARIANCE, first_three};
use crate::patch::{Hit, Patch};
use crate::piece::NO_PATCH;

/// Pixels that are traced at once.
const LANES: usize = 4;

/// Pixels that are prepared together: their planes and hits stay in the nearest cache, and are written long before they
/// are read as vectors.
pub(super) const RUN: usize = 64;

/// 0 to 3.
const STEPS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0];

/// One number a pixel of a run.
type Lane = [f64; RUN];

/// What a run of pixels sees, and where.
#[derive(Clone)]
pub(super) struct Run {
    patches: [u32; RUN],
    /// The pieces' planes: place x and y, disparity, slope x and y.
    planes: [Lane; 5],
    /// Position in the reference, px; disparity; camera z of the target.
    x: Lane,
    y: Lane,
    disparity: Lane,
    depth: Lane,
    /// Reference px per screen px, by columns.
    map: [Lane; 4],
    /// Variance of the filter along its longer axis, and its form (xx, xy, yy), reference px^2.
    variance: Lane,
    form: [Lane; 3],
    /// How well the reference resolves the pixel.
    resolution: Lane,
}

impl Run {
    pub(super) fn new() -> Self {
        let zero = [0.0; RUN];
        Self {
            patches: [NO_PATCH; RUN],
            // A pixel without a piece gets any plane in front.
            planes: [zero, zero, [1.0; RUN], zero, zero],
            x: zero,
            y: zero,
            disparity: zero,
            depth: zero,
            map: [zero; 4],
            variance: zero,
            form: [zero; 3],
            resolution: zero,
        }
    }

    /// Resolves the pixels of row `y` from `first` on that are not at edges.
    #[inline(always)]
    pub(super) fn resolve<S: Simd>(
        &mut self,
        simd: S,
        resolver: &Resolver<'_>,
        (first, y): (usize, usize),
        row: &mut Row<'_>,
    ) {
        if !self.gather(resolver, (first, y)) {
            return;
        }
        for lane in (0..RUN).step_by(LANES) {
            if self.patches[lane..lane + LANES]
                .iter()
                .any(|&patch| patch != NO_PATCH)
            {
                self.hit(
                    simd,
                    resolver,
                    lane,
                    [(first + lane) as f64 + 0.5, y as f64 + 0.5],
                );
            }
        }
        for lane in (0..RUN).filter(|&lane| self.patches[lane] != NO_PATCH) {
            if !(self.x[lane].is_finite() && self.y[lane].is_finite()) {
                continue;
            }
            let rgb = self.colour(simd, resolver, lane);
            let x = first + lane;
            row.rgba[x] = [rgb[0], rgb[1], rgb[2], 1.0];
            row.depth[x] = self.depth[lane] as f32;
            row.resolution[x] = self.resolution[lane] as f32;
        }
    }

    /// Looks up the planes; whether there is one.
    #[inline(always)]
    fn gather(&mut self, resolver: &Resolver<'_>, (first, y): (usize, usize)) -> bool {
        let row = y * resolver.size[0];
        let mut any = false;
        for (lane, patch) in self.patches.iter_mut().enumerate() {
            let at = row + first + lane;
            let inside =
                first + lane < resolver.size[0] && !resolver.hybrid.at_edge.get(first + lane, y);
            *patch = if inside {
                resolver.hybrid.patch[at]
            } else {
                NO_PATCH
            };
            if *patch == NO_PATCH {
                continue;
            }
            any = true;
            let piece = Patch::new(&resolver.prepared.surfaces, *patch);
            self.planes[0][lane] = piece.place.x;
            self.planes[1][lane] = piece.place.y;
            self.planes[2][lane] = piece.disparity;
            self.planes[3][lane] = piece.slope.x;
            self.planes[4][lane] = piece.slope.y;
        }
        any
    }

    #[inline(always)]
    fn colour<S: Simd>(&self, simd: S, resolver: &Resolver<'_>, lane: usize) -> [f32; 3] {
        let plane = |i: usize| self.planes[i][lane];
        let patch = Patch {
            place: DVec2::new(plane(0), plane(1)),
            disparity: plane(2),
            slope: DVec2::new(plane(3), plane(4)),
        };
        let lookup = resolver.lookup(&patch);
        let at = DVec2::new(self.x[lane], self.y[lane]);
        if self.variance[lane] < BENT_VARIANCE {
            let form = [
                self.form[0][lane] as f32,
                self.form[1][lane] as f32,
                self.form[2][lane] as f32,
            ];
            return first_three(lookup.bent(simd, at, form));
        }
        let column = |i: usize| DVec2::new(self.map[i][lane], self.map[i + 1][lane]);
        let reference_from_screen = DMat2::from_cols(column(0), column(2));
        let hit = Hit {
            pos_in_reference: at,
            reference_from_screen,
            disparity: self.disparity[lane],
        };
        lookup.filtered(simd, &hit)
    }

    /// Traces four pixels from `lane` on, the first at `[x, y]` on the screen.
    #[inline(always)]
    fn hit<S: Simd>(&mut self, simd: S, resolver: &Resolver<'_>, lane: usize, [x, y]: [f64; 2]) {
        let constant = |v: f64| f64x4::splat(simd, v);
        let load = |i: usize| f64x4::from_slice(simd, &self.planes[i][lane..lane + LANES]);
        let (place_x, place_y, disparity, slope_x, slope_y) =
            (load(0), load(1), load(2), load(3), load(4));
        let [column_x, column_y, column_one, column_d] = &resolver.columns;
        let (x, y) = (constant(x) + f64x4::from_slice(simd, &STEPS), constant(y));
        // The homogeneous screen position on each plane: origin, and what a step along x and y adds.
        let origin = |x: f64, y: f64, one: f64, d: f64| {
            constant(x) * place_x + constant(y) * place_y + constant(one) + constant(d) * disparity
        };
        let (ox, oy, oz) = (
            origin(column_x.x, column_y.x, column_one.x, column_d.x),
            origin(column_x.y, column_y.y, column_one.y, column_d.y),
            origin(column_x.z, column_y.z, column_one.z, column_d.z),
        );
        let step = |c: f64, slope: f64x4<S>, d: f64| constant(c) + slope * constant(d);
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
        let divisor = oz + u * az + v * bz;
        let scale = divisor * inverse;
        let map = [m11 * scale, -(m10 * scale), -(m01 * scale), m00 * scale];
        let disparity = disparity + slope_x * u + slope_y * v;
        let (x, y) = (place_x + u, place_y + v);
        let (depth_row, depth_divisor) = resolver.warp.depth_terms();
        let depth = constant(depth_row[0]) * x
            + constant(depth_row[1]) * y
            + constant(depth_row[2])
            + constant(depth_row[3]) * disparity;
        let depth = depth / (constant(depth_divisor[0]) + constant(depth_divisor[1]) * disparity);
        let area = (map[0] * map[3] - map[1] * map[2]).abs();
        let (variance, form) = filter(simd, map);
        let store = |value: f64x4<S>, to: &mut Lane| value.store_slice(&mut to[lane..lane + LANES]);
        store(x, &mut self.x);
        store(y, &mut self.y);
        store(disparity, &mut self.disparity);
        store(depth, &mut self.depth);
        store(variance, &mut self.variance);
        store(area.sqrt().min(constant(1.0)), &mut self.resolution);
        for (value, to) in map.into_iter().zip(&mut self.map) {
            store(value, to);
        }
        for (value, to) in form.into_iter().zip(&mut self.form) {
            store(value, to);
        }
    }
}

/// Variance along the longer axis of the footprint, and the form of the filter: the positive part of
/// sigma^2 (J J^T - 1).
#[inline(always)]
fn filter<S: Simd>(simd: S, map: [f64x4<S>; 4]) -> (f64x4<S>, [f64x4<S>; 3]) {
    let constant = |v: f64| f64x4::splat(simd, v);
    let (zero, one) = (constant(0.0), constant(1.0));
    let [ax, ay, bx, by] = map;
    let (xx, xy, yy) = (ax * ax + bx * bx, ax * ay + bx * by, ay * ay + by * by);
    let half_trace = constant(0.5) * (xx + yy);
    let difference = constant(0.5) * (xx - yy);
    let spread = (difference * difference + xy * xy).sqrt();
    let (large, small) = (half_trace + spread, half_trace - spread);
    let sigma2 = constant(PIXEL_SIGMA_PX * PIXEL_SIGMA_PX);
    let variance = |minification2: f64x4<S>| (sigma2 * (minification2 - one)).max(zero);
    let (along, across) = (variance(large), variance(small));
    // The projection on the longer axis is (J J^T - small) / (large - small); without one, both are the same.
    let gap = large - small;
    let round = gap.simd_le(constant(1e-9));
    let share = round.select(zero, (along - across) / gap);
    let wanted = along.simd_ge(constant(LEAST_VARIANCE));
    let form = |value: f64x4<S>, on_axis: f64x4<S>| wanted.select(on_axis + share * value, zero);
    (
        along,
        [
            form(xx - small, across),
            form(xy, zero),
            form(yy - small, across),
        ],
    )
}
