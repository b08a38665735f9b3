//! Samples laid on the screen one by one: points, or discs.
//!
//! A sample is a Gaussian disc in its tangent plane, so neighbours on the same surface give its size and shape, and the
//! screen sees an ellipse (Zwicker 2001). First the nearest surface of each pixel is found from the discs' middles; then
//! what lies on it is summed, weighted by the area that a sample covers, and normalised. Turned-away discs are dropped.
//!
//! Limits: one surface a pixel; what lies behind it does not shine through at its edge. Methods for comparison.

use glam::{DMat2, DVec2};
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::point::PIXEL_SIGMA_PX;
use resample_core::{Camera, Projection};

use crate::project::prepared::Prepared;
use crate::stats::FrameStats;
use crate::surfaces::patch::Patch;
use crate::surfaces::surface::Surfaces;
use crate::view::layer::{BAND_ROWS, Layer, RowRange, before_infinity};
use crate::view::warp::Warp;

/// Variance of a disc's Gaussian, reference px^2: sigma is half a sample, as the reference's own pixels have.
const DISC_VARIANCE: f64 = 0.25;

/// Least variance of a point, px^2: a narrower one falls between the pixels. A guess.
const LEAST_POINT_VARIANCE: f64 = 0.04;

/// Footprints end at this many sigmas.
const REACH_SIGMAS: f64 = 2.5;

/// Largest reach of a footprint, px: a disc seen from within would cover the picture.
const MAX_REACH_PX: f64 = 64.0;

/// The shape of a sample on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A point, gathered by the pixel's Gaussian.
    Point,
    /// A disc in its tangent plane, without a pixel filter.
    Disc,
}

/// A sample on the screen.
#[derive(Clone, Copy, Debug)]
struct Splat {
    sample: usize,
    at: DVec2,
    nearness: f32,
    /// Inverse covariance (xx, xy, yy).
    form: [f64; 3],
    reach: DVec2,
    /// Weight at the centre.
    weight: f32,
    /// How much the nearness may change over the footprint, relative.
    slack: f32,
}

/// Draws `prepared` from `target`.
pub(crate) fn render(
    prepared: &Prepared,
    target: &Camera,
    shape: Shape,
    stats: &mut FrameStats,
) -> Layer {
    let clock = StageClock::start();
    let warp = Warp::new(&prepared.camera, target);
    let surfaces = &prepared.surfaces;
    let width = surfaces.size[0];
    let rows: Vec<(RowRange, Vec<Splat>)> = (0..surfaces.size[1])
        .into_par_iter()
        .map(|y| {
            let of = |x| splat(surfaces, &warp, y * width + x, shape);
            let splats: Vec<Splat> = (0..width).filter_map(of).collect();
            let mut range = RowRange::EMPTY;
            for s in &splats {
                range.include((s.at.y - s.reach.y) as f32);
                range.include((s.at.y + s.reach.y) as f32);
            }
            (range, splats)
        })
        .collect();
    let drawn: u64 = rows.iter().map(|(_, splats)| splats.len() as u64).sum();
    let known = surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
    stats.samples += known;
    stats.outside += known - drawn;
    stats.stages.project += clock.stop();
    let clock = StageClock::start();
    let layer = draw(&rows, prepared, &warp, target, shape);
    stats.stages.accumulate += clock.stop();
    layer
}

fn splat(surfaces: &Surfaces, warp: &Warp, sample: usize, shape: Shape) -> Option<Splat> {
    let patch = Patch::of_sample_at(surfaces, sample)?;
    let warped = warp.at(patch.place, patch.disparity);
    if !warp.in_front(&warped) {
        return None;
    }
    let at = warped.pos_in_screen();
    let [x, y, _] = warp.pixel_columns();
    let d = warp.disparity_column();
    let column = |c: glam::DVec3| (c.truncate() - at * c.z) / warped.divisor;
    let jacobian = DMat2::from_cols(column(x + patch.slope.x * d), column(y + patch.slope.y * d));
    let area = jacobian.determinant();
    // The reference sees its samples from the front: a mirrored one shows its back.
    if !(area > 1e-9 && at.is_finite()) {
        return None;
    }
    let (a, b) = (jacobian.x_axis, jacobian.y_axis);
    let gram = [
        a.x * a.x + b.x * b.x,
        a.x * a.y + b.x * b.y,
        a.y * a.y + b.y * b.y,
    ];
    let pixel = PIXEL_SIGMA_PX * PIXEL_SIGMA_PX;
    let covariance = match shape {
        Shape::Point => {
            let variance = (pixel * (1.0 - area)).max(LEAST_POINT_VARIANCE);
            [variance, 0.0, variance]
        }
        Shape::Disc => gram.map(|g| DISC_VARIANCE * g),
    };
    let determinant = covariance[0] * covariance[2] - covariance[1] * covariance[1];
    let reach = DVec2::new(covariance[0].sqrt(), covariance[2].sqrt()) * REACH_SIGMAS;
    let covered = if shape == Shape::Point {
        area.min(1.0)
    } else {
        area
    };
    let form = [
        covariance[2] / determinant,
        -covariance[1] / determinant,
        covariance[0] / determinant,
    ];
    let weight = (covered / (std::f64::consts::TAU * determinant.sqrt())) as f32;
    // One that is stretched beyond all numbers weighs nothing anywhere.
    if !(weight.is_finite() && form.iter().all(|f| f.is_finite())) {
        return None;
    }
    let slope = patch.slope.abs().max_element() / patch.disparity.max(f64::MIN_POSITIVE);
    Some(Splat {
        sample,
        at,
        nearness: warp.nearness(warped.depth) as f32,
        form,
        reach: reach.min(DVec2::splat(MAX_REACH_PX)),
        weight,
        slack: (2.0 * f64::from(surfaces.tolerance) + 4.0 * slope).min(0.2) as f32,
    })
}

