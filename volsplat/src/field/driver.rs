//! The driver of the field: from a scene and options to bricks of cells, and from cameras to tiles.
//!
//! A viewer changes the look between two pictures: where all bricks of cells are kept, their visible cells are found again,
//! and the tables beside them are made anew. The pictures are those of a renderer that is prepared for this look.
//! An animation changes the transfer function: as long as the bricks hold all scalars that
//! the new function shows, only its table is made again, and everything that depends on it. A renderer that was prepared with the
//! mean of several functions can so take any of them, and any mean of them.
//! Limits: such an animation has one channel of scalars, no mask, gathered sheets.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use resample_core::{Camera, GridView, Reuse, Stop, Surface};
use resample_volume::Watch;
use resample_volume::volume::{Described, Lattice};

use crate::Error;
use crate::bricks::cells::{CellField, FromDifferences};
use crate::bricks::fill::{check_dims, plan, support};
use crate::bricks::support::Support;
use crate::field::known_light::FieldLight;
use crate::field::settings::{FieldFrame, FieldSettings, IsoSettings, Statistic, UniformChoice};
use crate::field::streamed::{LargeCells, StreamedCells};
use crate::field::surfaces::Surfaces;
use crate::grid::{Bounds, in_unit, power_of_two};
use crate::large::LargeVolume;
use crate::look::clip::{Clip, GridClip, bounds_in_world};
use crate::look::options::{Blend, FieldOptions, RenderOptions, Subpixels};
use crate::look::scene::{Look, Scene};
use crate::look::transfer::TransferFunction;
use crate::picture::{Means, TileDepth, TileLayout, TileSlot, automatic, refined};
use crate::slabs::settings::{
    Anchor, ChannelSettings, KernelReach, Reading, SheetSettings, Slabs, channels, check,
};
use crate::stats::FrameStats;

/// The bricks of a scene that are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// Those that may show something.
    Shown,
    /// All of them, where all channels are scalars: another look may show more.
    Whole,
}

/// The bricks of a scene.
pub(crate) fn cells(
    scene: &Scene,
    options: &RenderOptions,
    channels: &[ChannelSettings],
    kept: Kept,
) -> Result<CellField, Error> {
    let plan = plan(scene, options)?.tabulated(channels);
    let count = scene.count_visible();
    Ok(match kept {
        Kept::Whole if scene.transfers().is_some() => CellField::whole(&plan, count),
        Kept::Whole | Kept::Shown => CellField::new(&plan, count),
    })
}

/// The statistic that the options ask for.
pub(crate) fn statistic(options: &RenderOptions) -> Option<Statistic> {
    match options.blend() {
        Blend::Maximum => Some(Statistic::Greatest),
        Blend::Minimum => Some(Statistic::Least),
        Blend::Average => Some(Statistic::Mean),
        Blend::Emission | Blend::Isosurface(_) => None,
    }
}

/// The surface that the options ask for, without what depends on the camera.
pub(crate) fn iso(look: Look, options: &RenderOptions) -> Option<IsoSettings> {
    let Blend::Isosurface(iso) = options.blend() else {
        return None;
    };
    let own_colour = match look {
        Look::Transfer(transfer) => transfer.sample(iso.value).0,
        Look::Labels(_) | Look::Tint(_) => [1.0; 3],
    };
    let rgb = iso.colour.unwrap_or(own_colour);
    Some(IsoSettings {
        value: iso.value as f32,
        rgb,
        opacity: iso.opacity,
        step: 0.0,
    })
}

/// Sub-pixels along a pixel's side for what has hard edges: 16 a pixel, so that an edge has 17 shades. At 2 it has 5, and
/// stairs show.
const HARD_EDGE_SUBPIXELS: u32 = 4;

/// Most sub-pixels along a pixel's side whose mean is corrected.
const MOST_CORRECTED: u32 = 4;

/// Sub-pixels a voxel that are enough where a pixel has four along a side: such pictures keep 45 to 58 dB, where close up
/// one a pixel has 36 to 47.
const ENOUGH_AT_FOUR: f64 = 1.0;

/// Those for the rims of shells, which are soft: opacity falls off from the rim inwards.
const SHELL_EDGE_SUBPIXELS: u32 = 2;

