//! Where on the screen segments of cells lie at most, from the box around their samples: columns, rows and disparities.
//!
//! Screen x, screen y and nearness are quotients of linear functions of these, so that in front of the eye they are
//! largest and least at corners of the box. Where a corner is not in front, each sample is asked.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, mask64x8};
use fearless_simd_macros::simd;

use crate::project::warped::{Bounds, LANES, SEGMENT, Terms, eight_of, narrow};
use crate::surfaces::surface::{Cell, Surfaces};
use crate::view::layer::RowRange;

/// Screen positions are rounded to f32: by less than this up to 2^18 px.
const ROUNDED_PX: f32 = 1.0 / 64.0;

/// Least and greatest disparity of the corners of joined cells in a segment of the row `cy` from cell `first` on.
pub(crate) fn range_of(surfaces: &Surfaces, cy: usize, [first, end]: [usize; 2]) -> [f32; 2] {
    let width = surfaces.size[0];
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for cx in first..end {
        let cell = surfaces.cells[cy * (width + 1) + cx];
        if matches!(cell, Cell::MainDiagonal | Cell::AntiDiagonal) {
            let above = (cy - 1) * width + cx - 1;
            for corner in [above, above + 1, above + width, above + width + 1] {
                let disparity = surfaces.disparity[corner];
                range = [range[0].min(disparity), range[1].max(disparity)];
            }
        }
    }
    range
}

/// Screen columns and rows that the joined cells of each segment of the row `cy` of cells touch at most, from the
/// [`range_of`] each.
#[simd]
pub(crate) fn extents<S: Simd>(
    simd: S,
    terms: &Terms,
    surfaces: &Surfaces,
    ranges: &[[f32; 2]],
    cy: usize,
    to: &mut [[RowRange; 2]],
) {
    let per_row = to.len();
    for first in (0..per_row).step_by(LANES) {
        let count = LANES.min(per_row - first);
        let ranges = &ranges[first..first + count];
        if ranges.iter().all(|[least, most]| least > most) {
            to[first..first + count].fill([RowRange::EMPTY; 2]);
            continue;
        }
        let found = eight_extents(simd, terms, surfaces.size[0], [first, cy], ranges);
        for (i, extent) in to[first..first + count].iter_mut().enumerate() {
            let is_empty = ranges[i][0] > ranges[i][1];
            *extent = match (is_empty, found.in_front >> i & 1 != 0) {
                (true, _) => [RowRange::EMPTY; 2],
                (false, true) => found.lane(i),
                (false, false) => by_samples(simd, terms, surfaces, [first + i, cy]),
            };
        }
    }
}

/// Eight extents.
struct EightExtents<S: Simd> {
    low: [f32x8<S>; 2],
    high: [f32x8<S>; 2],
    /// Those that are in front as a whole, one bit each.
    in_front: u64,
}

impl<S: Simd> EightExtents<S> {
    #[inline(always)]
    fn lane(&self, lane: usize) -> [RowRange; 2] {
        [0, 1].map(|axis| RowRange {
            low: self.low[axis][lane] - ROUNDED_PX,
            high: self.high[axis][lane] + ROUNDED_PX,
        })
    }
}

/// Eight segments of the row `cy` of cells from segment `first` on.
#[inline(always)]
fn eight_extents<S: Simd>(
    simd: S,
    terms: &Terms,
    width: usize,
    [first, cy]: [usize; 2],
    ranges: &[[f32; 2]],
) -> EightExtents<S> {
    let (mut columns, mut disparities) = ([[0.0f64; LANES]; 2], [[1.0f64; LANES]; 2]);
    for (i, range) in ranges
        .iter()
        .enumerate()
        .filter(|(_, [least, most])| least <= most)
    {
        let cell = (first + i) * SEGMENT;
        // Cells lie between the centres of samples.
        columns[0][i] = cell as f64 - 0.5;
        columns[1][i] = (cell + SEGMENT).min(width) as f64 - 0.5;
        for k in 0..2 {
            disparities[k][i] = f64::from(range[k]);
        }
    }
    let mut low = [f32x8::splat(simd, f32::INFINITY); 2];
    let mut high = [f32x8::splat(simd, f32::NEG_INFINITY); 2];
    let mut in_front = mask64x8::splat(simd, true);
    for corner in 0..8 {
        let at = [
            f64x8::simd_from(simd, columns[corner & 1]),
            f64x8::splat(simd, (cy + (corner >> 1 & 1)) as f64 - 0.5),
            f64x8::simd_from(simd, disparities[corner >> 2]),
        ];
        let (place, is_in_front) = terms.corner(simd, at);
        in_front &= is_in_front;
        for axis in 0..2 {
            low[axis] = low[axis].min(narrow(place[axis]));
            high[axis] = high[axis].max(narrow(place[axis]));
        }
    }
    EightExtents {
        low,
        high,
        in_front: in_front.to_bitmask(),
    }
}

