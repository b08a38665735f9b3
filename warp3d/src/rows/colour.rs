//! The colours that a row of the screen sees: a pixel away from edges looks its colour up at its centre; one at an edge weights the
//! surfaces around it by the pixel's Gaussian.

use std::ops::Range;

use resample_core::narrow::cell;
use resample_core::point::PIXEL_SIGMA_PX;

use super::edges::Samples;
use super::scan::{Division, NOTHING, Scan};
use crate::resolve::colour::Axis;
use crate::view::layer::{Mix, Row};

/// Sigma of the pixel's Gaussian, px.
const SIGMA_PX: f32 = PIXEL_SIGMA_PX as f32;

/// Least sigma of a filter of columns, columns: half a column off, a weight is a hundredth then.
const LEAST_SIGMA: f32 = 1.0 / 6.0;

/// Half the width of a pixel's window, px: three sigma.
const WINDOW: f32 = 1.5;

/// The filters of a row, which are the same for all its pixels.
#[derive(Clone, Debug)]
pub(super) struct Filters {
    /// The weights of the sub-pixels around a pixel's centre.
    subpixels: Vec<f32>,
    /// The weights of the columns around the pixel. The samples are filtered already, so these are narrower; a single weight of 1 where pixels
    /// are not larger than samples.
    columns: Vec<f32>,
}

impl Filters {
    /// The filters of rows that are divided so.
    pub(super) fn new(division: &Division) -> Self {
        let fine = division.of_pixel();
        let gaussian = |count: usize, variance: f32| -> Vec<f32> {
            let offset = |i: usize| ((i as f32 + 0.5) / count as f32 - 0.5) * 2.0 * WINDOW;
            let weight = |i: usize| (-0.5 * offset(i).powi(2) / variance).exp();
            // Weights of a sum of 1 keep sums of the largest numbers finite.
            let sum: f32 = (0..count).map(weight).sum();
            (0..count).map(|i| weight(i) / sum).collect()
        };
        let variance = SIGMA_PX * SIGMA_PX;
        let columns = match division.columns {
            1 => vec![1.0],
            columns => {
                let left = variance * (1.0 - 1.0 / (division.samples * division.samples));
                // Not narrower than this: else the two columns beside the centre would have no weight.
                let least = (LEAST_SIGMA / columns as f32).powi(2);
                gaussian(3 * columns, left.max(least))
            }
        };
        Self {
            subpixels: gaussian(3 * fine, variance),
            columns,
        }
    }
}

/// A pixel of a row.
#[derive(Clone, Copy)]
struct Pixel {
    rgba: [f32; 4],
    depth: f32,
    resolution: f32,
    mix: Mix,
}

/// One surface in a pixel's window, as far as it is seen.
#[derive(Clone, Copy, Default)]
struct Part {
    weight: f32,
    /// Sums over its sub-pixels, weighted: disparity, and place on the row.
    nearness: f32,
    place: f32,
}

/// A row of the reference, where it lies on the screen.
struct Shown<'a> {
    scan: &'a Scan,
    samples: &'a Samples<'a>,
    division: &'a Division,
    filters: &'a Filters,
}

/// Adds what `scan` sees to a row, `weight` times; gives the number of pixels in which surfaces blend. Depth is that of the last row.
pub(super) fn draw(
    to: &mut Row<'_>,
    scan: &mut Scan,
    samples: &Samples<'_>,
    (division, filters): (&Division, &Filters),
    weight: f32,
) -> u64 {
    scan.look_up_columns(samples, division);
    let shown = Shown {
        scan,
        samples,
        division,
        filters,
    };
    let mut edge_pixels = 0;
    for x in 0..to.rgba.len() {
        let window = shown.window(x);
        let is_edge = scan.edges[window.start] != scan.edges[window.end - 1];
        edge_pixels += u64::from(is_edge);
        let seen = match is_edge {
            true => shown.at_edge(x, window),
            false => shown.inside(x),
        };
        let Some(pixel) = seen else { continue };
        add(&mut to.rgba[x], weight, pixel.rgba);
        (to.depth[x], to.resolution[x]) = (pixel.depth, pixel.resolution);
        to.mixes[x] = pixel.mix;
    }
    edge_pixels
}

/// Keeps the colours of a row in their range: a spline swings beyond it beside edges of the picture.
pub(super) fn keep_in_range(row: &mut Row<'_>) {
    for rgba in row.rgba.iter_mut() {
        *rgba = rgba.map(|v| v.max(0.0));
        rgba[3] = rgba[3].min(1.0);
    }
}

