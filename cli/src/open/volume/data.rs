//! The content to draw: volumes in memory, or one that stays in its file because it is larger than the memory that was allowed.
//!
//! Takes what was typed, gives what framing and the stats file ask of the first volume, and a renderer.

use std::path::Path;

use anyhow::{Result, bail};
use glam::DVec3;
use resample_core::Camera;
use resample_io::Gate;
use volsplat::input::{Format, format_of, peek};
use volsplat::large::most_brick_bytes;
use volsplat::{
    Blend, Described, FieldOptions, Isosurface, LabelLook, LargeVolume, LoadOptions, Order,
    RenderOptions, Renderer, Scene, Shading, TransferFunction, Volume,
};

use crate::args::{SceneArgs, TransferArgs, VolsplatArgs};
use crate::cameras::viewpoint;
use crate::look;
use crate::look::channel_look::{ChannelLook, Values};
use crate::look::file_channel::ShownChannel;
use crate::look::transfer::Suggested;
use crate::look::{Look, LookSource, transfer};
use crate::open::volume::file::load_options;
use crate::open::volume::scene;
use crate::open::volume::scene::Volumes;
use crate::open::volume::step_values::StepValues;
use crate::open::volume::time_steps::TimeSteps;
use crate::output;
use crate::process::report::{Progress, watch};
use crate::values::mesh_word::IsoWord;

/// The content to draw.
pub(crate) struct Content {
    data: Data,
    /// The values of all steps of a volume over time, of which the data are one.
    steps: Option<StepValues>,
    /// How it looks.
    pub(crate) look: Look,
}

/// The values of the content.
enum Data {
    /// Volumes in memory.
    Memory(Volumes),
    /// A volume in its file.
    Stored(Box<LargeVolume>),
}

impl Data {
    fn channels<'a>(&'a self, steps: Option<&'a StepValues>) -> Vec<look::Channel<'a>> {
        match self {
            Self::Memory(volumes) => volumes.channels(steps),
            Self::Stored(volume) => vec![look::Channel {
                values: Values::Stored(volume),
                source: &LookSource::Data,
            }],
        }
    }
}

/// The part of a volume that a renderer keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keeping {
    /// The part that its transfer function shows.
    Shown,
    /// All of it, so that any other look is quick.
    Whole,
}

/// Most memory that a renderer takes for a voxel that it keeps, bytes: scalars, their bounds and gradients.
const WHOLE_BYTES: u64 = 37;

fn fits_whole(volume: &Volume, gate: &Gate) -> bool {
    (volume.len() as u64).saturating_mul(WHOLE_BYTES) <= gate.max_memory()
}

impl Content {
    /// Reads the volumes, or looks the only one through, and decides the look.
    pub(crate) fn load(
        args: &VolsplatArgs,
        (typed, format): (&RenderOptions, output::Format),
        steps: Option<&TimeSteps>,
        gate: &Gate,
        progress: Progress,
    ) -> Result<Self> {
        let data = match steps {
            None => load(args, typed, gate, progress)?,
            Some(_) => Data::Memory(scene::load(args, gate)?),
        };
        let steps = match (&data, steps) {
            (Data::Memory(first), Some(steps)) => Some(steps.values(args, first, progress)?),
            _ => None,
        };
        let look = look::decide(args, format, &data.channels(steps.as_ref()))?;
        Ok(Self { data, steps, look })
    }

    /// Reads the volumes of another step, whose look is that of all.
    pub(crate) fn read_step(&mut self, args: &VolsplatArgs) -> Result<()> {
        let volumes = scene::load(args, &args.volume.reading.gate())?;
        if volumes.all().count() != self.look.channels.len() {
            bail!(
                "{}: has another number of channels than the first step",
                args.input
            );
        }
        self.data = Data::Memory(volumes);
        Ok(())
    }

