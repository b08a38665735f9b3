//! Volumes whose voxels are colours: how they are drawn where nobody chose a component.
//!
//! Takes the typed options and the scalar that opacity follows. Colours are drawn as they are, with an opacity that follows alpha or the
//! brightest component.

use anyhow::Result;
use volsplat::transfer::{ColourKnot, DataKind};
use volsplat::{Described, TransferFunction};

use crate::args::{OrderName, VolsplatArgs};
use crate::look::suggested::Suggested;
use crate::look::{suggested, transfer};

/// The opacity of colours by the scalar that it follows, in white: that of the typed transfer function, or of the data.
pub(super) fn opacity(
    args: &VolsplatArgs,
    volume: &dyn Described,
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
