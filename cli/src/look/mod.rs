//! The look of a volume: takes typed options and the facts of the data, returns transfer functions, light and blending.
//!
//! [`decide`] computes the whole look; drawing uses it unchanged. `options` translates typed options; `transfer` makes the function of
//! one volume, and the light and blending that go with it; `channel_look` makes the look of a channel and of colour voxels.

pub(crate) mod options;
pub(crate) mod transfer;
pub(crate) mod channel_look;

use anyhow::{Context, Result};
use volsplat::{Described, RenderOptions, TransferFunction};

use crate::args::{Given, RenderArgs, VolsplatArgs};
use crate::look::channel_look::{ChannelLook, Values};
use crate::look::transfer::Suggested;
use crate::output::Format;

/// The look of a volume, decided.
pub(crate) struct Look {
    /// One for each channel.
    pub(crate) channels: Vec<ChannelLook>,
    /// The light and blending that go with the channels' looks, where none were typed.
    pub(crate) suggested: Suggested,
    /// Render options: typed ones, and those of the preset or the data where none were typed.
    pub(crate) options: RenderOptions,
}

/// A channel whose look is decided.
pub(crate) struct Channel<'a> {
    /// Its values.
    pub(crate) values: Values<'a>,
    /// Where its look comes from.
    pub(crate) source: &'a LookSource,
}

/// Where the look of a channel comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LookSource {
    /// The options of the transfer function, or the data.
    Data,
    /// The word of a `--channel`, counted from 0.
    Channel(usize),
    /// The word of an `--also`, counted from 0.
    Also(usize),
    /// A word that came with a volume in memory.
    Word(String),
    /// The options of the transfer function, or the data: the opacity of voxels that are colours.
    ColourOpacity,
    /// Red, green or blue of voxels that are colours, counted from 0.
    Tint(usize),
}

/// Decides the look of all channels, and how frames are drawn. The first channel gives the picture its grid.
///
/// # Errors
/// Options that contradict one another, and files of looks that cannot be read.
pub(crate) fn decide(args: &VolsplatArgs, format: Format, channels: &[Channel]) -> Result<Look> {
    let decided: Vec<(ChannelLook, Suggested)> = channels
        .iter()
        .map(|channel| channel_look(args, channel))
        .collect::<Result<_>>()?;
    // Of several channels none decides about light and blending, which they share.
    let is_alone = decided.len() == 1 || channels[0].source == &LookSource::ColourOpacity;
    let suggested = match decided.first() {
        Some((_, suggested)) if is_alone => *suggested,
        _ => Suggested::default(),
    };
    let first = channels[0].values.described();
    Ok(Look {
        options: options(args, &args.render, format, (first, &suggested))?,
        channels: decided.into_iter().map(|(look, _)| look).collect(),
        suggested,
    })
}

/// The options that were typed, for checks before the data are known.
///
/// # Errors
/// Options that contradict one another.
pub(crate) fn typed_options(args: &VolsplatArgs, format: Format) -> Result<RenderOptions> {
    options::typed(&args.render, args.transfer.opacity_unit, format)
}

fn options(
    args: &VolsplatArgs,
    render: &Given<RenderArgs>,
    format: Format,
    (volume, suggested): (&dyn Described, &Suggested),
) -> Result<RenderOptions> {
    let typed = options::typed(render, args.transfer.opacity_unit, format)?;
    Ok(options::with_suggested(
        typed,
        &render.options,
        volume,
        suggested,
    ))
}

fn channel_look(args: &VolsplatArgs, channel: &Channel) -> Result<(ChannelLook, Suggested)> {
    let fewer = || "the number of channels changed: read the volume again";
    let channels = &args.scene.channels;
    let volume = channel.values.described();
    let of_word = |word: &str| {
        let look = channel_look::of_word(word, volume, args)?;
        Ok((look, Suggested::default()))
    };
    match channel.source {
        LookSource::Data => channel_look::of_data(args, channel.values),
        LookSource::Channel(place) => {
            let component = channels.components.get(*place).with_context(fewer)?;
            of_word(&component.look)
        }
        LookSource::Also(place) => {
            let volume = channels.also.get(*place).with_context(fewer)?;
            of_word(&volume.look)
        }
        LookSource::Word(word) => of_word(word),
        LookSource::ColourOpacity => {
            let (function, suggested) = channel_look::opacity(args, volume)?;
            Ok((ChannelLook::Transfer(function), suggested))
        }
        LookSource::Tint(component) => {
            let function = volsplat::transfer::tint(*component, volume);
            Ok((ChannelLook::Tint(function), Suggested::default()))
        }
    }
}

impl Look {
    /// The options of frames under other options of rendering; the channels keep their looks.
    ///
    /// # Errors
    /// Options that contradict one another.
    pub(crate) fn options_with(
        &self,
        render: &Given<RenderArgs>,
        (args, format): (&VolsplatArgs, Format),
        volume: &dyn Described,
    ) -> Result<RenderOptions> {
        options(args, render, format, (volume, &self.suggested))
    }

    /// The transfer function of the first channel; `None` where it holds labels.
    pub(crate) fn function(&self) -> Option<&TransferFunction> {
        match &self.channels[0] {
            ChannelLook::Transfer(function) => Some(function),
            ChannelLook::Labels(_) | ChannelLook::Tint(_) => None,
        }
    }

    /// Gives the first channel another transfer function.
    pub(crate) fn set_function(&mut self, function: TransferFunction) {
        self.channels[0] = ChannelLook::Transfer(function);
    }
}