    /// The box in the world around all that is visible in any step of a volume over time; `None` where there are no steps, or nothing is seen.
    pub(crate) fn box_of_steps(&self) -> Option<[DVec3; 2]> {
        let steps = self.steps.as_ref()?;
        let shown = self.look.channels.iter().enumerate();
        let boxes = shown.filter_map(|(place, look)| match (look, &self.look.options.order) {
            (_, Order::Field(field)) if let Blend::Isosurface(surface) = &field.blend => {
                steps.0[place].box_where(|_, most| most >= surface.value)
            }
            (ChannelLook::Transfer(function), _) => steps.shown_box(place, function),
            (ChannelLook::Labels(_), _) => steps.0[place].box_where(|_, most| most >= 1.0),
            (ChannelLook::Tint(_), _) => None,
        });
        boxes.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Takes the looks that the arguments name, for renderers that are made or changed from now on.
    pub(crate) fn decide(&mut self, args: &VolsplatArgs, format: output::Format) -> Result<()> {
        self.look = look::decide(args, format, &self.data.channels(self.steps.as_ref()))?;
        Ok(())
    }

    /// The first volume, which gives the picture its grid.
    pub(crate) fn first(&self) -> &dyn Described {
        match &self.data {
            Data::Memory(volumes) => volumes.first(),
            Data::Stored(volume) => volume.as_ref(),
        }
    }

    /// The main volume or its channels, then the volumes of `--also`. A volume that stays in its file is refused.
    pub(crate) fn volumes(&self) -> Result<Vec<&Volume>> {
        match &self.data {
            Data::Memory(volumes) => Ok(volumes.all().collect()),
            Data::Stored(_) => bail!("a volume that stays in its file has no slices here"),
        }
    }

    /// The voxel of the first volume that is nearest to a place in the world, and its value; `None` outside of the grid, and
    /// of a volume in its file.
    pub(crate) fn nearest(&self, pos_in_world: DVec3) -> Option<([usize; 3], f64)> {
        let Data::Memory(volumes) = &self.data else {
            return None;
        };
        let volume = volumes.first();
        let index = volume
            .world_from_index
            .inverse()
            .transform_point3(pos_in_world)
            .round();
        let last = DVec3::from_array(volume.dims.map(|count| count as f64 - 1.0));
        if !(index.cmpge(DVec3::ZERO).all() && index.cmple(last).all()) {
            return None;
        }
        let voxel = index.to_array().map(|place| place as usize);
        let place = voxel[0] + volume.dims[0] * (voxel[1] + volume.dims[1] * voxel[2]);
        Some((voxel, volume.value(place)))
    }

    /// The first voxel on the ray of a camera with one pixel that hides half of what lies behind it, with those before it;
    /// or the most opaque one. A slow walk among nearest voxels, for one ray at a time.
    pub(crate) fn first_voxel(&self, pixel: &Camera) -> Option<DVec3> {
        let Data::Memory(volumes) = &self.data else {
            return None;
        };
        let lattice = volumes.first().lattice();
        let [low, high] = lattice.bounds_in_world();
        let near = viewpoint::world_at(pixel, pixel.near);
        let direction = (viewpoint::world_at(pixel, 2.0 * pixel.near) - near).normalize();
        let middle = (0.5 * (low + high) - near).dot(direction);
        let reach = 0.5 * (high - low).length();
        // Half a voxel a step: no voxel along the ray is missed by more than its corner.
        let step = 0.5 * lattice.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let steps = (2.0 * reach / step).ceil() as usize;
        let (mut transmittance, mut most) = (1.0, (0.0, None));
        for number in 0..steps {
            let at = near + direction * (middle - reach + number as f64 * step).max(0.0);
            let Some((voxel, _)) = self.nearest(at) else {
                continue;
            };
            let opacity = volumes.opacity_at(&self.look, voxel);
            if opacity > most.0 {
                most = (opacity, Some(at));
            }
            transmittance *= 1.0 - opacity;
            if transmittance < 0.5 {
                return Some(at);
            }
        }
        most.1
    }

    /// Has the first volume follow the functions of keys, whose mean this is: light and blending are those that were typed.
    pub(crate) fn follow_keys(
        &mut self,
        mean: TransferFunction,
        args: &VolsplatArgs,
        format: output::Format,
    ) -> Result<()> {
        self.look.set_function(mean);
        self.look.suggested = Suggested::default();
        let typed = (args, format);
        self.look.options = self.look.options_with(&args.render, typed, self.first())?;
        Ok(())
    }

    /// The channels of the file as they are drawn, with their volumes.
    pub(crate) fn shown_channels(&self) -> Vec<(&ShownChannel, &dyn Described)> {
        match &self.data {
            Data::Memory(volumes) => {
                let volumes = volumes.of_file().map(|volume| volume as &dyn Described);
                self.look.shown.iter().zip(volumes).collect()
            }
            Data::Stored(_) => Vec::new(),
        }
    }

    /// The labels of the first volume that holds labels, with their looks, the most frequent first.
    pub(crate) fn labels(&self) -> Vec<(i64, LabelLook)> {
        match &self.data {
            Data::Memory(volumes) => volumes.labels(&self.look),
            Data::Stored(_) => Vec::new(),
        }
    }

    /// Draws the first transfer function over its volume's histogram, where that was asked for.
    pub(crate) fn show_transfer(&self, args: &TransferArgs) -> Result<()> {
        match self.look.function() {
            Some(function) => transfer::show(args, function, self.first()),
            // The command line does not accept both.
            None => Ok(()),
        }
    }

    /// How much a renderer may keep whose looks will change.
    pub(crate) fn keeping(&self, gate: &Gate) -> Keeping {
        match &self.data {
            Data::Memory(volumes) if fits_whole(volumes.first(), gate) => Keeping::Whole,
            Data::Memory(_) | Data::Stored(_) => Keeping::Shown,
        }
    }

    /// Has a renderer draw the present look.
    pub(crate) fn change(
        &self,
        renderer: &mut Renderer,
        keeping: Keeping,
    ) -> Result<(), volsplat::Error> {
        match &self.data {
            Data::Memory(volumes) if keeping == Keeping::Whole => {
                renderer.update_scene(&volumes.scene(&self.look), &self.look.options)
            }
            Data::Memory(_) | Data::Stored(_) => {
                *renderer = self.renderer(keeping, Progress::Hidden)?;
                Ok(())
            }
        }
    }

    /// A renderer of an isosurface that stands in the volume.
    pub(crate) fn isosurface(&self, word: &IsoWord) -> Result<Renderer, volsplat::Error> {
        let scene = self.scene_in_memory()?;
        Renderer::with_scene(&scene, &self.isosurface_options(word))
    }

    /// Draws an isosurface of the present look.
    pub(crate) fn change_isosurface(
        &self,
        word: &IsoWord,
        renderer: &mut Renderer,
    ) -> Result<(), volsplat::Error> {
        let scene = self.scene_in_memory()?;
        renderer.update_scene(&scene, &self.isosurface_options(word))
    }

    fn scene_in_memory(&self) -> Result<Scene<'_>, volsplat::Error> {
        match &self.data {
            Data::Memory(volumes) => Ok(volumes.scene(&self.look)),
            Data::Stored(_) => {
                let why =
                    "an isosurface in a volume needs all voxels in memory: raise --max-memory";
                Err(volsplat::Error::Option(why.to_owned()))
            }
        }
    }

