//! Parts of a picture: windows, and bands of rows, between which whoever waits can stop the work.
//!
//! Takes a camera and a function that draws with one; every part shows the pixels that the whole picture would show.
//! Windows begin at edges of the renderers' tiles.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::camera::Camera;
use crate::image::Image;
use crate::narrow::{count, index32, whole};
use crate::tile::TILE_PX;

/// Side of a tile of the renderers, px: bands and windows begin at edges of tiles.
pub const TILE_SIDE: u32 = TILE_PX as u32;

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
    ///
    /// ```
    /// use resample_core::camera::bands::Window;
    ///
    /// let window = Window {
    ///     columns: 3..7,
    ///     rows: 5..10,
    /// };
    /// assert_eq!((window.first(), window.size()), ([3, 5], [4, 5]));
    /// ```
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
            let band_px = count(whole(rate * seconds));
            self.band_px = index32(band_px.min(LARGEST_BAND_PX as usize)).max(LEAST_BAND_PX);
        }
    }
}

/// Draws a picture band by band, each as wide as the picture. After each band `next` gets the finished share; when it says stop, the result is `None`.
pub fn in_bands<E>(
    camera: &Camera,
    pace: &mut Pace,
    draw: &mut dyn FnMut(&Window) -> Result<Image, E>,
    next: &mut dyn FnMut(f64) -> Next,
) -> Result<Option<Image>, E> {
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
        match &mut joined {
            None => joined = Some(band),
            Some(above) => above.append_below(band),
        }
        if next(f64::from(bottom) / f64::from(camera.height)) == Next::Stop {
            return Ok(None);
        }
        top = bottom;
    }
    Ok(joined)
}

/// Draws a window of a picture by a camera that is moved to it. It begins at edges of tiles.
pub fn moved<E>(
    camera: &Camera,
    window: &Window,
    draw: &mut dyn FnMut(&Camera) -> Result<Image, E>,
) -> Result<Image, E> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::LookAt;

    #[test]
    fn a_window_shows_its_part_and_is_drawn_with_a_tile_around_it() {
        let pose = LookAt {
            position: glam::DVec3::Z,
            target: glam::DVec3::ZERO,
            up: glam::DVec3::Y,
        };
        let camera = Camera::perspective(&pose, 1.0, [100, 80]).expect("a camera");
        let mut sizes = Vec::new();
        // Every pixel says where it lies from the axis of the camera.
        let mut draw = |part: &Camera| -> Result<Image, ()> {
            sizes.push([part.width, part.height]);
            let mut image = Image::transparent(part.width as usize, part.height as usize);
            for (at, pixel) in image.rgba.iter_mut().enumerate() {
                let [x, y] = [at % part.width as usize, at / part.width as usize];
                *pixel = [
                    (x as f64 - part.cx) as f32,
                    (y as f64 - part.cy) as f32,
                    0.0,
                    1.0,
                ];
            }
            Ok(image)
        };
        let window = Window {
            columns: 35..70,
            rows: 17..40,
        };
        let image = moved(&camera, &window, &mut draw).expect("drawn");
        assert_eq!([image.width, image.height], [35, 23]);
        // The axis goes through 50, 40.
        assert_eq!(image.pixel(0, 0), [-15.0, -23.0, 0.0, 1.0]);
        assert_eq!(image.pixel(34, 22), [19.0, -1.0, 0.0, 1.0]);
        let whole = moved(&camera, &Window::whole(&camera), &mut draw).expect("drawn");
        assert_eq!(whole.pixel(99, 79), [49.0, 39.0, 0.0, 1.0]);
        // Columns 16 to 86 and rows 0 to 56: a tile of 16 before the one with the first, and 16 pixels behind the last.
        assert_eq!(sizes, [[70, 56], [100, 80]]);
    }
}
