//! How one channel looks: a transfer function, labels or a tint, from the words that describe it or from the data.
//!
//! Takes the typed options, a word of `--channel` or `--also`, and the volume. Voxels that are colours are drawn as they are, with an opacity
//! that follows alpha or the brightest component.

use std::path::Path;

use anyhow::{Result, bail};
use volsplat::transfer::{ColourKnot, ColourMap, DataKind, FileLook};
use volsplat::{Described, LabelTable, LargeVolume, TransferFunction, Volume};

use crate::args::{OrderName, VolsplatArgs};
use crate::look::transfer;
use crate::look::transfer::Suggested;
use crate::values;

/// The values of a channel.
#[derive(Clone, Copy)]
pub(crate) enum Values<'a> {
    /// All voxels are in memory.
    Memory(&'a Volume),
    /// The voxels stay in their file.
    Stored(&'a LargeVolume),
}

impl<'a> Values<'a> {
    /// Grid, range and histogram.
    pub(crate) fn described(self) -> &'a dyn Described {
        match self {
            Self::Memory(volume) => volume,
            Self::Stored(volume) => volume,
        }
    }
}

/// How a channel looks.
pub(crate) enum ChannelLook {
    Transfer(TransferFunction),
    Labels(LabelTable),
    Tint(TransferFunction),
}

/// Display colours by name, beside those that are written in numbers.
const COLOURS: [(&str, &str); 7] = [
    ("red", "#ff0000"),
    ("green", "#00ff00"),
    ("blue", "#0000ff"),
    ("cyan", "#00ffff"),
    ("magenta", "#ff00ff"),
    ("yellow", "#ffff00"),
    ("orange", "#ff8000"),
];

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
    if transfer::is_typed(&args.transfer) {
        let (function, suggested) = transfer::typed(&args.transfer, values.described())?;
        return Ok((ChannelLook::Transfer(function), suggested));
    }
    let histogram = values.described().histogram();
    let kind = match values {
        Values::Memory(volume) => DataKind::of_volume(volume, &histogram),
        Values::Stored(volume) => DataKind::of(volume, &histogram),
    };
    if transfer::are_labels(args, kind) {
        let table = ChannelLook::Labels(label_table(args)?);
        return Ok((table, Suggested::for_labels(Some(kind))));
    }
    // An isosurface or a projection of labels takes them as quantities.
    let kind = match kind {
        DataKind::Labels => DataKind::Field,
        other => other,
    };
    let (function, suggested) = transfer::of_data(args, kind, &histogram)?;
    Ok((ChannelLook::Transfer(function), suggested))
}

/// The look that a word describes.
pub(super) fn of_word(
    word: &str,
    volume: &dyn Described,
    args: &VolsplatArgs,
) -> Result<ChannelLook> {
    if word == "labels" {
        return Ok(ChannelLook::Labels(label_table(args)?));
    }
    let lower = word.to_lowercase();
    let function = if lower.ends_with(".json") || lower.ends_with(".vp") {
        let encoding = args.transfer.transfer_space;
        FileLook::load(Path::new(word), encoding, volume)?.function
    } else if let Ok(map) = word.parse::<ColourMap>() {
        TransferFunction::automatic(&volume.histogram(), map)
    } else {
        one_colour(word, volume)?
    };
    Ok(ChannelLook::Transfer(
        function.with_opacity_scaled(args.transfer.opacity_scale)?,
    ))
}

/// A colour by its name or in numbers, in linear light.
pub(crate) fn colour(word: &str) -> Option<[f32; 3]> {
    let named = COLOURS.iter().find(|(name, _)| *name == word);
    values::colour(named.map_or(word, |(_, digits)| digits)).ok()
}

/// The opacity of the histogram, in one colour.
fn one_colour(word: &str, volume: &dyn Described) -> Result<TransferFunction> {
    let Some(rgb) = colour(word) else {
        bail!(
            "{word}: expected the look of a channel: a file that ends in .json, a colour map such as viridis, labels, a colour \
             such as #ff8000, or one of {}",
            COLOURS.map(|(name, _)| name).join(", ")
        );
    };
    let opacities = TransferFunction::automatic(&volume.histogram(), ColourMap::default());
    let colour = ColourKnot {
        value: volume.value_range().0,
        rgb,
    };
    Ok(TransferFunction::new(
        vec![colour],
        opacities.opacity_knots().to_vec(),
    )?)
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
    let (function, suggested) = if transfer::is_typed(&args.transfer) {
        transfer::typed(&args.transfer, volume)?
    } else {
        transfer::of_data(args, DataKind::Field, &volume.histogram())?
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
