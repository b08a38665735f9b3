//! Parts of a picture: bands of rows, so that whoever waits for it can stop it in between, and tiles, each drawn by a process of its own.
//!
//! Every part shows the pixels that the whole picture would show. Tiles begin at edges of the renderers' own tiles, so that their sizes
//! are alike and all are exact; the file of a tile says which one it is.

use std::ops::Range;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use resample_core::{Camera, Image};
use serde::{Deserialize, Serialize};

use crate::output::Format;
use crate::values::TileWord;

/// Side of a tile of the renderers, px: bands and windows begin at edges of tiles.
pub const TILE_SIDE: u32 = 16;

/// Some pixels of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// From the left.
    pub columns: Range<u32>,
    /// From the top.
    pub rows: Range<u32>,
}

impl Window {
    /// All pixels of a camera's picture.
    pub fn whole(camera: &Camera) -> Self {
        Self {
            columns: 0..camera.width,
            rows: 0..camera.height,
        }
    }

    /// Its first column and row, px.
    pub fn first(&self) -> [usize; 2] {
        [self.columns.start as usize, self.rows.start as usize]
    }

    /// Its width and height, px.
    pub fn size(&self) -> [usize; 2] {
        [self.columns.len(), self.rows.len()]
    }
}

/// The decision between two bands: draw the next, or stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Yes.
    Draw,
    /// No: nobody waits any more.
    Stop,
}

/// How large bands are.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// About so many pixels the next one has.
    pub band_px: u32,
    /// The time that a band should take, by that of the one before it; without it all are as large as the first.
    pub seconds: Option<f64>,
}

/// Bands that follow the time are not smaller than this: each draws two rows of tiles more than it shows.
const LEAST_BAND_PX: u32 = 1 << 18;

/// And not larger: a picture of 4096x4096.
const LARGEST_BAND_PX: u32 = 1 << 24;

impl Pace {
    /// Records the time of a band of `pixels`.
    fn took(&mut self, pixels: usize, taken: Duration) {
        if let Some(seconds) = self.seconds {
            let rate = pixels as f64 / taken.as_secs_f64().max(1e-6);
            // A cast saturates.
            self.band_px = ((rate * seconds) as u32).clamp(LEAST_BAND_PX, LARGEST_BAND_PX);
        }
    }
}

/// Draws a picture band by band, each as wide as the picture. After each band `next` gets the finished share; when it says stop, the result is `None`.
pub fn in_bands(
    camera: &Camera,
    pace: &mut Pace,
    draw: &mut dyn FnMut(&Window) -> Result<Image>,
    next: &mut dyn FnMut(f64) -> Next,
) -> Result<Option<Image>> {
    let width = camera.width.max(1);
    let mut joined: Option<Image> = None;
    let mut top = 0;
    while top < camera.height {
        let rows = (pace.band_px / width).next_multiple_of(TILE_SIDE);
        let bottom = (top + rows.max(TILE_SIDE)).min(camera.height);
        let start = Instant::now();
        let band = draw(&Window {
            columns: 0..camera.width,
            rows: top..bottom,
        })?;
        pace.took(band.rgba.len(), start.elapsed());
        if bottom - top == camera.height {
            return Ok(Some(band));
        }
        add(&mut joined, band);
        if next(f64::from(bottom) / f64::from(camera.height)) == Next::Stop {
            return Ok(None);
        }
        top = bottom;
    }
    Ok(joined)
}

/// Draws a window of a picture by a camera that is moved to it. It begins at edges of tiles.
pub fn moved(
    camera: &Camera,
    window: &Window,
    draw: &mut dyn FnMut(&Camera) -> Result<Image>,
) -> Result<Image> {
    if *window == Window::whole(camera) {
        return draw(camera);
    }
    let [columns, rows] = [
        widened(&window.columns, camera.width),
        widened(&window.rows, camera.height),
    ];
    let part = Camera {
        width: columns.end - columns.start,
        height: rows.end - rows.start,
        cx: camera.cx - f64::from(columns.start),
        cy: camera.cy - f64::from(rows.start),
        ..*camera
    };
    let drawn = draw(&part)?;
    let left = (window.columns.start - columns.start) as usize;
    let top = (window.rows.start - rows.start) as usize;
    Ok(drawn.window([left, top], window.size()))
}

