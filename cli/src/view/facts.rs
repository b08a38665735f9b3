//! Facts of a scene for the page: its values, its transfer function, and the available choices.

use anyhow::Result;
use clap::ValueEnum;
use resample_core::image::srgb_from_linear;
use serde_json::{Map, Value, json};
use volsplat::transfer::{ColourMap, Histogram, Preset};
use volsplat::{Blend, Shading, TransferFunction};

use crate::args::{ColourBy, Drawing, RayBlend, TransferArgs, VolsplatArgs};
use crate::look::file_channel::ShownChannel;
use crate::look::transfer;
use crate::look::transfer::Suggested;
use crate::open::volume::OpenVolume;
use crate::values;
use crate::values::word;

/// Bars of the histogram that the page draws.
const BARS: usize = 256;

/// Colours of the preview of a colour map.
const STOPS: usize = 24;

/// A volume's grid, values and looks.
pub(crate) fn volume(open: &OpenVolume) -> Value {
    let volume = open.described();
    let (low, high) = volume.value_range();
    let lattice = volume.lattice();
    let maps: Map<String, Value> = ColourMap::names()
        .filter_map(|name| Some((name.to_owned(), stops(name.parse().ok()?))))
        .collect();
    let is_single = open.shown_channels().is_empty();
    let histogram = volume.histogram();
    let presets: Vec<Value> = Preset::all()
        .filter(|preset| is_single && preset.mismatch(volume).is_none())
        .map(|preset| {
            let suggested = suggested(&Suggested::for_preset(preset));
            json!({
                "name": preset.name(),
                "about": preset.about(),
                "suggested": suggested,
            })
        })
        .collect();
    json!({
        "dims": lattice.dims,
        "space": lattice.space,
        "spacing": lattice.spacing(),
        "origin": lattice.world_from_index.translation.to_array(),
        "axes": lattice.world_from_index.matrix3.to_cols_array_2d(),
        "has_slices": open.volumes().is_ok(),
        "steps": open.step_names(),
        "range": [low, high],
        "corners": lattice.bounds_in_world().map(|corner| corner.to_array()),
        "bars": bars(&histogram, volume.value_range()),
        "window": volume.slice_window(),
        "function": function(open),
        "maps": maps,
        "presets": presets,
        "suggested": suggested(&open.suggested()),
        "channels": channels(open),
        "labels": labels(open),
        "shadings": names::<Shading>(),
        "blends": names::<RayBlend>(),
    })
}

/// The words of options that go with a look where nobody typed them.
fn suggested(suggested: &Suggested) -> Value {
    json!({
        "shade": suggested.shading.map(word),
        "blend": suggested.blend.and_then(|blend| match blend {
            Blend::Emission => Some(word(RayBlend::Emission)),
            Blend::Maximum => Some(word(RayBlend::Maximum)),
            Blend::Minimum => Some(word(RayBlend::Minimum)),
            Blend::Average => Some(word(RayBlend::Average)),
            Blend::Isosurface(_) => None,
        }),
    })
}

/// The channels of the file as they are drawn, and the values of each.
fn channels(open: &OpenVolume) -> Vec<Value> {
    let shown = open.shown_channels().into_iter();
    let known = shown.map(|(ShownChannel { number, name, look }, volume)| {
        let word = look.word.as_deref();
        let colour = word.and_then(|word| values::colour(word).ok());
        let (least, most) = volume.value_range();
        json!({
            "number": number.to_string(),
            "name": name,
            "look": word,
            "colour": colour.map(|rgb| rgb.map(srgb_from_linear)),
            "window": look.window,
            "gamma": look.gamma.unwrap_or(1.0),
            "opacity": look.opacity.unwrap_or(1.0),
            "range": [least, most],
        })
    });
    known.collect()
}

/// The labels of the volume, the most frequent first: label, display colour, opacity.
fn labels(open: &OpenVolume) -> Vec<Value> {
    let labels = open.labels().into_iter();
    let known = labels.map(|(label, look)| {
        json!({ "label": label, "colour": look.rgb.map(srgb_from_linear), "opacity": look.opacity })
    });
    known.collect()
}

/// The isosurfaces that were typed: value, display colour, opacity.
pub(crate) fn surfaces(drawing: &Drawing) -> Vec<Value> {
    let Drawing::Volsplat(args) = drawing else {
        return Vec::new();
    };
    let known = args.scene.isosurfaces.iter().map(|word| {
        let colour = word.colour.map(|rgb| rgb.map(srgb_from_linear));
        json!({ "value": word.value, "colour": colour, "opacity": word.opacity })
    });
    known.collect()
}

