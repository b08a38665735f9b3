//! Stereo row by row: a camera that only moves along the rows of a picture shows every row on one row.
//!
//! A row then is drawn on its own, without cells, planes and two-dimensional filters. In the order in which data flow: `edges` finds where
//! surfaces end between the samples of a row and takes their colours apart there, once for a picture; `scan` lays the pieces between
//! samples on a row of the screen, the nearest one wins; `colour` reconstructs the colours that are seen there.
//!
//! Limits: the lens, its direction and the screen's rows stay those of the picture, so that a pair that is rectified comes out; other
//! cameras are refused. Colour is taken apart along rows alone: the mixed pixels of a level edge move with their own depth.

mod edges;
mod scan;
mod colour;

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::narrow::{count, single, whole};
use resample_core::{Camera, Projection};

use crate::options::SurfaceTolerance;
use crate::stats::FrameStats;
use crate::surfaces::sharpen_edges::Edges;
use crate::view::layer::{Layer, Mix, Row};
use crate::view::warp::Warp;
use crate::{Error, Reference};
use colour::Filters;
use edges::RowEdges;
use scan::{Division, Scan};

/// A reference made ready to be drawn row by row.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    /// As it was given.
    pub(crate) reference: Reference,
    edges: RowEdges,
}

/// Where the rows and columns of a reference lie on the screen.
#[derive(Clone, Copy, Debug)]
struct Placing {
    /// Screen x, px: per reference px, at 0, and per unit of disparity.
    x: [f64; 3],
    /// Screen y, px: per reference px and at 0.
    y: [f64; 2],
    /// The largest disparity before the near plane.
    largest: f32,
}

/// Largest departure from a warp along rows over a picture, px: far below what an eye or a filter of a pixel tells.
const LARGEST_DEPARTURE_PX: f64 = 1e-3;

impl Prepared {
    /// Finds surfaces of `reference`, whose depth is made sharp as its `edges` ask for it.
    pub(crate) fn new(reference: Reference, tolerance: SurfaceTolerance, edges: Edges) -> Self {
        let edges = RowEdges::new(&reference, tolerance, edges);
        Self { reference, edges }
    }

    /// The view of `target`.
    ///
    /// # Errors
    /// It is moved or turned by more than along the rows.
    pub(crate) fn render(
        &self,
        target: &Camera,
        to: Layer,
        stats: &mut FrameStats,
    ) -> Result<Layer, Error> {
        let placing = self.placing(target).ok_or_else(|| {
            Error::Option(
                "the method rows draws cameras that are moved along the picture's rows alone, with its lens, as --stereo moves them; \
                 use the method hybrid"
                    .into(),
            )
        })?;
        let clock = StageClock::start();
        let division = Division::new(placing.x);
        let filters = Filters::new(&division);
        let width = target.width as usize;
        let mut layer = to.reused(width * target.height as usize);
        layer.mixes.resize(width * target.height as usize, Mix::ONE);
        let planes = (layer.rgba.par_chunks_mut(width)).zip(layer.depth.par_chunks_mut(width));
        let shares =
            (layer.resolution.par_chunks_mut(width)).zip(layer.mixes.par_chunks_mut(width));
        let rows = planes.zip(shares).enumerate();
        let edge_pixels = rows.map_init(
            Scan::default,
            |scan, (y, ((rgba, depth), (resolution, mixes)))| {
                let row = Row {
                    rgba,
                    depth,
                    resolution,
                    mixes,
                };
                self.row(y, (&placing, &division, &filters), scan, row)
            },
        );
        stats.edge_pixels += edge_pixels.sum::<u64>();
        stats.samples += self.edges.known;
        stats.stages.resolve += clock.stop();
        Ok(layer)
    }

