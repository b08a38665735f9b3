//! Volumes whose voxels are colours: how they are drawn where nobody chose a component.
//!
//! Takes the typed options and the reading options. Colours are drawn as they are, with an opacity that follows alpha or the
//! brightest component.

use anyhow::Result;
use volsplat::input::ColourVoxels;
use volsplat::transfer::{ColourKnot, DataKind};
use volsplat::{Described, LoadOptions, TransferFunction, Volume, input};

use crate::args::{OrderName, VolsplatArgs};
use crate::look::suggested::Suggested;
use crate::look::{suggested, transfer};

/// The voxels of a file that holds colours, where nobody chose components; a note says how they are drawn.
pub(crate) fn of_file(args: &VolsplatArgs, options: &LoadOptions) -> Result<Option<ColourVoxels>> {
    let scene = &args.scene;
    if !scene.channel.is_empty() || scene.labels || args.source.held().is_some() {
        return Ok(None);
    }
    let path = &args.input.path;
    let colours = input::load_colours(path, options)?;
    if colours.is_some() {
        options.gate.remark(format!(
            "{}: its voxels are colours, opaque where they are bright or their alpha says so; FILE#component=N draws one of them",
            path.display()
        ));
    }
    Ok(colours)
}

/// The opacity of colours by the scalar that it follows, in white: that of the typed transfer function, or of the data.
pub(crate) fn opacity(
    args: &VolsplatArgs,
    volume: &Volume,
) -> Result<(TransferFunction, Suggested)> {
    let (function, suggested) = if suggested::is_typed(&args.transfer) {
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