impl Shown<'_> {
    /// The sub-pixels within a pixel's Gaussian.
    fn window(&self, x: usize) -> Range<usize> {
        let of_pixel = self.division.of_pixel();
        (x * of_pixel).saturating_sub(of_pixel)
            ..((x + 2) * of_pixel).min(self.scan.pos_in_row.len())
    }

    /// A pixel whose window sees one surface, or nothing.
    #[inline(always)]
    fn inside(&self, x: usize) -> Option<Pixel> {
        let (scan, of_pixel) = (self.scan, self.division.of_pixel());
        // The sub-pixels on either side of its centre.
        let behind = x * of_pixel + of_pixel / 2;
        let before = behind - 1;
        if scan.surface[behind] == NOTHING {
            return None;
        }
        let [r, g, b, _] = match self.division.columns {
            1 => scan.columns[x],
            _ => self.filtered(x),
        };
        let samples = (scan.pos_in_row[behind] - scan.pos_in_row[before]) * of_pixel as f32;
        Some(Pixel {
            rgba: [r, g, b, 1.0],
            depth: 2.0 / (scan.nearness[before] + scan.nearness[behind]),
            resolution: samples.min(1.0),
            mix: Mix::ONE,
        })
    }

    /// The columns around a pixel, filtered; those of the border beyond it.
    #[inline(always)]
    fn filtered(&self, x: usize) -> [f32; 4] {
        let (columns, of_pixel) = (&self.scan.columns, self.division.columns);
        let last = columns.len() - 1;
        let mut sum = [0.0; 4];
        for (i, &weight) in self.filters.columns.iter().enumerate() {
            let at = (x * of_pixel + i).saturating_sub(of_pixel).min(last);
            add(&mut sum, weight, columns[at]);
        }
        sum
    }

    /// A pixel beside an edge. The pixel's Gaussian gives each surface in its window a weight; the surface's colour is that of the spline at the mean of its places.
    fn at_edge(&self, x: usize, window: Range<usize>) -> Option<Pixel> {
        let scan = self.scan;
        // A window that begins with the picture has lost its first pixel.
        let lost = if x == 0 { self.division.of_pixel() } else { 0 };
        let weights = &self.filters.subpixels[lost..];
        let (mut sum, mut inside) = ([0.0; 4], 0.0);
        let (mut main, mut front) = (Part::default(), 0.0f32);
        let mut at = window.start;
        while at < window.end {
            let first = at;
            let mut part = Part::default();
            while at < window.end && scan.edges[at] == scan.edges[first] {
                let weight = weights[at - window.start];
                part.weight += weight;
                part.nearness += weight * scan.nearness[at];
                part.place += weight * scan.pos_in_row[at];
                at += 1;
            }
            inside += part.weight;
            if scan.surface[first] == NOTHING {
                continue;
            }
            let [r, g, b, _] = spline(self.samples, part.place / part.weight, scan.surface[first]);
            add(&mut sum, part.weight, [r, g, b, 1.0]);
            front = front.max(part.nearness / part.weight);
            if part.weight > main.weight {
                main = part;
            }
        }
        let nearness = main.nearness / main.weight;
        (main.weight > 0.0).then(|| Pixel {
            rgba: sum.map(|v| v / inside),
            depth: 1.0 / nearness,
            resolution: 1.0,
            mix: Mix {
                purity: main.weight / sum[3],
                front: if front > nearness {
                    1.0 / front
                } else {
                    f32::INFINITY
                },
            },
        })
    }
}

impl Scan {
    /// Looks up the colour in the middle of each column that sees one surface.
    fn look_up_columns(&mut self, samples: &Samples<'_>, division: &Division) {
        let columns = self.pos_in_row.len() / division.of_column;
        self.columns.clear();
        self.columns.resize(columns, [0.0; 4]);
        for (column, colour) in self.columns.iter_mut().enumerate() {
            let behind = column * division.of_column + division.of_column / 2;
            let surface = self.surface[behind];
            if surface != NOTHING && surface == self.surface[behind - 1] {
                let middle = 0.5 * (self.pos_in_row[behind - 1] + self.pos_in_row[behind]);
                *colour = spline(samples, middle, surface);
            }
        }
    }
}

/// Adds a colour `weight` times.
#[inline(always)]
fn add(to: &mut [f32; 4], weight: f32, colour: [f32; 4]) {
    for (to, value) in to.iter_mut().zip(colour) {
        *to += weight * value;
    }
}

/// The cubic spline of a surface at a place, samples from the first one's centre; beyond the surface's ends its last colour.
#[inline(always)]
fn spline(samples: &Samples<'_>, at: f32, surface: u32) -> [f32; 4] {
    let last = samples.surfaces.len() - 1;
    let is_of = |i: usize| samples.surfaces[i] == surface;
    let mut before = cell(at).min(last);
    // Beyond an end of the surface.
    if !is_of(before) {
        before = if before < last && is_of(before + 1) {
            before + 1
        } else {
            before.saturating_sub(1)
        };
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
    let after = if has_next && next < last && is_of(next + 1) {
        next + 1
    } else {
        before
    };
    let weights = Axis::new(t).value;
    let taps = [previous, before, next, after].map(|i| samples.coefficients[i]);
    std::array::from_fn(|c| {
        weights[0] * taps[0][c]
            + weights[1] * taps[1][c]
            + weights[2] * taps[2][c]
            + weights[3] * taps[3][c]
    })
}
