//! The image-sheets order, post-classified: slabs parallel to the image plane, one over another.
//!
//! 1. input: the voxels or cells that the transfer function may show were collected into bricks;
//! 2. sample: visible bricks are placed on the screen;
//! 3. accumulate: on the plane through a slab's middle, the scalar at every sub-pixel is gathered from the cell that the
//!    sample lies in ([`gather`]);
//! 4. composite: each plane is classified per sub-pixel and composited behind those before it;
//! 5. image: sub-pixels become pixels.
//!
//! Other kernels, and pre-classified voxels, are summed as slab sections and points ([`kernels`]): steps 2 and 3 differ.
//!
//! The default kernel is trilinear: a sample on a plane is exactly what a ray caster with trilinear interpolation reads there,
//! reached in object order, so that cost follows what is visible and not the box around it.
//! Source: K. Mueller, R. Crawfis, "Eliminating Popping Artifacts in Sheet Buffer-Based Splatting", IEEE Visualization
//! 1998, for the sheets; we sample the plane through a slab's middle instead of integrating the kernel over the slab.

mod cell_sample;
mod cells_frame;
pub(crate) mod channel;
pub(crate) mod classify;
pub(crate) mod frame;
pub(crate) mod gather;
pub(crate) mod isosurface;
mod kept;
pub(crate) mod kernel_tile;
pub(crate) mod kernels;
mod layers;
mod mixed;
mod over;
pub(crate) mod place;
mod prepare;
mod relook;
pub(crate) mod section;
pub(crate) mod statistic;
mod streamed;
mod uniform;
mod uniform_walk;

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use resample_core::composite::DepthRule;
use resample_core::{Camera, GridView};

use self::channel::{ChannelSettings, Reading};
use self::frame::{Anchor, SheetSettings};
use self::gather::is_plain;
use self::isosurface::IsoSettings;
use self::kernels::KernelSheets;
pub use self::layers::Layer;
pub(crate) use self::layers::refused as layers_refused;
pub(crate) use self::prepare::{channels, gradients, plan};
pub use self::relook::Reuse;
use self::section::SectionTable;
use self::streamed::{LargeCells, StreamedCells};
use self::uniform::{Uniform, UniformChoice};
use crate::Error;
use crate::cells::{CELL_SIDE, CellBrick, CellField};
use crate::clip::{Clip, GridClip};
use crate::large::{LargeVolume, Watch};
use crate::options::{Blend, DepthPlane, Order, RenderOptions, Subpixels};
use crate::picture::{TileDepth, TileLayout};
use crate::sample::{Bounds, bounds_in_world};
use crate::scene::{Look, Scene};
use crate::shade::{GradientRamp, ShadeSettings};
use crate::stats::FrameStats;
use crate::subpixels::{automatic, refined};
use crate::support::Support;
use crate::tiles::TileSlot;
use crate::transfer::TransferFunction;
use crate::volume::{Described, Lattice, Volume};

/// Sub-pixels along a pixel's side for what has hard edges: 16 a pixel, so that an edge has 17 shades. At 2 it has 5, and
/// stairs show.
const HARD_EDGE_SUBPIXELS: u32 = 4;

/// Renders a field in image-aligned sheets.
#[derive(Clone, Debug)]
pub(crate) struct ImageSheets {
    source: Source,
    channels: Arc<[ChannelSettings]>,
    /// The scalars that bricks are kept for, and those that are seen now where they are fewer; one channel of scalars.
    kept: Option<Support>,
    seen: Option<Support>,
    iso: Option<IsoSettings>,
    options: RenderOptions,
    clip: GridClip,
    world_from_index: DAffine3,
    smallest_spacing: f64,
    /// The voxel in the middle of the volume.
    middle: DVec3,
    /// Middle of what is visible, in the grid.
    visible_middle: Option<DVec3>,
}

/// What the sums are formed from.
#[derive(Clone, Debug)]
enum Source {
    Cells(CellField),
    /// Cells that are read when they are needed.
    Streamed(Box<StreamedCells>),
    Kernels(Box<KernelSheets>),
}

/// One frame's camera, at sub-pixel resolution, and settings.
pub(crate) struct SheetFrame<'a> {
    pub(crate) settings: &'a SheetSettings,
    pub(crate) view: &'a GridView,
    pub(crate) camera: &'a Camera,
    pub(crate) subpixels: u32,
    /// Which bricks of one colour are crossed in one step.
    pub(crate) uniform: Option<UniformChoice>,
}

