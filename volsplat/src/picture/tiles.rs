//! The tiles of a frame: what each shows, and what it cost.

use resample_core::clock::StageTime;
use resample_core::composite::{TileCounts, TilePixels};
use resample_core::maps::TilePlane;
use resample_core::tile::TILE_PX;

use crate::stats::{FrameStats, SampleCounts};

/// One tile of the frame buffer, with what it cost.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileSlot {
    /// The pixels of the tile, row by row, made when the tile first shows something: memory follows what is
    /// visible. Read it with [`TileSlot::shown`].
    pixels: Vec<ShownPixel>,
    /// Half of the differences between the halves of the pixels, along x and along y; only where means are corrected by
    /// them.
    slopes: Vec<[Values; 2]>,
    /// True if `pixels` are of this frame.
    seen: bool,
    pub(crate) entries: Vec<u64>,
    /// Items listed in the tile, where they are not in `entries`.
    listed: usize,
    pub(crate) counts: TileCounts,
    /// Counts of a field's samples.
    pub(crate) work: SampleCounts,
    pub(crate) sort_ms: f64,
    pub(crate) composite_ms: f64,
}

/// A pixel of the picture, premultiplied.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShownPixel {
    pub(crate) rgb: [f32; 3],
    pub(crate) opacity: f32,
    /// Depth times the opacity that it was seen with.
    pub(crate) depth: f32,
}

/// How the pixels of a picture follow from sub-pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Means {
    /// As the mean of their own.
    Own,
    /// With the first term of its error taken away.
    Corrected,
}

/// Numbers of a pixel.
pub(super) const VALUES: usize = 5;

/// The numbers of a pixel side by side.
pub(super) type Values = [f32; VALUES];

impl ShownPixel {
    pub(super) fn values(&self) -> Values {
        let [red, green, blue] = self.rgb;
        [red, green, blue, self.opacity, self.depth]
    }

    pub(super) fn of_values([red, green, blue, opacity, depth]: Values) -> Self {
        Self {
            rgb: [red, green, blue],
            opacity,
            depth,
        }
    }
}

impl TileSlot {
    /// An empty tile that `listed` items touch.
    pub(crate) fn reset(&mut self, listed: usize) {
        self.seen = false;
        self.entries.clear();
        self.listed = listed;
        self.counts = TileCounts::default();
        self.work = SampleCounts::default();
        (self.sort_ms, self.composite_ms) = (0.0, 0.0);
    }

    /// Takes note of more items that touch the tile.
    pub(crate) fn list_more(&mut self, listed: usize) {
        self.listed += listed;
    }

    /// Adds to what the tile cost.
    pub(crate) fn count(&mut self, counts: TileCounts) {
        self.counts.composited += counts.composited;
        self.counts.pixels_touched += counts.pixels_touched;
    }

    /// Adds to what became of the samples of a field.
    pub(crate) fn count_samples(&mut self, work: SampleCounts) {
        self.work.computed += work.computed;
        self.work.shown += work.shown;
        self.work.contributed += work.contributed;
    }

    /// Keeps what the tile shows in this frame: the means over squares of `subpixels` on a side, and what corrects them.
    pub(crate) fn show(&mut self, pixels: &TilePixels, subpixels: usize, means: Means) {
        self.seen = true;
        let side = TILE_PX / subpixels;
        let places = (0..side * side).map(|i| [i % side, i / side]);
        self.pixels.clear();
        self.slopes.clear();
        if means == Means::Corrected && subpixels > 1 {
            let quarters = quarters(pixels, subpixels / 2);
            for at in places {
                let (mean, slopes) = mean_and_slopes(&quarters, at);
                self.pixels.push(ShownPixel::of_values(mean));
                self.slopes.push(slopes);
            }
        } else {
            let averaged = pixels.averaged(subpixels);
            let pixel = |at| ShownPixel::of_values(values_at(&averaged, at));
            self.pixels.extend(places.map(pixel));
        }
    }

    /// The pixels of the tile in this frame, row by row; `None` where nothing is seen.
    pub(crate) fn shown(&self) -> Option<&[ShownPixel]> {
        self.seen.then_some(self.pixels.as_slice())
    }

    /// A row of the tile's pixels, `side` of them, and of their slopes where there are any; `None` where it shows nothing.
    pub(super) fn row(&self, y: usize, side: usize) -> Option<(&[ShownPixel], &[[Values; 2]])> {
        let pixels = &self.shown()?[y * side..][..side];
        let slopes = self.slopes.get(y * side..(y + 1) * side);
        Some((pixels, slopes.unwrap_or_default()))
    }
}

/// The numbers of a pixel of a tile.
fn values_at(pixels: &TilePixels, [x, y]: [usize; 2]) -> Values {
    let [red, green, blue] = &pixels.rgb;
    let at = |plane: &TilePlane| plane[y][x];
    let opacity = 1.0 - at(&pixels.transmittance);
    [at(red), at(green), at(blue), opacity, at(&pixels.depth)]
}

/// The means over squares of so many sub-pixels on a side, quarters of pixels.
fn quarters(pixels: &TilePixels, side: usize) -> TilePixels {
    let share = 1.0 / (side * side) as f32;
    let mean = |plane: &TilePlane| -> TilePlane {
        let mut means = [[0.0; TILE_PX]; TILE_PX];
        for (rows, means) in plane.chunks_exact(side).zip(&mut means) {
            let mut sums = [0.0; TILE_PX];
            for row in rows {
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += value;
                }
            }
            for (mean, sums) in means.iter_mut().zip(sums.chunks_exact(side)) {
                *mean = share * sums.iter().sum::<f32>();
            }
        }
        means
    };
    TilePixels {
        transmittance: mean(&pixels.transmittance),
        rgb: [0, 1, 2].map(|k| mean(&pixels.rgb[k])),
        depth: mean(&pixels.depth),
    }
}

/// The mean of a pixel, and half of the differences between its halves along x and along y, from its quarters.
fn mean_and_slopes(quarters: &TilePixels, [x, y]: [usize; 2]) -> (Values, [Values; 2]) {
    let at = |right: usize, down: usize| values_at(quarters, [2 * x + right, 2 * y + down]);
    let [[a, b], [c, d]] = [[at(0, 0), at(1, 0)], [at(0, 1), at(1, 1)]];
    let (mut mean, mut slopes) = ([0.0; VALUES], [[0.0; VALUES]; 2]);
    for k in 0..VALUES {
        mean[k] = 0.25 * ((a[k] + b[k]) + (c[k] + d[k]));
        slopes[0][k] = 0.25 * ((b[k] - a[k]) + (d[k] - c[k]));
        slopes[1][k] = 0.25 * ((c[k] - a[k]) + (d[k] - b[k]));
    }
    (mean, slopes)
}

/// Adds up what the tiles cost.
pub(crate) fn tally(slots: &[TileSlot], whole: StageTime, stats: &mut FrameStats) {
    let (mut sort_ms, mut composite_ms) = (0.0, 0.0);
    for slot in slots {
        sort_ms += slot.sort_ms;
        composite_ms += slot.composite_ms;
        let listed = slot.entries.len() + slot.listed;
        stats.tile_pairs += listed as u64;
        stats.hidden_pairs += (listed - slot.counts.composited) as u64;
        stats.pixels_touched += slot.counts.pixels_touched as u64;
        stats.lanes_computed += slot.work.computed as u64;
        stats.samples_shown += slot.work.shown as u64;
        stats.samples_contributed += slot.work.contributed as u64;
    }
    [stats.stages.sort, stats.stages.composite] = whole.shared([sort_ms, composite_ms]);
}
