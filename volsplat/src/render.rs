//! The renderer: a volume prepared once, then one picture per camera.
//!
//! The orders of compositing are whole pipelines of their own ([`crate::options::Order`]); what they share is that
//! they fill the tiles of a picture. Every buffer is kept from frame to frame. Chunks and tiles are cut without regard
//! to the number of threads, and each is owned by one task, so the same bytes come out on any number of them.

use glam::DVec3;
use resample_core::{Camera, Image};

use crate::every_sample::EverySample;
use crate::options::{Order, RenderOptions};
use crate::picture::picture;
use crate::sample::bounds_in_world;
use crate::sheets::ImageSheets;
use crate::stats::{FrameStats, StageClock};
use crate::tiles::TileSlot;
use crate::transfer::TransferFunction;
use crate::{Error, Volume};

/// Renders one prepared volume, frame after frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    pipeline: Pipeline,
    options: RenderOptions,
    tiles: Vec<TileSlot>,
}

#[derive(Clone, Debug)]
enum Pipeline {
    EverySample(Box<EverySample>),
    ImageSheets(Box<ImageSheets>),
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

impl Renderer {
    /// Prepares `volume` for rendering with `options`.
    pub fn new(volume: &Volume, transfer: &TransferFunction, options: &RenderOptions) -> Result<Self, Error> {
        options.validate()?;
        let pipeline = match options.order {
            Order::EverySample => {
                Pipeline::EverySample(Box::new(EverySample::new(volume, transfer, options)))
            }
            Order::ImageSheets => {
                Pipeline::ImageSheets(Box::new(ImageSheets::new(volume, transfer, options)))
            }
        };
        Ok(Self { pipeline, options: options.clone(), tiles: Vec::new() })
    }

    /// Voxels that the transfer function leaves visible.
    pub fn non_transparent(&self) -> u64 {
        match &self.pipeline {
            Pipeline::EverySample(p) => p.samples.count,
            Pipeline::ImageSheets(p) => p.field.non_transparent,
        }
    }

    /// Voxels of the volume.
    pub fn voxels(&self) -> u64 {
        match &self.pipeline {
            Pipeline::EverySample(p) => p.samples.voxels,
            Pipeline::ImageSheets(p) => p.field.voxels,
        }
    }

    /// The box, in the world, of the voxels that are drawn; `None` if there are none.
    pub fn visible_bounds_in_world(&self) -> Option<[DVec3; 2]> {
        match &self.pipeline {
            Pipeline::EverySample(p) => {
                bounds_in_world(p.samples.bricks.iter().map(|b| &b.bounds), &p.samples.world_from_index)
            }
            Pipeline::ImageSheets(p) => {
                bounds_in_world(p.field.bricks.iter().map(|b| &b.bounds), &p.field.world_from_index)
            }
        }
    }

    /// Renders one frame.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera.validated().map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let layout = match &mut self.pipeline {
            Pipeline::EverySample(p) => p.render(&camera, &mut self.tiles, &mut stats),
            Pipeline::ImageSheets(p) => p.render(&camera, &mut self.tiles, &mut stats),
        };
        let image = picture(&self.tiles, &layout, self.options.depth, &mut stats);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }
}
