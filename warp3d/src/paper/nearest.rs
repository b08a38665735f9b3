//! McMillan's baseline: every sample sets the one pixel that it falls in.
//!
//! The reference is warped row by row; then each band of target rows takes the samples that fall in it, in reference
//! order with a z-buffer, or in occlusion order without one.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f64x8, i32x8, mask32x8};
use fearless_simd_macros::simd;
use glam::{DVec3, DVec4};
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::simd::Vectors;
use resample_core::{Camera, Projection, dispatch};

use crate::Reference;
use crate::options::Visibility;
use crate::project::{Terms, narrow};
use crate::stats::FrameStats;
use crate::view::layer::{BAND_ROWS, Layer, RowRange, before_infinity};
use crate::view::warp::Warp;

/// Marks a sample that falls on no pixel.
const NOWHERE: u32 = u32::MAX;

/// Samples that are warped at once.
const LANES: usize = 8;

/// Buffers that are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nearest {
    /// The pixel in which each sample falls, and its depth there.
    pixels: Vec<u32>,
    depths: Vec<f32>,
    rows: Vec<PlacedRow>,
}

/// A placed row of samples.
#[derive(Clone, Copy, Debug)]
struct PlacedRow {
    /// Screen rows that it touches.
    range: RowRange,
    /// Samples with a depth, and those of them that fall on a pixel.
    counts: [u64; 2],
}

impl PlacedRow {
    const EMPTY: Self = Self {
        range: RowRange::EMPTY,
        counts: [0; 2],
    };
}

/// A row of samples, where it falls, and the size of the screen.
struct Placing<'a> {
    projection: Projection,
    depth: &'a [f32],
    pixels: &'a mut [u32],
    depths: &'a mut [f32],
    size: [u32; 2],
}

impl Nearest {
    /// Draws `reference` from `target` into the buffers `to`.
    pub(crate) fn render(
        &mut self,
        reference: &Reference,
        target: &Camera,
        (visibility, level): (Visibility, Vectors),
        to: Layer,
        stats: &mut FrameStats,
    ) -> Layer {
        let clock = StageClock::start();
        self.project(reference, target, level);
        for row in &self.rows {
            let [known, inside] = row.counts;
            stats.samples += known;
            stats.outside += known - inside;
        }
        stats.stages.project += clock.stop();
        let clock = StageClock::start();
        let order = match visibility {
            Visibility::ZBuffer => None,
            Visibility::OcclusionOrder => {
                let size = [reference.camera.width, reference.camera.height];
                Some(OcclusionOrder::new(&reference.camera, target, size))
            }
        };
        let layer = self.draw(reference, target, order, to);
        stats.stages.accumulate += clock.stop();
        layer
    }

    fn project(&mut self, reference: &Reference, target: &Camera, level: Vectors) {
        let camera = &reference.camera;
        let width = camera.width as usize;
        self.pixels.resize(reference.depth.len(), NOWHERE);
        self.depths.resize(reference.depth.len(), 0.0);
        self.rows.resize(camera.height as usize, PlacedRow::EMPTY);
        let warp = Warp::new(camera, target);
        let planes = self
            .pixels
            .par_chunks_mut(width)
            .zip(self.depths.par_chunks_mut(width));
        let rows = planes.zip(&mut self.rows).enumerate();
        rows.for_each(|(y, ((pixels, depths), row))| {
            let placing = Placing {
                projection: camera.projection,
                depth: &reference.depth[y * width..(y + 1) * width],
                pixels,
                depths,
                size: [target.width, target.height],
            };
            *row = dispatch!(level, simd => place_row(simd, &warp, y, placing));
        });
    }

    fn draw(
        &self,
        reference: &Reference,
        target: &Camera,
        order: Option<OcclusionOrder>,
        to: Layer,
    ) -> Layer {
        let width = target.width as usize;
        let mut layer = to.reused(width * target.height as usize);
        let has_front = target.projection == Projection::Perspective;
        let band = width * BAND_ROWS;
        let planes = layer
            .rgba
            .par_chunks_mut(band)
            .zip(layer.depth.par_chunks_mut(band));
        let seen = planes
            .zip(layer.resolution.par_chunks_mut(band))
            .enumerate()
            .map(|(index, ((rgba, depth), resolution))| {
                rgba.fill([0.0; 4]);
                depth.fill(f32::INFINITY);
                resolution.fill(0.0);
                let first = index * BAND_ROWS;
                let origin = (first * width) as u32;
                let mut visit = |pixel: u32, sample: usize, compare: bool| {
                    // A pixel before the band is far behind it.
                    let slot = pixel.wrapping_sub(origin) as usize;
                    if slot >= depth.len() {
                        return;
                    }
                    let z = self.depths[sample];
                    if !compare || z < depth[slot] || resolution[slot] == 0.0 {
                        let [r, g, b] = reference.colour[sample];
                        rgba[slot] = [r, g, b, 1.0];
                        depth[slot] = z;
                        resolution[slot] = 1.0;
                    }
                };
                self.visit_band(first, reference.camera.width as usize, order, &mut visit);
                if has_front {
                    before_infinity(depth);
                }
                let shown = resolution.iter().map(|&seen| u64::from(seen > 0.0));
                shown.sum::<u64>()
            });
        layer.seen = Some(seen.sum());
        layer
    }

