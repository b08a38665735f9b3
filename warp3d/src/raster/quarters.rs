//! The quarters of cut cells: a corner's own piece of its tangent plane, up to where the edge was found.
//!
//! Which quarters there are, and how far they reach, belongs to the reference; only their corners are warped for each
//! frame.

use glam::DVec2;
use rayon::prelude::*;

use super::vertex::{SEGMENT, Vertex};
use crate::piece::patch_id;
use crate::rims::Rims;
use crate::surface::{Cell, Surfaces};
use crate::warp::Warp;

/// The quarters of a reference, in the order of its segments of cells.
#[derive(Clone, Debug)]
pub(crate) struct Quarters {
    quarters: Vec<Quarter>,
    /// First quarter of each segment, and the end.
    first: Vec<u32>,
}

/// A quarter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quarter {
    /// The number of its piece.
    id: u32,
    /// Its sample.
    sample: u32,
    /// How far it reaches along x and y, samples, with sign.
    reach: [f32; 2],
}

impl Quarters {
    /// The quarters of every cut cell.
    pub(crate) fn new(surfaces: &Surfaces, rims: &Rims) -> Self {
        let [width, height] = surfaces.size;
        let per_row = (width + 1).div_ceil(SEGMENT);
        let of_segment = |segment: usize| {
            let (cy, first) = (segment / per_row, segment % per_row * SEGMENT);
            (first..(first + SEGMENT).min(width + 1))
                .filter(|cx| surfaces.cells[cy * (width + 1) + cx] == Cell::Cut)
                .flat_map(|cx| {
                    (0..4).filter_map(move |corner| quarter(surfaces, rims, (cx, cy), corner))
                })
                .collect()
        };
        let by_segment: Vec<Vec<Quarter>> = (0..per_row * (height + 1))
            .into_par_iter()
            .map(of_segment)
            .collect();
        let mut first = vec![0];
        first.extend(by_segment.iter().scan(0, |end, quarters| {
            *end += quarters.len() as u32;
            Some(*end)
        }));
        Self {
            quarters: by_segment.into_iter().flatten().collect(),
            first,
        }
    }

    /// The quarters of a segment.
    pub(super) fn of_segment(&self, segment: usize) -> std::ops::Range<usize> {
        self.first[segment] as usize..self.first[segment + 1] as usize
    }

    /// The number of a quarter's piece.
    pub(super) fn id(&self, quarter: usize) -> u32 {
        self.quarters[quarter].id
    }

    /// Warps every corner.
    pub(super) fn project(&self, surfaces: &Surfaces, warp: &Warp, to: &mut Vec<[Vertex; 4]>) {
        to.resize(self.quarters.len(), [Vertex::NOWHERE; 4]);
        to.par_iter_mut()
            .zip(&self.quarters)
            .with_min_len(256)
            .for_each(|(corners, quarter)| {
                *corners = projected(quarter, surfaces, warp);
            });
    }
}

fn quarter(
    surfaces: &Surfaces,
    rims: &Rims,
    (cx, cy): (usize, usize),
    corner: usize,
) -> Option<Quarter> {
    let sample = surfaces.corners(cx, cy)[corner].filter(|&i| !surfaces.disparity[i].is_nan())?;
    let towards = [1 - 2 * (corner as i32 % 2), 1 - 2 * (corner as i32 / 2)];
    let reach = rims.reach(surfaces, sample, towards);
    let id = patch_id(cy * (surfaces.size[0] + 1) + cx, corner as u32 + 2);
    let reach = [0, 1].map(|i| (f64::from(towards[i]) * reach[i]) as f32);
    Some(Quarter {
        id,
        sample: sample as u32,
        reach,
    })
}

/// The corners, wound like the reference's own triangles.
fn projected(quarter: &Quarter, surfaces: &Surfaces, warp: &Warp) -> [Vertex; 4] {
    let index = quarter.sample as usize;
    let [dx, dy] = quarter.reach.map(f64::from);
    let width = surfaces.size[0];
    let centre = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    let [slope_x, slope_y] = surfaces.slope[index].map(f64::from);
    let here = f64::from(surfaces.disparity[index]);
    let at = |x: f64, y: f64| {
        // The tangent plane may reach its horizon within a steep quarter: it stays in front of it.
        let disparity = (here + slope_x * x + slope_y * y).max(0.25 * here);
        Vertex::of(warp, &warp.at(centre + DVec2::new(x, y), disparity))
    };
    let around = [at(0.0, 0.0), at(dx, 0.0), at(dx, dy), at(0.0, dy)];
    // Mirrored quarters are wound the other way.
    let [p, q, r, s] = around;
    if dx * dy > 0.0 { around } else { [p, s, r, q] }
}
