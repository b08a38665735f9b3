//! Kernels on the screen: each sample of a brick becomes a point of one slab or sections of several, listed by tile.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::composite::TilePixels;
use resample_core::scratch::on_heap;
use resample_core::sort::{EXACT_KEYS, entry_key, sort_by_depth};
use resample_core::tile::{ChunkBins, TILE_PX, TileGrid};
use resample_core::{Camera, GridView, Projection, SelectMode};

use super::kernel_tile::{
    KernelSample, KernelScratch, KernelSettings, Tile, TileRays, render_tile,
};
use crate::grid::bounds::place;
use crate::look::clip::{Cut, GridClip};
use crate::look::options::{Classify, SampleOptions};
use crate::paper::samples::sample::Brick;
use crate::paper::samples::sample_light::SampleLight;
use crate::picture::tiles::{Means, TileSlot, tally};
use crate::slabs::projection::SheetProjection;
use crate::slabs::settings::SheetSettings;
use crate::slabs::view::TileView;
use crate::stats::FrameStats;

/// One frame's camera, at sub-pixel resolution, and settings.
pub(crate) struct SheetFrame<'a> {
    pub(crate) settings: &'a SheetSettings,
    pub(crate) view: &'a GridView,
    pub(crate) camera: &'a Camera,
    pub(crate) subpixels: u32,
}

/// The voxels of a chunk of bricks, by tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct KernelChunk {
    pub(crate) bins: ChunkBins<KernelSample>,
    pub(crate) culled: u64,
    pub(crate) points: u64,
}

/// The input for projecting a frame's voxels.
pub(crate) struct KernelProjection<'a> {
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
    /// The part of points that is kept.
    clip: &'a GridClip,
}

/// A voxel on the screen.
struct OnScreen {
    /// Position, px.
    at: [f32; 2],
    /// Weight of a point summed over the screen, opacity units times px^2.
    mass: f32,
    spacing2_px2: f32,
}

impl<'a> KernelProjection<'a> {
    pub(crate) fn new(
        frame: &SheetFrame<'a>,
        choices: &SampleOptions,
        kernel: &'a KernelSettings,
    ) -> Self {
        let (view, settings) = (frame.view, frame.settings);
        let area = view.focal.x * view.focal.y;
        Self {
            settings,
            projection: SheetProjection::new(view, frame.camera, settings),
            view: *view,
            grid: TileGrid::new(frame.camera.width as usize, frame.camera.height as usize),
            select: choices.select,
            threshold2_px2: choices.point_threshold_px * choices.point_threshold_px,
            mass_scale: (view.cell_volume() * area / settings.unit_in_world) as f32,
            classify: kernel.classify,
            light: match kernel.classify {
                Classify::Pre => SampleLight::new(
                    settings.shade,
                    settings.gradient_ramp,
                    frame.camera,
                    view,
                    settings.level,
                ),
                Classify::Post => None,
            },
            clip: &kernel.clip,
        }
    }

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

    /// The point that a voxel becomes, with its slab; `None` if it becomes a splat.
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
    /// Forgets the last frame.
    pub(crate) fn clear(&mut self) {
        self.bins.clear();
        (self.culled, self.points) = (0, 0);
    }

    /// Projects the samples of a brick.
    pub(crate) fn project(&mut self, setup: &KernelProjection, brick: &Brick) {
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
            let sample = KernelSample {
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
                Some((slab, screen)) => self.push_point(setup, slab, screen, sample),
                None => match setup.projection.cover(camera) {
                    Some((first, rect)) => self.bins.push(sample, first, rect),
                    None => self.culled += 1,
                },
            }
        }
    }

    fn push_point(
        &mut self,
        setup: &KernelProjection,
        slab: u32,
        screen: OnScreen,
        sample: KernelSample,
    ) {
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
            KernelSample {
                across: screen.at,
                mass: screen.mass,
                ..sample
            },
            slab,
            rect,
        );
    }
}

impl SheetFrame<'_> {
    /// Renders the tiles from projected voxels.
    pub(crate) fn sum_kernels(
        &self,
        kernel: &KernelSettings,
        chunks: &[KernelChunk],
        slots: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
    ) {
        let clock = StageClock::start();
        let grid = TileGrid::new(self.camera.width as usize, self.camera.height as usize);
        let columns = grid.columns();
        slots.resize_with(columns * grid.rows(), TileSlot::default);
        let voxels: Vec<&[KernelSample]> = chunks
            .iter()
            .map(|chunk| chunk.bins.primitives.as_slice())
            .collect();
        slots.par_iter_mut().enumerate().for_each_init(
            on_heap::<KernelScratch>,
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
                    slot,
                    scratch,
                );
            },
        );
        tally(slots, clock.stop(), stats);
    }

    fn kernel_tile(
        &self,
        kernel: &KernelSettings,
        corner_px: [usize; 2],
        voxels: &[&[KernelSample]],
        slot: &mut TileSlot,
        scratch: &mut KernelScratch,
    ) {
        if slot.entries.is_empty() {
            return;
        }
        scratch.pixels = TilePixels::default();
        let start = ThreadClock::start();
        sort_by_plane(&mut slot.entries, &mut scratch.sort);
        slot.sort_ms = start.elapsed_ms();
        let start = ThreadClock::start();
        let view = TileView::new(self.view, corner_px, self.settings);
        let rays = TileRays::new(self.view, corner_px, self.settings, &kernel.clip);
        let tile = Tile {
            settings: self.settings,
            kernel,
            view: &view,
            rays: &rays,
        };
        slot.counts = render_tile(tile, &slot.entries, voxels, scratch);
        slot.show(&scratch.pixels, self.subpixels as usize, Means::Own);
        slot.composite_ms = start.elapsed_ms();
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
