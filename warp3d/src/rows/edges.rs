//! Where surfaces end between the samples of a row, and what colours they have there.
//!
//! A sample beside a depth edge blends two surfaces. Its share of the other one, with the next samples inside as the pure colours, says
//! where between the two samples the edge lies, as in `surfaces::rims`; here along rows alone.

use rayon::prelude::*;

use crate::Reference;
use crate::options::SurfaceTolerance;
use crate::surfaces::rims::LEAST_CONTRAST2;
use crate::surfaces::sharpen_edges::{Edges, sharpened_in_bands};
use crate::surfaces::surface::{RIGHT, links};
use crate::surfaces::tolerance::{bridge, tolerance_of};
use crate::view::warp::disparity;

/// The samples of a reference, and the edges between them.
#[derive(Clone, Debug)]
pub(crate) struct RowEdges {
    width: usize,
    /// 1/z of each sample; NaN where it is unknown.
    disparity: Vec<f32>,
    /// Coefficients of the cubic spline along each surface of a row; the fourth number is unused.
    coefficients: Vec<[f32; 4]>,
    /// How far each sample reaches to its left and to its right, samples, where a surface ends there.
    reaches: Vec<[f32; 2]>,
    /// The number of each sample's surface on its row.
    surfaces: Vec<u32>,
    /// Number of samples with a depth.
    pub(super) known: u64,
    /// The largest disparity.
    pub(super) largest: f32,
}

/// The samples of one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Samples<'a> {
    /// 1/z; NaN where it is unknown.
    pub(super) disparity: &'a [f32],
    /// Coefficients of the cubic spline along each surface.
    pub(super) coefficients: &'a [[f32; 4]],
    /// How far each sample reaches to its left and to its right, samples, where a surface ends there.
    pub(super) reaches: &'a [[f32; 2]],
    /// The number of each sample's surface.
    pub(super) surfaces: &'a [u32],
}

/// How far the farther surface goes on behind the nearer one, samples, so that rounding opens no crack.
const BEHIND: f32 = 0.05;

/// Largest share of the other surface: the centre of a sample lies on its own.
const LARGEST_SHARE: f32 = 0.5;

impl RowEdges {
    /// The surfaces in the rows of `reference`, whose depth is made sharp as its `edges` ask for it.
    pub(super) fn new(reference: &Reference, tolerance: SurfaceTolerance, edges: Edges) -> Self {
        let camera = &reference.camera;
        let size = [camera.width as usize, camera.height as usize];
        let width = size[0];
        let given = (&reference.depth[..], &reference.colour[..]);
        let mut of_samples = match edges {
            Edges::Sharp => reference.depth.clone(),
            edges => sharpened_in_bands(camera.projection, given, width, edges),
        };
        let to_disparity = |z: &mut f32| *z = disparity(camera.projection, *z).unwrap_or(f32::NAN);
        of_samples.par_iter_mut().for_each(to_disparity);
        let tolerance = match tolerance {
            SurfaceTolerance::Relative(t) => t,
            SurfaceTolerance::Auto => tolerance_of(&of_samples, size),
        };
        bridge(&mut of_samples, size, tolerance);
        let links = links(&of_samples, size, tolerance);
        let mut reaches = vec![[0.5; 2]; of_samples.len()];
        let mut surfaces = vec![0; of_samples.len()];
        let mut coefficients = vec![[0.0; 4]; of_samples.len()];
        let rows = (reaches.par_chunks_mut(width)).zip(coefficients.par_chunks_mut(width));
        let rows = rows.zip(surfaces.par_chunks_mut(width)).enumerate();
        rows.for_each(|(y, ((reaches, coefficients), surfaces))| {
            let row = y * width..(y + 1) * width;
            let colours = reference.colour[row.clone()].iter();
            for (to, colour) in coefficients.iter_mut().zip(colours) {
                // A NaN or an infinity times a weight of 0 is NaN, which would spread.
                let [r, g, b] = colour.map(|v| if v.is_finite() { v } else { 0.0 });
                *to = [r, g, b, 0.0];
            }
            if of_samples[row.clone()].iter().all(|d| d.is_nan()) {
                return;
            }
            number(&links[row.clone()], surfaces);
            take_apart(&of_samples[row], surfaces, coefficients, reaches);
            solve(coefficients, surfaces);
        });
        Self {
            width,
            known: of_samples.iter().filter(|d| !d.is_nan()).count() as u64,
            largest: of_samples.par_iter().copied().reduce(|| 0.0, f32::max),
            disparity: of_samples,
            coefficients,
            reaches,
            surfaces,
        }
    }

    /// The samples of row `y`.
    pub(super) fn row(&self, y: usize) -> Samples<'_> {
        let row = y * self.width..(y + 1) * self.width;
        Samples {
            disparity: &self.disparity[row.clone()],
            coefficients: &self.coefficients[row.clone()],
            reaches: &self.reaches[row.clone()],
            surfaces: &self.surfaces[row],
        }
    }
}

