//! How one channel looks: a transfer function, labels or a tint, from the words that describe it or from the data.
//!
//! Takes the typed options, a word of `--channel` or `--also`, and the volume. Voxels that are colours are drawn as they are, with an opacity
//! that follows alpha or the brightest component.

use std::path::Path;

use anyhow::{Result, bail};
use resample_core::image::linear_from_srgb;
use volsplat::input::ImageChannel;
use volsplat::transfer;
use volsplat::transfer::{ChannelColours, ChannelStyle, ColourKnot, ColourMap, DataKind, FileLook};
use volsplat::volume::Steps;
use volsplat::{Described, LabelTable, LargeVolume, TransferFunction, Volume};

use crate::args::{LookWords, OrderName, VolsplatArgs};
use crate::look::file_channel::Place;
use crate::look::transfer as typed_transfer;
use crate::look::transfer::Suggested;
use crate::values;

/// The values of a channel.
#[derive(Clone, Copy)]
pub(crate) enum Values<'a> {
    /// All voxels are in memory.
    Memory(&'a Volume),
    /// The voxels stay in their file.
    Stored(&'a LargeVolume),
    /// All steps of a volume over time, and one of them.
    Steps(&'a Steps, &'a Volume),
}

impl<'a> Values<'a> {
    /// Grid, range and histogram.
    pub(crate) fn described(self) -> &'a dyn Described {
        match self {
            Self::Memory(volume) => volume,
            Self::Stored(volume) => volume,
            Self::Steps(steps, _) => steps,
        }
    }
}

/// How a channel looks.
pub(crate) enum ChannelLook {
    Transfer(TransferFunction),
    Labels(LabelTable),
    Tint(TransferFunction),
}

impl ChannelLook {
    /// As the library takes it.
    pub(crate) fn lent(&self) -> volsplat::Look<'_> {
        match self {
            Self::Transfer(function) => volsplat::Look::Transfer(function),
            Self::Labels(table) => volsplat::Look::Labels(table),
            Self::Tint(function) => volsplat::Look::Tint(function),
        }
    }
}

/// The look of the volume that no word describes, and what goes with it.
pub(super) fn of_data(args: &VolsplatArgs, values: Values) -> Result<(ChannelLook, Suggested)> {
    if args.scene.labels {
        return Ok((
            ChannelLook::Labels(label_table(args)?),
            Suggested::for_labels(None),
        ));
    }
    if typed_transfer::is_typed(&args.transfer) {
        let (function, suggested) = typed_transfer::typed(&args.transfer, values.described())?;
        return Ok((ChannelLook::Transfer(function), suggested));
    }
    let histogram = values.described().histogram();
    let kind = match values {
        Values::Memory(volume) | Values::Steps(_, volume) => {
            DataKind::of_volume(volume, &histogram)
        }
        Values::Stored(volume) => DataKind::of(volume, &histogram),
    };
    if typed_transfer::are_labels(args, kind) {
        let table = ChannelLook::Labels(label_table(args)?);
        return Ok((table, Suggested::for_labels(Some(kind))));
    }
    // An isosurface or a projection of labels takes them as quantities.
    let kind = match kind {
        DataKind::Labels => DataKind::Field,
        other => other,
    };
    let (function, suggested) = typed_transfer::of_data(args, kind, &histogram)?;
    Ok((ChannelLook::Transfer(function), suggested))
}

