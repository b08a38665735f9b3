//! The expensive way: the known samples joined by a Delaunay triangulation, cut at depth edges.
//!
//! Triangles are kept where their corners are on one surface; gaps in the depth map are bridged where their rim is. Each
//! pixel centre takes the colour between three samples, linearly.
//!
//! Limits: no filter, so minified textures alias; surfaces end at their outermost samples.

use fearless_simd::prelude::*;
use glam::DVec2;
use rayon::prelude::*;
use resample_core::Camera;
use resample_core::dispatch;
use resample_core::simd::SimdLevel;
use spade::{DelaunayTriangulation, Point2, Triangulation};

use crate::bands::{BAND_ROWS, RowRange};
use crate::hybrid::Prepared;
use crate::layer::Layer;
use crate::patch::{NO_PATCH, Patch};
use crate::raster::{Vertex, scan_triangle};
use crate::stats::{FrameStats, StageClock};
use crate::surface::Surfaces;
use crate::warp::Warp;
use crate::{Error, Reference};

/// Longest edge of a triangle, samples: larger gaps in the depth map stay open. A guess.
const LONGEST_EDGE: f64 = 8.0;

/// Triangles that share one entry in the table of screen rows.
const CHUNK: usize = 256;

/// The triangles of one reference.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    /// Samples at the corners, wound as x right, y down.
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Triangulates the known samples.
    pub(crate) fn new(surfaces: &Surfaces) -> Result<Self, Error> {
        let width = surfaces.size[0];
        let known: Vec<u32> = (0..surfaces.disparity.len())
            .filter(|&i| !surfaces.disparity[i].is_nan())
            .map(|i| i as u32)
            .collect();
        let points = known
            .iter()
            .map(|&i| Point2::new((i as usize % width) as f64, (i as usize / width) as f64));
        let triangulation: DelaunayTriangulation<Point2<f64>> =
            DelaunayTriangulation::bulk_load_stable(points.collect())
                .map_err(|e| Error::Input(format!("the samples cannot be triangulated: {e}")))?;
        let triangles = triangulation.inner_faces().filter_map(|face| {
            let [a, b, c] = face.vertices().map(|v| known[v.index()]);
            let joined = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|&(i, j)| joined(surfaces, i as usize, j as usize));
            // Counter-clockwise with y up is clockwise with y down, and the other way round.
            joined.then_some([a, b, c])
        });
        Ok(Self {
            triangles: triangles.collect(),
        })
    }

    /// Draws the mesh from `target`.
    pub(crate) fn render(
        &self,
        (reference, prepared): (&Reference, &Prepared),
        target: &Camera,
        stats: &mut FrameStats,
    ) -> Layer {
        let clock = StageClock::start();
        let surfaces = &prepared.surfaces;
        let warp = Warp::new(&reference.camera, target);
        let vertices: Vec<Vertex> = (0..surfaces.disparity.len())
            .into_par_iter()
            .map(|i| Vertex::of_sample(surfaces, &warp, i))
            .collect();
        let corners = |t: &[u32; 3]| t.map(|i| vertices[i as usize]);
        let ranges: Vec<RowRange> = self
            .triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut range = RowRange::EMPTY;
                chunk
                    .iter()
                    .flat_map(corners)
                    .for_each(|v| range.include(v.y));
                range
            })
            .collect();
        stats.samples += surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
        stats.stages.project.add(clock.stop());
        let clock = StageClock::start();
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
                let rows = [index * BAND_ROWS, index * BAND_ROWS + rgba.len() / width];
                let on_band = (&ranges[..], rows, width);
                let seen =
                    dispatch!(SimdLevel::Auto.resolve(), simd => self.seen(simd, on_band, corners));
                for (at, &triangle) in seen.iter().enumerate().filter(|(_, t)| **t != NO_PATCH) {
                    let pos = DVec2::new(
                        (at % width) as f64 + 0.5,
                        (rows[0] + at / width) as f64 + 0.5,
                    );
                    let Some((rgb, z)) = self.colour(triangle as usize, prepared, &warp, pos)
                    else {
                        continue;
                    };
                    rgba[at] = [rgb[0], rgb[1], rgb[2], 1.0];
                    (depth[at], resolution[at]) = (z, 1.0);
                }
            });
        stats.stages.accumulate.add(clock.stop());
        layer
    }

    /// The triangle that each pixel centre of a band sees.
    #[inline(always)]
    fn seen<S: Simd>(
        &self,
        simd: S,
        (ranges, rows, width): (&[RowRange], [usize; 2], usize),
        corners: impl Fn(&[u32; 3]) -> [Vertex; 3],
    ) -> Vec<u32> {
        let count = width * (rows[1] - rows[0]);
        let (mut seen, mut nearest) = (vec![NO_PATCH; count], vec![f32::NEG_INFINITY; count]);
        let clip = [[0, width as i32], rows.map(|r| r as i32)];
        for (chunk, _) in ranges
            .iter()
            .enumerate()
            .filter(|(_, r)| r.touches(rows[0], rows[1]))
        {
            let first = chunk * CHUNK;
            for (i, triangle) in self.triangles[first..].iter().take(CHUNK).enumerate() {
                let c = corners(triangle).map(|v| Vertex {
                    x: v.x - 0.5,
                    y: v.y - 0.5,
                    ..v
                });
                let area =
                    (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);
                if !(area > 0.0) {
                    continue;
                }
                scan_triangle(simd, c, clip, |column, row, nearness| {
                    let at = (row - clip[1][0]) as usize * width + column as usize;
                    if nearness > nearest[at] {
                        (nearest[at], seen[at]) = (nearness, (first + i) as u32);
                    }
                });
            }
        }
        seen
    }

    fn colour(
        &self,
        triangle: usize,
        prepared: &Prepared,
        warp: &Warp,
        pos: DVec2,
    ) -> Option<([f32; 3], f32)> {
        let surfaces = &prepared.surfaces;
        let [a, b, c] = self.triangles[triangle].map(|i| i as usize);
        let place = |i: usize| {
            DVec2::new(
                (i % surfaces.size[0]) as f64 + 0.5,
                (i / surfaces.size[0]) as f64 + 0.5,
            )
        };
        let disparity = |i: usize| f64::from(surfaces.disparity[i]);
        let (u, v) = (place(b) - place(a), place(c) - place(a));
        let area = u.perp_dot(v);
        let (du, dv) = (disparity(b) - disparity(a), disparity(c) - disparity(a));
        let slope = DVec2::new(du * v.y - dv * u.y, dv * u.x - du * v.x) / area;
        let patch = Patch {
            place: place(a),
            disparity: disparity(a),
            slope,
        };
        let hit = patch.hit(warp, pos)?;
        let offset = hit.pos_in_reference - place(a);
        let weights = [offset.perp_dot(v) / area, u.perp_dot(offset) / area];
        let colour = |i: usize, channel: usize| prepared.colours.samples[i][channel];
        let rgb = std::array::from_fn(|k| {
            let from = colour(a, k);
            from + weights[0] as f32 * (colour(b, k) - from)
                + weights[1] as f32 * (colour(c, k) - from)
        });
        Some((
            rgb,
            warp.at(hit.pos_in_reference, hit.disparity).depth as f32,
        ))
    }
}

