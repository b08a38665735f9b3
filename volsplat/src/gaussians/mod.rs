//! Gaussians drawn as a volume: extinction along each ray, summed in slabs, whatever their order.
//!
//! Takes [`Gaussians`], [`GaussianOptions`] and a camera, returns a picture. `project` puts the Gaussians in view into camera space
//! and lists them by tile; `tile` sorts a list by where the Gaussians begin; `ray_form` turns each into polynomials of the pixel;
//! `block` sums 4x4 pixels at a time front to back; `profile` has the functions of one Gaussian along a ray. `viewers` draws them
//! as other viewers do, to compare pictures with. `outline` measures the visible part, for framing.
//!
//! The optical depth of a Gaussian on a ray is -ln(1 - opacity G), with G its value at the ray's closest approach in standard
//! deviations; it is spread along the ray by a parabola with the Gaussian's mean and standard deviation there. So one alone has the
//! opacity that it was trained with, and where several overlap neither order nor camera makes a jump.
//! Limits: colours do not change inside a Gaussian, and light is not scattered.

mod block;
mod options;
mod outline;
mod profile;
mod project;
mod ray_form;
mod tile;
mod viewers;

use std::sync::Arc;

use glam::DAffine3;
use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::image::{Plane, linear_from_srgb};
use resample_core::scratch::on_heap;
use resample_core::tile::{TILE_PX, TileGrid};
use resample_core::{Camera, Image, Stop, dispatch};
use resample_volume::{BlendSpace, Gaussians};

use crate::Error;
use crate::gaussians::project::Binned;
use crate::gaussians::tile::{BlendPixel, TileJob, TileScratch, draw_tile};
use crate::gaussians::viewers::Footprints;
use crate::look::options::DepthPlane;
use crate::render::Frame;
use crate::stats::FrameStats;

pub use options::{GaussianLayer, GaussianModel, GaussianOptions, PixelSamples};
pub use outline::Outline;

/// Draws Gaussians, picture after picture.
///
/// The picture of [`GaussianModel::Volume`] has no order; those of the other models follow other viewers.
#[derive(Clone, Debug)]
pub struct GaussianRenderer {
    gaussians: Arc<Gaussians>,
    options: GaussianOptions,
    binned: Binned,
    footprints: Footprints,
    /// The camera whose Gaussians are binned: the windows of a picture share them.
    binned_for: Option<Camera>,
    stop: Stop,
}

/// The pixels of a tile, and where it lies.
struct DrawnTile {
    place: [usize; 2],
    pixels: Vec<BlendPixel>,
}

impl GaussianRenderer {
    /// A renderer of these Gaussians; [`Error::Option`] where an option is out of its range.
    pub fn new(gaussians: Arc<Gaussians>, options: &GaussianOptions) -> Result<Self, Error> {
        options.validate()?;
        Ok(Self {
            gaussians,
            options: options.clone(),
            binned: Binned::default(),
            footprints: Footprints::default(),
            binned_for: None,
            stop: Stop::default(),
        })
    }

    /// Draws with these options from now on; [`Error::Option`] as in [`GaussianRenderer::new`].
    pub fn update(&mut self, options: &GaussianOptions) -> Result<(), Error> {
        options.validate()?;
        if self.options.model != options.model || self.options.clip != options.clip {
            self.binned_for = None;
        }
        self.options = options.clone();
        Ok(())
    }

