//! A warp in the stats file, and the planes beside its picture.

use anyhow::{Context, Result};
use resample_core::Image;
use serde_json::{Value, json};
use warp3d::WarpOptions;

use crate::args::Warp3dArgs;
use crate::output::Format;
use crate::plan::Request;
use crate::{output, plan};

/// Options and files of the warp, for the stats file.
pub(crate) fn record(
    args: &Warp3dArgs,
    options: &WarpOptions,
    request: &Request,
    format: Format,
    convergence: f64,
) -> Value {
    let meaning = &args.meaning;
    let mut record = json!({
        "colour": args.colour,
        "depth": args.depth,
        "from": args.cameras.from.as_ref().map(ToString::to_string),
        "to": args.cameras.to.as_ref().map(ToString::to_string),
        "depth_kind": meaning.depth_kind,
        "depth_scale": meaning.depth_scale,
        "near": meaning.near,
        "far": meaning.far,
        "relative_range": meaning.relative_range,
        "invalid": meaning.invalid,
        "baseline": meaning.baseline,
        "doffs": meaning.doffs,
        "stereo": args.views.stereo,
        "convergence": convergence.is_finite().then_some(convergence),
        "picture": plan::picture_record(request, format),
    });
    if let (Value::Object(record), Value::Object(options)) = (&mut record, json!(options)) {
        record.extend(options);
    }
    record
}

/// Writes the planes beside the picture.
pub(crate) fn write_planes(args: &Warp3dArgs, image: &Image) -> Result<()> {
    let plane = |name: &str| {
        image
            .planes
            .iter()
            .find(|plane| plane.name == name)
            .map(|plane| &plane.values)
    };
    if let Some(path) = &args.filled {
        let seen = image
            .rgba
            .iter()
            .map(|pixel| 1.0 - pixel[3].clamp(0.0, 1.0));
        let mask: Vec<f32> = match plane("filled") {
            Some(filled) => seen
                .zip(filled)
                .map(|(hole, &filled)| hole.max(filled))
                .collect(),
            None => seen.collect(),
        };
        output::write_grey(path, [image.width, image.height], &mask)?;
    }
    if let Some(path) = &args.confidence {
        let confidence = plane("confidence")
            .context("this layout of views has no confidence: leave --confidence out")?;
        output::write_grey(path, [image.width, image.height], confidence)?;
    }
    Ok(())
}
