//! One look through the unpacked samples, in bands of rows: numbers become camera z, and what must be known of the whole
//! picture is gathered.

use rayon::prelude::*;
use resample_core::{Camera, Projection};

use super::blocks::{BLOCK, Blocks, HALO};
use super::files::Files;
use super::sheet::{Kind, Rect, Sheet};
use super::unpack::Unpacked;
use crate::Error;
use crate::input::meaning::{Numbers, ZOf};
use crate::input::nothing_known;
use crate::options::SurfaceTolerance;
use crate::prepared::Surveyed;
use crate::ramps::{self, Edges, Votes, sharpened};
use crate::reference::nearest;
use crate::tolerance::{BEND_STRIDE, bends_of_row, tolerance_of_bends};
use crate::warp::disparity;
use resample_io::files::fault;

/// What was found.
pub(super) struct Found {
    pub(super) blocks: Blocks,
    pub(super) surveyed: Surveyed,
    pub(super) known: u64,
    pub(super) nearest: f32,
}

/// What a row has.
struct RowFacts {
    known: u64,
    nearest: f32,
    bends: Vec<f32>,
    votes: Votes,
}

/// Looks through the samples and writes their camera z.
pub(super) fn survey(
    files: &Files<'_>,
    unpacked: &Unpacked,
    tolerance: SurfaceTolerance,
) -> Result<Found, Error> {
    let path = &files.depth.path;
    let numbers = Numbers {
        stored: unpacked.stored,
        range: files.meaning.range,
    };
    let z_of = files
        .meaning
        .converter(&numbers, files.camera)
        .map_err(|what| fault(path, what))?;
    let [width, height] = unpacked.sheet.size;
    let wanted = tolerance == SurfaceTolerance::Auto;
    let mut bends = Vec::with_capacity(if wanted {
        width * height / BEND_STRIDE + 1
    } else {
        0
    });
    let (mut known, mut nearest) = (0, f32::INFINITY);
    let mut votes = Votes::default();
    for first in (0..height).step_by(BLOCK) {
        let rows = Rect {
            first: [0, first],
            size: [width, BLOCK.min(height - first)],
        };
        let mut depth = unpacked.sheet.read(Kind::Depth, &rows)?;
        let facts: Vec<RowFacts> = depth
            .par_chunks_mut(width)
            .enumerate()
            .map(|(row, depth)| look_through(unpacked, files.camera, &z_of, first + row, depth))
            .collect();
        unpacked.sheet.write(Kind::Depth, [0, first], &depth)?;
        for row in facts {
            known += row.known;
            nearest = nearest.min(row.nearest);
            votes = votes.with(row.votes);
            if wanted {
                bends.extend(row.bends);
            }
        }
    }
    if known == 0 {
        return Err(nothing_known(files.meaning, unpacked.stored, path));
    }
    let edges = votes.edges();
    if edges != Edges::Sharp {
        sharpen(&unpacked.sheet, files.camera.projection, edges)?;
        bends = bends_of_sheet(&unpacked.sheet, files.camera.projection)?;
    }
    let tolerance = match tolerance {
        SurfaceTolerance::Auto => tolerance_of_bends(bends),
        SurfaceTolerance::Relative(tolerance) => tolerance,
    };
    let blocks = ranges(&unpacked.sheet, files.camera.projection, tolerance)?;
    Ok(Found {
        blocks,
        surveyed: Surveyed { tolerance, edges },
        known,
        nearest,
    })
}

/// Turns the numbers of row `y` into camera z.
fn look_through(
    unpacked: &Unpacked,
    camera: &Camera,
    z_of: &ZOf<'_>,
    y: usize,
    depth: &mut [f32],
) -> RowFacts {
    for (x, z) in depth.iter_mut().enumerate() {
        let is_there = unpacked.covered.get(x, y) && unpacked.given.get(x, y);
        *z = if is_there { z_of(*z, [x, y]) } else { f32::NAN };
    }
    let row = disparities(camera.projection, depth);
    RowFacts {
        known: depth.iter().filter(|z| !z.is_nan()).count() as u64,
        nearest: nearest(depth),
        bends: bends_of_row(&row, y * depth.len()).collect(),
        votes: Votes::of_row(camera.projection, depth),
    }
}

/// Makes the soft edges of the whole picture sharp, band by band.
fn sharpen(sheet: &Sheet, projection: Projection, edges: Edges) -> Result<(), Error> {
    let [width, height] = sheet.size;
    // Rows that are written already, as they were before.
    let mut above: Vec<f32> = Vec::new();
    for first in (0..height).step_by(BLOCK) {
        let end = (first + BLOCK).min(height);
        let rows = Rect {
            first: [0, first],
            size: [width, (end + ramps::HALO).min(height) - first],
        };
        let mut depth = std::mem::take(&mut above);
        let before = depth.len();
        depth.extend(sheet.read(Kind::Depth, &rows)?);
        let around = Rect {
            first: [0, first - before / width],
            size: [width, depth.len() / width],
        };
        let colours = sheet.colours(&around)?;
        let sharp = sharpened(projection, (&depth, &colours), width, edges);
        let own = before..before + (end - first) * width;
        sheet.write(Kind::Depth, [0, first], &sharp[own.clone()])?;
        above = depth[own.end.saturating_sub(ramps::HALO * width)..own.end].to_vec();
    }
    Ok(())
}

/// Second differences of the whole picture, band by band.
fn bends_of_sheet(sheet: &Sheet, projection: Projection) -> Result<Vec<f32>, Error> {
    let [width, height] = sheet.size;
    let mut bends = Vec::with_capacity(width * height / BEND_STRIDE + 1);
    for y in 0..height {
        let row = Rect {
            first: [0, y],
            size: [width, 1],
        };
        let depth = sheet.read(Kind::Depth, &row)?;
        bends.extend(bends_of_row(&disparities(projection, &depth), y * width));
    }
    Ok(bends)
}

/// The blocks of the picture, row of blocks by row of blocks.
fn ranges(sheet: &Sheet, projection: Projection, tolerance: f32) -> Result<Blocks, Error> {
    let [width, height] = sheet.size;
    let mut blocks = Blocks::new(sheet.size);
    for first in (0..height).step_by(BLOCK) {
        let from = first.saturating_sub(HALO);
        let to = (first + BLOCK + 1 + HALO).min(height);
        let depth = sheet.read(
            Kind::Depth,
            &Rect {
                first: [0, from],
                size: [width, to - from],
            },
        )?;
        blocks.push_row(&disparities(projection, &depth), tolerance, first - from);
    }
    Ok(blocks)
}

fn disparities(projection: Projection, depth: &[f32]) -> Vec<f32> {
    depth
        .iter()
        .map(|&z| disparity(projection, z).unwrap_or(f32::NAN))
        .collect()
}
