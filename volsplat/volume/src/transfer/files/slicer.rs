//! Volume properties of 3D Slicer: `.vp`, a text of nine lines, and `.vp.json`.
//!
//! Takes the content of a file, gives colour and opacity knots, the light, and the unit of opacity. A `.vp` has a line each of
//! interpolation, shade, diffuse, ambient, specular, specular power, then lists with their count in front: scalar opacity
//! (value, opacity), gradient opacity (gradient, opacity), colours (value, r, g, b). The JSON names the same.
//! Source: the developer guide of Slicer's module Volume Rendering, and its JSON schema.
//! Lengths of the gradient are value per mean spacing of the voxels, as VTK's ray caster was measured to take them (version 9, on grids of four spacings).
//! Limits: the first component; the strengths of light are this program's own; isosurfaces are left aside with a note (`--iso` does that); colours
//! are straight between their points, and so is gradient opacity, of at most 16 of them.

use serde_json::Value;

use crate::transfer::files::curve;
use crate::transfer::files::curve::{Knots, Node, decoded};
use crate::transfer::{ColourEncoding, ColourKnot, OpacityKnot};
use crate::transfer::{GradientOpacity, Shading};

/// Lines of a `.vp` file.
const LINES: usize = 9;

/// The knots of a `.vp` file; an error names the line.
pub(crate) fn parse_text(text: &str, encoding: ColourEncoding) -> Result<Knots, String> {
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .map(|(number, line)| (number + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .collect();
    let [_, shade, _, _, specular, _, scalar, gradient, colours] = lines.as_slice() else {
        return Err(format!(
            "{} lines with content: a Slicer .vp file has {LINES}: interpolation, shade, diffuse, ambient, specular, specular \
             power, scalar opacity, gradient opacity, colours",
            lines.len()
        ));
    };
    let opacities = list::<2>(scalar, "scalar opacity")?
        .into_iter()
        .map(|[value, opacity]| OpacityKnot { value, opacity });
    let colours = list::<4>(colours, "colours")?
        .into_iter()
        .map(|[value, r, g, b]| ColourKnot {
            value,
            rgb: decoded([r, g, b], encoding),
        });
    let gradient = list::<2>(gradient, "gradient opacity")?;
    let (gradient, notes) = gradient_opacity(gradient);
    Ok(Knots {
        colours: Some(colours.collect()),
        opacities: Some(opacities.collect()),
        shading: Some(shading(
            single(shade, "shade")?,
            single(specular, "specular")?,
        )),
        opacity_unit: None,
        gradient,
        notes,
    })
}

/// The knots of a `.vp.json`; an error names the key.
pub(crate) fn parse_document(document: &Value, encoding: ColourEncoding) -> Result<Knots, String> {
    let first = |value: &Value, key: &str| -> Result<(Value, usize), String> {
        let list = value.get(key).and_then(Value::as_array);
        match list.and_then(|list| Some((list.first()?.clone(), list.len()))) {
            Some(found) => Ok(found),
            None => Err(format!("{key}: expected a list of at least one object")),
        }
    };
    let (property, _) = first(document, "volumeProperties")?;
    let (component, components) = first(&property, "components")?;
    let points = |key: &str| -> Result<&[Value], String> {
        match component
            .get(key)
            .and_then(|function| function.get("points"))
        {
            None => Ok(&[]),
            Some(Value::Array(points)) => Ok(points),
            Some(_) => Err(format!("{key}.points: expected a list")),
        }
    };
    let opacities = opacity_nodes("scalarOpacity", points("scalarOpacity")?)?;
    let colours = colour_knots(
        "rgbTransferFunction",
        points("rgbTransferFunction")?,
        encoding,
    )?;
    let gradient = opacity_nodes("gradientOpacity", points("gradientOpacity")?)?;
    let points = gradient.iter().map(|node| [node.value, node.opacity]);
    let (gradient, mut notes) = gradient_opacity(points.collect());
    if components > 1 {
        notes.push(format!("the first of its {components} components is used"));
    }
    let is_listed = |key: &str| {
        component
            .get(key)
            .or_else(|| property.get(key))
            .and_then(Value::as_array)
    };
    if is_listed("isoSurfaceValues").is_some_and(|values| !values.is_empty()) {
        notes.push("its isosurfaces are left aside: --iso VALUE draws one".to_owned());
    }
    let is_shaded = component.get("shade").or_else(|| property.get("shade"));
    let is_shaded = is_shaded.map(|value| value.as_bool().unwrap_or(value.as_f64() == Some(1.0)));
    let specular = component
        .pointer("/lighting/specular")
        .and_then(Value::as_f64);
    let unit = component
        .get("scalarOpacityUnitDistance")
        .and_then(Value::as_f64);
    if let Some(unit) = unit.filter(|&unit| !(unit > 0.0 && unit.is_finite())) {
        return Err(format!(
            "scalarOpacityUnitDistance is {unit}: expected a length above 0"
        ));
    }
    if opacities.is_empty() && colours.is_empty() {
        return Err("neither scalarOpacity nor rgbTransferFunction has points".to_owned());
    }
    Ok(Knots {
        colours: (!colours.is_empty()).then_some(colours),
        opacities: (!opacities.is_empty()).then(|| curve::knots(&opacities)),
        shading: is_shaded.map(|on| shading(f64::from(u8::from(on)), specular.unwrap_or(1.0))),
        opacity_unit: unit,
        gradient,
        notes,
    })
}

/// The light: none, or with a highlight where there is one.
fn shading(shade: f64, specular: f64) -> Shading {
    match (shade != 0.0, specular > 0.0) {
        (false, _) => Shading::None,
        (true, false) => Shading::Lambert,
        (true, true) => Shading::Phong,
    }
}

/// Opacity by the gradient, where it is not 1 everywhere; a note where it has more points than a curve here.
fn gradient_opacity(mut points: Vec<[f64; 2]>) -> (Option<GradientOpacity>, Vec<String>) {
    if points.iter().all(|&[_, opacity]| opacity == 1.0) {
        return (None, Vec::new());
    }
    if let [[length, opacity]] = points[..] {
        points.push([length + 1.0, opacity]);
    }
    let curve = GradientOpacity { knots: points };
    match curve.validate() {
        Ok(()) => (Some(curve), Vec::new()),
        Err(error) => (
            None,
            vec![format!("its gradient opacity is left aside: {error}")],
        ),
    }
}

/// The number of a line that holds one.
fn single(&(number, line): &(usize, &str), what: &str) -> Result<f64, String> {
    let value = line.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| format!("line {number} ({what}): expected one number"))
}

/// The rows of a line that begins with its count, of numbers or of rows: both are found.
fn list<const N: usize>(
    &(number, line): &(usize, &str),
    what: &str,
) -> Result<Vec<[f64; N]>, String> {
    let located = |text: String| format!("line {number} ({what}): {text}");
    let mut words = line.split_ascii_whitespace();
    let count: usize = words
        .next()
        .and_then(|word| word.parse().ok())
        .ok_or_else(|| located("expected a count and then numbers".to_owned()))?;
    let mut numbers = Vec::new();
    for (place, word) in words.enumerate() {
        let value = word.parse().ok().filter(|value: &f64| value.is_finite());
        numbers.push(value.ok_or_else(|| located(format!("number {place} is '{}'", short(word))))?);
    }
    let held = numbers.len();
    let (rows, rest) = numbers.as_chunks::<N>();
    if rows.is_empty() || !rest.is_empty() || (count != held && count != rows.len()) {
        return Err(located(format!(
            "the count is {count}, but {held} numbers follow: expected that many numbers, in rows of {N}"
        )));
    }
    let rows = rows.to_vec();
    check_rows(&rows).map_err(located)?;
    Ok(rows)
}

/// Values must ascend, and what stands behind them lie in 0 to 1.
fn check_rows<const N: usize>(rows: &[[f64; N]]) -> Result<(), String> {
    for (place, row) in rows.iter().enumerate() {
        if place > 0 && row[0] < rows[place - 1][0] {
            return Err(format!(
                "point {place} is at {} after {}: expected ascending values",
                row[0],
                rows[place - 1][0]
            ));
        }
        if let Some(bad) = row[1..].iter().find(|value| !(0.0..=1.0).contains(*value)) {
            return Err(format!("point {place} has {bad}: expected 0 to 1"));
        }
    }
    Ok(())
}

fn opacity_nodes(key: &str, points: &[Value]) -> Result<Vec<Node>, String> {
    let number = |point: &Value, field: &str| point.get(field).and_then(Value::as_f64);
    let mut nodes = Vec::new();
    let mut rows = Vec::new();
    for (place, point) in points.iter().enumerate() {
        let (Some(value), Some(opacity)) = (number(point, "x"), number(point, "y")) else {
            return Err(format!("{key}.points[{place}]: expected numbers x and y"));
        };
        rows.push([value, opacity]);
        nodes.push(Node {
            value,
            opacity,
            midpoint: number(point, "midpoint").unwrap_or(0.5).clamp(0.0, 1.0),
            sharpness: number(point, "sharpness").unwrap_or(0.0).clamp(0.0, 1.0),
        });
    }
    check_rows(&rows).map_err(|what| format!("{key}.points: {what}"))?;
    Ok(nodes)
}

fn colour_knots(
    key: &str,
    points: &[Value],
    encoding: ColourEncoding,
) -> Result<Vec<ColourKnot>, String> {
    let mut rows = Vec::new();
    for (place, point) in points.iter().enumerate() {
        let value = point.get("x").and_then(Value::as_f64);
        let rgb = point
            .get("color")
            .and_then(Value::as_array)
            .filter(|list| list.len() == 3);
        let rgb =
            rgb.and_then(|list| Some([list[0].as_f64()?, list[1].as_f64()?, list[2].as_f64()?]));
        let (Some(value), Some([r, g, b])) = (value, rgb) else {
            return Err(format!(
                "{key}.points[{place}]: expected a number x, and color as three numbers"
            ));
        };
        rows.push([value, r, g, b]);
    }
    check_rows(&rows).map_err(|what| format!("{key}.points: {what}"))?;
    let knot = |[value, r, g, b]: [f64; 4]| ColourKnot {
        value,
        rgb: decoded([r, g, b], encoding),
    };
    Ok(rows.into_iter().map(knot).collect())
}

/// The start of a word, short enough for a message.
fn short(word: &str) -> String {
    word.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::transfer::FileLook;
    use crate::{Volume, Voxels};

    const TEXT: &str =
        "1\n1\n0.9\n0.1\n0.2\n10\n6 0 0 100 0.25 200 1\n4 0 1 255 1\n8 0 0 0 0 200 1 0.5 0\n";

    fn opacities(knots: &Knots) -> Vec<(f64, f64)> {
        let list = knots.opacities.as_deref().unwrap_or_default();
        list.iter().map(|knot| (knot.value, knot.opacity)).collect()
    }

    #[test]
    fn text_and_json_say_the_same() {
        let json = r#"{"volumeProperties":[{"components":[{"shade":true,
            "lighting":{"diffuse":0.9,"ambient":0.1,"specular":0.2,"specularPower":10},
            "scalarOpacityUnitDistance":2.5,
            "scalarOpacity":{"points":[{"x":0,"y":0},{"x":100,"y":0.25},{"x":200,"y":1,"midpoint":0.5,"sharpness":0}]},
            "gradientOpacity":{"points":[{"x":0,"y":1},{"x":255,"y":1}]},
            "rgbTransferFunction":{"points":[{"x":0,"color":[0,0,0]},{"x":200,"color":[1,0.5,0]}]}}]}]}"#;
        let text = parse_text(TEXT, ColourEncoding::Linear).expect("good");
        let document = serde_json::from_str(json).expect("JSON");
        let json = parse_document(&document, ColourEncoding::Linear).expect("good");
        for knots in [&text, &json] {
            assert_eq!(opacities(knots), [(0.0, 0.0), (100.0, 0.25), (200.0, 1.0)]);
            let colours = knots.colours.as_deref().expect("colours");
            assert_eq!(colours[1].rgb, [1.0, 0.5, 0.0]);
            assert_eq!(knots.shading, Some(Shading::Phong));
            assert!(knots.notes.is_empty(), "{:?}", knots.notes);
        }
        assert_eq!((text.opacity_unit, json.opacity_unit), (None, Some(2.5)));
    }

    #[test]
    fn counts_may_be_of_rows() {
        let rows = TEXT.replace("6 0 0", "3 0 0").replace("8 0 0", "2 0 0");
        let knots = parse_text(&rows, ColourEncoding::Linear).expect("good");
        assert_eq!(opacities(&knots).len(), 3);
    }

    #[test]
    fn light_follows_shade_and_specular() {
        assert_eq!(shading(0.0, 1.0), Shading::None);
        assert_eq!(shading(1.0, 0.0), Shading::Lambert);
    }

    #[test]
    fn opacity_by_the_gradient_is_a_curve() {
        let of = |gradient: &str| {
            let text = TEXT.replace("4 0 1 255 1", gradient);
            let knots = parse_text(&text, ColourEncoding::Linear).expect("good");
            (knots.gradient, knots.notes)
        };
        let (curve, notes) = of("6 0 0 10 0.5 255 1");
        let knots = vec![[0.0, 0.0], [10.0, 0.5], [255.0, 1.0]];
        assert_eq!(
            (curve, notes),
            (Some(GradientOpacity { knots }), Vec::new())
        );
        // A single point gives a constant factor; a factor of 1 changes nothing and is left out.
        let (half, _) = of("2 3 0.5");
        assert_eq!(
            half.map(|curve| [curve.at(0.0), curve.at(9.0)]),
            Some([0.5; 2])
        );
        assert_eq!(of("2 3 1"), (None, Vec::new()));
        let (none, notes) = of("4 -5 0 255 1");
        assert!(
            none.is_none() && notes[0].contains("left aside"),
            "{notes:?}"
        );
    }

    #[test]
    fn gradients_of_a_file_are_counted_in_mean_spacings() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("skins.vp");
        let text = TEXT.replace("4 0 1 255 1", "4 4 0 8 1");
        std::fs::write(&path, text).expect("write");
        let grid = DAffine3::from_scale([1.0, 1.0, 4.0].into());
        let voxels = Voxels::U8((0..100).collect());
        let volume = Volume::new([10, 10, 1], voxels, grid).expect("valid");
        let curve = |look: FileLook| look.gradient_opacity.expect("a curve").knots;
        let look = FileLook::load(&path, ColourEncoding::Linear, &volume).expect("valid");
        assert_eq!(curve(look), [[2.0, 0.0], [4.0, 1.0]]);
        // Values from 0 to 200 become 0 to 99, and gradients as much less.
        let moved = FileLook::load_rescaled(&path, ColourEncoding::Linear, &volume).expect("valid");
        let [[low, _], [high, _]] = curve(moved)[..] else {
            panic!("two knots");
        };
        assert!(
            (low - 0.99).abs() < 1e-12 && (high - 1.98).abs() < 1e-12,
            "{low}, {high}"
        );
    }

    #[test]
    fn faults_name_their_place() {
        for (from, to, said) in [
            (
                "6 0 0",
                "7 0 0",
                "line 7 (scalar opacity): the count is 7, but 6 numbers",
            ),
            (
                "100 0.25",
                "100 x",
                "line 7 (scalar opacity): number 3 is 'x'",
            ),
            ("100 0.25", "300 0.25", "point 2 is at 200 after 300"),
            (
                "200 1 0.5 0",
                "200 2 0.5 0",
                "line 9 (colours): point 1 has 2",
            ),
            ("1\n1\n0.9", "1\nyes\n0.9", "line 2 (shade)"),
            ("10\n", "", "8 lines with content"),
        ] {
            let error = parse_text(&TEXT.replacen(from, to, 1), ColourEncoding::Linear);
            let error = error.expect_err("bad");
            assert!(error.contains(said), "{error}");
        }
        let refused = |json: &str| {
            let document: Value = serde_json::from_str(json).expect("JSON");
            parse_document(&document, ColourEncoding::Linear).expect_err("bad")
        };
        assert!(refused(r#"{"volumeProperties":[]}"#).contains("volumeProperties"));
        let bad =
            r#"{"volumeProperties":[{"components":[{"scalarOpacity":{"points":[{"x":0}]}}]}]}"#;
        assert!(refused(bad).contains("scalarOpacity.points[0]"));
    }
}
