//! The driver: discs prepared once, then one picture per camera.

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::narrow::side;
use resample_core::sort::entry_index;
use resample_core::tile::{ChunkBins, TILE_PX};
use resample_core::{Camera, Image};

use crate::cloud::options::CloudOptions;
use crate::cloud::prepare::{Disc, LeftOut, Prepared};
use crate::cloud::project::{Splat, project};
use crate::cloud::tile::{Pixel, TileJob, TileScratch};
use crate::{Error, StageTime};

/// Draws a prepared cloud, picture after picture.
#[derive(Clone, Debug)]
pub struct CloudRenderer {
    prepared: Prepared,
    options: CloudOptions,
    chunks: Vec<ChunkBins<Splat>>,
    /// The camera and the options that `chunks` belong to.
    projected_for: Option<(Camera, CloudOptions)>,
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

/// The pixels of a tile, and where it lies.
struct DrawnTile {
    job: TileJob,
    pixels: Vec<Pixel>,
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
            chunks: Vec::new(),
            projected_for: None,
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
        self.projected_for = None;
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
        if self.projected_for.as_ref() != Some(&wanted) {
            project(&self.prepared, &camera, &self.options, &mut self.chunks);
            self.projected_for = Some(wanted);
        }
        stats.project = clock.stop();
        let in_view = self
            .chunks
            .iter()
            .map(|chunk| chunk.primitives.len() as u64);
        stats.in_view = in_view.sum();
        let clock = StageClock::start();
        let image = self.draw(&camera, &window);
        stats.draw = clock.stop();
        stats.seen = image.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        Ok(CloudFrame { image, stats })
    }

    fn draw(&self, camera: &Camera, window: &Window) -> Image {
        let [width, height] = window.size;
        let columns = width.div_ceil(TILE_PX);
        let tiles: Vec<DrawnTile> = (0..columns * height.div_ceil(TILE_PX))
            .into_par_iter()
            .map_init(
                || TileScratch::new(self.options.subpixels as usize),
                |scratch, tile| {
                    let place = [
                        window.first_tile[0] + tile % columns,
                        window.first_tile[1] + tile / columns,
                    ];
                    self.draw_tile(camera, place, scratch)
                },
            )
            .collect();
        let mut image = Image::transparent(width, height);
        let mut depth = vec![f32::INFINITY; width * height];
        for (number, DrawnTile { job, pixels }) in tiles.iter().enumerate() {
            let first = [number % columns * TILE_PX, number / columns * TILE_PX];
            // The last tiles of a window may show more than it holds.
            let shown = job.size[0].min(width - first[0]);
            let rows = pixels.chunks_exact(job.size[0]).take(height - first[1]);
            for (row, pixels) in rows.enumerate() {
                let start = (first[1] + row) * width + first[0];
                for (i, pixel) in pixels[..shown].iter().enumerate() {
                    image.rgba[start + i] = pixel.rgba;
                    depth[start + i] = pixel.depth;
                }
            }
        }
        image.depth = Some(depth);
        image
    }

    fn draw_tile(
        &self,
        camera: &Camera,
        place: [usize; 2],
        scratch: &mut TileScratch,
    ) -> DrawnTile {
        let first = place.map(|p| p * TILE_PX);
        let size = [camera.width as usize, camera.height as usize];
        let job = TileJob {
            first,
            size: std::array::from_fn(|axis| (size[axis] - first[axis]).min(TILE_PX)),
            picture: size,
            projection: camera.projection,
            blend: self.options.blend,
        };
        let lists = || {
            self.chunks.iter().flat_map(move |chunk| {
                let list = chunk.tile(side(place[0]), side(place[1]));
                list.iter()
                    .map(|&entry| &chunk.primitives[entry_index(entry) as usize & 0xffff])
            })
        };
        let mut pixels = Vec::new();
        scratch.draw(&job, lists, &mut pixels);
        DrawnTile { job, pixels }
    }
}