    fn isosurface_options(&self, word: &IsoWord) -> RenderOptions {
        let look = &self.look.options;
        RenderOptions {
            order: Order::Field(FieldOptions {
                blend: Blend::Isosurface(Isosurface {
                    value: word.value,
                    colour: word.colour,
                    opacity: 1.0,
                }),
                ..look.field().cloned().unwrap_or_default()
            }),
            shading: match look.shading {
                Shading::None => Shading::Phong,
                lit => lit,
            },
            gradient_opacity: None,
            ..look.clone()
        }
    }

    /// A renderer.
    pub(crate) fn renderer(
        &self,
        keeping: Keeping,
        progress: Progress,
    ) -> Result<Renderer, volsplat::Error> {
        let options = &self.look.options;
        match (&self.data, self.look.function()) {
            (Data::Memory(volumes), _) if keeping == Keeping::Whole => {
                Renderer::for_changes(&volumes.scene(&self.look), options)
            }
            (Data::Memory(volumes), _) => Renderer::with_scene(&volumes.scene(&self.look), options),
            (Data::Stored(volume), Some(function)) => Renderer::from_file(
                volume,
                function,
                options,
                &mut watch("finding what is visible", progress),
            ),
            (Data::Stored(_), None) => Err(volsplat::Error::Option(
                "labels need all voxels in memory".to_owned(),
            )),
        }
    }
}

/// Reads the volumes, or looks the only one through.
fn load(
    args: &VolsplatArgs,
    typed: &RenderOptions,
    gate: &Gate,
    progress: Progress,
) -> Result<Data> {
    if args.source.held().is_some() {
        return Ok(Data::Memory(scene::load(args, gate)?));
    }
    let mut load_options = load_options(&args.volume, &args.input, gate)?;
    let axes = volsplat::input::axes_of(&args.input.path, &load_options)?;
    let is_channel = load_options.component.is_some() || axes.channels.len() == 1;
    if !is_channel {
        // All channels are as large as the first.
        load_options.component = Some(0);
    }
    match look_through(&args.input.path, &load_options, typed, progress)? {
        None => Ok(Data::Memory(scene::load(args, gate)?)),
        Some(_) if !is_channel || !is_single(&args.scene) => bail!(
            "{}: masks, labels and further channels need all voxels in memory: allow more with --max-memory, leave them out, \
             or draw a coarser level or a smaller volume",
            args.input.path.display()
        ),
        Some(volume) => Ok(Data::Stored(volume)),
    }
}

/// Looks a volume through that does not fit the memory as a whole; `None` where it fits, or has to be read as a whole.
pub(crate) fn look_through(
    path: &Path,
    load_options: &LoadOptions,
    options: &RenderOptions,
    progress: Progress,
) -> Result<Option<Box<LargeVolume>>> {
    let gate = &load_options.gate;
    // To unpack an array into a temporary file takes a disk's room, which has to be asked for.
    if gate.given_memory().is_none() && format_of(path)? == Some(Format::Zarr) {
        return Ok(None);
    }
    let max_memory = gate.max_memory();
    let Some((lattice, voxel_type)) = peek(path, load_options)? else {
        return Ok(None);
    };
    let voxels = (lattice.len() as u64).saturating_mul(voxel_type.bytes() as u64);
    if voxels.saturating_add(most_brick_bytes(&lattice, voxel_type, options)) <= max_memory {
        return Ok(None);
    }
    let mut watch = watch("looking through the volume", progress);
    Ok(LargeVolume::open(path, load_options, max_memory, &mut watch)?.map(Box::new))
}

fn is_single(args: &SceneArgs) -> bool {
    let channels = &args.channels;
    let has_channels = !channels.components.is_empty() || !channels.also.is_empty();
    args.mask.is_none() && !args.labels && !has_channels
}
