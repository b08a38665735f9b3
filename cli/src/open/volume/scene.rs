//! The volumes of a picture: the main one, further channels, a mask.
//!
//! Takes the arguments, reads every file that they name, gives the volumes and the source of each look. Without options of this
//! kind that is one volume.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use glam::DVec3;
use resample_io::Gate;
use serde_json::{Value, json};
use volsplat::input::ColourVoxels;
use volsplat::volume::Between;
use volsplat::{Channel, Described, LabelLook, LoadOptions, Scene, Volume};

use crate::args::{SceneArgs, VolsplatArgs};
use crate::look;
use crate::look::channel_look::{ChannelLook, Values};
use crate::look::{Look, LookSource};
use crate::open::volume::channels;
use crate::open::volume::file::{load_options, with_part};
use crate::open::volume::step_values::StepValues;
use crate::process::report;
use crate::values::input_file::InputFile;
use crate::values::mesh_word::{IsoWord, SlicePlace};

/// All volumes of a picture.
pub(crate) struct Volumes {
    /// At least one; the first gives the picture its grid.
    channels: Vec<ChannelVolume>,
    mask: Option<Arc<Volume>>,
}

/// A volume, and where its look comes from.
struct ChannelVolume {
    volume: Arc<Volume>,
    source: LookSource,
}

/// Reads all volumes that the arguments name.
pub(crate) fn load(args: &VolsplatArgs, gate: &Gate) -> Result<Volumes> {
    let options = load_options(&args.volume, &args.input, gate)?;
    let scene = &args.scene;
    let held = args.source.held();
    if !scene.channels.components.is_empty() && options.component.is_some() {
        bail!("--channel names components itself: leave component=N out of the part of the file");
    }
    let mut channels = main_channels(args, &options)?;
    for (place, also) in scene.channels.also.iter().enumerate() {
        let between = match also.look.word.as_deref() {
            Some("labels") => Between::Nearest,
            _ => Between::Linear,
        };
        let volume = beside(&also.file, &options)?;
        let volume = on_grid(
            volume,
            (&also.file, between),
            &channels[0].volume,
            &args.input,
            gate,
        )?;
        channels.push(ChannelVolume {
            volume: volume.into(),
            source: LookSource::Also(place),
        });
    }
    for (volume, look) in held.map_or(&[][..], |held| &held.also) {
        channels.push(ChannelVolume {
            volume: volume.clone(),
            source: LookSource::Words(look.parse()?),
        });
    }
    let mask = match (held.and_then(|held| held.mask.clone()), &scene.mask) {
        (Some(mask), _) => Some(mask),
        (None, Some(path)) => {
            let file = InputFile::of(path.into());
            let mask = beside(&file, &options)?;
            let own = (&file, Between::Nearest);
            Some(on_grid(mask, own, &channels[0].volume, &args.input, gate)?.into())
        }
        (None, None) => None,
    };
    if let Some(mask) = &mask {
        check_mask(mask, &channels[0].volume)?;
    }
    Ok(Volumes { channels, mask })
}

/// The channels of the main file: those that were chosen or all that the file shows, its colours, or its values.
fn main_channels(args: &VolsplatArgs, options: &LoadOptions) -> Result<Vec<ChannelVolume>> {
    if let Some(voxels) = colours_of_file(args, options)? {
        return Ok(of_colours(voxels));
    }
    let held = args.source.held();
    let axes = match held {
        Some(held) => held.axes(),
        None => volsplat::input::axes_of(&args.input.path, options)?,
    };
    let drawn = channels::drawn(args, options, &axes)?;
    if drawn.is_empty() {
        let volume = match held {
            Some(held) => held.volume.clone(),
            None => volsplat::load(&args.input.path, options)?.into(),
        };
        let source = LookSource::Data;
        return Ok(vec![ChannelVolume { volume, source }]);
    }
    let numbers: Vec<usize> = drawn.iter().map(|channel| channel.number).collect();
    let volumes: Vec<Arc<Volume>> = match held {
        Some(held) => numbers
            .iter()
            .filter_map(|&number| held.channel(number))
            .collect(),
        None => volsplat::load_components(&args.input.path, options, &numbers)?
            .into_iter()
            .map(Arc::new)
            .collect(),
    };
    if volumes.len() < drawn.len() {
        bail!(
            "{}: --channel names {} channels, but a voxel has {}",
            args.input,
            drawn.len(),
            volumes.len()
        );
    }
    let channels = volumes.into_iter().zip(drawn);
    Ok(channels
        .map(|(volume, channel)| ChannelVolume {
            volume,
            source: LookSource::Channel(channel),
        })
        .collect())
}