/// Numbers the surfaces of a row from its links.
fn number(links: &[u8], surfaces: &mut [u32]) {
    let mut surface = 0;
    for (to, link) in surfaces.iter_mut().zip(links) {
        *to = surface;
        surface += u32::from(link & RIGHT == 0);
    }
}

/// Finds how far the samples beside edges of a row reach, and gives them the colour of their own surface.
fn take_apart(
    disparity: &[f32],
    surfaces: &[u32],
    colours: &mut [[f32; 4]],
    reaches: &mut [[f32; 2]],
) {
    // A sample between two edges is taken apart at each as it was given.
    let mut given = colours[0];
    for right in 1..disparity.len() {
        let left = right - 1;
        let beside = [given, colours[right]];
        given = colours[right];
        if surfaces[left] == surfaces[right] {
            continue;
        }
        let mut place = 0.5;
        let is_known = !disparity[left].is_nan() && !disparity[right].is_nan();
        // The next samples inside; one that is alone counts as pure.
        let inside = |at: usize, of: usize| match surfaces.get(at) == Some(&surfaces[of]) {
            true => colours[at],
            false => beside[of - left],
        };
        let pure = [inside(left.wrapping_sub(1), left), inside(right + 1, right)];
        if let Some(mixed) = Mixed::of(beside, pure).filter(|_| is_known) {
            let [of_right, of_left] = mixed.shares;
            place = 0.5 - of_right + of_left;
            colours[left] = without(colours[left], mixed.across, of_right);
            colours[right] = without(colours[right], mixed.across, -of_left);
        }
        (reaches[left][1], reaches[right][0]) = (place, 1.0 - place);
        // The farther surface continues behind the nearer one. Where the left depth is unknown, the right surface continues.
        match disparity[left] < disparity[right] {
            true => reaches[left][1] += BEHIND,
            false => reaches[right][0] += BEHIND,
        }
    }
}

/// The samples on either side of an edge as mixtures of two surfaces.
struct Mixed {
    /// The step from the colour of the left surface to that of the right one.
    across: [f32; 4],
    /// The share of the right surface in the left sample, and of the left one in the right sample.
    shares: [f32; 2],
}

impl Mixed {
    /// Of the colours of both samples and of both surfaces; `None` where these are alike.
    fn of([left, right]: [[f32; 4]; 2], pure: [[f32; 4]; 2]) -> Option<Self> {
        let across = difference(pure[1], pure[0]);
        let contrast2 = dot(across, across);
        let share = |off: f32| (off / contrast2).clamp(0.0, LARGEST_SHARE);
        let is_told = contrast2 >= LEAST_CONTRAST2 && contrast2.is_finite();
        is_told.then(|| Self {
            across,
            shares: [
                share(dot(difference(left, pure[0]), across)),
                share(dot(difference(pure[1], right), across)),
            ],
        })
    }
}

/// The colour without a share of the step `across` to another surface.
fn without(colour: [f32; 4], across: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|c| (colour[c] - share * across[c]).max(0.0))
}

/// The coefficients of the cubic spline through the colours of each surface of a row, in their place: surfaces are mirrored at their ends.
fn solve(colours: &mut [[f32; 4]], surfaces: &[u32]) {
    let mut first = 0;
    for surface in surfaces.chunk_by(|a, b| a == b) {
        solve_run(&mut colours[first..first + surface.len()]);
        first += surface.len();
    }
}

/// The pole of the cubic B-spline, sqrt(3) - 2.
const POLE: f32 = -0.267_949_2;

/// Samples after which the pole's power is below 1e-7.
const HORIZON: usize = 13;

fn solve_run(run: &mut [[f32; 4]]) {
    let count = run.len();
    if count == 1 {
        return;
    }
    // The sum over the mirrored run before its first sample.
    let mut sum = run[0];
    let mut power = POLE;
    for colour in &run[1..count.min(HORIZON)] {
        sum = plus(sum, *colour, power);
        power *= POLE;
    }
    run[0] = sum;
    for i in 1..count {
        run[i] = plus(run[i], run[i - 1], POLE);
    }
    // The mirrored end.
    let end = plus(run[count - 1], run[count - 2], POLE);
    run[count - 1] = end.map(|v| v * (POLE / (POLE * POLE - 1.0)));
    for i in (0..count - 1).rev() {
        run[i] = std::array::from_fn(|c| POLE * (run[i + 1][c] - run[i][c]));
    }
    for colour in run {
        *colour = colour.map(|v| 6.0 * v);
    }
}

fn plus(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] + share * b[c])
}

fn difference(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: [f32; 4], b: [f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
