//! The every-sample order: each sample over those behind it, in strict depth order (the paper's choice, section 4.1).
//!
//! 1. input: a volume and a transfer function were classified into bricks of samples ([`crate::paper::samples::sample`]);
//! 2. sample and select: visible bricks are projected, each sample becomes a point or a splat (`project`), by settings from the options, the
//!    camera and a layer;
//! 3. accumulate: primitives are listed by screen tile, each tile sorts its list by depth;
//! 4. composite: points and splats are composited front to back, tile by tile, until the tile is opaque.
//!
//! The bricks go through these stages in batches, front to back ([`crate::paper::batches`]), so that samples behind opaque tiles are
//! never projected.
//!
//! The axis-sheets order ([`crate::paper::axis_sheets`]) runs the same stages; it sorts by slice and composites whole slices.

use glam::DVec3;
use rayon::prelude::*;
use resample_core::clock::{StageClock, StageTime};
use resample_core::composite::{DepthRule, IndexRule, TilePixels, TileSettings};
use resample_core::maps::MapSource;
use resample_core::point::PixelFilter;
use resample_core::table::FootprintProfile;
use resample_core::tile::{TILE_AREA, TileGrid};
use resample_core::{Camera, FootprintMode, GridView, Kernel, SelectMode};

use crate::Error;
use crate::bricks::cull::{ViewVolume, visible_bricks};
use crate::grid::{in_unit, power_of_two};
use crate::light::{GradientCurve, ShadeSettings};
use crate::look::clip::{Clip, Cut};
use crate::look::options::{
    Cells, DepthPlane, RenderOptions, SampleOptions, SampleOrder, Subpixels,
};
use crate::look::scene::Scene;
use crate::paper::axis_sheets::SliceOrder;
use crate::paper::batches::{
    Batch, BrickPlace, Hiding, Outlines, PlacedBrick, Run, in_batches, project_runs,
};
use crate::paper::geometry::Lens;
use crate::paper::project::{
    Layers, NearSample, NearSetup, OpenTile, Painting, ProjectSetup, ProjectedChunk, SortKeys,
    TileStage,
};
use crate::paper::samples::layer::{Layer, cells_of, layers, layers_in_world};
use crate::paper::samples::sample_light::SampleLight;
use crate::picture::{Means, TileDepth, TileLayout, TileSlot, automatic, refined, tally};
use crate::stats::FrameStats;

impl EverySample {
    /// Returns the extent of footprints beside their kernels' outlines.
    pub(crate) fn outlines(&self) -> Outlines {
        match (self.choices.select, self.choices.footprint) {
            (SelectMode::Ewa, _) | (_, FootprintMode::AffineApprox) => Outlines::Wider,
            _ => Outlines::Kernels,
        }
    }

    /// The maps of a layer; `camera` counts in [`Self::length`].
    pub(crate) fn maps(&self, layer: &Layer, camera: &Camera) -> MapSource {
        MapSource {
            view: GridView::new(
                camera,
                &in_unit(&layer.samples.world_from_index, self.length),
            ),
            radius: self.kernel.radius(),
            unit_in_world: self.opacity_unit,
            mode: self.evaluated_footprint(),
        }
    }

    /// The footprint that the tiles evaluate: EWA is affine by construction.
    fn evaluated_footprint(&self) -> FootprintMode {
        if self.choices.select == SelectMode::Ewa {
            FootprintMode::Affine
        } else {
            self.choices.footprint
        }
    }

    /// How a layer is projected, given its view and that of the first layer.
    fn project_setup(
        &self,
        layer: &Layer,
        maps: &MapSource,
        camera: &Camera,
        first: &GridView,
    ) -> ProjectSetup {
        let threshold = self.choices.point_threshold_px;
        ProjectSetup {
            lens: Lens::new(
                &maps.view,
                layer.halvings,
                &self.kernel,
                &self.choices,
                self.opacity_unit,
            ),
            view_volume: ViewVolume::new(camera, &maps.view, self.kernel.radius()),
            grid: TileGrid::new(camera.width as usize, camera.height as usize),
            select: self.choices.select,
            threshold2_px2: threshold * threshold,
            light: SampleLight::new(
                ShadeSettings::new(&self.options, camera),
                self.options
                    .gradient_opacity
                    .as_ref()
                    .map(|curve| GradientCurve::new(curve, self.length)),
                camera,
                &maps.view,
                self.options.simd.resolve(),
            ),
            painting: self.painting,
            level: self.options.simd.resolve(),
            keys: match self.choices.order {
                SampleOrder::AxisSheets => {
                    SortKeys::Slice(SliceOrder::new(first, self.dims).halved(layer.halvings))
                }
                SampleOrder::EverySample | SampleOrder::ImageSheets(_) => SortKeys::Depth,
            },
            layer: layer.halvings as u8,
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
            sheet_thickness: (self.choices.sheet_voxels * smallest) as f32,
            min_transmittance: self.options.min_transmittance,
        }
    }
}

