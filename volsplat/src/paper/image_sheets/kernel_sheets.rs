//! Image sheets summed from kernels: any kernel, pre- or post-classified, with points where voxels are small.
//!
//! Visible bricks are projected voxel by voxel. One whose spacing projects to less than the threshold adds to its slab as a
//! point, through the pixel's Gaussian (with sub-pixels, that of the sub-pixel); any other is cut into slab sections. Each
//! is listed by the tiles that it touches, and each tile sums slab by slab ([`crate::paper::image_sheets::kernel_tile`]).
//! Where samples are lit, gradients are summed with the scalars; voxels that are classified are lit by themselves
//! ([`crate::paper::samples::sample_light`]).

use glam::{DAffine3, DVec3};
use resample_core::point::PixelFilter;
use resample_core::section::SectionProfile;
use resample_core::{Camera, GridView, Kernel};
use resample_volume::volume::{Described, Grid, Lattice, scalar, with_voxels};

use super::kernel_field::kernel_samples;
use super::kernel_project::{KernelChunk, KernelProjection, SheetFrame};
use super::kernel_tile::KernelSettings;
use crate::Error;
use crate::bricks::cull::{ViewVolume, visible_bricks};
use crate::bricks::fill::check_dims;
use crate::grid::{Bounds, in_unit, power_of_two};
use crate::look::clip::{Clip, GridClip, bounds_in_world};
use crate::look::options::{Cells, Classify, Interpolate, RenderOptions, SampleOptions, Subpixels};
use crate::look::scene::{Scene, count_visible};
use crate::paper::batches::{chunk_target, project_runs, runs_of_bricks};
use crate::paper::image_sheets::kernel_field::coefficients;
use crate::paper::samples::layer::{Parts, cell_samples, cells_of};
use crate::paper::samples::sample::Samples;
use crate::picture::{Means, TileDepth, TileLayout, TileSlot, automatic, refined};
use crate::slabs::settings::{Anchor, KernelReach, SheetSettings, Slabs};
use crate::slabs::table::TransferTable;
use crate::stats::FrameStats;

/// Voxels with their kernel, and the chunks that they are projected in, kept from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct KernelSheets {
    pub(crate) samples: Samples,
    /// Voxels that the transfer function leaves visible.
    pub(crate) non_transparent: u64,
    /// Of interpolating kernels: the largest difference between their sum at a voxel and its scalar.
    pub(crate) residual: Option<f32>,
    options: RenderOptions,
    choices: SampleOptions,
    table: TransferTable,
    kernel: Kernel,
    settings: KernelSettings,
    lattice: Lattice,
    /// The clip in the indices of the samples.
    clip: GridClip,
    /// Middle of what is visible, in the grid.
    visible_middle: Option<DVec3>,
    chunks: Vec<KernelChunk>,
}

impl KernelSheets {
    /// [`Error::Option`] where the scene holds more than one channel of scalars, or cells are to be split.
    pub(crate) fn new(
        scene: &Scene,
        options: &RenderOptions,
        choices: &SampleOptions,
    ) -> Result<Self, Error> {
        check_dims(scene.grid().dims)?;
        let (volume, transfer) = scene.single().ok_or_else(|| {
            let what = "sums of kernels know one channel of scalars and no mask: draw the field";
            Error::Option(what.into())
        })?;
        let sheets = choices.sheets().copied().unwrap_or_default();
        let kernel = Kernel::new(choices.kernel);
        let solved = match sheets.interpolate {
            Interpolate::On => {
                let scalars: Vec<f32> = with_voxels!(&volume.voxels, slice => {
                    slice.iter().map(|&value| scalar(value) as f32).collect()
                });
                Some(coefficients(&scalars, volume.dims, &kernel))
            }
            Interpolate::Off => None,
        };
        let mut samples = match (sheets.classify, cells_of(scene, choices)) {
            (Classify::Post, _) => kernel_samples(
                volume,
                transfer,
                solved.as_ref().map(|solved| solved.values.as_slice()),
            ),
            (Classify::Pre, Cells::Mean) => {
                cell_samples(scene, options, Parts::Whole)?.swap_remove(0)
            }
            (Classify::Pre, _) => Samples::classify(volume, transfer, options.opacity),
        };
        if options.follows_gradient() {
            // Of the coefficients, where there are some.
            match &solved {
                Some(solved) => {
                    let grid = Grid {
                        voxels: &solved.values,
                        dims: volume.dims,
                    };
                    samples.set_gradients_of_grid(&grid, &volume.world_from_index.matrix3);
                }
                None => samples.set_gradients_of(volume),
            }
        }
        let mut made = Self {
            samples,
            non_transparent: count_visible(volume, transfer),
            residual: solved.map(|solved| solved.residual),
            options: options.clone(),
            choices: choices.clone(),
            table: TransferTable::new(transfer, options.opacity, volume.value_range()),
            settings: KernelSettings {
                profile: SectionProfile::new(&kernel),
                filter: PixelFilter::new(),
                classify: sheets.classify,
                interpolate: sheets.interpolate,
                clip: GridClip::default(),
            },
            kernel,
            lattice: volume.lattice(),
            clip: GridClip::default(),
            visible_middle: None,
            chunks: Vec::new(),
        };
        made.update_clip(&options.clip);
        Ok(made)
    }

