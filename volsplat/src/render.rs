//! The driver: one frame, stage by stage.
//!
//! 1. input: a volume and a transfer function were classified into bricks of samples ([`crate::sample`]);
//! 2. sample and select: visible bricks are projected, each sample becomes a point or a splat ([`crate::project`]);
//! 3. accumulate: primitives are listed by screen tile, each tile sorts its list by depth;
//! 4. composite: points and splats are composited front to back, tile by tile, until the tile is opaque;
//! 5. image: the tiles become a picture.
//!
//! Every buffer is kept from frame to frame. Chunks and tiles are cut without regard to the number of threads, and
//! each is owned by one task, so the same bytes come out on any number of them.

use cpu_time::ThreadTime;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resample_core::composite::{DepthRule, IndexRule, TileSettings};
use resample_core::maps::{MapSource, TilePlane};
use resample_core::point::PixelFilter;
use resample_core::table::FootprintProfile;
use resample_core::tile::{TILE_PX, TileGrid};
use resample_core::{Camera, FootprintMode, GridView, Image, Kernel, Projection, SelectMode};

use crate::cull::ViewVolume;
use crate::geometry::Lens;
use crate::near::{NearSample, NearSetup};
use crate::options::{DepthPlane, RenderOptions};
use crate::project::{ProjectSetup, ProjectedChunk};
use crate::sample::{Brick, Samples};
use crate::stats::{FrameStats, StageClock};
use crate::tiles::{TileSlot, TileStage, elapsed_ms};
use crate::transfer::TransferFunction;
use crate::{Error, Volume};

/// Samples of a chunk: its primitives (48 bytes each) then stay in the second-level cache while they are binned.
const CHUNK_SAMPLES: usize = 1 << 14;

