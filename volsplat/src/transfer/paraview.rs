//! Colour maps of ParaView, as its colour map editor exports them: JSON, one object or a list with one object.
//!
//! Takes a file, gives colour and opacity knots. `RGBPoints` is a flat list x, r, g, b, ...; `Points` is a flat list
//! x, opacity, midpoint, sharpness, ...; `ColorSpace` says how colours are interpolated. Colours that are not straight in
//! linear light are sampled into knots. In a step of `Step`, as in VTK, a knot's own scalar still has its own colour.
//! Limits: `NanColor`, `Name` and `Creator` are left aside; indexed colours and logarithmic scales are refused.

use std::path::Path;

use resample_core::image::linear_from_srgb;
use serde_json::Value;

use resample_io::files::read_json;

use crate::Error;
use crate::transfer::colour_space::ColourSpace;
use crate::transfer::curve::Node;
use crate::transfer::{ColourEncoding, ColourKnot, OpacityKnot, curve};

use super::TransferFunction;
use super::automatic::opacities;
use crate::volume::Described;

impl TransferFunction {
    /// Reads a colour map of ParaView (JSON): `RGBPoints`, `Points`, `ColorSpace`.
    ///
    /// Without `Points` the opacity is that of [`TransferFunction::automatic`] for this volume. `NanColor` has no
    /// use here, as a volume holds no NaN. Errors name the file, the key and the place in its list.
    pub fn load_paraview(
        path: &Path,
        encoding: ColourEncoding,
        volume: &dyn Described,
    ) -> Result<Self, Error> {
        let knots = load(path, encoding)?;
        let opacities = knots
            .opacities
            .unwrap_or_else(|| opacities(&volume.histogram()));
        Self::new(knots.colours, opacities)
    }

    /// As [`TransferFunction::load_paraview`], with the file's knots moved to span the volume's values, as
    /// [`TransferFunction::rescaled`] does it; for maps that are written over 0..1.
    ///
    /// Without `Points` only the colours are moved: the automatic opacity is that of the volume already.
    pub fn load_paraview_rescaled(
        path: &Path,
        encoding: ColourEncoding,
        volume: &dyn Described,
    ) -> Result<Self, Error> {
        let knots = load(path, encoding)?;
        let (low, high) = volume.value_range();
        let Some(opacities) = knots.opacities else {
            // The one opacity knot lies on a colour knot, so the colours alone decide how all is moved.
            let placeholder = OpacityKnot {
                value: knots.colours[0].value,
                opacity: 0.0,
            };
            let colours = Self::new(knots.colours, vec![placeholder])?
                .rescaled(low, high)
                .colours;
            return Self::new(colours, opacities(&volume.histogram()));
        };
        Ok(Self::new(knots.colours, opacities)?.rescaled(low, high))
    }
}

/// What a file gives.
#[derive(Debug)]
pub(super) struct Knots {
    pub(super) colours: Vec<ColourKnot>,
    /// Absent where the file has no `Points`.
    pub(super) opacities: Option<Vec<OpacityKnot>>,
}

/// A colour of the file, in the file's own encoding.
#[derive(Clone, Copy)]
struct FileColour {
    value: f64,
    rgb: [f64; 3],
}

/// Longest file that is read; a map of a thousand knots has 100 kB. A guess.
const MAX_FILE_BYTES: u64 = 1 << 24;

/// Straight pieces per interval of a bent colour path, where there are few intervals: one per 8-bit level.
const MOST_PIECES: usize = 256;

/// Pieces of all intervals together, about; long tables are fine enough as they are.
const PIECES_IN_ALL: usize = 4096;

pub(super) fn load(path: &Path, encoding: ColourEncoding) -> Result<Knots, Error> {
    let cannot_read = |source| Error::Read {
        path: path.to_owned(),
        source,
    };
    let invalid = |what: String| Error::Invalid {
        path: path.to_owned(),
        what,
    };
    let text = read_json(path, MAX_FILE_BYTES).map_err(cannot_read)?;
    parse(&text, encoding).map_err(invalid)
}

/// The knots of a file's text; an error names the key and the place in its list.
fn parse(text: &[u8], encoding: ColourEncoding) -> Result<Knots, String> {
    let document: Value =
        serde_json::from_slice(text).map_err(|error| format!("no valid JSON: {error}"))?;
    let map = single_map(&document)?;
    refuse_log_scale(map)?;
    let colours = file_colours(map)?;
    let space = colour_space(map)?;
    let opacities = match map.get("Points") {
        None | Some(Value::Null) => None,
        Some(list) => Some(curve::knots(&nodes(list)?)),
    };
    Ok(Knots {
        colours: colour_knots(&colours, space, encoding),
        opacities,
    })
}

fn single_map(document: &Value) -> Result<&Value, String> {
    let maps = match document {
        Value::Array(maps) => maps.as_slice(),
        other => std::slice::from_ref(other),
    };
    match maps {
        [map] if map.is_object() => Ok(map),
        [_] | [] => {
            Err("expected an object with RGBPoints, or a list with one such object".to_owned())
        }
        many => {
            let name = |map: &Value| {
                map.get("Name")
                    .and_then(Value::as_str)
                    .unwrap_or("unnamed")
                    .to_owned()
            };
            let names: Vec<_> = many.iter().map(name).collect();
            Err(format!(
                "{} colour maps ({}): keep one of them in the file",
                many.len(),
                names.join(", ")
            ))
        }
    }
}

fn refuse_log_scale(map: &Value) -> Result<(), String> {
    let is_log = match map.get("UseLogScale") {
        None | Some(Value::Null) => false,
        Some(Value::Bool(flag)) => *flag,
        Some(other) => other.as_f64() != Some(0.0),
    };
    if is_log {
        Err("UseLogScale is set: a logarithmic scale is not read, export a linear map".to_owned())
    } else {
        Ok(())
    }
}