/// How far apart samples are at least, in sub-pixels, that are composited on their own: about one.
const SPACING_IN_SUBPIXELS: f64 = 0.75;

/// Most bytes that tiles may take between batches: a picture with more of them is drawn in one batch, tile after tile.
const MAX_OPEN_BYTES: usize = 1 << 29;

/// Renders samples one over another.
#[derive(Clone, Debug)]
pub(crate) struct EverySample {
    pub(crate) layers: Vec<Layer>,
    /// Voxels that the transfer function leaves visible.
    pub(crate) non_transparent: u64,
    /// Voxels of the volume.
    pub(crate) voxels: u64,
    pub(crate) options: RenderOptions,
    pub(crate) choices: SampleOptions,
    pub(crate) kernel: Kernel,
    pub(crate) profile: FootprintProfile,
    pub(crate) filter: PixelFilter,
    /// How samples are painted in the next frame.
    pub(crate) painting: Painting,
    pub(crate) dims: [usize; 3],
    pub(crate) bounds_in_world: Option<[DVec3; 2]>,
    /// The power of two, in world units, in which lengths are counted: f32 holds squares and cubes of those.
    pub(crate) length: f64,
    /// In that length.
    pub(crate) smallest_spacing: f64,
    /// World length over which opacity is meant, in that length.
    pub(crate) opacity_unit: f64,
    pub(crate) chunks: Vec<ProjectedChunk>,
    pub(crate) open: Vec<OpenTile>,
}

impl EverySample {
    /// [`Error::Option`] where a label map has too many labels, or samples are to be lit that have no gradient.
    pub(crate) fn new(
        scene: &Scene,
        options: &RenderOptions,
        choices: &SampleOptions,
    ) -> Result<Self, Error> {
        let volume = scene.grid();
        let kernel = Kernel::new(choices.kernel);
        let layers = layers(scene, options, choices)?;
        let spacing = volume.smallest_spacing();
        let length = power_of_two(spacing);
        let non_transparent = match cells_of(scene, choices) {
            Cells::Off => layers[0].samples.count,
            _ => scene.count_visible(),
        };
        Ok(Self {
            bounds_in_world: layers_in_world(&layers),
            layers,
            painting: choices.colour_by.into(),
            non_transparent,
            voxels: volume.len() as u64,
            options: options.clone(),
            choices: choices.clone(),
            kernel,
            profile: FootprintProfile::new(&kernel),
            filter: PixelFilter::new(),
            dims: volume.dims,
            length,
            smallest_spacing: spacing / length,
            opacity_unit: options.opacity_unit_in_world(spacing) / length,
            chunks: Vec::new(),
            open: Vec::new(),
        })
    }

    /// Takes options that differ only in settings read anew for each frame.
    pub(crate) fn update(&mut self, options: &RenderOptions) {
        if let Some(samples) = options.samples() {
            self.choices = samples.clone();
        }
        self.options = options.clone();
    }

    /// How the options paint samples.
    pub(crate) fn own_painting(&self) -> Painting {
        self.choices.colour_by.into()
    }

    /// Changes the kept part of the volume.
    pub(crate) fn update_clip(&mut self, clip: &Clip) {
        for layer in &mut self.layers {
            layer.update_clip(clip);
        }
        self.bounds_in_world = layers_in_world(&self.layers);
    }