/// Renders one classified volume, frame after frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    samples: Samples,
    options: RenderOptions,
    kernel: Kernel,
    profile: FootprintProfile,
    filter: PixelFilter,
    bounds_in_world: Option<[DVec3; 2]>,
    smallest_spacing: f64,
    unit_in_world: f64,
    chunks: Vec<ProjectedChunk>,
    tiles: Vec<TileSlot>,
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
    /// Classifies `volume` for rendering with `options`.
    pub fn new(volume: &Volume, transfer: &TransferFunction, options: &RenderOptions) -> Result<Self, Error> {
        options.validate()?;
        let kernel = Kernel::new(options.kernel);
        let samples = Samples::classify(volume, transfer, options.opacity);
        Ok(Self {
            bounds_in_world: samples.bounds_in_world(),
            samples,
            options: options.clone(),
            kernel,
            profile: FootprintProfile::new(&kernel),
            filter: PixelFilter::new(),
            smallest_spacing: volume.smallest_spacing(),
            unit_in_world: options.opacity_unit.unwrap_or_else(|| volume.smallest_spacing()),
            chunks: Vec::new(),
            tiles: Vec::new(),
        })
    }

    /// Voxels that the transfer function leaves visible.
    pub fn non_transparent(&self) -> u64 {
        self.samples.count
    }

    /// Voxels of the volume.
    pub fn voxels(&self) -> u64 {
        self.samples.voxels
    }

    /// The box, in the world, of the visible voxels; `None` if there are none.
    pub fn visible_bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders one frame.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera.validated().map_err(|e| Error::Option(e.to_string()))?;
        let depth_origin = self.depth_origin(&camera);
        let camera = moved_forward(camera, depth_origin);
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let view = GridView::new(&camera, &self.samples.world_from_index);
        let grid = TileGrid { width: camera.width as usize, height: camera.height as usize };
        let maps = MapSource {
            view,
            radius: self.kernel.radius(),
            unit_in_world: self.unit_in_world,
            mode: self.evaluated_footprint(),
        };

        let view_volume = ViewVolume::new(&camera, &view, self.kernel.radius());
        let visible = cull(&self.samples.bricks, &view_volume, &mut stats);

        let setup = self.project_setup(&maps, grid, view_volume);
        let runs = runs_of_bricks(&self.samples.bricks, visible);
        self.chunks.resize_with(self.chunks.len().max(runs.len()), ProjectedChunk::default);
        let chunks = &mut self.chunks[..runs.len()];
        project(chunks, &setup, &self.samples.bricks, &runs, &mut stats);

        let near = nearest_first(&self.chunks[..runs.len()]);
        let stage = TileStage {
            settings: self.tile_settings(&maps),
            maps,
            grid,
            near: &near,
            near_setup: NearSetup { source: maps, kernel: self.kernel, opacity: self.options.opacity },
            chunks: &self.chunks[..runs.len()],
        };
        stage.run(&mut self.tiles, &mut stats);

        let mut image = picture(&self.tiles, &camera, self.options.depth, &mut stats);
        image.depth.iter_mut().flatten().for_each(|depth| *depth += depth_origin as f32);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    /// Camera z at which the depths of parallel rays begin: before every sample that is seen, and a whole number of
    /// sheets, so that sheets stay where they are. Depths are then small and not negative, as sorting wants them,
    /// wherever the image plane lies. 0 in perspective, where depth is the distance from the eye.
    fn depth_origin(&self, camera: &Camera) -> f64 {
        let Some([low, high]) =
            self.bounds_in_world.filter(|_| camera.projection == Projection::Orthographic)
        else {
            return 0.0;
        };
        let forward = camera.forward_in_world();
        let nearest_corner = DVec3::select(forward.cmpge(DVec3::ZERO), low, high);
        let nearest = forward.dot(nearest_corner) + camera.camera_from_world.translation.z;
        let start = nearest.max(camera.near);
        let thickness = self.options.sheet_voxels * self.smallest_spacing;
        let origin = (start / thickness).floor() * thickness;
        // Sheets too thin to be counted overflow the quotient.
        if origin.is_finite() { origin } else { start }
    }

    /// The footprint that the tiles evaluate: EWA is affine by construction.
    fn evaluated_footprint(&self) -> FootprintMode {
        if self.options.select == SelectMode::Ewa { FootprintMode::Affine } else { self.options.footprint }
    }

    fn project_setup(&self, maps: &MapSource, grid: TileGrid, view_volume: ViewVolume) -> ProjectSetup {
        let threshold = self.options.point_threshold_px;
        let modes = (self.options.footprint, self.options.select);
        ProjectSetup {
            lens: Lens::new(&maps.view, &self.kernel, modes, self.unit_in_world),
            view_volume,
            grid,
            select: self.options.select,
            threshold2_px2: threshold * threshold,
            colour_by: self.options.colour_by,
            level: self.options.simd.resolve(),
        }
    }

    fn tile_settings(&self, maps: &MapSource) -> TileSettings {
        let smallest = self.smallest_spacing;
        TileSettings {
            level: self.options.simd.resolve(),
            profile: self.profile,
            filter: self.filter.clone(),
            opacity: self.options.opacity,
            index: match maps.mode {
                FootprintMode::Table => IndexRule::ConeCorrected,
                _ => IndexRule::Direct,
            },
            depth: match self.options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            sheet_thickness: (self.options.sheet_voxels * smallest) as f32,
            min_transmittance: self.options.min_transmittance,
        }
    }
}

/// The camera with its image plane moved along the view by this camera z; the near plane stays where it is.
fn moved_forward(mut camera: Camera, by: f64) -> Camera {
    camera.camera_from_world.translation.z -= by;
    camera.near -= by;
    camera
}

/// The bricks that may reach into the view; the samples of the others are counted as culled.
fn cull(bricks: &[Brick], view_volume: &ViewVolume, stats: &mut FrameStats) -> Vec<usize> {
    let clock = StageClock::start();
    let seen: Vec<bool> = bricks.par_iter().map(|brick| view_volume.sees(brick)).collect();
    let (visible, hidden): (Vec<usize>, Vec<usize>) = (0..bricks.len()).partition(|&i| seen[i]);
    stats.culled = hidden.iter().map(|&i| bricks[i].places.len() as u64).sum();
    stats.stages.cull = clock.stop();
    visible
}

