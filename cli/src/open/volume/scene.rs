//! The volumes of a picture and their looks: the main one, further channels, a mask.
//!
//! Takes the arguments, reads every file that they name, gives what a `volsplat::Scene` borrows. Without options of this
//! kind that is one volume and its transfer function.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use resample_io::Gate;
use serde_json::{Value, json};
use volsplat::input::ColourVoxels;
use volsplat::{Channel, LabelLook, LoadOptions, Scene, TransferFunction, Volume};

use crate::args::{SceneArgs, TransferArgs, VolsplatArgs};
use crate::look::channel_look::{OwnLook, own_look, parsed_look};
use crate::look::suggested::Suggested;
use crate::look::{colours, transfer};
use crate::open::volume::file::{load_options, with_part};
use crate::process::report;
use crate::values::input_file::InputFile;

/// All volumes of a picture.
pub(crate) struct Volumes {
    /// At least one; the first gives the picture its grid.
    pub channels: Vec<LookedAt>,
    mask: Option<Arc<Volume>>,
    /// The light and blending of the only channel's look.
    pub suggested: Suggested,
}

/// A volume and how it looks.
pub(crate) struct LookedAt {
    /// The voxels.
    pub volume: Arc<Volume>,
    look: OwnLook,
}

/// Reads all volumes and looks that the arguments name.
pub(crate) fn load(args: &VolsplatArgs, gate: &Gate) -> Result<Volumes> {
    let options = load_options(&args.volume, &args.input, gate)?;
    let scene = &args.scene;
    if !scene.channel.is_empty() && args.source.held().is_some() {
        bail!("--channel names components of a file: give further arrays with --also");
    }
    if !scene.channel.is_empty() && options.component.is_some() {
        bail!("--channel names components itself: leave component=N out of the part of the file");
    }
    let mut channels = Vec::new();
    let mut suggested = Suggested::default();
    if let Some(voxels) = colours::of_file(args, &options)? {
        (channels, suggested) = of_colours(args, voxels)?;
    }
    for pair in scene.channel.chunks(2) {
        let [number, look] = pair else { continue };
        let component = number.parse().ok().with_context(|| {
            format!(
                "--channel {number}: expected the number of a component, counted from 0, and then its look"
            )
        })?;
        let volume = volsplat::load(
            &args.input.path,
            &LoadOptions {
                component: Some(component),
                ..options.clone()
            },
        )?;
        channels.push(LookedAt {
            look: parsed_look(look, &volume, args)?,
            volume: volume.into(),
        });
    }
    let held = args.source.held();
    if channels.is_empty() {
        let volume = match held {
            Some(held) => held.volume.clone(),
            None => volsplat::load(&args.input.path, &options)?.into(),
        };
        let (look, goes_with) = own_look(args, &volume)?;
        if scene.also.is_empty() && held.is_none_or(|held| held.also.is_empty()) {
            suggested = goes_with;
        }
        channels.push(LookedAt { look, volume });
    }
    for pair in scene.also.chunks(2) {
        let [file, look] = pair else { continue };
        let volume = beside(&InputFile::of(file.into()), &options)?;
        channels.push(LookedAt {
            look: parsed_look(look, &volume, args)?,
            volume: volume.into(),
        });
    }
    for (volume, look) in held.map_or(&[][..], |held| &held.also) {
        channels.push(LookedAt {
            look: parsed_look(look, volume, args)?,
            volume: volume.clone(),
        });
    }
    let mask = match (held.and_then(|held| held.mask.clone()), &scene.mask) {
        (Some(mask), _) => Some(mask),
        (None, Some(path)) => Some(beside(&InputFile::of(path.into()), &options)?.into()),
        (None, None) => None,
    };
    if let Some(mask) = &mask {
        check_mask(mask, &channels[0].volume, scene.mask.as_deref())?;
    }
    Ok(Volumes {
        channels,
        mask,
        suggested,
    })
}

