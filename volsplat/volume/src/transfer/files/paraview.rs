//! Colour maps of ParaView, as its colour map editor exports them: JSON, one object or a list with one object.
//!
//! Takes a document, gives colour and opacity knots. `RGBPoints` is a flat list x, r, g, b, ...; `Points` is a flat list
//! x, opacity, midpoint, sharpness, ...; `ColorSpace` says how colours are interpolated. Colours that are not straight in
//! linear light are sampled into knots. In a step of `Step`, as in VTK, a knot's own scalar still has its own colour.
//! Limits: `NanColor`, `Name` and `Creator` are left aside; indexed colours and logarithmic scales are refused.

use serde_json::Value;

use crate::transfer::files::colour_space::ColourSpace;
use crate::transfer::files::curve;
use crate::transfer::files::curve::{Knots, Node, decoded};
use crate::transfer::{ColourEncoding, ColourKnot};

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
mod tests {
    use crate::volume::{Volume, Voxels};
    use glam::DAffine3;
    use resample_core::image::linear_from_srgb;

    use super::{ColourSpace, MOST_PIECES};
    use crate::Error;
    use crate::transfer::files::parse;
    use crate::transfer::{
        ColourEncoding, ColourMap, FileLook, Histogram, OpacityKnot, TransferFunction,
    };

    const COLOURS: &str = r#""RGBPoints": [0, 0, 0, 0,  10, 1, 0.5, 0]"#;

    fn function(json: &str, encoding: ColourEncoding) -> TransferFunction {
        let knots = parse(json.as_bytes(), encoding).expect("valid JSON map");
        let opacities = knots.opacities.unwrap_or(vec![OpacityKnot {
            value: 0.0,
            opacity: 1.0,
        }]);
        TransferFunction::new(knots.colours.expect("colours"), opacities).expect("valid knots")
    }

    fn refusal(json: &str) -> String {
        parse(json.as_bytes(), ColourEncoding::Linear).expect_err("this map must be refused")
    }

    #[test]
    fn points_and_colours_are_read_from_object_or_list() {
        let map = format!(
            r#"{{"Name": "x", "NanColor": [1, 0, 0], "ColorSpace": "RGB", {COLOURS}, "Points": [0, 0, 0.5, 0, 10, 0.8, 0.5, 0]}}"#
        );
        for json in [map.clone(), format!("[{map}]")] {
            let function = function(&json, ColourEncoding::Linear);
            assert_eq!(function.sample(5.0), ([0.5, 0.25, 0.0], 0.4));
            assert_eq!(
                (
                    function.colour_knots().len(),
                    function.opacity_knots().len()
                ),
                (2, 2),
                "no needless knots"
            );
        }
    }

    #[test]
    fn srgb_is_interpolated_as_written_and_then_decoded() {
        let function = function(&format!("{{{COLOURS}}}"), ColourEncoding::Srgb);
        for value in [0.0, 0.15, 2.5, 5.0, 7.34, 10.0] {
            let expected = linear_from_srgb(value / 10.0);
            let got = function.colour(f64::from(value))[0];
            assert!(
                (got - expected).abs() < 2e-4,
                "at {value}: {got} against {expected}"
            );
        }
    }

    #[test]
    fn step_keeps_the_own_colour_at_a_knot_and_the_upper_one_above() {
        let json = r#"{"ColorSpace": "Step", "RGBPoints": [0, 1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1]}"#;
        let function = function(json, ColourEncoding::Linear);
        let expected = [
            (-1.0, [1.0, 0.0, 0.0]),
            (0.0, [1.0, 0.0, 0.0]),
            (1e-9, [0.0, 1.0, 0.0]),
            (10.0, [0.0, 1.0, 0.0]),
            (11.0, [0.0, 0.0, 1.0]),
            (99.0, [0.0, 0.0, 1.0]),
        ];
        for (value, rgb) in expected {
            assert_eq!(function.colour(value), rgb, "at {value}");
        }
    }

