//! A picture in bands of rows, so that whoever waits for it can stop it in between.
//!
//! Every band shows the pixels that the whole picture would show.

use std::ops::Range;
use std::time::{Duration, Instant};

use anyhow::Result;
use resample_core::image::Plane;
use resample_core::{Camera, Image};

/// Rows of a tile, px: bands begin at edges of tiles.
const TILE_ROWS: u32 = 16;

/// Whether the next band is drawn.
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
    /// A band of so many pixels took so long.
    fn took(&mut self, pixels: usize, taken: Duration) {
        if let Some(seconds) = self.seconds {
            let rate = pixels as f64 / taken.as_secs_f64().max(1e-6);
            // A cast saturates.
            self.band_px = ((rate * seconds) as u32).clamp(LEAST_BAND_PX, LARGEST_BAND_PX);
        }
    }
}

/// Draws a picture band by band. After each band `next` gets the finished share; when it says stop, the result is `None`.
pub fn in_bands(
    camera: &Camera,
    pace: &mut Pace,
    draw: &mut dyn FnMut(&Camera) -> Result<Image>,
    next: &mut dyn FnMut(f64) -> Next,
) -> Result<Option<Image>> {
    let width = camera.width.max(1);
    let mut joined: Option<Image> = None;
    let mut top = 0;
    while top < camera.height {
        let rows = (pace.band_px / width).next_multiple_of(TILE_ROWS);
        let bottom = (top + rows.max(TILE_ROWS)).min(camera.height);
        let start = Instant::now();
        if bottom - top == camera.height {
            let whole = draw(camera)?;
            pace.took(whole.rgba.len(), start.elapsed());
            return Ok(Some(whole));
        }
        let drawn = add_rows(&mut joined, camera, top..bottom, draw)?;
        pace.took(drawn, start.elapsed());
        if next(f64::from(bottom) / f64::from(camera.height)) == Next::Stop {
            return Ok(None);
        }
        top = bottom;
    }
    Ok(joined.map(|image| Image {
        height: camera.height as usize,
        ..image
    }))
}

/// Draws some rows of a camera's picture, with the same pixels as the whole picture has there.
pub fn rows(
    camera: &Camera,
    rows: Range<u32>,
    draw: &mut dyn FnMut(&Camera) -> Result<Image>,
) -> Result<Image> {
    let height = rows.len();
    if rows == (0..camera.height) {
        return draw(camera);
    }
    let mut image = None;
    add_rows(&mut image, camera, rows, draw)?;
    let image = image.unwrap_or_else(|| Image::transparent(camera.width as usize, 0));
    Ok(Image { height, ..image })
}

/// Draws rows and adds them to those above; how many pixels were drawn for that.
fn add_rows(
    joined: &mut Option<Image>,
    camera: &Camera,
    rows: Range<u32>,
    draw: &mut dyn FnMut(&Camera) -> Result<Image>,
) -> Result<usize> {
    // Pixels are corrected by their neighbours: a row of tiles more on both sides is drawn and cut off again. Bands begin at
    // edges of tiles.
    let first = (rows.start / TILE_ROWS).saturating_sub(1) * TILE_ROWS;
    let last = (rows.end + TILE_ROWS).min(camera.height);
    let band = Camera {
        height: last - first,
        cy: camera.cy - f64::from(first),
        ..*camera
    };
    let drawn = draw(&band)?;
    let place = |row: u32| (row - first) as usize * camera.width as usize;
    add(joined, &drawn, place(rows.start)..place(rows.end));
    Ok(drawn.rgba.len())
}

/// Adds some pixels of a band to those above it.
fn add(joined: &mut Option<Image>, band: &Image, pixels: Range<usize>) {
    let Some(joined) = joined else {
        let plane = |plane: &Plane| Plane {
            name: plane.name.clone(),
            values: plane.values[pixels.clone()].to_vec(),
        };
        *joined = Some(Image {
            width: band.width,
            height: 0,
            rgba: band.rgba[pixels.clone()].to_vec(),
            depth: band
                .depth
                .as_ref()
                .map(|depth| depth[pixels.clone()].to_vec()),
            planes: band.planes.iter().map(plane).collect(),
        });
        return;
    };
    joined.rgba.extend(&band.rgba[pixels.clone()]);
    if let (Some(above), Some(depth)) = (&mut joined.depth, &band.depth) {
        above.extend(&depth[pixels.clone()]);
    }
    for (above, plane) in joined.planes.iter_mut().zip(&band.planes) {
        above.values.extend(&plane.values[pixels.clone()]);
    }
}