fn colour_space(map: &Value) -> Result<ColourSpace, String> {
    let name = match map.get("ColorSpace") {
        None | Some(Value::Null) => return Ok(ColourSpace::Rgb),
        Some(name) => name
            .as_str()
            .ok_or("ColorSpace: expected a name such as \"RGB\"")?,
    };
    match name.to_lowercase().as_str() {
        "rgb" => Ok(ColourSpace::Rgb),
        "hsv" => Ok(ColourSpace::Hsv),
        // The name under which ParaView stores hue with its wrap flag.
        "wrapped" => Ok(ColourSpace::HsvWrapped),
        "lab" | "cielab" => Ok(ColourSpace::Lab),
        "diverging" => Ok(ColourSpace::Diverging),
        "step" => Ok(ColourSpace::Step),
        _ => Err(format!(
            "ColorSpace '{name}': expected RGB, HSV, Lab, Diverging or Step"
        )),
    }
}

fn file_colours(map: &Value) -> Result<Vec<FileColour>, String> {
    let Some(list) = map.get("RGBPoints") else {
        let hint = if map.get("IndexedColors").is_some() {
            " (IndexedColors are for categories)"
        } else {
            ""
        };
        return Err(format!(
            "RGBPoints is missing{hint}: expected a list x, r, g, b, ..."
        ));
    };
    let rows = rows_of_four("RGBPoints", list)?;
    check_unit("RGBPoints", &rows, &["r", "g", "b"])?;
    Ok(rows
        .iter()
        .map(|&[value, red, green, blue]| FileColour {
            value,
            rgb: [red, green, blue],
        })
        .collect())
}

fn nodes(list: &Value) -> Result<Vec<Node>, String> {
    let rows = rows_of_four("Points", list)?;
    check_unit("Points", &rows, &["opacity", "midpoint", "sharpness"])?;
    let node = |&[value, opacity, midpoint, sharpness]: &[f64; 4]| Node {
        value,
        opacity,
        midpoint,
        sharpness,
    };
    Ok(rows.iter().map(node).collect())
}

/// A flat list of numbers in rows of four, the first of each ascending.
fn rows_of_four(key: &str, list: &Value) -> Result<Vec<[f64; 4]>, String> {
    let entries = list
        .as_array()
        .ok_or_else(|| format!("{key}: expected a list of numbers"))?;
    let mut numbers = Vec::new();
    for (place, entry) in entries.iter().enumerate() {
        let number = entry.as_f64().filter(|number| number.is_finite());
        numbers.push(
            number.ok_or_else(|| format!("{key}[{place}] is {entry}: expected a finite number"))?,
        );
    }
    let (rows, rest) = numbers.as_chunks::<4>();
    if rows.is_empty() || !rest.is_empty() {
        return Err(format!(
            "{key} has {} numbers: expected a multiple of four, at least four",
            numbers.len()
        ));
    }
    if let Some(row) = (1..rows.len()).find(|&row| rows[row][0] < rows[row - 1][0]) {
        let (place, here, before) = (4 * row, rows[row][0], rows[row - 1][0]);
        return Err(format!(
            "{key}[{place}] is {here} after {before}: expected ascending scalars"
        ));
    }
    Ok(rows.to_vec())
}

/// The last three of each row must be in 0..=1.
fn check_unit(key: &str, rows: &[[f64; 4]], names: &[&str; 3]) -> Result<(), String> {
    for (row, numbers) in rows.iter().enumerate() {
        for (column, name) in names.iter().enumerate() {
            let number = numbers[column + 1];
            if !(0.0..=1.0).contains(&number) {
                let place = 4 * row + column + 1;
                return Err(format!(
                    "{key}[{place}] ({name}) is {number}: expected 0 to 1"
                ));
            }
        }
    }
    Ok(())
}

fn colour_knots(
    colours: &[FileColour],
    space: ColourSpace,
    encoding: ColourEncoding,
) -> Vec<ColourKnot> {
    let knot = |value: f64, rgb: [f64; 3]| ColourKnot {
        value,
        rgb: decoded(rgb, encoding),
    };
    let pieces = match (space, encoding) {
        (ColourSpace::Rgb, ColourEncoding::Linear) | (ColourSpace::Step, _) => 1,
        _ => (PIECES_IN_ALL / colours.len()).clamp(2, MOST_PIECES),
    };
    let mut knots = Vec::new();
    for pair in colours.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        knots.push(knot(from.value, from.rgb));
        if from.value >= to.value {
            continue;
        }
        if space == ColourSpace::Step {
            // Just above the knot, so that the knot's own scalar keeps its colour, as it does in VTK.
            let above = from.value.next_up();
            knots.extend([knot(above, from.rgb), knot(above, to.rgb)]);
        }
        for piece in 1..pieces {
            let share = piece as f64 / pieces as f64;
            let value = from.value * (1.0 - share) + to.value * share;
            knots.push(knot(
                value.clamp(from.value, to.value),
                space.between(from.rgb, to.rgb, share),
            ));
        }
    }
    knots.extend(colours.last().map(|last| knot(last.value, last.rgb)));
    knots
}

fn decoded(rgb: [f64; 3], encoding: ColourEncoding) -> [f32; 3] {
    match encoding {
        ColourEncoding::Linear => rgb.map(|channel| channel as f32),
        ColourEncoding::Srgb => rgb.map(|channel| linear_from_srgb(channel as f32)),
    }
}

#[cfg(test)]
mod tests;
