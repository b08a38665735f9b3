//! Makes the transfer function from typed options.
//!
//! Takes what was typed and the volume, gives the function, and the light and the blending that go with it where neither was
//! typed. Where neither a file, a window, a preset nor a colour map is given, the data decide, and one line says so. Typed options win over all of that. No file but the
//! function's own is read, and none but the plot of `--show-transfer` is written.

use std::path::Path;

use anyhow::Result;
use volsplat::transfer::{ColourMap, DataKind, DefaultLook, FileLook, Histogram, Preset, plot};
use volsplat::{
    Blend, Described, FieldOptions, GradientOpacity, Order, RenderOptions, Shading,
    TransferFunction,
};

use resample_io::figure::number;

use crate::args::{RayBlend, RenderArgs, TransferArgs, VolsplatArgs};
use crate::output;
use crate::output::{Depth, Format};
use crate::process::report;
use crate::values::Window;

/// How values become colour and opacity, and what goes with it. Errors name the file or the option.
pub(crate) fn function(
    args: &VolsplatArgs,
    volume: &dyn Described,
) -> Result<(TransferFunction, Suggested)> {
    if is_typed(&args.transfer) {
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
    let (function, suggested) = suggest(kind, histogram, &args.render.options);
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

/// A warning where a preset or a window does not suit the volume.
pub(crate) fn warning(args: &TransferArgs, volume: &dyn Described) -> Option<String> {
    if let Some(window) = args.window {
        return wide_window(window, volume.value_range().into());
    }
    let preset = args.preset?;
    let why = preset.mismatch(volume)?;
    Some(format!(
        "warning: --preset {} expects Hounsfield units, but {why}",
        preset.name()
    ))
}

/// A warning if a level and a width span more than all values, although the same numbers, as the ends of a window, lie among the values. Many programs
/// take the ends.
fn wide_window(Window { level, width }: Window, [least, most]: [f64; 2]) -> Option<String> {
    let [low, high] = [level - 0.5 * width, level + 0.5 * width];
    let is_meant = least <= level && level < width && width <= most;
    (is_meant && low < least && most < high).then(|| {
        let [low, high, least, most] = [low, high, least, most].map(number);
        format!(
            "warning: --window {level},{width} is a level and a width, {low} to {high}, and the values lie between {least} and {most}: \
             --window {level}..{width} is low and high"
        )
    })
}

/// Draws the function over the volume's histogram, where that was asked for.
pub(crate) fn show(
    args: &TransferArgs,
    function: &TransferFunction,
    volume: &dyn Described,
) -> Result<()> {
    if let Some(path) = &args.show_transfer {
        let plot = plot::draw(function, &volume.histogram());
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

/// Light and blending that nobody typed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Suggested {
    /// The light of emission.
    pub shading: Option<Shading>,
    /// The value of a ray.
    pub blend: Option<Blend>,
    /// Length over which the opacities of a file are meant, world units.
    pub opacity_unit: Option<f64>,
    /// Opacity by the gradient of a file.
    pub gradient_opacity: Option<GradientOpacity>,
    /// The kind of data, where the data decided.
    pub kind: Option<DataKind>,
}

impl Suggested {
    /// Labels, typed or recognised: their surfaces are lit.
    pub(crate) fn for_labels(kind: Option<DataKind>) -> Self {
        Self {
            shading: Some(Shading::Phong),
            kind,
            ..Self::default()
        }
    }

    /// The light and blending of a preset.
    pub(crate) fn for_preset(preset: Preset) -> Self {
        Self {
            shading: Some(preset.shading()),
            blend: Some(preset.blend()),
            ..Self::default()
        }
    }

    /// The light and unit of a file.
    pub(crate) fn for_file(file: &FileLook) -> Self {
        Self {
            shading: file.shading,
            opacity_unit: file.opacity_unit,
            gradient_opacity: file.gradient_opacity.clone(),
            ..Self::default()
        }
    }

    /// Returns the options; those that were not typed get the suggested values.
    pub(super) fn fill(&self, options: RenderOptions, args: &RenderArgs) -> RenderOptions {
        let mut options = options;
        options.opacity_unit = options.opacity_unit.or(self.opacity_unit);
        let gradient = &mut options.gradient_opacity;
        *gradient = gradient.take().or_else(|| self.gradient_opacity.clone());
        if let (Order::Field(field), Some(blend)) = (&mut options.order, self.blend)
            && args.blend.blend.is_none()
            && args.blend.iso.is_none()
        {
            *field = FieldOptions {
                blend,
                ..field.clone()
            };
        }
        let is_statistic = matches!(
            options.order,
            Order::Field(FieldOptions {
                blend: Blend::Maximum | Blend::Minimum | Blend::Average,
                ..
            })
        );
        if args.shade.is_none() && args.blend.iso.is_none() && !is_statistic {
            // --light implies shading.
            let unasked = args.light.map(|_| Shading::Phong);
            options.shading = self.shading.or(unasked).unwrap_or(options.shading);
        }
        options
    }

    /// The kind of data and the options for another look; `None` where the look was typed.
    pub(crate) fn line(&self) -> Option<String> {
        let (taken, others) = match self.kind? {
            DataKind::Hounsfield => ("Hounsfield units, drawn as --preset ct", OTHER_LOOKS),
            DataKind::Scan => ("a scan without units, drawn as --preset scan", OTHER_LOOKS),
            DataKind::Labels => (
                "labels, drawn as --labels",
                "--colormap NAME takes them as quantities",
            ),
            DataKind::Field => ("a field, drawn by its histogram", OTHER_LOOKS),
        };
        Some(format!("its values were taken for {taken} ({others})"))
    }
}

/// The kind of data, as named in the stats file.
pub(crate) fn name(kind: DataKind) -> &'static str {
    match kind {
        DataKind::Hounsfield => "hounsfield",
        DataKind::Scan => "scan",
        DataKind::Labels => "labels",
        DataKind::Field => "field",
    }
}

/// How another look is asked for.
const OTHER_LOOKS: &str = "other looks: --preset list, --window, --colormap, --transfer";

/// Returns true if how values become colours was typed.
pub(crate) fn is_typed(args: &TransferArgs) -> bool {
    args.transfer.is_some()
        || args.window.is_some()
        || args.preset.is_some()
        || args.colormap.is_some()
}

/// The function of data for which nobody typed one.
fn suggest(
    kind: DataKind,
    histogram: &Histogram,
    args: &RenderArgs,
) -> (TransferFunction, Suggested) {
    let blend = args.blend.blend;
    let is_statistic = matches!(
        blend,
        Some(RayBlend::Maximum | RayBlend::Minimum | RayBlend::Average)
    );
    if is_statistic {
        let function = TransferFunction::projection(histogram, ColourMap::greys());
        return (function, Suggested::default());
    }
    let look = DefaultLook::of(kind, histogram);
    let suggested = Suggested {
        shading: Some(look.shading),
        kind: Some(kind),
        ..Suggested::default()
    };
    (look.function, suggested)
}

/// Returns true if the volume is drawn as labels although nobody asked for that.
pub(crate) fn are_labels(args: &VolsplatArgs, kind: DataKind) -> bool {
    let is_emission = matches!(
        args.render.options.blend.blend,
        None | Some(RayBlend::Emission)
    ) && args.render.options.blend.iso.is_none();
    kind == DataKind::Labels
        && is_emission
        && !is_typed(&args.transfer)
        && args.transfer.show_transfer.is_none()
}