    /// Calls `visit(pixel, sample, whether depths are compared)` for the samples of every row that touches the band, in
    /// drawing order.
    #[inline(always)]
    fn visit_band(
        &self,
        first: usize,
        width: usize,
        order: Option<OcclusionOrder>,
        visit: &mut impl FnMut(u32, usize, bool),
    ) {
        let touches = |y: usize| self.rows[y].range.touches(first, first + BAND_ROWS);
        match order {
            None => {
                for y in (0..self.rows.len()).filter(|&y| touches(y)) {
                    let row = &self.pixels[y * width..(y + 1) * width];
                    for (x, &pixel) in row.iter().enumerate() {
                        visit(pixel, y * width + x, true);
                    }
                }
            }
            Some(order) => {
                for y in order
                    .rows
                    .indices()
                    .map(|y| y as usize)
                    .filter(|&y| touches(y))
                {
                    order.columns.indices().for_each(|x| {
                        let sample = y * width + x as usize;
                        visit(self.pixels[sample], sample, false);
                    });
                }
            }
        }
    }
}

/// Finds the pixels of the samples of row `y`.
#[simd]
fn place_row<S: Simd>(simd: S, warp: &Warp, y: usize, to: Placing<'_>) -> PlacedRow {
    let terms = Terms::new(warp);
    let mut row = PlacedRow::EMPTY;
    let mut rows = [
        f32x8::splat(simd, f32::INFINITY),
        f32x8::splat(simd, f32::NEG_INFINITY),
    ];
    let size = to.size.map(|v| f64x8::splat(simd, f64::from(v)));
    let zero = f64x8::splat(simd, 0.0);
    let nowhere = i32x8::splat(simd, NOWHERE as i32);
    for first in (0..to.depth.len()).step_by(LANES) {
        let count = LANES.min(to.depth.len() - first);
        let mut depth = [f32::NAN; LANES];
        depth[..count].copy_from_slice(&to.depth[first..first + count]);
        let disparity = disparities(simd, to.projection, f32x8::simd_from(simd, depth));
        let known: mask32x8<S> = disparity.simd_eq(disparity);
        let [x, y, nearness] = terms.warped(simd, [first, y], disparity);
        let inside = x.simd_ge(zero) & y.simd_ge(zero) & x.simd_lt(size[0]) & y.simd_lt(size[1]);
        let inside = mask32x8::from_bitmask(simd, inside.to_bitmask());
        let column: i32x8<S> = narrow(x.floor()).to_int();
        let line: i32x8<S> = narrow(y.floor()).to_int();
        let pixel = line * i32x8::splat(simd, to.size[0] as i32) + column;
        let pixel = inside.select(pixel, nowhere).to_array();
        let depth = narrow(warp.depths(simd, nearness)).to_array();
        for lane in 0..count {
            to.pixels[first + lane] = pixel[lane] as u32;
            to.depths[first + lane] = depth[lane];
        }
        let y = narrow(y);
        rows = [
            inside.select(y.min(rows[0]), rows[0]),
            inside.select(y.max(rows[1]), rows[1]),
        ];
        row.counts[0] += u64::from(known.to_bitmask().count_ones());
        row.counts[1] += u64::from(inside.to_bitmask().count_ones());
    }
    row.range = RowRange {
        low: rows[0].reduce_min(),
        high: rows[1].reduce_max(),
    };
    row
}

/// Generalised disparities of eight depths, NaN where nothing is known: as [`disparity`](crate::view::warp::disparity) has them.
#[inline(always)]
fn disparities<S: Simd>(simd: S, projection: Projection, depth: f32x8<S>) -> f32x8<S> {
    let constant = |v: f32| f32x8::splat(simd, v);
    let disparity = match projection {
        Projection::Perspective => constant(1.0) / depth,
        Projection::Orthographic => depth,
    };
    let known = depth.simd_gt(constant(0.0)) & disparity.simd_lt(constant(f32::INFINITY));
    known.select(disparity, constant(f32::NAN))
}