    /// Ends frames early, between two tiles, once `stop` is asked for.
    pub fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Draws the picture of a camera; [`Error::Stopped`] where its end was asked for.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let size = [camera.width as usize, camera.height as usize];
        self.render_window(camera, [0, 0], size)
    }

    /// Draws the pixels from column and row `first` on, `size` of them along x and y: those that the whole picture has there.
    /// `first` is a multiple of 16.
    pub fn render_window(
        &mut self,
        camera: &Camera,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Result<Frame, Error> {
        let whole = StageClock::start();
        let mut stats = FrameStats::default();
        let clock = StageClock::start();
        let is_volume = self.options.model == GaussianModel::Volume;
        if self.binned_for != Some(*camera) {
            if is_volume {
                self.binned.fill(&self.gaussians, camera);
            } else {
                self.footprints.fill(&self.gaussians, camera, &self.options);
            }
            self.binned_for = Some(*camera);
        }
        let [in_view, pairs] = if is_volume {
            [self.binned.count() as u64, self.binned.pairs() as u64]
        } else {
            self.footprints.counts()
        };
        stats.stages.project = clock.stop();
        (stats.splats, stats.tile_pairs) = (in_view, pairs);
        stats.culled = self.gaussians.len() as u64 - in_view;
        let clock = StageClock::start();
        let places = tile_places(camera, first, size);
        let tiles = if is_volume {
            self.draw_tiles(camera, &places, &mut stats)
        } else {
            let drawn = self
                .footprints
                .draw(&places, self.options.model, &self.stop);
            let tiles = places.iter().zip(drawn);
            tiles
                .map(|(&place, pixels)| DrawnTile { place, pixels })
                .collect()
        };
        if self.stop.is_asked() {
            return Err(Error::Stopped);
        }
        stats.stages.composite = clock.stop();
        let clock = StageClock::start();
        let image = self.picture(&tiles, first, size);
        stats.stages.image = clock.stop();
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    fn draw_tiles(
        &self,
        camera: &Camera,
        places: &[[usize; 2]],
        stats: &mut FrameStats,
    ) -> Vec<DrawnTile> {
        let clip = self.options.clip.in_grid(&DAffine3::IDENTITY);
        let job = TileJob {
            camera,
            binned: &self.binned,
            clip: &clip,
            options: &self.options,
        };
        let level = self.options.simd.resolve();
        let drawn: Vec<_> = places
            .par_iter()
            .map_init(on_heap::<TileScratch>, |scratch, place| {
                scratch.work = Default::default();
                let is_shown = !self.stop.is_asked()
                    && dispatch!(level, simd => draw_tile(simd, &job, *place, scratch));
                let pixels = if is_shown {
                    scratch.pixels.clone()
                } else {
                    Vec::new()
                };
                (
                    DrawnTile {
                        place: *place,
                        pixels,
                    },
                    scratch.work,
                )
            })
            .collect();
        let mut tiles = Vec::with_capacity(drawn.len());
        for (tile, work) in drawn {
            stats.pixels_touched += work.met * block::LANES as u64;
            stats.lanes_computed += work.summed * block::LANES as u64;
            tiles.push(tile);
        }
        tiles
    }

    fn picture(&self, tiles: &[DrawnTile], first: [usize; 2], size: [usize; 2]) -> Image {
        let mut image = Image::transparent(size[0], size[1]);
        let nothing = || vec![f32::INFINITY; size[0] * size[1]];
        image.depth = (self.options.depth != DepthPlane::None).then(nothing);
        let layers = self.options.layers.iter();
        let plane = |layer: &GaussianLayer| Plane {
            name: layer.channel().to_owned(),
            values: nothing(),
        };
        image.planes = layers.map(plane).collect();
        for tile in tiles {
            for (at, pixel) in tile.pixels.iter().enumerate() {
                let x = tile.place[0] * TILE_PX + at % TILE_PX - first[0];
                let y = tile.place[1] * TILE_PX + at / TILE_PX - first[1];
                if x < size[0] && y < size[1] && pixel.rgba[3] > 0.0 {
                    self.put(&mut image, y * size[0] + x, pixel);
                }
            }
        }
        image
    }

    /// Puts a pixel that shows something at its place.
    fn put(&self, image: &mut Image, at: usize, pixel: &BlendPixel) {
        image.rgba[at] = linear(pixel.rgba, self.gaussians.blend_space);
        if let Some(depth) = &mut image.depth {
            depth[at] = pixel.depth / pixel.rgba[3];
        }
        for (layer, plane) in self.options.layers.iter().zip(&mut image.planes) {
            plane.values[at] = match layer {
                GaussianLayer::MedianDepth if pixel.rgba[3] >= 0.5 && pixel.halved > 0.0 => {
                    pixel.median / pixel.halved
                }
                GaussianLayer::MedianDepth => f32::INFINITY,
            };
        }
    }
}

/// Column and row of the tiles of a part of the picture.
fn tile_places(camera: &Camera, first: [usize; 2], size: [usize; 2]) -> Vec<[usize; 2]> {
    let grid = TileGrid::new(camera.width as usize, camera.height as usize);
    let columns = first[0] / TILE_PX..(first[0] + size[0]).div_ceil(TILE_PX).min(grid.columns());
    let rows = first[1] / TILE_PX..(first[1] + size[1]).div_ceil(TILE_PX).min(grid.rows());
    rows.flat_map(|row| columns.clone().map(move |column| [column, row]))
        .collect()
}

/// A pixel of the blend space in linear light, times opacity.
fn linear([red, green, blue, opacity]: [f32; 4], space: BlendSpace) -> [f32; 4] {
    if space == BlendSpace::Linear || opacity <= 0.0 {
        return [red, green, blue, opacity];
    }
    let decoded = |c: f32| linear_from_srgb(c / opacity) * opacity;
    [decoded(red), decoded(green), decoded(blue), opacity]
}