/// Renders a field on sheets.
#[derive(Clone, Debug)]
pub(crate) struct FieldPipeline {
    pub(super) source: Source,
    pub(super) channels: Arc<[ChannelSettings]>,
    /// True if all bricks are kept, shown or not.
    pub(super) is_whole: bool,
    /// The scalars that bricks are kept for, and those that are seen now where they are fewer; one channel of scalars.
    pub(super) kept: Option<Support>,
    pub(super) seen: Option<Support>,
    pub(super) iso: Option<IsoSettings>,
    pub(super) options: RenderOptions,
    /// Those of the field.
    pub(super) choices: FieldOptions,
    pub(super) clip: GridClip,
    pub(super) world_from_index: DAffine3,
    pub(super) smallest_spacing: f64,
    /// The power of two, in world units, in which pictures count lengths.
    pub(super) length: f64,
    /// The voxel in the middle of the volume.
    pub(super) middle: DVec3,
    /// Middle of what is visible, in the grid.
    pub(super) visible_middle: Option<DVec3>,
    /// Light at the vertices of the bricks, once a picture with shadows or occlusion was drawn.
    pub(super) light: FieldLight,
    /// Voxels of the volume along each axis.
    pub(super) dims: [usize; 3],
}

/// Where the cells are.
#[derive(Clone, Debug)]
pub(super) enum Source {
    Cells(CellField),
    /// Cells that are read when they are needed.
    Streamed(Box<StreamedCells>),
}

impl FieldPipeline {
    pub(crate) fn new(
        scene: &Scene,
        options: &RenderOptions,
        choices: &FieldOptions,
        kept: Kept,
    ) -> Result<Self, Error> {
        let volume = scene.grid();
        check_dims(volume.dims)?;
        let channels = channels(scene, options)?;
        let source = Source::Cells(cells(scene, options, &channels, kept)?);
        let iso = iso(scene.channels[0].look, options);
        Ok(Self {
            is_whole: kept == Kept::Whole && scene.transfers().is_some(),
            kept: scene
                .single()
                .map(|(_, transfer)| support(transfer, options)),
            iso,
            ..Self::assembled(source, channels, &volume.lattice(), options, choices)
        })
    }

    /// Image sheets of a volume that stays in its file.
    pub(crate) fn from_file(
        volume: &LargeVolume,
        transfer: &TransferFunction,
        options: &RenderOptions,
        choices: &FieldOptions,
        watch: &mut Watch,
    ) -> Result<Self, Error> {
        let lattice = volume.lattice();
        check_dims(lattice.dims)?;
        let source = match LargeCells::new(volume, transfer, options, watch)? {
            LargeCells::Resident(field) => Source::Cells(field),
            LargeCells::Streamed(cells) => Source::Streamed(cells),
        };
        let channel = ChannelSettings::of_transfer(transfer, volume.drawn_range(), options.opacity);
        let iso = iso(Look::Transfer(transfer), options);
        let kept = Some(support(transfer, options));
        Ok(Self {
            kept,
            iso,
            ..Self::assembled(source, Arc::from([channel]), &lattice, options, choices)
        })
    }

    fn assembled(
        source: Source,
        channels: Arc<[ChannelSettings]>,
        lattice: &Lattice,
        options: &RenderOptions,
        choices: &FieldOptions,
    ) -> Self {
        let mut sheets = Self {
            world_from_index: lattice.world_from_index,
            visible_middle: None,
            light: FieldLight::none(options.light_grid),
            dims: lattice.dims,
            clip: GridClip::default(),
            source,
            channels,
            is_whole: false,
            kept: None,
            seen: None,
            iso: None,
            options: options.clone(),
            choices: choices.clone(),
            smallest_spacing: lattice.smallest_spacing(),
            length: power_of_two(lattice.smallest_spacing()),
            middle: DVec3::from(lattice.dims.map(|n| (n / 2) as f64)),
        };
        sheets.update_clip(&options.clip);
        sheets
    }

    /// Changes the kept part of the volume.
    pub(crate) fn update_clip(&mut self, clip: &Clip) {
        self.clip = clip.in_grid(&self.world_from_index);
        self.light.forget_reaching();
        let visible = bounds_in_world(self.source.bounds(), &self.clip, &DAffine3::IDENTITY);
        self.visible_middle = visible.map(|[low, high]| 0.5 * (low + high));
    }

    /// The box, in the world, of the voxels that are drawn.
    pub(crate) fn bounds_in_world(&self) -> Option<[DVec3; 2]> {
        bounds_in_world(self.source.bounds(), &self.clip, &self.world_from_index)
    }

    /// Returns true if each frame reads the volume's file.
    pub(crate) fn reads_file(&self) -> bool {
        matches!(self.source, Source::Streamed(_))
    }

    /// Voxels that the transfer function leaves visible, and voxels in all.
    pub(crate) fn counts(&self) -> [u64; 2] {
        match &self.source {
            Source::Cells(field) => [field.non_transparent, field.voxels],
            Source::Streamed(cells) => [cells.non_transparent, cells.voxels],
        }
    }