// The order in which a reference is drawn so that nearer samples come later, without comparing depths.
//
// The target's eye, seen from the reference, is the epipole. A ray of the target is a half line of the reference that
// starts there and runs from near to far if the eye is in front of the reference; so samples are drawn towards the
// epipole. If the eye is behind, its image is the far end, and samples are drawn away from it (McMillan 1995). Any
// order that is monotone along x and along y on either side of the epipole is such an order.

/// How rows (or columns) are visited: ranges of indices, each forwards or backwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisOrder {
    /// Where the epipole splits the axis, in pixels of the reference, clamped to its size.
    split: u32,
    size: u32,
    towards: bool,
}

/// The order around the epipole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OcclusionOrder {
    /// Order of columns.
    pub(crate) columns: AxisOrder,
    /// Order of rows.
    pub(crate) rows: AxisOrder,
}

impl OcclusionOrder {
    /// The order of the `size` cells of `reference` for a picture from `target`.
    pub(crate) fn new(reference: &Camera, target: &Camera, size: [u32; 2]) -> Self {
        let (place, weight) = epipole(reference, target);
        let towards = weight >= 0.0;
        let axis = |along: f64, size: u32| {
            // 0/0, without motion along this axis or at all, is NaN: any split will do.
            let at = along / weight.abs() * if towards { 1.0 } else { -1.0 };
            let split = if at.is_nan() {
                0.0
            } else {
                at.clamp(0.0, f64::from(size))
            };
            AxisOrder {
                split: split.round() as u32,
                size,
                towards,
            }
        };
        Self {
            columns: axis(place[0], size[0]),
            rows: axis(place[1], size[1]),
        }
    }
}

impl AxisOrder {
    /// The indices in the order in which they are drawn.
    pub(crate) fn indices(self) -> impl Iterator<Item = u32> + Clone {
        let (split, size, towards) = (self.split, self.size, self.towards);
        // Towards the split: 0.., then size-1 down to it. Away: the reverse of that.
        (0..size).map(move |i| {
            let step = if towards { i } else { size - 1 - i };
            if step < split {
                step
            } else {
                size - 1 - (step - split)
            }
        })
    }
}

/// The target's eye on the reference's screen: homogeneous x and y (px times weight) and the weight, whose sign says
/// whether the eye is in front.
fn epipole(reference: &Camera, target: &Camera) -> ([f64; 2], f64) {
    let to_world = target.camera_from_world.inverse();
    let eye = match target.projection {
        Projection::Perspective => to_world.translation.extend(1.0),
        // Parallel rays come from infinity, against the view direction.
        Projection::Orthographic => (-to_world.matrix3.z_axis).extend(0.0),
    };
    let pose = reference.camera_from_world;
    let direction: DVec3 = pose.matrix3 * eye.truncate() + eye.w * pose.translation;
    // The eyes coincide up to rounding: the direction between them is noise, and any order will do.
    let scale = (pose.matrix3 * eye.truncate()).length() + pose.translation.length();
    let eye: DVec4 = if direction.length() <= 1e-14 * scale {
        DVec4::ZERO
    } else {
        direction.extend(eye.w)
    };
    let weight = match reference.projection {
        Projection::Perspective => eye.z,
        Projection::Orthographic => eye.w,
    };
    (
        [
            reference.fx * eye.x + reference.cx * weight,
            reference.fy * eye.y + reference.cy * weight,
        ],
        weight,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_run_towards_or_away_from_the_split() {
        let order = |split, towards| {
            AxisOrder {
                split,
                size: 5,
                towards,
            }
            .indices()
            .collect::<Vec<_>>()
        };
        assert_eq!(order(2, true), [0, 1, 4, 3, 2], "towards an epipole inside");
        assert_eq!(
            order(2, false),
            [2, 3, 4, 1, 0],
            "away from an epipole inside"
        );
        assert_eq!(
            order(0, true),
            [4, 3, 2, 1, 0],
            "towards an epipole before the picture"
        );
        assert_eq!(
            order(5, true),
            [0, 1, 2, 3, 4],
            "towards an epipole beyond the picture"
        );
        assert_eq!(
            order(0, false),
            [0, 1, 2, 3, 4],
            "away from an epipole before the picture"
        );
    }
}