impl SheetFrame<'_> {
    /// The colour of a brick that is crossed in one step.
    fn uniform(&self, brick: &CellBrick) -> Option<Uniform> {
        let choice = self.uniform.as_ref()?;
        choice.of_brick(self.view, &self.settings.table, brick)
    }
}

impl ImageSheets {
    pub(crate) fn new(scene: &Scene, options: &RenderOptions) -> Result<Self, Error> {
        let volume = scene.grid();
        check_dims(volume.dims)?;
        let channels = channels(scene, options)?;
        let source = match &options.order {
            Order::Field(_) => Source::Cells(prepare::cells(scene, options)?),
            Order::Samples(samples) => {
                Source::Kernels(Box::new(KernelSheets::new(scene, (options, samples))?))
            }
        };
        let iso = prepare::iso(scene.channels[0].look, options);
        let kept = scene
            .single()
            .map(|(_, transfer)| prepare::support(transfer, options));
        Ok(Self {
            kept,
            ..Self::assembled(source, (channels, iso), &volume.lattice(), options)
        })
    }

    /// Image sheets of a volume that stays in its file.
    pub(crate) fn from_file(
        volume: &LargeVolume,
        transfer: &TransferFunction,
        options: &RenderOptions,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        let lattice = volume.lattice();
        check_dims(lattice.dims)?;
        let source = match LargeCells::new(volume, transfer, options, watch)? {
            LargeCells::Resident(field) => Source::Cells(field),
            LargeCells::Streamed(cells) => Source::Streamed(cells),
        };
        let channel = ChannelSettings::of_transfer(transfer, volume.value_range(), options.opacity);
        let iso = prepare::iso(Look::Transfer(transfer), options);
        let kept = Some(prepare::support(transfer, options));
        Ok(Self {
            kept,
            ..Self::assembled(source, (Arc::from([channel]), iso), &lattice, options)
        })
    }

    fn assembled(
        source: Source,
        (channels, iso): (Arc<[ChannelSettings]>, Option<IsoSettings>),
        lattice: &Lattice,
        options: &RenderOptions,
    ) -> Self {
        let mut sheets = Self {
            world_from_index: match &source {
                Source::Kernels(sheets) => sheets.world_from_grid(),
                _ => lattice.world_from_index,
            },
            visible_middle: None,
            clip: GridClip::default(),
            source,
            channels,
            kept: None,
            seen: None,
            iso,
            options: options.clone(),
            smallest_spacing: lattice.smallest_spacing(),
            middle: DVec3::from(lattice.dims.map(|n| (n / 2) as f64)),
        };
        sheets.set_clip(&options.clip);
        sheets
    }

    /// Changes what is kept of the volume.
    pub(crate) fn set_clip(&mut self, clip: &Clip) {
        self.clip = match &mut self.source {
            Source::Kernels(sheets) => sheets.set_clip(clip),
            _ => clip.in_grid(&self.world_from_index),
        };
        let visible = bounds_in_world(self.source.bounds(), &self.clip, &DAffine3::IDENTITY);
        self.visible_middle = visible.map(|[low, high]| 0.5 * (low + high));
    }