/// Cuts the visible bricks into runs of about [`CHUNK_SAMPLES`], one chunk each.
fn runs_of_bricks(bricks: &[Brick], visible: Vec<usize>) -> Vec<Vec<usize>> {
    let total: usize = visible.iter().map(|&i| bricks[i].places.len()).sum();
    // A chunk's number has 16 bits: beyond 2^30 samples the chunks grow.
    let target = CHUNK_SAMPLES.max(total >> 15);
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let mut filled = usize::MAX;
    for brick in visible {
        let samples = bricks[brick].places.len();
        match runs.last_mut() {
            Some(run) if filled + samples <= target => {
                run.push(brick);
                filled += samples;
            }
            _ => {
                runs.push(vec![brick]);
                filled = samples;
            }
        }
    }
    runs
}

/// Projects each run of bricks into its chunk and lists it by tile.
fn project(
    chunks: &mut [ProjectedChunk],
    setup: &ProjectSetup,
    bricks: &[Brick],
    runs: &[Vec<usize>],
    stats: &mut FrameStats,
) {
    let clock = StageClock::start();
    let parts: Vec<[f64; 2]> = chunks
        .par_iter_mut()
        .zip(runs)
        .enumerate()
        .map(|(number, (chunk, run))| {
            let start = ThreadTime::try_now().ok();
            chunk.clear();
            for &brick in run {
                chunk.project(setup, &bricks[brick]);
            }
            let project_ms = elapsed_ms(start);
            let start = ThreadTime::try_now().ok();
            chunk.bins.bin(number);
            [project_ms, elapsed_ms(start)]
        })
        .collect();
    let cpu_ms = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
    [stats.stages.project, stats.stages.bin] = clock.stop().shared(cpu_ms);
    for chunk in chunks.iter() {
        stats.culled += chunk.culled;
        stats.points += chunk.points;
        stats.splats += chunk.splats;
        stats.near_splats += chunk.near.len() as u64;
    }
}

/// The samples at the eye, of all chunks, in the order of compositing.
fn nearest_first(chunks: &[ProjectedChunk]) -> Vec<NearSample> {
    let mut near: Vec<NearSample> = chunks.iter().flat_map(|chunk| chunk.near.iter().copied()).collect();
    near.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    near
}

/// Copies the tiles into a picture.
fn picture(tiles: &[TileSlot], camera: &Camera, depth: DepthPlane, stats: &mut FrameStats) -> Image {
    let clock = StageClock::start();
    let (width, height) = (camera.width as usize, camera.height as usize);
    let columns = width.div_ceil(TILE_PX);
    let mut image = Image::transparent(width, height);
    image.rgba.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let tile = &tiles[y / TILE_PX * columns + x / TILE_PX].pixels;
            let at = |plane: &TilePlane| plane[y % TILE_PX][x % TILE_PX];
            *pixel = [at(&tile.rgb[0]), at(&tile.rgb[1]), at(&tile.rgb[2]), 1.0 - at(&tile.transmittance)];
        }
    });
    if depth == DepthPlane::Expected {
        let plane = (0..width * height).map(|i| {
            let (x, y) = (i % width, i / width);
            let tile = &tiles[y / TILE_PX * columns + x / TILE_PX].pixels;
            let opacity = 1.0 - tile.transmittance[y % TILE_PX][x % TILE_PX];
            let depth = tile.depth[y % TILE_PX][x % TILE_PX] / opacity;
            if opacity > 0.0 { depth * camera_z_per_depth(camera, x, y) } else { f32::INFINITY }
        });
        image.depth = Some(plane.collect());
    }
    stats.stages.image = clock.stop();
    image
}

/// Camera z per unit of the depth that orders samples, at a pixel: that depth is the distance from the eye.
fn camera_z_per_depth(camera: &Camera, x: usize, y: usize) -> f32 {
    let (_, direction) = camera.ray_in_camera(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    (1.0 / direction.length()) as f32
}