    /// Changes the kept part of each ray and of points: scalars are known inside the volume alone, where samples that only
    /// complete the sums of splats lie around it.
    pub(crate) fn update_clip(&mut self, clip: &Clip) {
        let mut clip = clip.clone();
        if self.settings.classify == Classify::Post {
            let last = DVec3::from(self.lattice.dims.map(|n| (n - 1) as f64));
            let [low, high] = clip.crop_in_grid.unwrap_or([DVec3::ZERO, last]);
            clip.crop_in_grid = Some([low.max(DVec3::ZERO), high.min(last)]);
        }
        self.clip = self.samples.clip(&clip);
        self.settings.clip = self.clip.clone();
        let visible = bounds_in_world(self.bounds(), &self.clip, &DAffine3::IDENTITY);
        self.visible_middle = visible.map(|[low, high]| 0.5 * (low + high));
    }

    /// Takes options that differ only in settings read anew for each frame.
    pub(crate) fn update(&mut self, options: &RenderOptions) {
        if let Some(samples) = options.samples() {
            self.choices = samples.clone();
        }
        self.options = options.clone();
    }

    fn bounds(&self) -> impl Iterator<Item = Bounds> + '_ {
        self.samples.bricks.iter().map(|brick| brick.bounds)
    }

    /// The box, in the world, of the voxels that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        bounds_in_world(self.bounds(), &self.clip, &self.samples.world_from_index)
    }

    /// The number of sub-pixels along a pixel's side: two a voxel, as in the field.
    fn subpixels(&self, camera: &Camera) -> u32 {
        match (self.options.subpixels, self.visible_middle) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, None) => 1,
            (Subpixels::Auto, Some(middle)) => {
                automatic(camera, &self.samples.world_from_index, middle, 1.5)
            }
        }
    }

    fn sheet_settings(&self, view: &GridView, camera: &Camera) -> SheetSettings {
        let smallest_spacing = self.lattice.smallest_spacing();
        let length = power_of_two(smallest_spacing);
        let sheets = self.choices.sheets().copied().unwrap_or_default();
        let thickness = sheets.slab_voxels * smallest_spacing / length;
        let radius = self.kernel.radius();
        let middle = DVec3::from(self.lattice.dims.map(|n| (n / 2) as f64));
        SheetSettings::new(
            &self.options,
            camera,
            KernelReach::of_ball(view.camera_from_grid.matrix3, radius, thickness),
            &self.table,
            Slabs {
                anchor: Anchor::new(middle, view),
                length,
                thickness,
                opacity_unit: self.options.opacity_unit_in_world(smallest_spacing) / length,
            },
        )
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) -> TileLayout {
        let (fine, subpixels) = refined(camera, self.subpixels(camera));
        let length = power_of_two(self.lattice.smallest_spacing());
        let fine = fine.in_unit(length);
        let view = GridView::new(&fine, &in_unit(&self.samples.world_from_index, length));
        let settings = self.sheet_settings(&view, &fine);
        let frame = SheetFrame {
            settings: &settings,
            view: &view,
            camera: &fine,
            subpixels,
        };
        let mut chunks = std::mem::take(&mut self.chunks);
        let used = self.project(&frame, &mut chunks, stats);
        frame.sum_kernels(&self.settings, &chunks[..used], slots, stats);
        self.chunks = chunks;
        TileLayout {
            camera: *camera,
            subpixels,
            means: Means::Own,
            depth: TileDepth::CameraZ,
            length,
        }
    }

    /// Projects the voxels in view; returns how many chunks hold it.
    fn project(
        &self,
        frame: &SheetFrame,
        chunks: &mut Vec<KernelChunk>,
        stats: &mut FrameStats,
    ) -> usize {
        let view_volume = ViewVolume::new(frame.camera, frame.view, self.kernel.radius());
        let bricks = &self.samples.bricks;
        let visible = visible_bricks(bricks, &view_volume, stats);
        stats.bricks_empty = self.samples.empty;
        let in_view = visible.iter().map(|&i| bricks[i].places.len()).sum();
        let runs = runs_of_bricks(bricks, visible, chunk_target(in_view));
        chunks.resize_with(chunks.len().max(runs.len()), KernelChunk::default);
        let setup = KernelProjection::new(frame, &self.choices, &self.settings);
        let used = &mut chunks[..runs.len()];
        let project = |chunk: &mut KernelChunk, run: &Vec<usize>| {
            chunk.clear();
            for &brick in run {
                chunk.project(&setup, &bricks[brick]);
            }
        };
        project_runs(used, &runs, stats, project, |chunk, number| {
            chunk.bins.bin(number)
        });
        for chunk in used.iter() {
            stats.culled += chunk.culled;
            stats.points += chunk.points;
            stats.splats += chunk.bins.primitives.len() as u64 - chunk.points;
        }
        runs.len()
    }
}