/// Screen columns and rows of the samples that are in front, of those around segment `block` of the row `cy` of cells.
#[simd]
fn by_samples<S: Simd>(
    simd: S,
    terms: &Terms,
    surfaces: &Surfaces,
    [block, cy]: [usize; 2],
) -> [RowRange; 2] {
    let width = surfaces.size[0];
    let mut bounds = Bounds::new(simd);
    let first = (block * SEGMENT).saturating_sub(LANES);
    for y in [cy - 1, cy] {
        let row = &surfaces.disparity[y * width..(y + 1) * width];
        for first in (first..((block + 1) * SEGMENT).min(width)).step_by(LANES) {
            let [x, y, _] = terms.warped(simd, [first, y], eight_of(simd, row, first));
            let [x, y] = [narrow(x), narrow(y)];
            // NaN is no x of a sample in front.
            bounds.include([x, y], x.simd_eq(x));
        }
    }
    bounds.ranges()
}

/// Returns true if all samples of a reference with disparities up to the largest are in front.
#[simd]
pub(crate) fn all_in_front<S: Simd>(simd: S, terms: &Terms, surfaces: &Surfaces) -> bool {
    let [width, height] = surfaces.size.map(|n| n as f64);
    let largest = f64::from(surfaces.largest);
    let at = [
        f64x8::simd_from(simd, [0.0, width, 0.0, width, 0.0, width, 0.0, width]),
        f64x8::simd_from(simd, [0.0, 0.0, height, height, 0.0, 0.0, height, height]),
        f64x8::simd_from(
            simd,
            [0.0, 0.0, 0.0, 0.0, largest, largest, largest, largest],
        ),
    ];
    terms.corner(simd, at).1.all_true()
}

/// Number of samples of row `y` that are in front.
#[simd]
pub(crate) fn count_in_front<S: Simd>(
    simd: S,
    terms: &Terms,
    surfaces: &Surfaces,
    y: usize,
) -> u64 {
    let width = surfaces.size[0];
    let row = &surfaces.disparity[y * width..(y + 1) * width];
    let mut count = 0;
    for first in (0..width).step_by(LANES) {
        let [x, _, _] = terms.warped(simd, [first, y], eight_of(simd, row, first));
        count += u64::from(narrow(x).simd_eq(narrow(x)).to_bitmask().count_ones());
    }
    count
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec2, DVec3};
    use resample_core::dispatch;
    use resample_core::simd::SimdLevel;
    use resample_core::{Camera, LookAt, Projection};

    use super::*;
    use crate::options::SurfaceTolerance;
    use crate::project::{Quarters, Segments};
    use crate::surfaces::rims::Rims;
    use crate::view::warp::Warp;

    /// A hilly ground of 150 x 40 samples, which are joined everywhere.
    fn hills(camera: &Camera) -> Surfaces {
        let depth = |i: usize| 3.0 + (i as f32 * 0.37).sin() + (i / 150) as f32 * 0.02;
        let depths = (0..150 * 40).map(depth).collect();
        Surfaces::new(camera, depths, SurfaceTolerance::Relative(0.9))
    }

    #[test]
    fn extents_hold_every_sample_in_front_and_all_of_them_are_counted() {
        let pose = LookAt {
            position: DVec3::ZERO,
            target: DVec3::Z,
            up: DVec3::NEG_Y,
        };
        let camera = Camera::perspective(&pose, 0.9, [150, 40]).expect("a camera");
        // To the side, turned, and so far forwards that some samples lie behind the eye.
        let targets = [
            [0.4, 0.1, 0.0, 0.0],
            [0.0, 0.0, 0.3, 0.5],
            [0.3, 0.0, 3.0, 0.2],
        ];
        for (projection, [x, y, z, turn]) in [Projection::Perspective, Projection::Orthographic]
            .into_iter()
            .flat_map(|projection| targets.map(|target| (projection, target)))
        {
            let moved =
                DAffine3::from_rotation_z(turn) * DAffine3::from_translation(-DVec3::new(x, y, z));
            let target = Camera {
                camera_from_world: moved * camera.camera_from_world,
                projection,
                ..camera
            };
            let surfaces = hills(&camera);
            let cells = Segments::new(
                &surfaces,
                Quarters::new(&surfaces, &Rims::half_way(&surfaces)),
            );
            let warp = Warp::new(&camera, &target);
            let terms = Terms::new(&warp);
            let level = SimdLevel::Auto.resolve();
            let mut known_in_front = 0;
            for cy in 1..40 {
                let per_row = 151usize.div_ceil(SEGMENT);
                let mut found = vec![[RowRange::EMPTY; 2]; per_row];
                let ranges = &cells.ranges[cy * per_row..(cy + 1) * per_row];
                dispatch!(level, simd => extents(simd, &terms, &surfaces, ranges, cy, &mut found));
                for y in [cy - 1, cy] {
                    for x in 0..150 {
                        let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                        let at = warp.at(place, f64::from(surfaces.disparity[y * 150 + x]));
                        if !warp.in_front(&at) {
                            continue;
                        }
                        known_in_front += u64::from(y == cy);
                        let [columns, rows] = found[x / SEGMENT];
                        let pos = at.pos_in_screen().as_vec2();
                        assert!(
                            columns.low <= pos.x && pos.x <= columns.high,
                            "sample {x}, {y}: column {} in {columns:?}",
                            pos.x
                        );
                        assert!(rows.low <= pos.y && pos.y <= rows.high, "sample {x}, {y}");
                    }
                }
            }
            let count = |y| dispatch!(level, simd => count_in_front(simd, &terms, &surfaces, y));
            assert_eq!((1..40).map(count).sum::<u64>(), known_in_front);
        }
    }
}