impl Volumes {
    /// The scene that the library draws.
    pub(crate) fn scene(&self) -> Scene<'_> {
        Scene {
            channels: self
                .channels
                .iter()
                .map(|channel| Channel {
                    volume: &channel.volume,
                    look: channel.look.lent(),
                })
                .collect(),
            mask: self.mask.as_deref(),
        }
    }

    /// The first volume, which gives the picture its grid.
    pub(crate) fn first(&self) -> &Volume {
        &self.channels[0].volume
    }

    /// The transfer function of the first volume; `None` where it holds labels.
    pub(crate) fn function(&self) -> Option<&TransferFunction> {
        match &self.channels[0].look {
            OwnLook::Transfer(function) => Some(function),
            OwnLook::Labels(_) | OwnLook::Tint(_) => None,
        }
    }

    /// Takes another transfer function for the first volume.
    pub(crate) fn set_function(&mut self, function: TransferFunction) {
        self.channels[0].look = OwnLook::Transfer(function);
    }

    /// Takes the looks that the arguments name; the volumes stay.
    pub(crate) fn relook(&mut self, args: &VolsplatArgs) -> Result<()> {
        let words = args.scene.channel.chunks(2).map(|pair| pair.last());
        let mut words: Vec<Option<&String>> = words.collect();
        if words.is_empty() {
            words.push(None);
        }
        words.extend(args.scene.also.chunks(2).map(|pair| pair.last()));
        let has_tints = self.channels.iter().any(LookedAt::is_tint);
        let looks: Result<Vec<(OwnLook, Suggested)>> = self
            .channels
            .iter()
            .filter(|channel| !channel.is_tint())
            .zip(&words)
            .map(|(channel, word)| match word {
                Some(word) => Ok((
                    parsed_look(word, &channel.volume, args)?,
                    Suggested::default(),
                )),
                None if has_tints => colours::opacity(args, &channel.volume)
                    .map(|(function, suggested)| (OwnLook::Transfer(function), suggested)),
                None => own_look(args, &channel.volume),
            })
            .collect();
        let looks = looks?;
        self.suggested = match looks.as_slice() {
            [(_, suggested)] => *suggested,
            _ => Suggested::default(),
        };
        let looked_at = self
            .channels
            .iter_mut()
            .filter(|channel| !channel.is_tint());
        for (channel, (look, _)) in looked_at.zip(looks) {
            channel.look = look;
        }
        Ok(())
    }

    /// Opacity of a voxel of the grid in all channels together, 0 to 1.
    pub(crate) fn opacity_at(&self, [x, y, z]: [usize; 3]) -> f64 {
        let [columns, rows, _] = self.first().dims;
        let voxel = x + columns * (y + rows * z);
        let clear = self.channels.iter().map(|channel| {
            let value = channel.volume.value(voxel);
            1.0 - match &channel.look {
                OwnLook::Transfer(function) => function.opacity(value),
                OwnLook::Labels(table) => table.look(value as i64).opacity,
                OwnLook::Tint(_) => 0.0,
            }
        });
        1.0 - clear.product::<f64>()
    }

    /// The labels of the first volume that holds labels, with their looks, the most frequent first.
    pub(crate) fn labels(&self) -> Vec<(i64, LabelLook)> {
        let found = self
            .channels
            .iter()
            .find_map(|channel| match &channel.look {
                OwnLook::Labels(table) => Some((&channel.volume, table)),
                OwnLook::Transfer(_) | OwnLook::Tint(_) => None,
            });
        let Some((volume, table)) = found else {
            return Vec::new();
        };
        let looks = counted(volume).into_iter();
        looks.map(|(label, _)| (label, table.look(label))).collect()
    }

    /// Draws the first transfer function over its volume's histogram, where that was asked for.
    pub(crate) fn show_transfer(&self, args: &TransferArgs) -> Result<()> {
        match &self.channels[0].look {
            OwnLook::Transfer(function) => transfer::show(args, function, self.first()),
            // The command line does not accept both.
            OwnLook::Labels(_) | OwnLook::Tint(_) => Ok(()),
        }
    }
}

impl LookedAt {
    fn is_tint(&self) -> bool {
        matches!(self.look, OwnLook::Tint(_))
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
    let also = args.also.iter().step_by(2).map(|file| {
        // The part behind a `#` is no part of the name.
        Path::new(
            file.rsplit_once('#')
                .map_or(file.as_str(), |(path, _)| path),
        )
    });
    args.mask
        .iter()
        .chain(&args.label_colours)
        .map(PathBuf::as_path)
        .chain(also)
}

/// The scene's part of the settings in the stats file.
pub(crate) fn record(args: &SceneArgs) -> Value {
    json!({
        "mask": args.mask.as_deref().map(report::name),
        "labels": args.labels,
        "label_colours": args.label_colours.as_deref().map(report::name),
        "channels": args.channel.chunks(2).collect::<Vec<_>>(),
        "also": args.also.chunks(2).collect::<Vec<_>>(),
    })
}

/// The channels of voxels that are colours: the opacity first, which may take another look, then the tints.
fn of_colours(args: &VolsplatArgs, voxels: ColourVoxels) -> Result<(Vec<LookedAt>, Suggested)> {
    let (function, suggested) = colours::opacity(args, &voxels.opacity)?;
    let mut channels = vec![LookedAt {
        volume: voxels.opacity.into(),
        look: OwnLook::Transfer(function),
    }];
    for (number, volume) in voxels.components.into_iter().enumerate() {
        channels.push(LookedAt {
            look: OwnLook::Tint(volsplat::transfer::tint(number, &volume)),
            volume: volume.into(),
        });
    }
    Ok((channels, suggested))
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

fn check_mask(mask: &Volume, grid: &Volume, file: Option<&Path>) -> Result<()> {
    if mask.dims != grid.dims {
        let text = |[x, y, z]: [usize; 3]| format!("{x}x{y}x{z}");
        bail!(
            "{}: the mask has {} voxels, the volume has {}; expected the same dimensions",
            file.unwrap_or(Path::new("mask")).display(),
            text(mask.dims),
            text(grid.dims)
        );
    }
    Ok(())
}
