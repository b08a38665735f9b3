//! The driver: discs prepared once, then one picture per camera.

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::narrow::side;
use resample_core::simd::SimdLevel;
use resample_core::tile::TILE_PX;
use resample_core::{Camera, Image, Plane, dispatch};

use crate::cloud::discs::prepare::{Disc, LeftOut, Prepared};
use crate::cloud::draw::listed::Listed;
use crate::cloud::draw::tile::{EMPTY, Shown, TileScratch, draw_tile};
use crate::cloud::draw::view::View;
use crate::cloud::options::{CloudLayer, CloudOptions};
use crate::{Error, StageTime};

/// Draws a prepared cloud, picture after picture.
#[derive(Clone, Debug)]
pub struct CloudRenderer {
    prepared: Prepared,
    options: CloudOptions,
    listed: Listed,
    /// The camera and the options that `listed` belongs to.
    listed_for: Option<(Camera, CloudOptions)>,
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct CloudFrame {
    /// Linear premultiplied colour, and depth (camera z).
    pub image: Image,
    /// Counts and times.
    pub stats: CloudStats,
}

/// Counts and times of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct CloudStats {
    /// Discs of the cloud.
    pub discs: u64,
    /// Points that have no disc.
    pub left_out: LeftOut,
    /// Discs of which the camera sees at least the place.
    pub in_view: u64,
    /// Pixels in which something is seen.
    pub seen: u64,
    /// Time of projecting and listing.
    pub project: StageTime,
    /// Time of drawing tiles.
    pub draw: StageTime,
}

/// Rows of tiles of a picture, for one task.
struct Rows<'a> {
    rgba: &'a mut [[f32; 4]],
    depth: &'a mut [f32],
    /// Empty where normals are not asked for.
    normals: &'a mut [[f32; 3]],
}

/// A part of a picture that begins at edges of tiles.
struct Window {
    first_tile: [usize; 2],
    /// Width and height, px.
    size: [usize; 2],
}

impl Window {
    fn new(camera: &Camera, first: [usize; 2], size: [usize; 2]) -> Result<Self, Error> {
        let whole = [camera.width as usize, camera.height as usize];
        let is_inside = (0..2).all(|axis| {
            let end = first[axis].checked_add(size[axis]);
            first[axis].is_multiple_of(TILE_PX) && end.is_some_and(|end| end <= whole[axis])
        });
        if !is_inside {
            return Err(Error::Option(format!(
                "a window of {size:?} pixels from {first:?} on is not inside of {}x{}, or begins within {TILE_PX} pixels",
                whole[0], whole[1]
            )));
        }
        Ok(Self {
            first_tile: first.map(|place| place / TILE_PX),
            size,
        })
    }
}

impl CloudRenderer {
    /// A renderer of discs.
    ///
    /// # Errors
    /// An option is out of its range.
    pub fn new(prepared: Prepared, options: &CloudOptions) -> Result<Self, Error> {
        options.validate()?;
        Ok(Self {
            prepared,
            options: options.clone(),
            listed: Listed::default(),
            listed_for: None,
        })
    }

    /// Draws with these options from now on.
    ///
    /// # Errors
    /// As [`CloudRenderer::new`]; then nothing changes.
    pub fn update(&mut self, options: &CloudOptions) -> Result<(), Error> {
        options.validate()?;
        self.options = options.clone();
        Ok(())
    }

    /// The discs.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// Takes other colours, as [`Prepared::recolour`] does.
    pub fn recolour(&mut self, colour: impl Fn(&Disc, usize) -> [u8; 3] + Sync) {
        self.prepared.recolour(colour);
    }

    /// The picture from `camera`.
    ///
    /// # Errors
    /// The camera is invalid.
    pub fn render(&mut self, camera: &Camera) -> Result<CloudFrame, Error> {
        let size = [camera.width as usize, camera.height as usize];
        self.render_window(camera, [0, 0], size)
    }

    /// A window of the picture from `camera`: the pixels that the whole picture has there. It begins at edges of tiles
    /// ([`TILE_PX`]).
    ///
    /// # Errors
    /// The camera is invalid, or the window does not begin at edges of tiles or leaves the picture.
    pub fn render_window(
        &mut self,
        camera: &Camera,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Result<CloudFrame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let window = Window::new(&camera, first, size)?;
        let mut stats = CloudStats {
            discs: self.prepared.discs.len() as u64,
            left_out: self.prepared.left_out,
            ..CloudStats::default()
        };
        let clock = StageClock::start();
        let wanted = (camera, self.options.clone());
        let level = SimdLevel::Auto.resolve();
        let view = View::new(&self.prepared, &camera, &self.options, level);
        if self.listed_for.as_ref() != Some(&wanted) {
            self.listed.fill(&view);
            self.listed_for = Some(wanted);
        }
        stats.project = clock.stop();
        let in_view = self
            .listed
            .chunks
            .iter()
            .map(|chunk| chunk.primitives.len() as u64);
        stats.in_view = in_view.sum();
        let clock = StageClock::start();
        let image = draw(&view, &self.listed, &window);
        stats.draw = clock.stop();
        stats.seen = image.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        Ok(CloudFrame { image, stats })
    }
}

fn draw(view: &View, listed: &Listed, window: &Window) -> Image {
    let [width, height] = window.size;
    let mut image = Image::transparent(width, height);
    let mut depth = vec![EMPTY.depth; width * height];
    let has_normals = view.options.layers.contains(&CloudLayer::Normal);
    let mut normals = vec![[0.0; 3]; if has_normals { width * height } else { 0 }];
    let mut of_rows = normals.chunks_mut(TILE_PX * width);
    let colours = image.rgba.chunks_mut(TILE_PX * width);
    let both = colours.zip(depth.chunks_mut(TILE_PX * width));
    let rows = both.map(|(rgba, depth)| Rows {
        rgba,
        depth,
        normals: of_rows.next().unwrap_or_default(),
    });
    let rows: Vec<Rows<'_>> = rows.collect();
    rows.into_par_iter().enumerate().for_each_init(
        || Box::new(TileScratch::new(view.options.subpixels as usize)),
        |scratch, (row, mut rows)| {
            for column in 0..width.div_ceil(TILE_PX) {
                let tile = [
                    side(window.first_tile[0] + column),
                    side(window.first_tile[1] + row),
                ];
                let shown =
                    dispatch!(view.level, simd => draw_tile(simd, view, listed, tile, scratch));
                if let Some(shown) = shown {
                    rows.put(shown, column * TILE_PX, width);
                }
            }
        },
    );
    image.depth = Some(depth);
    if has_normals {
        for (axis, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
            let values = normals.iter().map(|normal| normal[axis]).collect();
            let name = name.to_owned();
            image.planes.push(Plane { name, values });
        }
    }
    image
}

impl Rows<'_> {
    /// Puts a tile into the rows, from this column on.
    fn put(&mut self, tile: Shown<'_>, first: usize, width: usize) {
        let shown = TILE_PX.min(width - first);
        for (row, pixels) in tile.pixels.chunks(TILE_PX).enumerate() {
            let start = row * width + first;
            if start >= self.rgba.len() {
                break;
            }
            for (i, pixel) in pixels[..shown].iter().enumerate() {
                self.rgba[start + i] = pixel.rgba;
                self.depth[start + i] = pixel.depth;
            }
            if !self.normals.is_empty() && !tile.normals.is_empty() {
                let normals = &tile.normals[row * TILE_PX..][..shown];
                self.normals[start..start + shown].copy_from_slice(normals);
            }
        }
    }
}