fn draw(
    rows: &[(RowRange, Vec<Splat>)],
    prepared: &Prepared,
    warp: &Warp,
    target: &Camera,
    shape: Shape,
) -> Layer {
    let width = target.width as usize;
    let mut layer = Layer::empty(width * target.height as usize);
    let band = width * BAND_ROWS;
    let planes = layer
        .rgba
        .par_chunks_mut(band)
        .zip(layer.depth.par_chunks_mut(band));
    planes
        .zip(layer.resolution.par_chunks_mut(band))
        .enumerate()
        .for_each(|(index, ((rgba, depth), resolution))| {
            let first = index * BAND_ROWS;
            let size = [width, rgba.len() / width];
            let splats = || {
                let touching = rows
                    .iter()
                    .filter(|(r, _)| r.touches(first, first + size[1]));
                touching.flat_map(|(_, splats)| splats.iter())
            };
            let mut nearest = vec![f32::NEG_INFINITY; rgba.len()];
            splats().for_each(|s| {
                // The middle of a footprint, one sigma, decides which surface a pixel shows.
                each_pixel(s, first, size, |at, q, _| {
                    if q <= 1.0 {
                        nearest[at] = nearest[at].max(s.nearness);
                    }
                });
            });
            splats().for_each(|s| {
                let patch = Patch::of_sample_at(&prepared.surfaces, s.sample);
                let links = prepared.surfaces.links[s.sample];
                let colour = prepared.colours.sample(s.sample, links);
                each_pixel(s, first, size, |at, q, pos| {
                    let hidden = s.nearness + s.slack * s.nearness.abs() < nearest[at];
                    let q = if shape == Shape::Disc {
                        patch.and_then(|p| exact_form(&p, warp, pos)).unwrap_or(q)
                    } else {
                        q
                    };
                    if hidden || q > REACH_SIGMAS * REACH_SIGMAS {
                        return;
                    }
                    let weight = s.weight * (-0.5 * q as f32).exp();
                    for (sum, c) in rgba[at]
                        .iter_mut()
                        .zip([colour[0], colour[1], colour[2], 1.0])
                    {
                        *sum += weight * c;
                    }
                    // Until the end the depth plane holds the weighted sum of nearness.
                    depth[at] = weight * s.nearness
                        + if depth[at].is_finite() {
                            depth[at]
                        } else {
                            0.0
                        };
                });
            });
            for (at, pixel) in rgba.iter_mut().enumerate().filter(|(_, p)| p[3] > 0.0) {
                let total = pixel[3];
                depth[at] = warp.depth(f64::from(depth[at] / total)) as f32;
                let covered = total.min(1.0);
                *pixel = pixel.map(|v| v * covered / total);
                resolution[at] = covered;
            }
            if target.projection == Projection::Perspective {
                before_infinity(depth);
            }
        });
    layer
}

/// The squared distance in sigmas by the disc's homography.
fn exact_form(patch: &Patch, warp: &Warp, pos_in_screen: DVec2) -> Option<f64> {
    let hit = patch.hit(warp, pos_in_screen)?;
    Some((hit.pos_in_reference - patch.place).length_squared() / DISC_VARIANCE)
}

/// Calls `visit(index in the band, squared distance in sigmas, screen position)` for the pixels of a footprint.
fn each_pixel(
    splat: &Splat,
    first_row: usize,
    size: [usize; 2],
    mut visit: impl FnMut(usize, f64, DVec2),
) {
    let range = |centre: f64, reach: f64, first: usize, count: usize| {
        let low = (centre - reach - 0.5).ceil().max(first as f64);
        let high = (centre + reach - 0.5)
            .floor()
            .min((first + count) as f64 - 1.0);
        if low <= high {
            low as usize..high as usize + 1
        } else {
            0..0
        }
    };
    for y in range(splat.at.y, splat.reach.y, first_row, size[1]) {
        for x in range(splat.at.x, splat.reach.x, 0, size[0]) {
            let pos = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let o = pos - splat.at;
            let q = splat.form[0] * o.x * o.x
                + 2.0 * splat.form[1] * o.x * o.y
                + splat.form[2] * o.y * o.y;
            if q <= REACH_SIGMAS * REACH_SIGMAS {
                visit((y - first_row) * size[0] + x, q, pos);
            }
        }
    }
}
