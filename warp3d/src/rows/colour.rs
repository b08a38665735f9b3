//! The colours that a row of the screen sees: a pixel away from edges looks its colour up at its centre; one at an edge weights the
//! surfaces around it by the pixel's Gaussian.

use super::edges::Samples;
use super::scan::{NOTHING, SUBPIXELS, Scan, Step};
use crate::view::layer::Mix;

/// A row of a layer.
pub(super) struct Row<'a> {
    pub(super) rgba: &'a mut [[f32; 4]],
    pub(super) depth: &'a mut [f32],
    pub(super) resolution: &'a mut [f32],
    pub(super) mixes: &'a mut [Mix],
}

/// Sigma of the pixel's Gaussian, px.
const SIGMA_PX: f32 = 0.5;

/// Half the width of a pixel's window, px: three sigma.
const WINDOW: f32 = 1.5;

/// The filters of a row, which are the same for all its pixels.
#[derive(Clone, Debug)]
pub(super) struct Filters {
    /// The weights of the sub-pixels around a pixel's centre.
    subpixels: Vec<f32>,
    /// The weights of the columns around it, for what the reference's own Gaussian leaves; one where pixels are not larger than samples.
    columns: Vec<f32>,
}

impl Filters {
    pub(super) fn new(step: &Step) -> Self {
        let fine = step.of_pixel();
        let gaussian = |count: usize, variance: f32| -> Vec<f32> {
            let offset = |i: usize| ((i as f32 + 0.5) / count as f32 - 0.5) * 2.0 * WINDOW;
            let weights = (0..count).map(|i| (-0.5 * offset(i).powi(2) / variance).exp());
            weights.collect()
        };
        let variance = SIGMA_PX * SIGMA_PX;
        let columns = match step.columns {
            1 => vec![1.0],
            columns => {
                let left = variance * (1.0 - 1.0 / (step.samples * step.samples));
                let weights = gaussian(3 * columns, left.max(1e-6));
                let sum: f32 = weights.iter().sum();
                weights.iter().map(|w| w / sum).collect()
            }
        };
        Self {
            subpixels: gaussian(3 * fine, variance),
            columns,
        }
    }
}

/// What is seen of one surface in a pixel's window.
#[derive(Clone, Copy, Default)]
struct Part {
    weight: f32,
    /// Its disparity times its weight.
    nearness: f32,
}

impl Row<'_> {
    /// Nothing is seen.
    pub(super) fn clear(&mut self) {
        self.rgba.fill([0.0; 4]);
        self.depth.fill(f32::INFINITY);
        self.resolution.fill(0.0);
        self.mixes.fill(Mix::ONE);
    }

    /// Keeps colours in their range: a spline swings beyond it beside edges of the picture.
    pub(super) fn finish(&mut self) {
        for rgba in self.rgba.iter_mut() {
            *rgba = rgba.map(|v| v.max(0.0));
            rgba[3] = rgba[3].min(1.0);
        }
    }
}

/// Adds what `scan` sees, `weight` times; gives the number of pixels in which surfaces blend. Depth is that of the last row.
pub(super) fn add(
    scan: &mut Scan,
    samples: &Samples<'_>,
    (step, filters): (&Step, &Filters),
    weight: f32,
    to: &mut Row<'_>,
) -> u64 {
    let of_pixel = step.of_pixel();
    let fine = to.rgba.len() * of_pixel;
    let mut edge_pixels = 0;
    scan.look_up_columns(samples);
    for x in 0..to.rgba.len() {
        let window = (x * of_pixel).saturating_sub(of_pixel)..((x + 2) * of_pixel).min(fine);
        let middle = x * of_pixel + of_pixel / 2;
        let is_edge = scan.edges[window.start] != scan.edges[window.end - 1];
        if is_edge {
            let left_out = (x == 0) as usize * of_pixel;
            edge_pixels += at_edge(scan, samples, (x, window, left_out), filters, weight, to);
            continue;
        }
        if scan.surface[middle] == NOTHING {
            continue;
        }
        let rgb = if filters.columns.len() == 1 {
            scan.columns[x]
        } else {
            filtered(scan, filters, x * step.columns, step.columns)
        };
        for c in 0..3 {
            to.rgba[x][c] += weight * rgb[c];
        }
        to.rgba[x][3] += weight;
        let nearness = 0.5 * (scan.nearness[middle - 1] + scan.nearness[middle]);
        to.depth[x] = 1.0 / nearness;
        let samples_of_pixel = (scan.at[middle] - scan.at[middle - 1]) * of_pixel as f32;
        to.resolution[x] = samples_of_pixel.min(1.0);
    }
    edge_pixels
}

