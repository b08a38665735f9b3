//! Image sheets summed from kernels: any kernel, pre- or post-classified, with points where voxels are small.
//!
//! Visible bricks are projected voxel by voxel. One whose spacing projects to less than the threshold adds to its slab as a
//! point, through the pixel's Gaussian (with sub-pixels, that of the sub-pixel); any other is cut into slab sections. Each
//! is listed by the tiles that it touches, and each tile sums slab by slab ([`super::kernel_tile`]).
//! Where samples are lit, gradients are summed with the scalars; voxels that are classified are lit by themselves
//! ([`crate::sample_light`]).

use cpu_time::ThreadTime;
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use resample_core::composite::TilePixels;
use resample_core::point::PixelFilter;
use resample_core::section::SectionProfile;
use resample_core::sort::{EXACT_KEYS, entry_key, sort_by_depth};
use resample_core::tile::{ChunkBins, TILE_PX, TileGrid};
use resample_core::{GridView, Kernel, Projection, SelectMode};

use super::frame::{SheetProjection, SheetSettings, TileView};
use super::kernel_tile::{KernelScratch, KernelSettings, Laid, TileRays, render_tile};
use super::section::SectionTable;
use super::{SheetFrame, single};
use crate::Error;
use crate::cell_samples::{Parts, cell_samples};
use crate::cells::Gradients;
use crate::chunks::{chunk_target, project_runs, runs_of_bricks, visible_bricks};
use crate::clip::{Clip, Cut, GridClip};
use crate::cull::ViewVolume;
use crate::grid::Grid;
use crate::interpolate::coefficients;
use crate::kernel_field::kernel_samples;
use crate::layer::cells_of;
use crate::options::{Cells, Classify, Interpolate, RenderOptions, SampleOptions};
use crate::sample::{Brick, Samples, place};
use crate::sample_light::{SampleLight, set_gradients};
use crate::scene::Scene;
use crate::stats::{FrameStats, StageClock};
use crate::support::count_visible;
use crate::tiles::{TileSlot, elapsed_ms, tally};
use crate::volume::{scalar, with_voxels};

/// Voxels with their kernel, and the chunks that they are projected in, kept from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct KernelSheets {
    pub(crate) samples: Samples,
    /// Voxels that the transfer function leaves visible.
    pub(crate) non_transparent: u64,
    /// Of interpolating kernels: the largest difference between their sum at a voxel and its scalar.
    pub(crate) residual: Option<f32>,
    dims: [usize; 3],
    kernel: Kernel,
    settings: KernelSettings,
    select: SelectMode,
    threshold_px: f32,
    chunks: Vec<KernelChunk>,
}

/// The voxels of a chunk of bricks, by tile.
#[derive(Clone, Debug, Default)]
struct KernelChunk {
    bins: ChunkBins<Laid>,
    culled: u64,
    points: u64,
}

/// What voxels of a frame are projected with.
struct KernelProjection<'a> {
    settings: &'a SheetSettings,
    projection: SheetProjection,
    view: GridView,
    grid: TileGrid,
    select: SelectMode,
    threshold2_px2: f32,
    /// World volume of a cell times the focal lengths, over the opacity unit.
    mass_scale: f32,
    classify: Classify,
    /// Where classified voxels are lit: how.
    light: Option<SampleLight>,
    /// What is kept of points.
    clip: &'a GridClip,
}