    #[test]
    fn bent_colour_spaces_follow_their_path() {
        let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        for (name, space) in [
            ("HSV", ColourSpace::Hsv),
            ("Wrapped", ColourSpace::HsvWrapped),
            ("Lab", ColourSpace::Lab),
            ("CIELAB", ColourSpace::Lab),
            ("diverging", ColourSpace::Diverging),
        ] {
            let json =
                format!(r#"{{"ColorSpace": "{name}", "RGBPoints": [0, 1, 0, 0, 1, 0, 0, 1]}}"#);
            let function = function(&json, ColourEncoding::Linear);
            for step in 0..=1000 {
                let share = f64::from(step) / 1000.0;
                let expected = space.between(red, blue, share);
                let got = function.colour(share);
                for channel in 0..3 {
                    let error = (f64::from(got[channel]) - expected[channel]).abs();
                    // The worst place is where a channel leaves 0: the sRGB curve has slope 12.92 there, and a piece
                    // across that kink misses it by at most a quarter of slope times width (light rising by 1 in all).
                    assert!(
                        error < 12.92 / 4.0 / MOST_PIECES as f64,
                        "{name} at {share}: {got:?} against {expected:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn midpoint_and_sharpness_shape_the_opacity() {
        let json =
            format!(r#"{{{COLOURS}, "Points": [0, 0, 0.25, 0, 8, 1, 0.5, 1, 16, 0, 0.5, 0]}}"#);
        let function = function(&json, ColourEncoding::Linear);
        assert_eq!(function.opacity(2.0), 0.5, "half way at the midpoint");
        assert_eq!(
            (function.opacity(11.999), function.opacity(12.0)),
            (1.0, 0.0),
            "a sharp segment is a step"
        );
    }

    #[test]
    fn equal_scalars_are_a_step_that_holds_from_there() {
        let json =
            format!(r#"{{{COLOURS}, "Points": [0, 0, 0.5, 0, 71, 0, 0.5, 0, 71, 1, 0.5, 0]}}"#);
        let function = function(&json, ColourEncoding::Linear);
        assert_eq!(
            (function.opacity(70.999), function.opacity(71.0)),
            (0.0, 1.0)
        );
    }

    #[test]
    fn faults_name_key_and_place() {
        let cases = [
            ("[1, 2", "no valid JSON"),
            ("[]", "expected an object with RGBPoints"),
            ("[3]", "expected an object with RGBPoints"),
            (r#"[{"Name": "a"}, {"Name": "b"}]"#, "2 colour maps (a, b)"),
            ("{}", "RGBPoints is missing: expected"),
            (r#"{"Points": [0, 0, 0.5]}"#, "Points has 3 numbers"),
            (
                r#"{"IndexedColors": [0, 0, 0]}"#,
                "IndexedColors are for categories",
            ),
            (r#"{"RGBPoints": 3}"#, "RGBPoints: expected a list"),
            (r#"{"RGBPoints": []}"#, "RGBPoints has 0 numbers"),
            (
                r#"{"RGBPoints": [0, 0, 0, 0, 1]}"#,
                "RGBPoints has 5 numbers: expected a multiple of four",
            ),
            (r#"{"RGBPoints": [0, 0, null, 0]}"#, "RGBPoints[2] is null"),
            (
                r#"{"RGBPoints": [0, 0, "NaN", 0]}"#,
                "RGBPoints[2] is \"NaN\"",
            ),
            (r#"{"RGBPoints": [0, 0, NaN, 0]}"#, "no valid JSON"),
            (
                r#"{"RGBPoints": [0, 0, 255, 0]}"#,
                "RGBPoints[2] (g) is 255: expected 0 to 1",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0]}"#,
                "RGBPoints[8] is 1 after 2",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5, 0, 1, 1.5, 0.5, 0]}"#,
                "Points[5] (opacity) is 1.5",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5, -1]}"#,
                "Points[3] (sharpness) is -1",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0], "Points": [0, 0, 0.5]}"#,
                "Points has 3 numbers",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0], "ColorSpace": "Lab/CIEDE2000"}"#,
                "ColorSpace 'Lab/CIEDE2000': expected RGB",
            ),
            (
                r#"{"RGBPoints": [0, 0, 0, 0], "ColorSpace": 3}"#,
                "ColorSpace: expected a name",
            ),
            (
                r#"{"RGBPoints": [1, 0, 0, 0], "UseLogScale": 1}"#,
                "UseLogScale",
            ),
        ];
        for (json, expected) in cases {
            let text = refusal(json);
            assert!(text.contains(expected), "{json}: {text}");
        }
    }

    #[test]
    fn files_are_named_in_errors_and_absent_points_become_automatic() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("map.json");
        let values = [vec![0u8; 90], vec![200; 10]].concat();
        let volume =
            Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
        let load = || FileLook::load(&path, ColourEncoding::Linear, &volume);
        assert!(matches!(load(), Err(Error::Read { .. })), "an absent file");
        std::fs::write(&path, "{}").expect("write");
        assert!(
            load()
                .expect_err("no colours")
                .to_string()
                .contains("map.json: RGBPoints is missing")
        );
        std::fs::write(&path, format!("{{{COLOURS}}}")).expect("write");
        let function = load().expect("valid").function;
        assert_eq!(function.opacity(0.0), 0.0, "the background vanishes");
        assert!(function.opacity(200.0) > 0.0, "the object stays");
    }

    #[test]
    fn rescaling_moves_the_file_to_the_volume_but_not_the_automatic_opacity() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("map.json");
        let values = [vec![50u8; 90], vec![200; 10]].concat();
        let volume =
            Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
        let colours = r#""RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]"#;
        let load = || FileLook::load_rescaled(&path, ColourEncoding::Linear, &volume);
        std::fs::write(
            &path,
            format!(r#"{{{colours}, "Points": [0, 0, 0.5, 0, 0.5, 1, 0.5, 0]}}"#),
        )
        .expect("write");
        let function = load().expect("valid").function;
        assert_eq!(
            function.value_range(),
            (50.0, 200.0),
            "both kinds of knots span the volume"
        );
        assert_eq!(
            (function.opacity(87.5), function.opacity(125.0)),
            (0.5, 1.0),
            "opacity keeps its shape"
        );
        std::fs::write(&path, format!("{{{colours}}}")).expect("write");
        let function = load().expect("valid").function;
        let automatic =
            TransferFunction::automatic(&Histogram::of_volume(&volume), ColourMap::default());
        assert_eq!(
            function.opacity_knots(),
            automatic.opacity_knots(),
            "automatic opacity stays"
        );
        assert_eq!(
            (function.colour(50.0), function.colour(200.0)),
            ([0.0; 3], [1.0; 3]),
            "colours are moved"
        );
    }

    #[test]
    fn a_file_of_opacity_alone_gets_the_default_colours() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("opacity.json");
        let values = [vec![50u8; 90], vec![200; 10]].concat();
        let volume =
            Volume::new([100, 1, 1], Voxels::U8(values), DAffine3::IDENTITY).expect("valid");
        std::fs::write(&path, r#"[{"Points": [100, 0, 0.5, 0, 180, 0.5, 0.5, 0]}]"#)
            .expect("write");
        let look = FileLook::load(&path, ColourEncoding::Linear, &volume).expect("valid");
        let function = look.function;
        assert_eq!((function.opacity(140.0), look.shading), (0.25, None));
        let map = TransferFunction::new(
            ColourMap::default().knots(50.0, 200.0),
            function.opacities.clone(),
        );
        let map = map.expect("valid");
        assert_eq!(
            function.colour(125.0),
            map.colour(125.0),
            "over the volume's values"
        );
        let moved = FileLook::load_rescaled(&path, ColourEncoding::Linear, &volume).expect("valid");
        assert_eq!(
            moved.function.opacity(125.0),
            0.25,
            "from the first knot to the last"
        );
    }
}