impl Volumes {
    /// The channels, for the look; of a volume over time with the values of all steps.
    pub(crate) fn channels<'a>(&'a self, steps: Option<&'a StepValues>) -> Vec<look::Channel<'a>> {
        let channel = |(place, channel): (usize, &'a ChannelVolume)| look::Channel {
            values: match steps {
                None => Values::Memory(&channel.volume),
                Some(steps) => Values::Steps(&steps.0[place], &channel.volume),
            },
            source: &channel.source,
        };
        self.channels.iter().enumerate().map(channel).collect()
    }

    /// The scene that the library draws.
    pub(crate) fn scene<'a>(&'a self, look: &'a Look) -> Scene<'a> {
        let channels = self.channels.iter().zip(&look.channels);
        Scene {
            channels: channels
                .map(|(channel, look)| Channel {
                    volume: &channel.volume,
                    look: look.lent(),
                })
                .collect(),
            mask: self.mask.as_deref(),
        }
    }

    /// All volumes but the mask.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Volume> {
        self.channels.iter().map(|channel| channel.volume.as_ref())
    }

    /// The channels of the file.
    pub(crate) fn of_file(&self) -> impl Iterator<Item = &Volume> {
        let channels = self.channels.iter();
        channels
            .filter(|channel| matches!(channel.source, LookSource::Channel(_)))
            .map(|channel| channel.volume.as_ref())
    }

    /// The first volume, which gives the picture its grid.
    pub(crate) fn first(&self) -> &Volume {
        &self.channels[0].volume
    }

    /// Opacity of a voxel of the grid in all channels together, 0 to 1.
    pub(crate) fn opacity_at(&self, look: &Look, [x, y, z]: [usize; 3]) -> f64 {
        let [columns, rows, _] = self.first().dims;
        let voxel = x + columns * (y + rows * z);
        let clear = self
            .channels
            .iter()
            .zip(&look.channels)
            .map(|(channel, look)| {
                let value = channel.volume.value(voxel);
                1.0 - match look {
                    ChannelLook::Transfer(function) => function.opacity(value),
                    ChannelLook::Labels(table) => table.look(value as i64).opacity,
                    ChannelLook::Tint(_) => 0.0,
                }
            });
        1.0 - clear.product::<f64>()
    }

    /// The labels of the first volume that holds labels, with their looks, the most frequent first.
    pub(crate) fn labels(&self, look: &Look) -> Vec<(i64, LabelLook)> {
        let mut channels = self.channels.iter().zip(&look.channels);
        let found = channels.find_map(|(channel, look)| match look {
            ChannelLook::Labels(table) => Some((&channel.volume, table)),
            ChannelLook::Transfer(_) | ChannelLook::Tint(_) => None,
        });
        let Some((volume, table)) = found else {
            return Vec::new();
        };
        let looks = counted(volume).into_iter();
        looks.map(|(label, _)| (label, table.look(label))).collect()
    }
}

/// The labels of a volume but 0 and their voxels, the most frequent first.
fn counted(volume: &Volume) -> Vec<(i64, usize)> {
    let mut counts = BTreeMap::new();
    let mut run = (0, 0);
    for voxel in 0..volume.len() {
        let label = volume.value(voxel) as i64;
        if label != run.0 {
            *counts.entry(run.0).or_insert(0) += run.1;
            run = (label, 0);
        }
        run.1 += 1;
    }
    *counts.entry(run.0).or_insert(0) += run.1;
    counts.remove(&0);
    let mut counted: Vec<_> = counts.into_iter().collect();
    counted.sort_by_key(|&(label, count)| (usize::MAX - count, label));
    counted
}

/// The files that are read beside the volume, the transfer function and the cameras.
pub(crate) fn inputs(args: &SceneArgs) -> impl Iterator<Item = &Path> {
    let also = args.channels.also.iter();
    let files_of_meshes = args.meshes.iter().filter(|mesh| mesh.held.is_none());
    args.mask
        .iter()
        .chain(&args.label_colours)
        .chain(files_of_meshes.map(|mesh| &mesh.path))
        .map(PathBuf::as_path)
        .chain(also.map(|also| also.file.path.as_path()))
}