    /// Draws row `y` of the screen; gives its pixels in which surfaces blend.
    fn row(
        &self,
        y: usize,
        (placing, division, filters): (&Placing, &Division, &Filters),
        scan: &mut Scan,
        mut to: Row<'_>,
    ) -> u64 {
        to.clear();
        let mut edge_pixels = 0;
        for (row, weight) in placing.rows_of(y, self.reference.camera.height as usize) {
            let samples = self.edges.row(row);
            scan.lay(&samples, division, placing.largest, to.rgba.len());
            let blended = colour::draw(&mut to, scan, &samples, (division, filters), weight);
            edge_pixels = blended.max(edge_pixels);
        }
        colour::keep_in_range(&mut to);
        edge_pixels
    }

    /// Where rows and columns lie, if every row lies on one row.
    fn placing(&self, target: &Camera) -> Option<Placing> {
        let reference = &self.reference.camera;
        let pinholes = [reference, target].map(|c| c.projection == Projection::Perspective);
        if pinholes != [true; 2] {
            return None;
        }
        let warp = Warp::new(reference, target);
        let [x, y, one] = warp.pixel_columns();
        let disparity = warp.disparity_column();
        let [width, height] = [reference.width, reference.height].map(f64::from);
        let largest = f64::from(self.edges.largest);
        let size = f64::from(target.width.max(target.height));
        let divisor = one.z;
        // Each is 0 for a camera along the rows, times the divisor.
        let departures_px = [
            y.x * height,
            x.y * width,
            disparity.y * largest,
            x.z * width * size,
            y.z * height * size,
            disparity.z * largest * size,
        ];
        let is_along_rows = (divisor > 0.0 && x.x > 0.0 && y.y > 0.0)
            && (departures_px.iter()).all(|px| px.abs() <= LARGEST_DEPARTURE_PX * divisor);
        is_along_rows.then(|| Placing {
            x: [x.x, one.x, disparity.x].map(|v| v / divisor),
            y: [y.y, one.y].map(|v| v / divisor),
            largest: single(1.0 / target.near),
        })
    }
}

impl Placing {
    /// The rows of a reference of `height` that make up row `y` of the screen, with their weights: what the reference's own Gaussian
    /// leaves of a larger pixel's, or the two rows beside where pixels are not larger.
    fn rows_of(&self, y: usize, height: usize) -> impl Iterator<Item = (usize, f32)> {
        let [scale, offset] = self.y;
        let middle = (y as f64 + 0.5 - offset) / scale - 0.5;
        let rows_of_pixel = 1.0 / scale;
        // The variance of both Gaussians, rows^2; not narrower than the least: else the rows beside the middle would have no weight.
        let left = 0.25 * (rows_of_pixel * rows_of_pixel - 1.0);
        let is_larger = left > LEAST_LEFT;
        let variance = left.max(LEAST_VARIANCE);
        let reach = if is_larger {
            (3.0 * variance.sqrt()).max(1.0)
        } else {
            1.0
        };
        let weight = move |row: usize| {
            let apart = (row as f64 - middle).abs();
            match is_larger {
                true => (-0.5 * apart * apart / variance).exp(),
                false => (1.0 - apart).max(0.0),
            }
        };
        // A place beyond the first or the last row by half a row is outside the picture.
        let beyond = 0.5 + LARGEST_DEPARTURE_PX;
        let is_inside = middle > -beyond && middle < height as f64 - 1.0 + beyond;
        let end = if is_inside { height } else { 0 };
        let index = |place: f64| count(whole(place));
        let first = index(middle - reach);
        let rows = first..(index(middle + reach) + 1).min(end);
        let sum: f64 = rows.clone().map(weight).sum();
        let weighted = rows.map(move |row| (row, single(weight(row) / sum)));
        weighted.filter(|&(_, weight)| weight > LEAST_WEIGHT)
    }
}

/// Least variance that is left for which rows are filtered, rows^2: less is rounding.
const LEAST_LEFT: f64 = 1e-6;

/// Least variance of a filter of rows, rows^2: half a row off, a weight is a hundredth then.
const LEAST_VARIANCE: f64 = 1.0 / 36.0;

/// Least weight of a row: less is below half a step of 12 bits.
const LEAST_WEIGHT: f32 = 1e-4;
