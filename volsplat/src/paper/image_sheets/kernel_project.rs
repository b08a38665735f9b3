//! Kernels on the screen: each sample of a brick becomes a point of one slab or sections of several, listed by tile.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use resample_core::clock::{StageClock, ThreadClock};
use resample_core::composite::TilePixels;
use resample_core::scratch::on_heap;
use resample_core::sort::{EXACT_KEYS, entry_key, sort_by_depth};
use resample_core::tile::{ChunkBins, TILE_PX, TileGrid, TileRect};
use resample_core::{Camera, GridView, Projection, SelectMode};

use crate::grid::place;
use crate::look::clip::{Cut, GridClip};
use crate::look::options::{Classify, SampleOptions};
use crate::paper::image_sheets::kernel_tile::{
    KernelSample, KernelScratch, KernelSettings, Tile, TileRays, render_tile,
};
use crate::paper::samples::sample::Brick;
use crate::paper::samples::sample_light::SampleLight;
use crate::picture::{Means, TileSlot, tally};
use crate::slabs::settings::{Anchor, SheetSettings};
use crate::slabs::view::TileView;
use crate::stats::FrameStats;

/// The input for projecting voxels.
#[derive(Clone, Debug)]
pub(crate) struct SheetProjection {
    view: GridView,
    anchor: Anchor,
    grid: TileGrid,
    axes: [Vec3; 3],
    inverse_thickness: f32,
    thickness: f32,
    /// Plane of the anchor, in planes; fractional.
    anchor_plane: f32,
    /// First plane that is seen.
    first_plane: f32,
    reach_z: f32,
    /// Box of all sections: least x, y, greatest x, y, world units.
    reach: [f32; 4],
    near: f32,
}

/// Planes at whose number a voxel is cut off from a frame: beyond this, f32 no longer counts planes one by one.
const MAX_PLANE: f32 = 8_388_608.0;

impl SheetProjection {
    pub(crate) fn new(view: &GridView, camera: &Camera, settings: &SheetSettings) -> Self {
        let m = view.camera_from_grid.matrix3;
        // Slabs before the near plane are not seen; neither are those behind the eye of an orthographic camera.
        let first_plane = (view.near / settings.thickness).floor().max(0.0);
        Self {
            view: *view,
            anchor: settings.anchor,
            grid: TileGrid::new(camera.width as usize, camera.height as usize),
            axes: [m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3()],
            inverse_thickness: (1.0 / settings.thickness) as f32,
            thickness: settings.thickness as f32,
            anchor_plane: (settings.anchor.camera_z / settings.thickness - 0.5) as f32,
            first_plane: first_plane as f32,
            reach_z: settings.reach.z,
            reach: settings.reach.ends,
            near: view.near as f32,
        }
    }

    /// The pixels first..end, along one axis, that a voxel's sections may touch between two camera z.
    #[inline(always)]
    fn pixels(&self, camera: f32, z: [f32; 2], axis: usize) -> [u16; 2] {
        let (focal, principal) = (
            self.view.focal[axis] as f32,
            self.view.principal_px[axis] as f32,
        );
        let count = if axis == 0 {
            self.grid.width
        } else {
            self.grid.height
        } as f32;
        let scale = match self.view.projection {
            Projection::Perspective => [focal / z[0], focal / z[1]],
            Projection::Orthographic => [focal; 2],
        };
        let at = |offset: f32| [(camera + offset) * scale[0], (camera + offset) * scale[1]];
        let (low, high) = (at(self.reach[axis]), at(self.reach[axis + 2]));
        let first = (low[0].min(low[1]) + principal - 0.5)
            .ceil()
            .clamp(0.0, count);
        let end = ((high[0].max(high[1]) + principal - 0.5).floor() + 1.0).clamp(0.0, count);
        [first as u16, end as u16]
    }

    /// The first plane that cuts the kernel of a voxel (camera space, z relative to the anchor), and the tiles that its
    /// sections touch; `None` where no picture of it is seen.
    #[inline(always)]
    pub(crate) fn cover(&self, camera: Vec3) -> Option<(u32, TileRect)> {
        // Planes first..=last cut the kernel.
        let plane = |z: f32| z * self.inverse_thickness + self.anchor_plane;
        let first = plane(camera.z - self.reach_z).ceil().max(self.first_plane);
        let last = plane(camera.z + self.reach_z).floor();
        if !(last >= first && last < MAX_PLANE) {
            return None;
        }
        // A slab that the near plane cuts begins there.
        let z = [
            (first * self.thickness).max(self.near),
            (last + 1.0) * self.thickness,
        ];
        let rect = self
            .grid
            .rect(self.pixels(camera.x, z, 0), self.pixels(camera.y, z, 1));
        (rect.area() > 0).then_some((first as u32, rect))
    }

    /// Camera space position of a grid position, z relative to the anchor.
    #[inline(always)]
    pub(crate) fn at_corner(&self, corner: DVec3) -> [Vec3; 2] {
        let in_camera = self.view.camera_from_grid.transform_point3(corner);
        [
            (in_camera - self.anchor.camera_z * DVec3::Z).as_vec3(),
            (corner - self.anchor.grid).as_vec3(),
        ]
    }

    /// The camera movement per grid axis.
    pub(crate) fn axes(&self) -> [Vec3; 3] {
        self.axes
    }
}

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
                    settings.gradient_curve,
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