    /// Renders the tiles of one frame. Fails only where voxels have to be read and cannot be.
    pub(crate) fn render(
        &mut self,
        camera: &Camera,
        tiles: &mut Vec<TileSlot>,
        stats: &mut FrameStats,
        (surfaces, depth_origin): (&[Surface], f64),
        (watch, stop): (&mut Watch, &Stop),
    ) -> Result<TileLayout, Error> {
        let (fine, subpixels) = self.fine_camera(camera);
        check_surfaces(surfaces, &fine)?;
        stats.subpixels = u64::from(subpixels);
        let view = self.view(&fine);
        self.block_light((watch, stop))?;
        let settings = self.settings(&view, &fine);
        let uniform = if settings.is_plain() {
            UniformChoice::new(&self.options, &view, &camera.in_unit(self.length))
        } else {
            None
        };
        let means = if surfaces.is_empty() {
            self.means(subpixels)
        } else {
            Means::Own
        };
        let frame = FieldFrame {
            settings: &settings,
            view: &view,
            camera: &fine,
            clip: &self.clip,
            light: self.light.drawn(&self.options),
            coarse: self.light.coarse.as_ref(),
            subpixels,
            means,
            uniform,
            surfaces: Surfaces {
                all: surfaces,
                depth_origin,
                length: self.length,
            },
            stop,
        };
        match &mut self.source {
            Source::Cells(field) => {
                frame.gather(field, self.seen.as_ref(), tiles, stats);
            }
            Source::Streamed(_) if !surfaces.is_empty() => {
                let what = "surfaces in the volume need all visible voxels in memory: allow more memory, or leave them out";
                return Err(Error::Option(what.into()));
            }
            Source::Streamed(cells) => cells.render(&frame, tiles, stats, watch)?,
        }
        Ok(TileLayout {
            camera: *camera,
            subpixels,
            means,
            depth: TileDepth::CameraZ,
            length: self.length,
        })
    }

    /// The camera that has sub-pixels for pixels, in the length in which pictures count, and how many along a pixel's side.
    pub(crate) fn fine_camera(&self, camera: &Camera) -> (Camera, u32) {
        refined(&camera.in_unit(self.length), self.subpixels(camera))
    }

    /// The number of sub-pixels along a pixel's side.
    fn subpixels(&self, camera: &Camera) -> u32 {
        match (self.options.subpixels, self.visible_middle) {
            (Subpixels::Fixed(n), _) => n,
            (Subpixels::Auto, None) => 1,
            (Subpixels::Auto, Some(middle)) => {
                // Two sub-pixels a voxel: at one, thin structures lose 9 dB, beyond two it costs more than it gains.
                // Shells bend within a voxel: at two they have 32 dB, at four 42.
                let a_voxel = if self.has_shells() { 4.0 } else { 1.5 };
                let at = |a_voxel: f64| automatic(camera, &self.world_from_index, middle, a_voxel);
                let mut of_voxels = at(a_voxel);
                if !self.has_shells() {
                    // The mean of sixteen rays is nearer the truth than one ray is close up.
                    of_voxels = of_voxels.min(at(ENOUGH_AT_FOUR).max(4));
                }
                of_voxels.max(self.least_subpixels())
            }
        }
    }

    /// How pixels follow from sub-pixels: what is composited, smooth at their scale, is corrected. Hard edges are not
    /// smooth, and shells far away, at more than four, lose a decibel.
    fn means(&self, subpixels: u32) -> Means {
        let is_smooth = self.options.blend() == Blend::Emission && !self.has_labels();
        let is_auto = self.options.subpixels == Subpixels::Auto;
        if is_auto && is_smooth && subpixels <= MOST_CORRECTED {
            Means::Corrected
        } else {
            Means::Own
        }
    }

    fn has_labels(&self) -> bool {
        let mut channels = self.channels.iter();
        channels.any(|channel| channel.reading == Reading::Nearest)
    }

    /// Returns true if shells are drawn that are thinner than the distance of samples.
    fn has_shells(&self) -> bool {
        let is_plain = self.channels.len() == 1 && self.options.gradient_opacity.is_none();
        let is_emission = self.options.blend() == Blend::Emission;
        is_plain && is_emission && self.channels[0].table.integrals().is_some()
    }

    /// Sub-pixels that edges need however large voxels are: surfaces, shells and labels end between one pixel and the next.
    fn least_subpixels(&self) -> u32 {
        if self.has_labels() || matches!(self.options.blend(), Blend::Isosurface(_)) {
            HARD_EDGE_SUBPIXELS
        } else if self.has_shells() {
            SHELL_EDGE_SUBPIXELS
        } else {
            1
        }
    }