/// Whether two samples that the triangulation joins are on one surface.
fn joined(surfaces: &Surfaces, i: usize, j: usize) -> bool {
    let width = surfaces.size[0];
    let (low, high) = (i.min(j), i.max(j));
    let (dx, dy) = (
        (high % width) as i64 - (low % width) as i64,
        high / width - low / width,
    );
    match (dx, dy) {
        (1, 0) => surfaces.linked_on(low, 0),
        (0, 1) => surfaces.linked_on(low, 1),
        (1, 1) => {
            (surfaces.linked_on(low, 0) && surfaces.linked_on(low + 1, 1))
                || (surfaces.linked_on(low, 1) && surfaces.linked_on(low + width, 0))
        }
        (-1, 1) => {
            (surfaces.linked_on(low, 1) && surfaces.linked_on(high, 0))
                || (surfaces.linked_on(low - 1, 0) && surfaces.linked_on(low - 1, 1))
        }
        _ => {
            let (a, b) = (surfaces.disparity[i], surfaces.disparity[j]);
            let length = ((dx * dx) as f64 + (dy * dy) as f64).sqrt();
            let allowed = surfaces.tolerance * length as f32;
            length <= LONGEST_EDGE && (a - b).abs() <= allowed * a.min(b)
        }
    }
}
