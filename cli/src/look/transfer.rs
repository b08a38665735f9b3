//! Makes the transfer function from typed options.
//!
//! Takes what was typed and the volume, gives the function, and the light and the blending that go with it where neither was
//! typed. Where neither a file, a window, a preset nor a colour map is given, the data decide (`suggested.rs`). No file but the
//! function's own is read, and none but the plot of `--show-transfer` is written.

use std::path::Path;

use anyhow::Result;
use volsplat::transfer::{DataKind, FileLook, Histogram};
use volsplat::{Described, TransferFunction};

use crate::args::{TransferArgs, VolsplatArgs};
use crate::look::suggested::Suggested;
use crate::look::{suggested, transfer_plot};
use crate::output;
use crate::output::{Depth, Format};
use crate::process::report;

/// How values become colour and opacity, and what goes with it. Errors name the file or the option.
pub(crate) fn function(
    args: &VolsplatArgs,
    volume: &dyn Described,
) -> Result<(TransferFunction, Suggested)> {
    if suggested::is_typed(&args.transfer) {
        return typed(&args.transfer, volume);
    }
    let histogram = volume.histogram();
    of_data(args, DataKind::of(volume, &histogram), &histogram)
}

/// The function of data for which none was typed.
pub(crate) fn of_data(
    args: &VolsplatArgs,
    kind: DataKind,
    histogram: &Histogram,
) -> Result<(TransferFunction, Suggested)> {
    let (function, suggested) = suggested::of_data(kind, histogram, &args.render.options);
    Ok((scaled(function, &args.transfer)?, suggested))
}

/// The function that was typed.
pub(crate) fn typed(
    args: &TransferArgs,
    volume: &dyn Described,
) -> Result<(TransferFunction, Suggested)> {
    if let Some(path) = &args.transfer {
        let file = of_file(path, args, volume)?;
        let suggested = Suggested::for_file(&file);
        return Ok((scaled(file.function, args)?, suggested));
    }
    let suggested = args
        .preset
        .map_or(Suggested::default(), Suggested::for_preset);
    Ok((scaled(unscaled(args, volume)?, args)?, suggested))
}

/// The look of a file.
fn of_file(path: &Path, args: &TransferArgs, volume: &dyn Described) -> Result<FileLook> {
    let encoding = args.transfer_space;
    let file = if args.rescale_transfer {
        FileLook::load_rescaled(path, encoding, volume)?
    } else {
        FileLook::load(path, encoding, volume)?
    };
    for note in &file.notes {
        report::say(&format!("note: {}: {note}", path.display()));
    }
    Ok(file)
}

fn scaled(function: TransferFunction, args: &TransferArgs) -> Result<TransferFunction> {
    if args.opacity_scale == 1.0 {
        // Not even a rounding error where nothing was asked for.
        return Ok(function);
    }
    Ok(function.with_opacity_scaled(args.opacity_scale)?)
}

/// A warning where a preset does not suit the volume.
pub(crate) fn warning(args: &TransferArgs, volume: &dyn Described) -> Option<String> {
    let preset = args.preset?;
    let why = preset.mismatch(volume)?;
    Some(format!(
        "warning: --preset {} expects Hounsfield units, but {why}",
        preset.name()
    ))
}

/// Draws the function over the volume's histogram, where that was asked for.
pub(crate) fn show(
    args: &TransferArgs,
    function: &TransferFunction,
    volume: &dyn Described,
) -> Result<()> {
    if let Some(path) = &args.show_transfer {
        let plot = transfer_plot::draw(function, &volume.histogram());
        output::write_picture(path, Format::Png(Depth::Eight), &plot)?;
    }
    Ok(())
}

fn unscaled(args: &TransferArgs, volume: &dyn Described) -> Result<TransferFunction> {
    let map = args.colormap.unwrap_or_default();
    if let Some(preset) = args.preset {
        return Ok(preset.transfer(&volume.histogram()));
    }
    Ok(match args.window {
        Some(window) => TransferFunction::window(window.level, window.width, map)?,
        None => TransferFunction::automatic(&volume.histogram(), map),
    })
}