    /// The grid before a camera; both count in [`Self::length`].
    pub(super) fn view(&self, camera: &Camera) -> GridView {
        GridView::new(camera, &in_unit(&self.world_from_index, self.length))
    }

    pub(super) fn settings(&self, view: &GridView, camera: &Camera) -> FieldSettings {
        let thickness = self.choices.slab_voxels * self.smallest_spacing / self.length;
        let anchor = Anchor::new(self.middle, view);
        FieldSettings {
            sheets: SheetSettings::new(
                &self.options,
                camera,
                KernelReach::of_cube(view.camera_from_grid.matrix3),
                &self.channels[0].table,
                Slabs {
                    anchor,
                    length: self.length,
                    thickness,
                    opacity_unit: self.options.opacity_unit_in_world(self.smallest_spacing)
                        / self.length,
                },
            ),
            clip: self.clip.anchored(self.middle),
            channels: Arc::clone(&self.channels),
            from_differences: FromDifferences::new(&self.world_from_index.matrix3),
            statistic: statistic(&self.options),
            segments: (1.0 / self.choices.slab_voxels).ceil().max(1.0) as u32,
            iso: self.iso.map(|iso| IsoSettings {
                step: thickness as f32,
                ..iso
            }),
            gains: self.light.drawn(&self.options).gains(),
        }
    }

    /// Takes options that differ only in settings read anew for each frame.
    pub(crate) fn update(&mut self, options: &RenderOptions) {
        if let Some(field) = options.field() {
            self.choices = field.clone();
        }
        self.light.update(&self.options, options);
        self.options = options.clone();
    }
}

/// Refuses surfaces that are not at the sub-pixels of this camera.
fn check_surfaces(surfaces: &[Surface], fine: &Camera) -> Result<(), Error> {
    let expected = [fine.width, fine.height].map(|side| side as usize);
    let odd = surfaces
        .iter()
        .map(Surface::size)
        .find(|size| *size != expected);
    odd.map_or(Ok(()), |[width, height]| {
        Err(Error::Option(format!(
            "a surface has {width}x{height} pixels, expected the {}x{} sub-pixels of the volume's picture",
            expected[0], expected[1]
        )))
    })
}

impl Source {
    pub(super) fn bounds(&self) -> Box<dyn Iterator<Item = Bounds> + '_> {
        match self {
            Self::Cells(field) => Box::new(field.bricks.iter().map(|brick| brick.bounds)),
            Self::Streamed(cells) => Box::new(cells.bounds()),
        }
    }
}

impl FieldPipeline {
    /// Draws a scene of the voxels and the mask that this was prepared with, by these options.
    /// [`Error::Option`] where the scene does not suit them; nothing has changed then.
    pub(crate) fn update_scene(
        &mut self,
        scene: &Scene,
        options: &RenderOptions,
    ) -> Result<Reuse, Error> {
        let (Source::Cells(field), Some(transfers), Some(choices)) =
            (&mut self.source, scene.transfers(), options.field())
        else {
            return Ok(Reuse::NeedsRenderer);
        };
        if !self.is_whole || transfers.len() != self.channels.len() {
            return Ok(Reuse::NeedsRenderer);
        }
        let channels: Arc<[ChannelSettings]> = transfers
            .iter()
            .zip(self.channels.iter())
            .map(|(transfer, before)| {
                ChannelSettings::of_transfer(transfer, before.value_range, options.opacity)
            })
            .collect();
        check(&channels, options)?;
        if self.options.used_gradient_filter() != options.used_gradient_filter() {
            field.forget_gradients();
        }
        field.show(&plan(scene, options)?.tabulated(&channels));
        self.kept = scene
            .single()
            .map(|(_, transfer)| support(transfer, options));
        self.seen = None;
        self.iso = iso(scene.channels[0].look, options);
        self.channels = channels;
        self.choices = choices.clone();
        self.options = options.clone();
        self.light = FieldLight::none(options.light_grid);
        self.update_clip(&options.clip);
        Ok(Reuse::Kept)
    }
}

impl FieldPipeline {
    /// Takes another transfer function.
    pub(crate) fn update_transfer(&mut self, transfer: &TransferFunction) -> Reuse {
        let Some(kept) = &self.kept else {
            return Reuse::NeedsRenderer;
        };
        let support = support(transfer, &self.options);
        if !kept.covers(&support) {
            return Reuse::NeedsRenderer;
        }
        self.seen = (!support.covers(kept)).then_some(support);
        let range = self.channels[0].value_range;
        self.channels = Arc::from([ChannelSettings::of_transfer(
            transfer,
            range,
            self.options.opacity,
        )]);
        self.light.forget();
        self.iso = iso(Look::Transfer(transfer), &self.options);
        Reuse::Kept
    }
}
