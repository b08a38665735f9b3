//! The driver: discs prepared once, then one picture per camera.

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::narrow::side;
use resample_core::sort::entry_index;
use resample_core::tile::{ChunkBins, TILE_PX, TileGrid};
use resample_core::{Camera, Image};

use crate::cloud::options::CloudOptions;
use crate::cloud::prepare::{LeftOut, Prepared};
use crate::cloud::project::{Splat, project};
use crate::cloud::tile::{Pixel, TileJob, TileScratch};
use crate::{Error, StageTime};

/// Draws a prepared cloud, picture after picture.
#[derive(Clone, Debug)]
pub struct CloudRenderer {
    prepared: Prepared,
    options: CloudOptions,
    chunks: Vec<ChunkBins<Splat>>,
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

    /// The picture from `camera`.
    ///
    /// # Errors
    /// The camera is invalid.
    pub fn render(&mut self, camera: &Camera) -> Result<CloudFrame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = CloudStats {
            discs: self.prepared.discs.len() as u64,
            left_out: self.prepared.left_out,
            ..CloudStats::default()
        };
        let clock = StageClock::start();
        project(&self.prepared, &camera, &self.options, &mut self.chunks);
        stats.project = clock.stop();
        let in_view = self
            .chunks
            .iter()
            .map(|chunk| chunk.primitives.len() as u64);
        stats.in_view = in_view.sum();
        let clock = StageClock::start();
        let image = self.draw(&camera);
        stats.draw = clock.stop();
        stats.seen = image.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        Ok(CloudFrame { image, stats })
    }

    fn draw(&self, camera: &Camera) -> Image {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let grid = TileGrid::new(width, height);
        let tiles: Vec<DrawnTile> = (0..grid.columns() * grid.rows())
            .into_par_iter()
            .map_init(TileScratch::new, |scratch, tile| {
                let place = [tile % grid.columns(), tile / grid.columns()];
                self.draw_tile(camera, place, scratch)
            })
            .collect();
        let mut image = Image::transparent(width, height);
        let mut depth = vec![f32::INFINITY; width * height];
        for DrawnTile { job, pixels } in &tiles {
            for (row, pixels) in pixels.chunks_exact(job.size[0]).enumerate() {
                let start = (job.first[1] + row) * width + job.first[0];
                for (i, pixel) in pixels.iter().enumerate() {
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