/// The scene's part of the settings in the stats file.
pub(crate) fn record(args: &SceneArgs) -> Value {
    let components = args.channels.components.iter();
    let components =
        components.map(|component| [component.channel.clone(), component.look.to_string()]);
    let also = args.channels.also.iter();
    let also = also.map(|also| [also.file.to_string(), also.look.to_string()]);
    let meshes = args.meshes.iter().map(|mesh| {
        json!({
            "file": report::name(&mesh.path),
            "colour": mesh.colour,
            "opacity": mesh.opacity,
        })
    });
    let isosurfaces = args.isosurfaces.iter();
    let isosurfaces = isosurfaces.map(
        |IsoWord {
             value,
             colour,
             opacity,
         }| { json!({ "value": value, "colour": colour, "opacity": opacity }) },
    );
    let slices = args.slices.iter().map(|word| {
        let plane = match word.place {
            SlicePlace::Voxels(axis, index) => json!({ "axis": axis, "voxel": index }),
            SlicePlace::Plane(plane) => json!([plane.normal.to_array(), plane.offset]),
        };
        json!({ "plane": plane, "window": word.window })
    });
    json!({
        "mask": args.mask.as_deref().map(report::name),
        "labels": args.labels,
        "label_colours": args.label_colours.as_deref().map(report::name),
        "channels": components.collect::<Vec<_>>(),
        "also": also.collect::<Vec<_>>(),
        "meshes": meshes.collect::<Vec<_>>(),
        "isosurfaces": isosurfaces.collect::<Vec<_>>(),
        "slices": slices.collect::<Vec<_>>(),
    })
}

/// The voxels of a file that holds colours, where nobody chose components; a note says how they are drawn.
fn colours_of_file(args: &VolsplatArgs, options: &LoadOptions) -> Result<Option<ColourVoxels>> {
    let scene = &args.scene;
    if !scene.channels.components.is_empty() || scene.labels || args.source.held().is_some() {
        return Ok(None);
    }
    let path = &args.input.path;
    let colours = volsplat::input::load_colours(path, options)?;
    if colours.is_some() {
        options.gate.remark(format!(
            "{}: its voxels are colours, opaque where they are bright or their alpha says so; FILE#component=N draws one of them",
            path.display()
        ));
    }
    Ok(colours)
}

/// The channels of voxels that are colours: the opacity first, which may take another look, then the tints.
fn of_colours(voxels: ColourVoxels) -> Vec<ChannelVolume> {
    let opacity = ChannelVolume {
        volume: voxels.opacity.into(),
        source: LookSource::ColourOpacity,
    };
    let tint = |(component, volume): (usize, Volume)| ChannelVolume {
        volume: volume.into(),
        source: LookSource::Tint(component),
    };
    let tints = voxels.components.into_iter().enumerate().map(tint);
    std::iter::once(opacity).chain(tints).collect()
}

/// Reads a volume that lies on the grid of another: as headerless as that one, if it has no header of its own.
fn beside(file: &InputFile, options: &LoadOptions) -> Result<Volume> {
    let is_known = volsplat::input::format_of(&file.path)?.is_some();
    let raw = options.raw.clone().filter(|_| !is_known);
    let own = LoadOptions {
        raw,
        component: None,
        array: None,
        series: None,
        ..options.clone()
    };
    Ok(volsplat::load(&file.path, &with_part(own, file)?)?)
}

/// The volume of a file on the grid of the first: as it is where it lies there, and resampled with a note where it does not.
fn on_grid(
    volume: Volume,
    (file, between): (&InputFile, Between),
    first: &Volume,
    first_file: &InputFile,
    gate: &Gate,
) -> Result<Volume> {
    let grid = first.lattice();
    if volume.lies_on(&grid) {
        return Ok(volume);
    }
    if volume.space.is_none() && first.space.is_none() && volume.dims != first.dims {
        let own = volume.lattice();
        let is_unplaced =
            own.world_from_index.translation == DVec3::ZERO && own.spacing() == [1.0; 3];
        if is_unplaced {
            let text = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
            bail!(
                "{file}: {} voxels without a place, but {first_file} has {}: expected the same dimensions, or a header that says where they lie",
                text(volume.dims),
                text(first.dims)
            );
        }
    }
    gate.ask(
        4 * first.len() as u64,
        "the voxels on the first volume's grid",
    )
    .map_err(|what| anyhow!("{file}: {what}"))?;
    let outside = match between {
        Between::Nearest => 0.0,
        Between::Linear => volume.value_range().0,
    };
    report::say(&format!(
        "note: {file} lies on another grid: resampled to that of {first_file}{}",
        match between {
            Between::Nearest => " by its nearest voxels",
            Between::Linear => "",
        }
    ));
    let moved = volume.on_grid(&grid, between, outside);
    moved.with_context(|| file.to_string())
}

/// Refuses a mask of memory, which has no place of its own, with other dimensions.
fn check_mask(mask: &Volume, grid: &Volume) -> Result<()> {
    if mask.dims != grid.dims {
        let text = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
        bail!(
            "the mask has {} voxels, the volume has {}; expected the same dimensions",
            text(mask.dims),
            text(grid.dims)
        );
    }
    Ok(())
}
