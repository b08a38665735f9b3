//! The look of a volume: takes typed options and the facts of the data, returns transfer functions, light and blending.
//!
//! [`decide`] computes the whole look; drawing uses it unchanged. `options` translates typed options; `transfer` makes the function of
//! one volume, and the light and blending that go with it; `file_channel` describes a channel of a file, and `channel_look` makes its look and
//! that of colour voxels.

pub(crate) mod options;
pub(crate) mod transfer;
pub(crate) mod file_channel;
pub(crate) mod channel_look;

use anyhow::{Context, Result, bail};
use volsplat::input::ImageChannel;
use volsplat::{Blend, Described, RenderOptions, TransferFunction};

use crate::args::{Given, LookWords, RayBlend, RenderArgs, VolsplatArgs};
use crate::look::channel_look::{ChannelLook, Values};
use crate::look::file_channel::{FileChannel, Place, ShownChannel};
use crate::look::transfer::Suggested;
use crate::output::Format;

/// The look of a volume, decided.
pub(crate) struct Look {
    /// One for each channel.
    pub(crate) channels: Vec<ChannelLook>,
    /// The channels of the file, where it has several or they were typed.
    pub(crate) shown: Vec<ShownChannel>,
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
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LookSource {
    /// The options of the transfer function, or the data.
    Data,
    /// A channel of the file, by its words and by the file's own description.
    Channel(FileChannel),
    /// The word of an `--also`, counted from 0.
    Also(usize),
    /// Words that came with a volume in memory.
    Words(LookWords),
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
    check_typed(args, channels)?;
    let suggested_blend = projected(args, format, channels)?.then_some(Blend::Maximum);
    let is_projection = suggested_blend.is_some()
        || matches!(
            args.render.options.blend.blend,
            Some(RayBlend::Maximum | RayBlend::Minimum | RayBlend::Average)
        );
    let mut shown = Vec::new();
    let decided: Vec<(ChannelLook, Suggested)> = channels
        .iter()
        .map(|channel| channel_look((args, is_projection), channel, &mut shown))
        .collect::<Result<_>>()?;
    // Of several channels none decides about light and blending, which they share.
    let is_alone = decided.len() == 1 || channels[0].source == &LookSource::ColourOpacity;
    let suggested = match decided.first() {
        Some((_, suggested)) if is_alone && suggested_blend.is_none() => suggested.clone(),
        _ => Suggested {
            blend: suggested_blend,
            ..Suggested::default()
        },
    };
    let first = channels[0].values.described();
    Ok(Look {
        options: options(args, &args.render, format, (first, &suggested))?,
        channels: decided.into_iter().map(|(look, _)| look).collect(),
        shown,
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

/// Refuses looks of channels that were not read.
fn check_typed(args: &VolsplatArgs, channels: &[Channel]) -> Result<()> {
    for (place, typed) in args.scene.channels.components.iter().enumerate() {
        let is_its = |channel: &Channel| match channel.source {
            LookSource::Channel(channel) => {
                channel.typed == Some(place) || channel.number.to_string() == typed.channel
            }
            _ => false,
        };
        if !channels.iter().any(is_its) {
            bail!(
                "--channel {}: the volume was read without this channel: read it again",
                typed.channel
            );
        }
    }
    Ok(())
}

/// Returns true if the channels of an image are drawn as a maximum projection by default: all of them come from the image, and no blend, surface,
/// layer or light was typed. Windows of microscopes are made for projections, which also show the inside.
fn projected(args: &VolsplatArgs, format: Format, channels: &[Channel]) -> Result<bool> {
    let render = &args.render.options;
    let is_image = |channel: &Channel| match channel.source {
        LookSource::Channel(channel) => channel.is_of_image,
        _ => false,
    };
    let blend = &render.blend;
    let is_free = (blend.blend, blend.iso, &blend.layers) == (None, None, &None)
        && (render.shade, render.light, render.occlusion) == (None, None, None)
        && render.gradient_opacity.is_none();
    let order = typed_options(args, format)?.field().is_some();
    Ok(is_free && order && channels.iter().all(is_image))
}

fn channel_look(
    (args, is_projection): (&VolsplatArgs, bool),
    channel: &Channel,
    shown: &mut Vec<ShownChannel>,
) -> Result<(ChannelLook, Suggested)> {
    let fewer = || "the number of channels changed: read the volume again";
    let typed = &args.scene.channels;
    let volume = channel.values.described();
    let nothing = ImageChannel::default();
    let of_words = |words: &LookWords, known: &ImageChannel, place: Place| {
        let (look, words) =
            channel_look::of_words(words, (known, place), volume, (args, is_projection))?;
        Ok::<_, anyhow::Error>(((look, Suggested::default()), words))
    };
    match channel.source {
        LookSource::Data => channel_look::of_data(args, channel.values),
        LookSource::Channel(channel) => {
            let words = match channel.place_in(typed) {
                Some(place) => &typed.components.get(place).with_context(fewer)?.look,
                None => &LookWords::default(),
            };
            let (look, words) = of_words(words, &channel.known, channel.place)?;
            shown.push(ShownChannel {
                number: channel.number,
                name: channel.known.name.clone(),
                look: words,
            });
            Ok(look)
        }
        LookSource::Also(place) => {
            let volume = typed.also.get(*place).with_context(fewer)?;
            Ok(of_words(&volume.look, &nothing, Place::ALONE)?.0)
        }
        LookSource::Words(words) => Ok(of_words(words, &nothing, Place::ALONE)?.0),
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
    /// How the channels of a file were drawn, where nobody typed that.
    pub(crate) fn channel_line(&self, args: &VolsplatArgs) -> Option<String> {
        if self.shown.is_empty() || !args.scene.channels.components.is_empty() {
            return None;
        }
        let channel = |shown: &ShownChannel| {
            let name = shown.name.as_deref().map(|name| format!(" {name}"));
            let name = name.unwrap_or_default();
            format!("{}{name} {}", shown.number, shown.look)
        };
        let channels: Vec<String> = self.shown.iter().map(channel).collect();
        let black = match args.picture.background {
            None => "; --background black as in a microscope",
            Some(_) => "",
        };
        Some(format!(
            "channels: {} (--channel N:COLOUR:LOW,HIGH chooses and changes them{black})",
            channels.join(", ")
        ))
    }

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
