//! The pieces between the samples of a row, laid on a row of the screen: at each sub-pixel the nearest one wins.

use resample_core::narrow::{cell, count, single, whole};

use super::edges::Samples;

/// Least number of sub-pixels of a pixel, as many as the hybrid has.
const SUBPIXELS: usize = 4;

/// Stands for a sub-pixel in which nothing is seen.
pub(super) const NOTHING: u32 = u32::MAX;

/// Where the samples of a row lie on the screen, and how finely it is divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Division {
    /// Sub-pixel x: per sample, at the first sample, and per unit of disparity.
    place: [f64; 3],
    /// Samples of a pixel.
    pub(super) samples: f32,
    /// Columns of a pixel: enough that a column is at most as wide as a sample.
    pub(super) columns: usize,
    /// Sub-pixels of a column, an even number.
    pub(super) of_column: usize,
}

/// The sub-pixels of a row, each with the nearest piece that it sees.
#[derive(Clone, Debug, Default)]
pub(super) struct Scan {
    /// Disparity of the nearest piece; below 0 where nothing is seen.
    pub(super) nearness: Vec<f32>,
    /// The place on the reference's row, samples from the first one's centre.
    pub(super) pos_in_row: Vec<f32>,
    /// The number of the surface, [`NOTHING`] for none.
    pub(super) surface: Vec<u32>,
    /// The number of edges up to each sub-pixel, and between it and the one before.
    pub(super) edges: Vec<u32>,
    /// The colour in the middle of each column, where it sees one surface.
    pub(super) columns: Vec<[f32; 4]>,
    /// Sub-pixel x of each sample.
    x: Vec<f32>,
}

/// Neighbouring sub-pixels see two parts of one surface that are farther from each other than this, samples: it folds over itself.
const FAR: f32 = 2.0;

/// An end of a piece.
#[derive(Clone, Copy)]
struct End {
    x: f32,
    at: f32,
    nearness: f32,
}

impl Division {
    /// Screen x in px: per reference px, at 0, and per unit of disparity.
    pub(super) fn new([scale, offset, disparity]: [f64; 3]) -> Self {
        let columns = count(whole((1.0 / scale - ROUNDING).ceil())).clamp(1, MOST_COLUMNS);
        let of_column = if columns == 1 {
            SUBPIXELS
        } else {
            SUBPIXELS / 2
        };
        let fine = (columns * of_column) as f64;
        Self {
            // The centre of the first sample lies at half a reference px.
            place: [
                scale * fine,
                (offset + 0.5 * scale) * fine,
                disparity * fine,
            ],
            samples: single(1.0 / scale),
            columns,
            of_column,
        }
    }

    /// Sub-pixels of a pixel.
    pub(super) fn of_pixel(&self) -> usize {
        self.columns * self.of_column
    }
}

/// Samples by which a pixel may be larger than one without a second column: rounding of the lens.
const ROUNDING: f64 = 1e-6;

/// Most columns of a pixel: pictures made smaller than to a sixteenth alias.
const MOST_COLUMNS: usize = 16;

impl Scan {
    /// Lays a row of samples, none of them nearer than disparity `largest`, on a row of `width` pixels.
    pub(super) fn lay(
        &mut self,
        samples: &Samples<'_>,
        division: &Division,
        largest: f32,
        width: usize,
    ) {
        let fine = width * division.of_pixel();
        self.nearness.clear();
        self.nearness.resize(fine, -1.0);
        self.pos_in_row.resize(fine, 0.0);
        self.surface.clear();
        self.surface.resize(fine, NOTHING);
        let [scale, offset, per_disparity] = division.place;
        self.x.clear();
        let x = |(i, &d): (usize, &f32)| {
            (scale * i as f64 + (offset + per_disparity * f64::from(d))) as f32
        };
        self.x.extend(samples.disparity.iter().enumerate().map(x));
        let spacing = single(scale);
        let last = samples.disparity.len() - 1;
        for i in 0..=last {
            let nearness = samples.disparity[i];
            if nearness.is_nan() || nearness > largest {
                continue;
            }
            let here = End {
                x: self.x[i],
                at: i as f32,
                nearness,
            };
            let surface = samples.surfaces[i];
            let [left, right] = samples.reaches[i];
            if i == 0 || samples.surfaces[i - 1] != surface {
                self.draw(here.moved(-left, spacing), here, surface);
            }
            let end = if i == last || samples.surfaces[i + 1] != surface {
                here.moved(right, spacing)
            } else if samples.disparity[i + 1] <= largest {
                End {
                    x: self.x[i + 1],
                    at: (i + 1) as f32,
                    nearness: samples.disparity[i + 1],
                }
            } else {
                continue;
            };
            self.draw(here, end, surface);
        }
        self.count_edges();
    }

    fn count_edges(&mut self) {
        self.edges.clear();
        let mut count = 0;
        let mut before = (self.surface[0], self.pos_in_row[0]);
        let subpixels = self.surface.iter().zip(&self.pos_in_row);
        self.edges.extend(subpixels.map(|(&surface, &at)| {
            // Where nothing is seen the place is that of an earlier row.
            let is_far = surface != NOTHING && (at - before.1).abs() > FAR;
            let is_edge = surface != before.0 || is_far;
            before = (surface, at);
            count += u32::from(is_edge);
            count
        }));
    }

    /// Draws a piece of a surface; one that is turned away is left out.
    #[inline(always)]
    fn draw(&mut self, from: End, to: End, surface: u32) {
        // The first sub-pixels whose centres lie behind; of what lies beyond the row nothing is left.
        let behind = |x: f32| {
            let whole = cell(x - 0.5);
            whole + usize::from((whole as f32) < x - 0.5)
        };
        let (first, end) = (behind(from.x), behind(to.x).min(self.pos_in_row.len()));
        if first >= end {
            return;
        }
        let per_x = 1.0 / (to.x - from.x);
        let (at_slope, slope) = (
            (to.at - from.at) * per_x,
            (to.nearness - from.nearness) * per_x,
        );
        let start = first as f32 + 0.5 - from.x;
        for s in first..end {
            let along = start + (s - first) as f32;
            let nearness = from.nearness + slope * along;
            if nearness > self.nearness[s] {
                self.nearness[s] = nearness;
                self.pos_in_row[s] = from.at + at_slope * along;
                self.surface[s] = surface;
            }
        }
    }
}

impl End {
    fn moved(self, samples: f32, spacing: f32) -> Self {
        Self {
            x: self.x + samples * spacing,
            at: self.at + samples,
            ..self
        }
    }
}