impl KernelSheets {
    /// [`Error::Option`] where the scene holds more than one channel of scalars, or cells are to be split.
    pub(crate) fn new(
        scene: &Scene,
        (options, choices): (&RenderOptions, &SampleOptions),
    ) -> Result<Self, Error> {
        let (volume, transfer) = single(scene)?;
        let sheets = choices.sheets().copied().unwrap_or_default();
        let kernel = Kernel::new(choices.kernel);
        let solved = match sheets.interpolate {
            Interpolate::On => {
                let scalars = with_voxels!(&volume.voxels, slice => {
                    slice.par_iter().map(|&value| scalar(value) as f32).collect::<Vec<f32>>()
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
        if crate::sheets::gradients(options) == Gradients::With {
            // Of the coefficients, where there are some.
            match &solved {
                Some(solved) => {
                    let grid = Grid {
                        voxels: &solved.values,
                        dims: volume.dims,
                    };
                    set_gradients(&mut samples, &grid, &volume.world_from_index.matrix3);
                }
                None => samples.set_gradients_of(volume),
            }
        }
        Ok(Self {
            samples,
            non_transparent: count_visible(volume, transfer),
            residual: solved.map(|solved| solved.residual),
            dims: volume.dims,
            settings: KernelSettings {
                profile: SectionProfile::new(&kernel),
                filter: PixelFilter::new(),
                classify: sheets.classify,
                interpolate: sheets.interpolate,
                clip: GridClip::default(),
            },
            kernel,
            select: choices.select,
            threshold_px: choices.point_threshold_px,
            chunks: Vec::new(),
        })
    }

    /// From the indices of the samples to the world.
    pub(crate) fn world_from_grid(&self) -> DAffine3 {
        self.samples.world_from_index
    }

    /// Changes what is kept of each ray and of points, and gives the former: scalars are known inside the volume alone, where
    /// samples that only complete the sums of splats lie around it.
    pub(crate) fn set_clip(&mut self, clip: &Clip) -> GridClip {
        let mut clip = clip.clone();
        if self.settings.classify == Classify::Post {
            let last = DVec3::from(self.dims.map(|n| (n - 1) as f64));
            let [low, high] = clip.crop_in_grid.unwrap_or([DVec3::ZERO, last]);
            clip.crop_in_grid = Some([low.max(DVec3::ZERO), high.min(last)]);
        }
        self.settings.clip = self.samples.clip(&clip);
        self.settings.clip.clone()
    }

    /// The extents of the kernel's sections.
    pub(crate) fn sections(&self, view: &GridView, thickness: f64) -> SectionTable {
        let radius = self.kernel.radius();
        SectionTable::of_ball(view.camera_from_grid.matrix3, radius, thickness)
    }

    /// Renders the tiles of one frame.
    pub(crate) fn render(
        &mut self,
        frame: &SheetFrame,
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) {
        let view_volume = ViewVolume::new(frame.camera, frame.view, self.kernel.radius());
        let visible = visible_bricks(&self.samples.bricks, &view_volume, stats);
        stats.bricks_empty = self.samples.empty;
        let in_view = visible
            .iter()
            .map(|&i| self.samples.bricks[i].places.len())
            .sum();
        let runs = runs_of_bricks(&self.samples.bricks, visible, chunk_target(in_view));
        let mut chunks = std::mem::take(&mut self.chunks);
        chunks.resize_with(chunks.len().max(runs.len()), KernelChunk::default);
        let setup = self.projection(frame);
        let bricks = &self.samples.bricks;
        let used = &mut chunks[..runs.len()];
        let project = |chunk: &mut KernelChunk, run: &Vec<usize>| {
            chunk.bins.clear();
            (chunk.culled, chunk.points) = (0, 0);
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
        frame.sum_kernels(&self.settings, used, slots, stats);
        self.chunks = chunks;
    }

    fn projection<'a>(&'a self, frame: &'a SheetFrame) -> KernelProjection<'a> {
        let (view, settings) = (frame.view, frame.settings);
        let area = view.focal.x * view.focal.y;
        KernelProjection {
            settings,
            projection: SheetProjection::new(view, frame.camera, settings),
            view: *view,
            grid: TileGrid {
                width: frame.camera.width as usize,
                height: frame.camera.height as usize,
            },
            select: self.select,
            threshold2_px2: self.threshold_px * self.threshold_px,
            mass_scale: (view.cell_volume() * area / settings.unit_in_world) as f32,
            classify: self.settings.classify,
            light: match self.settings.classify {
                Classify::Pre => {
                    let how = (settings.shade, settings.gradient_ramp);
                    SampleLight::new(how, frame.camera, view, settings.level)
                }
                Classify::Post => None,
            },
            clip: &self.settings.clip,
        }
    }
}

/// A voxel on the screen.
struct OnScreen {
    /// Position, px.
    at: [f32; 2],
    /// Weight of a point summed over the screen, opacity units times px^2.
    mass: f32,
    spacing2_px2: f32,
}

impl KernelProjection<'_> {
    /// Where a voxel in front of the near plane falls, given its camera position, z relative to the anchor.
    #[inline(always)]
    fn on_screen(&self, camera: Vec3, z: f32) -> OnScreen {
        let (focal, principal) = (self.view.focal.as_vec2(), self.view.principal_px.as_vec2());
        let axes = self.projection.axes();
        let (scale, x, y, distance_per_z3) = match self.view.projection {
            Projection::Perspective => {
                let distance = (camera.x * camera.x + camera.y * camera.y + z * z).sqrt();
                (1.0 / z, camera.x / z, camera.y / z, distance / (z * z * z))
            }
            Projection::Orthographic => (1.0, camera.x, camera.y, 1.0),
        };
        let oblique = if self.view.projection == Projection::Perspective {
            1.0
        } else {
            0.0
        };
        let mut gram = [0.0f32; 3];
        for axis in axes {
            let across = focal.x * scale * (axis.x - oblique * x * axis.z);
            let down = focal.y * scale * (axis.y - oblique * y * axis.z);
            gram = [
                gram[0] + across * across,
                gram[1] + across * down,
                gram[2] + down * down,
            ];
        }
        let half = 0.5 * (gram[0] - gram[2]);
        OnScreen {
            at: [focal.x * x + principal.x, focal.y * y + principal.y],
            mass: self.mass_scale * distance_per_z3,
            spacing2_px2: 0.5 * (gram[0] + gram[2]) + (half * half + gram[1] * gram[1]).sqrt(),
        }
    }

    /// The point that a voxel becomes, with its slab; `None` if it is none.
    #[inline(always)]
    fn point(&self, camera: Vec3) -> Option<(u32, OnScreen)> {
        let camera_z = f64::from(camera.z) + self.settings.anchor.camera_z;
        let z = camera_z as f32;
        let wanted = matches!(self.select, SelectMode::Hybrid | SelectMode::Points);
        let near = (self.view.near as f32).max(0.0);
        if !wanted || !(z > near) {
            return None;
        }
        let screen = self.on_screen(camera, z);
        let small = self.select == SelectMode::Points || screen.spacing2_px2 < self.threshold2_px2;
        let slab = camera_z / self.settings.thickness;
        (small && slab < f64::from(1u32 << 23)).then_some((slab as u32, screen))
    }
}

impl KernelChunk {
    fn project(&mut self, setup: &KernelProjection, brick: &Brick) {
        let corner = DVec3::from(brick.bounds.corner.map(f64::from));
        let [in_camera, in_grid] = setup.projection.at_corner(corner);
        let [ax, ay, az] = setup.projection.axes();
        let lit = setup.light.as_ref().map(|light| light.values(brick));
        let values = lit.as_ref().unwrap_or(&brick.values);
        let is_whole = matches!(setup.clip.cut(&brick.bounds), Cut::By(0));
        for (number, (&packed, &value)) in brick.places.iter().zip(values).enumerate() {
            let at = Vec3::from(place(packed).map(f32::from));
            let camera = in_camera + at.x * ax + at.y * ay + at.z * az;
            let [a, b, c, d] = value;
            let gradient = brick.gradients.get(number).copied().unwrap_or_default();
            let value = match setup.classify {
                Classify::Pre => [a * d, b * d, c * d, d, 0.0, 0.0],
                Classify::Post => [a, b, c, gradient[0], gradient[1], gradient[2]],
            };
            let laid = Laid {
                grid: (in_grid + at).to_array(),
                offset_z: camera.z,
                value,
                scalar: d,
                across: [camera.x, camera.y],
                mass: 0.0,
            };
            match setup.point(camera) {
                // A section is cut along each ray; a point is kept or not.
                Some(_) if !is_whole && !setup.clip.keeps(corner + at.as_dvec3()) => {
                    self.culled += 1
                }
                Some((slab, screen)) => self.push_point(setup, slab, screen, laid),
                None => match setup.projection.cover(camera) {
                    Some((first, rect)) => self.bins.push(laid, first, rect),
                    None => self.culled += 1,
                },
            }
        }
    }

    fn push_point(&mut self, setup: &KernelProjection, slab: u32, screen: OnScreen, laid: Laid) {
        const REACH_PX: f32 = 2.0;
        let cover = |at: f32, count: usize| {
            let inside = |p: f32| p.clamp(0.0, count as f32) as u16;
            [
                inside((at - REACH_PX - 0.5).ceil()),
                inside((at + REACH_PX - 0.5).floor() + 1.0),
            ]
        };
        let [x, y] = screen.at;
        let rect = setup
            .grid
            .rect(cover(x, setup.grid.width), cover(y, setup.grid.height));
        if rect.area() == 0 || !(screen.mass > 0.0) {
            self.culled += 1;
            return;
        }
        self.points += 1;
        self.bins.push(
            Laid {
                across: screen.at,
                mass: screen.mass,
                ..laid
            },
            slab,
            rect,
        );
    }
}

impl SheetFrame<'_> {
    /// Renders the tiles from projected voxels.
    fn sum_kernels(
        &self,
        kernel: &KernelSettings,
        chunks: &[KernelChunk],
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) {
        let clock = StageClock::start();
        let grid = TileGrid {
            width: self.camera.width as usize,
            height: self.camera.height as usize,
        };
        let columns = grid.columns();
        slots.resize_with(columns * grid.rows(), TileSlot::default);
        let voxels: Vec<&[Laid]> = chunks
            .iter()
            .map(|chunk| chunk.bins.primitives.as_slice())
            .collect();
        slots.par_iter_mut().enumerate().for_each_init(
            KernelScratch::default,
            |scratch, (index, slot)| {
                let at = [index % columns, index / columns];
                slot.reset(0);
                for chunk in chunks {
                    slot.entries
                        .extend_from_slice(chunk.bins.tile(at[0] as u16, at[1] as u16));
                }
                self.kernel_tile(
                    kernel,
                    at.map(|tile| tile * TILE_PX),
                    &voxels,
                    (slot, scratch),
                );
            },
        );
        tally(slots, clock.stop(), stats);
    }

    fn kernel_tile(
        &self,
        kernel: &KernelSettings,
        corner_px: [usize; 2],
        voxels: &[&[Laid]],
        (slot, scratch): (&mut TileSlot, &mut KernelScratch),
    ) {
        if slot.entries.is_empty() {
            return;
        }
        scratch.pixels = TilePixels::default();
        let start = ThreadTime::try_now().ok();
        sort_by_plane(&mut slot.entries, &mut scratch.sort);
        slot.sort_ms = elapsed_ms(start);
        let start = ThreadTime::try_now().ok();
        let view = TileView::new(self.view, corner_px, self.settings);
        let rays = TileRays::new(self.view, corner_px, self.settings, &kernel.clip);
        let frame = (self.settings, kernel);
        slot.counts = render_tile(frame, (&view, &rays), &slot.entries, voxels, scratch);
        slot.show(&scratch.pixels, self.subpixels as usize);
        slot.composite_ms = elapsed_ms(start);
    }
}

/// Sorts entries by their plane, exactly: the tile relies on it.
fn sort_by_plane(entries: &mut [u64], scratch: &mut Vec<u64>) {
    let planes = entries.iter().map(|&e| entry_key(e));
    let (nearest, farthest) = planes.fold((u32::MAX, 0), |(lo, hi), plane| {
        (lo.min(plane), hi.max(plane))
    });
    if farthest.saturating_sub(nearest) < EXACT_KEYS {
        sort_by_depth(entries, scratch);
    } else {
        entries.sort_unstable();
    }
}