/// The columns around a pixel, whose first one is `first`, filtered.
#[inline(always)]
fn filtered(scan: &Scan, filters: &Filters, first: usize, columns: usize) -> [f32; 4] {
    let start = first as isize - columns as isize;
    let mut sum = [0.0f32; 4];
    for (i, weight) in filters.columns.iter().enumerate() {
        let at = (start + i as isize).clamp(0, scan.columns.len() as isize - 1) as usize;
        for c in 0..4 {
            sum[c] += weight * scan.columns[at][c];
        }
    }
    sum
}

/// A pixel beside an edge: each surface in its window weighs what the pixel's Gaussian gives it, and is looked up at its centre of gravity.
fn at_edge(
    scan: &Scan,
    samples: &Samples<'_>,
    (x, window, left_out): (usize, std::ops::Range<usize>, usize),
    filters: &Filters,
    weight: f32,
    to: &mut Row<'_>,
) -> u64 {
    let mut sum = [0.0f32; 4];
    let mut inside = 0.0;
    let (mut main, mut front) = (Part::default(), f32::NEG_INFINITY);
    let mut at = window.start;
    let weights = &filters.subpixels[left_out..];
    while at < window.end {
        let surface = scan.surface[at];
        let edges = scan.edges[at];
        let mut part = Part::default();
        let mut place = 0.0;
        while at < window.end && scan.edges[at] == edges {
            let w = weights[at - window.start];
            part.weight += w;
            part.nearness += w * scan.nearness[at];
            place += w * scan.at[at];
            at += 1;
        }
        inside += part.weight;
        if surface == NOTHING {
            continue;
        }
        let colour = spline(samples, place / part.weight, surface);
        for c in 0..3 {
            sum[c] += part.weight * colour[c];
        }
        sum[3] += part.weight;
        front = front.max(part.nearness / part.weight);
        if part.weight > main.weight {
            main = part;
        }
    }
    if main.weight == 0.0 {
        return 0;
    }
    for c in 0..4 {
        to.rgba[x][c] += weight * sum[c] / inside;
    }
    let nearness = main.nearness / main.weight;
    to.depth[x] = 1.0 / nearness;
    let purity = main.weight / sum[3];
    to.mixes[x] = Mix {
        purity,
        front: if front > nearness { 1.0 / front } else { f32::INFINITY },
    };
    to.resolution[x] = 1.0;
    1
}

impl Scan {
    /// Looks up the colour in the middle of each column that sees one surface.
    fn look_up_columns(&mut self, samples: &Samples<'_>) {
        let columns = self.at.len() / SUBPIXELS;
        self.columns.clear();
        self.columns.resize(columns, [0.0; 4]);
        for (column, colour) in self.columns.iter_mut().enumerate() {
            let middle = column * SUBPIXELS + SUBPIXELS / 2;
            let surface = self.surface[middle];
            if surface == NOTHING || surface != self.surface[middle - 1] {
                continue;
            }
            *colour = spline(samples, 0.5 * (self.at[middle - 1] + self.at[middle]), surface);
        }
    }
}

/// The cubic spline of a surface at a place, samples from the first one's centre; beyond the surface's ends its last colour.
#[inline(always)]
fn spline(samples: &Samples<'_>, at: f32, surface: u32) -> [f32; 4] {
    let last = samples.surfaces.len() - 1;
    let is_of = |i: usize| samples.surfaces[i] == surface;
    let mut before = (at.max(0.0) as usize).min(last);
    // Beyond an end of the surface.
    if !is_of(before) {
        before = if before < last && is_of(before + 1) { before + 1 } else { before.saturating_sub(1) };
    }
    let t = (at - before as f32).clamp(0.0, 1.0);
    let has_next = before < last && is_of(before + 1);
    let has_previous = before > 0 && is_of(before - 1);
    // Mirrored at the ends.
    let (previous, next, t) = match (has_previous, has_next) {
        (true, true) => (before - 1, before + 1, t),
        (false, true) => (before + 1, before + 1, t),
        (true, false) => (before - 1, before - 1, 0.0),
        (false, false) => (before, before, 0.0),
    };
    let after = if has_next && next < last && is_of(next + 1) { next + 1 } else { before };
    let u = 1.0 - t;
    let weights = [
        u * u * u / 6.0,
        2.0 / 3.0 - 0.5 * t * t * (2.0 - t),
        2.0 / 3.0 - 0.5 * u * u * (2.0 - u),
        t * t * t / 6.0,
    ];
    let taps = [previous, before, next, after].map(|i| samples.coefficients[i]);
    std::array::from_fn(|c| {
        weights[0] * taps[0][c] + weights[1] * taps[1][c] + weights[2] * taps[2][c] + weights[3] * taps[3][c]
    })
}
