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
use resample_core::{Camera, Projection};

use crate::options::SurfaceTolerance;
use crate::stats::FrameStats;
use crate::view::layer::{Layer, Mix};
use crate::view::warp::Warp;
use crate::{Error, Reference};
use colour::Filters;
use edges::RowEdges;
use scan::{Scan, Step};

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
    /// Finds surfaces and edges of `reference`.
    pub(crate) fn new(reference: Reference, tolerance: SurfaceTolerance) -> Self {
        let edges = RowEdges::new(&reference, tolerance);
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
        let step = Step::new(placing.x);
        let filters = Filters::new(&step);
        let width = target.width as usize;
        let mut layer = to.reused(width * target.height as usize);
        layer.mixes.resize(width * target.height as usize, Mix::ONE);
        let planes = (layer.rgba.par_chunks_mut(width)).zip(layer.depth.par_chunks_mut(width));
        let shares = (layer.resolution.par_chunks_mut(width)).zip(layer.mixes.par_chunks_mut(width));
        let rows = planes.zip(shares).enumerate();
        let edge_pixels = rows.map_init(Scan::default, |scan, (y, ((rgba, depth), (resolution, mixes)))| {
            let row = colour::Row {
                rgba,
                depth,
                resolution,
                mixes,
            };
            self.row(y, (&placing, &step, &filters), scan, row)
        });
        stats.edge_pixels += edge_pixels.sum::<u64>();
        stats.samples += self.edges.known;
        stats.stages.resolve += clock.stop();
        Ok(layer)
    }

    /// Draws row `y` of the screen; gives its pixels in which surfaces blend.
    fn row(&self, y: usize, (placing, step, filters): (&Placing, &Step, &Filters), scan: &mut Scan, mut to: colour::Row<'_>) -> u64 {
        to.clear();
        let mut edge_pixels = 0;
        for (row, weight) in placing.rows_of(y, self.reference.camera.height as usize) {
            let samples = self.edges.row(row);
            scan.lay(&samples, step, placing.largest, to.rgba.len());
            edge_pixels = colour::add(scan, &samples, (step, filters), weight, &mut to).max(edge_pixels);
        }
        to.finish();
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
        let divisor = one.z;
        let size = f64::from(target.width.max(target.height));
        let largest = f64::from(self.edges.largest);
        // What the departures add to a screen position, px.
        let beside = (x.y.abs() * width).max(y.x.abs() * height).max(disparity.y.abs() * largest);
        let turned = (x.z.abs() * width).max(y.z.abs() * height).max(disparity.z.abs() * largest) * size;
        let is_along_rows = divisor > 0.0
            && x.x > 0.0
            && y.y > 0.0
            && beside.max(turned) <= LARGEST_DEPARTURE_PX * divisor;
        is_along_rows.then(|| Placing {
            x: [x.x, one.x, disparity.x].map(|v| v / divisor),
            y: [y.y, one.y].map(|v| v / divisor),
            largest: (1.0 / target.near) as f32,
        })
    }
}

impl Placing {
    /// The rows of a reference of `height` that make up row `y` of the screen, with their weights: a tent as wide as a row of either.
    fn rows_of(&self, y: usize, height: usize) -> impl Iterator<Item = (usize, f32)> {
        let [scale, offset] = self.y;
        let middle = (y as f64 + 0.5 - offset) / scale - 0.5;
        // What the reference's own Gaussian leaves of a larger pixel's; a tent between rows where pixels are not larger.
        let samples = 1.0 / scale;
        let variance = 0.25 * (samples * samples - 1.0);
        let reach = if variance > 1e-6 { (1.5 * samples).max(1.0) } else { 1.0 };
        let first = (middle - reach).floor().max(0.0) as usize;
        let end = ((middle + reach).ceil() + 1.0).clamp(0.0, height as f64) as usize;
        let weight = move |row: usize| {
            let offset = row as f64 - middle;
            if variance > 1e-6 { (-0.5 * offset * offset / variance).exp() } else { (1.0 - offset.abs()).max(0.0) }
        };
        let inside = middle > -0.5 - LARGEST_DEPARTURE_PX && middle < height as f64 - 0.5 + LARGEST_DEPARTURE_PX;
        let rows = first..if inside { end } else { first };
        let sum: f64 = rows.clone().map(weight).sum();
        rows.map(move |row| (row, (weight(row) / sum) as f32))
            .filter(|&(_, weight)| weight > LEAST_WEIGHT)
    }
}

/// Least weight of a row: less is below half a step of 12 bits.
const LEAST_WEIGHT: f32 = 1e-4;