    /// The box, in the world, of the voxels that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        bounds_in_world(self.source.bounds(), &self.clip, &self.world_from_index)
    }

    /// Voxels that the transfer function leaves visible, and voxels in all.
    pub(crate) fn counts(&self) -> [u64; 2] {
        match &self.source {
            Source::Cells(field) => [field.non_transparent, field.voxels],
            Source::Streamed(cells) => [cells.non_transparent, cells.voxels],
            Source::Kernels(sheets) => [sheets.non_transparent, sheets.samples.voxels],
        }
    }

    /// Of interpolating kernels: the largest difference between their sum at a voxel and its scalar.
    pub(crate) fn residual(&self) -> Option<f32> {
        if let Source::Kernels(sheets) = &self.source {
            sheets.residual
        } else {
            None
        }
    }

    /// Renders the tiles of one frame. Fails only where voxels have to be read and cannot be.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        (stats, watch): (&mut FrameStats, &mut Watch),
    ) -> Result<TileLayout, Error> {
        let subpixels = self.subpixels(camera);
        let (fine, subpixels) = refined(camera, subpixels);
        let view = GridView::new(&fine, &self.world_from_index);
        let settings = self.settings(&view, &fine);
        let uniform = if is_plain(&settings) {
            UniformChoice::new(&self.options, &view, camera)
        } else {
            None
        };
        let frame = SheetFrame {
            settings: &settings,
            view: &view,
            camera: &fine,
            subpixels,
            uniform,
        };
        match &mut self.source {
            Source::Cells(field) => {
                frame.gather((field, self.seen.as_ref()), &self.clip, tiles, stats);
            }
            Source::Streamed(cells) => cells.render(&frame, &self.clip, tiles, (stats, watch))?,
            Source::Kernels(sheets) => sheets.render(&frame, tiles, stats),
        }
        Ok(TileLayout {
            camera: *camera,
            subpixels,
            depth: TileDepth::CameraZ,
        })
    }

    /// The number of sub-pixels along a pixel's side.
    fn subpixels(&self, camera: &Camera) -> u32 {
        match (self.options.subpixels, self.visible_middle) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, None) => 1,
            (Subpixels::Auto, Some(middle)) => {
                // Two sub-pixels a voxel: at one, thin structures lose 9 dB, beyond two it costs more than it gains.
                let of_voxels = automatic(camera, &self.world_from_index, middle, 1.5);
                of_voxels.max(self.least_subpixels())
            }
        }
    }

    /// Sub-pixels that edges need however large voxels are: surfaces and labels end between one pixel and the next.
    fn least_subpixels(&self) -> u32 {
        let has_labels = self
            .channels
            .iter()
            .any(|channel| channel.reading == Reading::Nearest);
        if has_labels || matches!(self.options.blend(), Blend::Isosurface(_)) {
            HARD_EDGE_SUBPIXELS
        } else {
            1
        }
    }

    fn slab_voxels(&self) -> f64 {
        match &self.options.order {
            Order::Field(field) => field.slab_voxels,
            Order::Samples(samples) => samples.sheets().copied().unwrap_or_default().slab_voxels,
        }
    }

    fn settings(&self, view: &GridView, camera: &Camera) -> SheetSettings {
        let thickness = self.slab_voxels() * self.smallest_spacing;
        let sections = match &self.source {
            Source::Kernels(sheets) => sheets.sections(view, thickness),
            _ => SectionTable::of_cube(view.camera_from_grid.matrix3),
        };
        let camera_z = view.camera_from_grid.transform_point3(self.middle).z;
        let anchor = Anchor {
            grid: self.middle,
            camera_z,
        };
        SheetSettings {
            level: self.options.simd.resolve(),
            table: self.channels[0].table.clone(),
            channels: Arc::clone(&self.channels),
            gradient_ramp: self.options.gradient_opacity.map(GradientRamp::new),
            statistic: prepare::statistic(&self.options),
            iso: self.iso.map(|iso| IsoSettings {
                near: (view.near - anchor.camera_z) as f32,
                step: thickness as f32,
                ..iso
            }),
            ring_len: SheetSettings::ring_len(&sections, thickness),
            sections,
            brick_sections: SheetSettings::of_bricks(view.camera_from_grid.matrix3, CELL_SIDE),
            thickness,
            unit_in_world: self.options.opacity_unit.unwrap_or(self.smallest_spacing),
            anchor,
            clip: self.clip.anchored(self.middle),
            opacity: self.options.opacity,
            shade: ShadeSettings::new(&self.options, camera),
            world_from_camera: camera.camera_from_world.matrix3.transpose(),
            depth: match self.options.depth {
                DepthPlane::None => DepthRule::Skip,
                DepthPlane::Expected => DepthRule::Expected,
            },
            min_transmittance: self.options.min_transmittance,
        }
    }
}

/// The one scalar field of a scene: all that summed kernels know.
fn single<'a>(scene: &Scene<'a>) -> Result<(&'a Volume, &'a TransferFunction), Error> {
    scene.single().ok_or_else(|| {
        let what = "sums of kernels know one channel of scalars and no mask: draw the field";
        Error::Option(what.into())
    })
}

/// A sample needs a cell around it.
fn check_dims(dims: [usize; 3]) -> Result<(), Error> {
    let Some(axis) = dims.iter().position(|&n| n < 2) else {
        return Ok(());
    };
    Err(Error::Option(format!(
        "sheets need two voxels or more along each axis, and there is one along {}: composite every \
         sample instead",
        ["x", "y", "z"][axis]
    )))
}

impl Source {
    fn bounds(&self) -> Box<dyn Iterator<Item = Bounds> + '_> {
        match self {
            Self::Cells(field) => Box::new(field.bricks.iter().map(|brick| brick.bounds)),
            Self::Streamed(cells) => Box::new(cells.bounds()),
            Self::Kernels(sheets) => {
                Box::new(sheets.samples.bricks.iter().map(|brick| brick.bounds))
            }
        }
    }
}
