//! The look that goes with the data or with a preset, where parts of it were not typed.
//!
//! Takes what was typed, the volume and its histogram, gives a transfer function or labels, and the light and the blending that
//! were chosen with it. Typed options win over all of that. One line says what the data decided, and how to ask for another look.

use volsplat::transfer::{ColourMap, DataKind, DefaultLook, FileLook, Histogram, Preset};
use volsplat::{Blend, FieldOptions, Order, RenderOptions, Shading, TransferFunction};

use crate::args::{RayBlend, RenderArgs, TransferArgs, VolsplatArgs};

/// Light and blending that nobody typed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Suggested {
    /// The light of emission.
    pub shading: Option<Shading>,
    /// The value of a ray.
    pub blend: Option<Blend>,
    /// Length over which the opacities of a file are meant, world units.
    pub opacity_unit: Option<f64>,
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
            ..Self::default()
        }
    }

    /// The options with what is suggested where nothing was typed.
    pub(super) fn fill(&self, options: RenderOptions, args: &RenderArgs) -> RenderOptions {
        let mut options = options;
        options.opacity_unit = options.opacity_unit.or(self.opacity_unit);
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
            DataKind::Scan => ("a scan in no unit, drawn as --preset scan", OTHER_LOOKS),
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
pub(crate) fn of_data(
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