    /// The box, in the world, of the samples that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        self.bounds_in_world
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) -> TileLayout {
        let (fine, subpixels) = refined(camera, self.subpixels(camera));
        let fine = fine.in_unit(self.length);
        let grid = TileGrid::new(fine.width as usize, fine.height as usize);
        let maps: Vec<MapSource> = self
            .layers
            .iter()
            .map(|layer| self.maps(layer, &fine))
            .collect();
        let setups: Vec<ProjectSetup> = self
            .layers
            .iter()
            .zip(&maps)
            .map(|(layer, source)| self.project_setup(layer, source, &fine, &maps[0].view))
            .collect();
        let batches = self.batches(&setups, &maps, &fine, stats);
        let near_setup = |&source: &MapSource| NearSetup {
            source,
            kernel: self.kernel,
            opacity: self.options.opacity,
        };
        let near_setups: Vec<NearSetup> = maps.iter().map(near_setup).collect();
        let mut stage = TileStage {
            settings: self.tile_settings(&maps[0]),
            maps: maps[0],
            grid,
            near: Vec::new(),
            near_setups: &near_setups,
            layers: match self.choices.order {
                SampleOrder::AxisSheets => Layers::Slices,
                SampleOrder::EverySample | SampleOrder::ImageSheets(_) => Layers::Samples,
            },
            subpixels: subpixels as usize,
        };
        stage.begin(tiles, &mut self.open);
        let (mut hiding, mut first, mut spent) = (Hiding::default(), 0, StageTime::default());
        for (number, batch) in batches.iter().enumerate() {
            let runs = batch.runs(&self.layers, &hiding, stats);
            let end = first + runs.len();
            self.chunks
                .resize_with(self.chunks.len().max(end), ProjectedChunk::default);
            let projection = Projection {
                setups: &setups,
                layers: &self.layers,
                hiding: &hiding,
                first,
            };
            projection.project(&mut self.chunks[first..end], &runs, stats);
            if number == 0 {
                stage.near = nearest_first(&self.chunks[..end]);
            }
            let clock = StageClock::start();
            let frontier = batches
                .get(number + 1)
                .map_or(f64::INFINITY, |next| next.nearest);
            stage.advance(&self.chunks[..end], first, frontier, tiles, &mut self.open);
            hiding = Hiding::new(&grid, |tile| self.open[tile].is_opaque);
            spent += clock.stop();
            first = end;
        }
        tally(tiles, spent, stats);
        TileLayout {
            camera: *camera,
            subpixels,
            means: Means::Own,
            depth: TileDepth::Distance,
            length: self.length,
        }
    }

    /// The number of sub-pixels along a pixel's side.
    fn subpixels(&self, camera: &Camera) -> u32 {
        match (self.options.subpixels, self.bounds_in_world) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, Some([low, high]))
                if self.choices.order == SampleOrder::EverySample =>
            {
                let world_from_grid = self.usual_layer().samples.world_from_index;
                let middle = world_from_grid
                    .inverse()
                    .transform_point3(0.5 * (low + high));
                automatic(camera, &world_from_grid, middle, SPACING_IN_SUBPIXELS)
            }
            (Subpixels::Auto, _) => 1,
        }
    }

    /// The layer of the sample in the middle, where all are put in order of their size.
    fn usual_layer(&self) -> &Layer {
        let half = self
            .layers
            .iter()
            .map(|layer| layer.samples.count)
            .sum::<u64>()
            / 2;
        let mut before = 0;
        let reached = |layer: &&Layer| {
            before += layer.samples.count;
            before > half
        };
        self.layers.iter().find(reached).unwrap_or(&self.layers[0])
    }

    /// The bricks in view, front to back, in batches.
    fn batches(
        &self,
        setups: &[ProjectSetup],
        maps: &[MapSource],
        camera: &Camera,
        stats: &mut FrameStats,
    ) -> Vec<Batch> {
        let mut placed: Vec<PlacedBrick> = Vec::new();
        for (layer, setup) in setups.iter().enumerate() {
            let samples = &self.layers[layer].samples;
            stats.bricks_empty += samples.empty;
            let visible = visible_bricks(&samples.bricks, &setup.view_volume, stats);
            let place = |number: usize| {
                let brick = &samples.bricks[number];
                let place = BrickPlace::new(
                    &brick.bounds,
                    self.kernel.radius(),
                    &maps[layer].view,
                    camera,
                );
                PlacedBrick {
                    layer,
                    number,
                    samples: brick.places.len(),
                    place,
                }
            };
            placed.par_extend(visible.into_par_iter().map(place));
        }
        let tiles = camera.width as usize * camera.height as usize / TILE_AREA;
        let is_one = self.choices.order == SampleOrder::AxisSheets
            || tiles * size_of::<TilePixels>() > MAX_OPEN_BYTES;
        in_batches(placed, is_one, self.outlines())
    }
}

/// The input for projecting runs of bricks.
struct Projection<'a> {
    setups: &'a [ProjectSetup],
    layers: &'a [Layer],
    hiding: &'a Hiding,
    /// The number of the first chunk.
    first: usize,
}

impl Projection<'_> {
    /// Projects each run into its chunk, and lists it by tile.
    fn project(&self, chunks: &mut [ProjectedChunk], runs: &[Run], stats: &mut FrameStats) {
        let project = |chunk: &mut ProjectedChunk, run: &Run| {
            chunk.clear();
            let (layer, setup) = (&self.layers[run.layer], &self.setups[run.layer]);
            let bricks = run
                .bricks
                .iter()
                .map(|&number| &layer.samples.bricks[number]);
            for brick in bricks {
                match layer.clip.cut(&brick.bounds) {
                    Cut::Outside => {}
                    Cut::By(0) => chunk.project(setup, self.hiding, brick),
                    Cut::By(_) => chunk.project(setup, self.hiding, &brick.kept(&layer.clip)),
                }
            }
        };
        project_runs(chunks, runs, stats, project, |chunk, number| {
            chunk.bins.bin(self.first + number)
        });
        for chunk in chunks.iter() {
            stats.culled += chunk.culled;
            stats.hidden += chunk.hidden;
            stats.points += chunk.points;
            stats.splats += chunk.splats;
            stats.near_splats += chunk.near.len() as u64;
        }
    }
}

/// The samples at the eye, of all chunks, in the order of compositing.
fn nearest_first(chunks: &[ProjectedChunk]) -> Vec<NearSample> {
    let mut near: Vec<NearSample> = chunks
        .iter()
        .flat_map(|chunk| chunk.near.iter().copied())
        .collect();
    near.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    near
}