/// Counts in equal bars from the least value to the greatest.
fn bars(histogram: &Histogram, (low, high): (f64, f64)) -> Vec<u64> {
    let mut bars = vec![0; BARS];
    for (bin, count) in histogram.counts().iter().enumerate() {
        let place = (histogram.value(bin) - low) / (high - low).max(f64::MIN_POSITIVE);
        bars[((place * BARS as f64) as usize).min(BARS - 1)] += count;
    }
    bars
}

/// The transfer function; null where labels or several channels have looks of their own.
pub(crate) fn function(open: &OpenVolume) -> Value {
    let args = open.args();
    if open.function().is_none() || !open.shown_channels().is_empty() {
        return Value::Null;
    }
    // The page scales opacities by an option of their own.
    let unscaled = VolsplatArgs {
        transfer: TransferArgs {
            opacity_scale: 1.0,
            ..args.transfer.clone()
        },
        ..args.clone()
    };
    transfer::function(&unscaled, open.described()).map_or(Value::Null, |(found, _)| knots(&found))
}

/// Knots of a transfer function: value and opacity, value and display colour.
pub(crate) fn knots(function: &TransferFunction) -> Value {
    let opacities: Vec<_> = function
        .opacity_knots()
        .iter()
        .map(|knot| [knot.value, knot.opacity])
        .collect();
    let colours: Vec<_> = function
        .colour_knots()
        .iter()
        .map(|knot| {
            let [r, g, b] = knot.rgb.map(|light| f64::from(srgb_from_linear(light)));
            [knot.value, r, g, b]
        })
        .collect();
    json!({ "opacities": opacities, "colours": colours })
}

/// Display colours along a map.
fn stops(map: ColourMap) -> Value {
    let at = |step: usize| {
        map.colour(step as f64 / (STOPS - 1) as f64)
            .map(srgb_from_linear)
    };
    json!((0..STOPS).map(at).collect::<Vec<_>>())
}

/// The words of a choice.
fn names<T: ValueEnum>() -> Vec<String> {
    let values = T::value_variants()
        .iter()
        .filter_map(ValueEnum::to_possible_value);
    values.map(|value| value.get_name().to_owned()).collect()
}

/// The choices of Gaussians, a mesh or a warp, and the options that are set already.
pub(crate) fn options(drawing: &Drawing) -> Result<Value> {
    let set: Map<String, Value> = drawing
        .setting()
        .given()
        .map(|(name, word)| (name.to_owned(), json!(word)))
        .collect();
    let mut options = json!({ "set": set });
    let figure = match drawing {
        Drawing::Volsplat(args) => Some(&args.figure),
        Drawing::Texmap(args) => Some(&args.figure),
        Drawing::Gaussians(args) => Some(&args.figure),
        Drawing::Points(args) => Some(&args.figure),
        Drawing::Warp3d(_) => None,
    };
    if let Some(figure) = figure {
        options["figure"] = json!({
            "scale-bar": figure.scale_bar.is_some(),
            "colour-bar": figure.colour_bar.is_some(),
            "axes": figure.axes.map(word),
            "caption": figure.caption,
        });
    }
    match drawing {
        Drawing::Texmap(args) => {
            let textures = args.model.textures.to_possible_value();
            options["textures"] = json!(textures.map(|value| value.get_name().to_owned()));
            options["shade"] = json!(names::<texmap::Shade>());
            options["tone-map"] = json!(names::<texmap::ToneMap>());
            options["shadows"] = json!(names::<texmap::Shadows>());
            options["method"] = json!(names::<texmap::Method>());
        }
        Drawing::Gaussians(args) => {
            options["slab-error"] = json!(args.render.options.slab_error);
            options["samples"] = json!(names::<volsplat::PixelSamples>());
        }
        Drawing::Warp3d(_) => {
            options["fill"] = json!(names::<warp3d::Fill>());
            options["method"] = json!(warp3d::args::MethodName::FOR_ANY_CAMERA.map(word));
        }
        Drawing::Points(args) => {
            options["shade"] = json!(names::<resample_cloud::Shade>());
            options["color-by"] = json!(names::<ColourBy>());
            options["colored"] = json!(word(args.look.color_by));
            options["colormap"] = json!(args.look.colormap.map(|map| map.name()));
            options["maps"] = json!(ColourMap::names().collect::<Vec<_>>());
        }
        Drawing::Volsplat(args) => {
            let look = &args.transfer;
            options["opacity-scale"] = json!(look.opacity_scale);
            options["preset"] = json!(look.preset.map(|preset| preset.name()));
            options["colormap"] = json!(look.colormap.map(|map| map.name()));
            options["has_file"] = json!(look.transfer.is_some());
        }
    }
    Ok(options)
}