/// The look that words describe, and the words with all that they leave open.
pub(super) fn of_words(
    words: &LookWords,
    (known, place): (&ImageChannel, Place),
    volume: &dyn Described,
    (args, is_projection): (&VolsplatArgs, bool),
) -> Result<(ChannelLook, LookWords)> {
    let word = words.word.as_deref();
    let lower = word.unwrap_or_default().to_lowercase();
    let is_file = lower.ends_with(".json") || lower.ends_with(".vp");
    if is_file || word == Some("labels") {
        let look = of_file_or_labels(words, &lower, volume, args)?;
        return Ok((look, words.clone()));
    }
    let typed = match word {
        None => None,
        Some(word) => Some(colours(word)?),
    };
    let display = known
        .rgb
        .unwrap_or_else(|| transfer::usual_colour(place.number, place.count));
    let of_file = display.map(|code| linear_from_srgb(f32::from(code) / 255.0));
    let scale = if is_projection {
        1.0
    } else {
        transfer::EMISSION_OPACITY
    };
    let style = ChannelStyle {
        colours: typed.unwrap_or(ChannelColours::One(of_file)),
        window: words.window.or(known.window),
        gamma: words.gamma.unwrap_or(1.0),
        opacity: scale * words.opacity.unwrap_or(1.0),
    };
    let histogram = volume.histogram();
    let [red, green, blue] = display;
    let all = LookWords {
        word: Some(word.map_or(format!("#{red:02x}{green:02x}{blue:02x}"), str::to_owned)),
        window: Some(style.window_of(&histogram)),
        ..words.clone()
    };
    let function = style.transfer(&histogram)?;
    let function = function.with_opacity_scaled(args.transfer.opacity_scale)?;
    Ok((ChannelLook::Transfer(function), all))
}

/// The look of a file or of labels, which have windows and opacities of their own.
fn of_file_or_labels(
    words: &LookWords,
    lower: &str,
    volume: &dyn Described,
    args: &VolsplatArgs,
) -> Result<ChannelLook> {
    if (words.window, words.gamma, words.opacity) != (None, None, None) {
        bail!("{words}: labels and the look of a file take no window, gamma or opacity");
    }
    if lower == "labels" {
        return Ok(ChannelLook::Labels(label_table(args)?));
    }
    let path = Path::new(words.word.as_deref().unwrap_or_default());
    let function = FileLook::load(path, args.transfer.transfer_space, volume)?.function;
    let function = function.with_opacity_scaled(args.transfer.opacity_scale)?;
    Ok(ChannelLook::Transfer(function))
}

fn colours(word: &str) -> Result<ChannelColours> {
    if let Ok(map) = word.parse::<ColourMap>() {
        return Ok(ChannelColours::Map(map));
    }
    match values::colour(word).ok() {
        Some(rgb) => Ok(ChannelColours::One(rgb)),
        None => bail!(
            "{word}: expected the look of a channel: a file that ends in .json, a colour map such as viridis, labels, a colour \
             such as #ff8000, or one of {}",
            values::COLOURS.map(|(name, _)| name).join(", ")
        ),
    }
}

fn label_table(args: &VolsplatArgs) -> Result<LabelTable> {
    let table = match &args.scene.label_colours {
        Some(path) => LabelTable::load(path)?,
        None => LabelTable::distinct(),
    };
    Ok(table.with_opacity_scaled(args.transfer.opacity_scale))
}

/// The opacity of colours by the scalar that it follows, in white: that of the typed transfer function, or of the data.
pub(super) fn opacity(
    args: &VolsplatArgs,
    volume: &dyn Described,
) -> Result<(TransferFunction, Suggested)> {
    let (function, suggested) = if typed_transfer::is_typed(&args.transfer) {
        typed_transfer::typed(&args.transfer, volume)?
    } else {
        typed_transfer::of_data(args, DataKind::Field, &volume.histogram())?
    };
    let white = ColourKnot {
        value: volume.value_range().0,
        rgb: [1.0; 3],
    };
    let function = TransferFunction::new(vec![white], function.opacity_knots().to_vec())?;
    // Samples are lit by the gradient of one channel, and there are four.
    let is_field = matches!(args.render.options.order, None | Some(OrderName::Field));
    let suggested = Suggested {
        kind: None,
        shading: suggested.shading.filter(|_| is_field),
        ..suggested
    };
    Ok((function, suggested))
}
