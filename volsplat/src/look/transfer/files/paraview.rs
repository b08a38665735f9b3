//! Colour maps of ParaView, as its colour map editor exports them: JSON, one object or a list with one object.
//!
//! Takes a document, gives colour and opacity knots. `RGBPoints` is a flat list x, r, g, b, ...; `Points` is a flat list
//! x, opacity, midpoint, sharpness, ...; `ColorSpace` says how colours are interpolated. Colours that are not straight in
//! linear light are sampled into knots. In a step of `Step`, as in VTK, a knot's own scalar still has its own colour.
//! Limits: `NanColor`, `Name` and `Creator` are left aside; indexed colours and logarithmic scales are refused.

use serde_json::Value;

use super::knots::{Knots, decoded};
use crate::look::transfer::files::colour_space::ColourSpace;
use crate::look::transfer::files::curve;
use crate::look::transfer::files::curve::Node;
use crate::look::transfer::{ColourEncoding, ColourKnot};

/// A colour of the file, in the file's own encoding.
#[derive(Clone, Copy)]
struct FileColour {
    value: f64,
    rgb: [f64; 3],
}

/// Straight pieces per interval of a bent colour path, where there are few intervals: one per 8-bit level.
const MOST_PIECES: usize = 256;

/// Pieces of all intervals together, about; long tables are fine enough as they are.
const PIECES_IN_ALL: usize = 4096;

/// The knots of a document; an error names the key and the place in its list.
pub(crate) fn parse(document: &Value, encoding: ColourEncoding) -> Result<Knots, String> {
    let map = single_map(document)?;
    refuse_log_scale(map)?;
    let opacities = match map.get("Points") {
        None | Some(Value::Null) => None,
        Some(list) => Some(curve::knots(&nodes(list)?)),
    };
    // Colours may be left out where there is opacity: they are then those of any volume.
    let colours = match (map.get("RGBPoints"), &opacities) {
        (None | Some(Value::Null), Some(_)) if map.get("IndexedColors").is_none() => None,
        _ => {
            let colours = file_colours(map)?;
            Some(colour_knots(&colours, colour_space(map)?, encoding))
        }
    };
    Ok(Knots {
        colours,
        opacities,
        ..Knots::default()
    })
}

fn single_map(document: &Value) -> Result<&Value, String> {
    let maps = match document {
        Value::Array(maps) => maps.as_slice(),
        other => std::slice::from_ref(other),
    };
    match maps {
        [map] if map.is_object() => Ok(map),
        [_] | [] => Err(
            "expected an object with RGBPoints or Points, or a list with one such object"
                .to_owned(),
        ),
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

#[cfg(test)]
mod tests;