/// Pixels are corrected by their neighbours: a tile more on both sides is drawn and cut off again.
fn widened(span: &Range<u32>, side: u32) -> Range<u32> {
    let first = (span.start / TILE_SIDE).saturating_sub(1) * TILE_SIDE;
    first..(span.end + TILE_SIDE).min(side)
}

/// Adds a band below those before it.
fn add(joined: &mut Option<Image>, band: Image) {
    let Some(joined) = joined else {
        *joined = Some(band);
        return;
    };
    joined.height += band.height;
    joined.rgba.extend(&band.rgba);
    if let (Some(above), Some(depth)) = (&mut joined.depth, &band.depth) {
        above.extend(depth);
    }
    for (above, plane) in joined.planes.iter_mut().zip(&band.planes) {
        above.values.extend(&plane.values);
    }
}

/// The record inside the file of a tile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PartMark {
    /// The version of the program.
    pub(crate) version: String,
    /// The vector instructions that drew it.
    pub(crate) vector_level: String,
    /// The mark of the whole picture.
    pub(crate) fingerprint: String,
    /// The number of the picture, where it is one of several.
    pub(crate) number: Option<usize>,
    /// Width and height of the whole picture, px.
    pub(crate) whole: [u32; 2],
    /// Column and row of the tile.
    pub(crate) place: [u32; 2],
    /// Columns and rows of all tiles.
    pub(crate) grid: [u32; 2],
    /// The format of the whole picture's file.
    pub(crate) format: Format,
}

/// The pixels of a tile.
pub(crate) fn window(word: &TileWord, [width, height]: [u32; 2]) -> Result<Window> {
    let span = |number: u32, count: u32, side: u32| -> Option<Range<u32>> {
        let blocks = u64::from(side.div_ceil(TILE_SIDE));
        let edge = |number: u32| {
            // At most `blocks`, which is a u32.
            let block = (u64::from(number) * blocks / u64::from(count)) as u32;
            (block * TILE_SIDE).min(side)
        };
        let span = edge(number)..edge(number + 1);
        (u64::from(count) <= blocks).then_some(span)
    };
    let spans = (
        span(word.column, word.grid.columns, width),
        span(word.row, word.grid.rows, height),
    );
    match spans {
        (Some(columns), Some(rows)) => Ok(Window { columns, rows }),
        _ => bail!(
            "--tile: a picture of {width}x{height} pixels has at most {}x{} tiles",
            width.div_ceil(TILE_SIDE),
            height.div_ceil(TILE_SIDE)
        ),
    }
}

#[cfg(test)]
mod tests {
    use crate::values;

    use super::*;

    #[test]
    fn tiles_cover_the_picture_once() {
        for (size, grid) in [([100, 80], "3x2"), ([800, 600], "7x5"), ([16, 16], "1x1")] {
            let (columns, rows) = grid.split_once('x').expect("a grid");
            let (columns, rows): (u32, u32) = (
                columns.parse().expect("a number"),
                rows.parse().expect("a number"),
            );
            let mut covered = vec![0; (size[0] * size[1]) as usize];
            for place in 0..columns * rows {
                let text = format!("{},{}/{grid}", place % columns, place / columns);
                let tile = values::tile(&text).expect("a tile");
                let window = window(&tile, size).expect("fits");
                for y in window.rows.clone() {
                    for x in window.columns.clone() {
                        covered[(y * size[0] + x) as usize] += 1;
                    }
                }
            }
            assert!(covered.iter().all(|&times| times == 1), "{grid}");
        }
        let small = values::tile("0,0/3x1").expect("a tile");
        assert!(window(&small, [32, 16]).is_err(), "only two of 16 pixels");
    }
}
