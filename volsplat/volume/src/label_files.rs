//! Files of labels, in display colours (sRGB).
//!
//! Takes a path or a text, gives a [`LabelTable`]. The content decides: a first mark of `{` is JSON; otherwise lines are read, without
//! empty ones and without those that begin with `#`. A line with commas is CSV, one without is ITK-SNAP's: label, red, green, blue,
//! opacity, visible, mesh, name (source: the comment at the head of the files that ITK-SNAP writes).

use std::path::Path;

use resample_core::image::linear_from_srgb;
use resample_io::files::read_json;

use crate::Error;
use crate::labels::{LabelLook, LabelTable};

/// Most bytes of a table: a hundred bytes for each of 100 000 labels. More is another kind of file.
const MAX_BYTES: u64 = 10_000_000;

impl LabelTable {
    /// Reads a table: a label file of ITK-SNAP, CSV (label, red, green, blue from 0 to 255, and opacity from 0 to 1 if
    /// wanted), or JSON (`{"1": "#ff8000", "2": {"colour": "#00ff00", "opacity": 0.3}}`); the content decides which.
    ///
    /// JSON can also be typed in place of the name. An error names the file, its line or key, and the expected form.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let read = |source| Error::Read {
            path: path.to_owned(),
            source,
        };
        let invalid = |what: String| Error::Invalid {
            path: path.to_owned(),
            what,
        };
        let bytes = read_json(path, MAX_BYTES).map_err(read)?;
        let text = String::from_utf8(bytes).map_err(|_| {
            invalid("this is no text: expected a label file of ITK-SNAP, CSV or JSON".into())
        })?;
        parse(&text).map_err(invalid)
    }
}

/// The table in a text; the error says where it is wrong.
fn parse(text: &str) -> Result<LabelTable, String> {
    let text = text.trim_start_matches('\u{feff}');
    let looks = if text.trim_start().starts_with('{') {
        json(text)?
    } else {
        lines(text)?
    };
    if looks.is_empty() {
        return Err(
            "no label is listed: expected lines such as '1 255 0 0 1 1 1 \"name\"' or '1,255,0,0'"
                .into(),
        );
    }
    LabelTable::new(looks).map_err(|error| error.to_string())
}

fn lines(text: &str) -> Result<Vec<(i64, LabelLook)>, String> {
    let mut looks = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let comma = line.contains(',');
        // A table may have one line of headings.
        if comma && looks.is_empty() && line.starts_with(|c: char| c.is_alphabetic() || c == '"') {
            continue;
        }
        let look = if comma {
            csv_line(line)
        } else {
            snap_line(line)
        };
        looks.push(look.map_err(|what| format!("line {}: {what}", number + 1))?);
    }
    Ok(looks)
}

fn snap_line(line: &str) -> Result<(i64, LabelLook), String> {
    let expected = || {
        format!(
            "'{line}': expected label, red, green, blue, opacity, visible, mesh and a name in quotes"
        )
    };
    let words: Vec<&str> = line.split_whitespace().take(6).collect();
    let [label, r, g, b, opacity, visible] = words.as_slice() else {
        return Err(expected());
    };
    let numbers: Option<Vec<f64>> = [r, g, b, opacity, visible]
        .into_iter()
        .map(|w| finite(w))
        .collect();
    let (Ok(label), Some(numbers)) = (label.parse(), numbers) else {
        return Err(expected());
    };
    let shown = if numbers[4] == 0.0 { 0.0 } else { numbers[3] };
    Ok((label, look([numbers[0], numbers[1], numbers[2]], shown)?))
}

fn csv_line(line: &str) -> Result<(i64, LabelLook), String> {
    let words: Vec<&str> = line
        .split(',')
        .map(|word| word.trim().trim_matches('"'))
        .collect();
    let number = |place: usize| words.get(place).and_then(|word| finite(word));
    let label = words[0].parse().ok();
    let (Some(label), Some(r), Some(g), Some(b)) = (label, number(1), number(2), number(3)) else {
        return Err(format!(
            "'{line}': expected label,red,green,blue and, if wanted, opacity"
        ));
    };
    // What follows the colour may be a name.
    Ok((label, look([r, g, b], number(4).unwrap_or(1.0))?))
}

fn json(text: &str) -> Result<Vec<(i64, LabelLook)>, String> {
    let table: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(text).map_err(|error| format!("this is no JSON object: {error}"))?;
    table
        .iter()
        .map(|(key, value)| json_look(key, value))
        .collect()
}

fn json_look(key: &str, value: &serde_json::Value) -> Result<(i64, LabelLook), String> {
    let expected = || {
        format!(
            "{key:?}: expected a whole number as the key, and \"#rrggbb\" or {{\"colour\": \"#rrggbb\", \"opacity\": 0.5}}"
        )
    };
    let label = key.parse().map_err(|_| expected())?;
    let (colour, opacity) = match value {
        serde_json::Value::String(colour) => (Some(colour.as_str()), 1.0),
        _ => {
            let colour = value
                .get("colour")
                .or_else(|| value.get("color"))
                .and_then(|c| c.as_str());
            let opacity = value.get("opacity").map_or(Some(1.0), |o| o.as_f64());
            (colour, opacity.ok_or_else(expected)?)
        }
    };
    let encoded = colour.and_then(hex).ok_or_else(expected)?;
    Ok((
        label,
        look(encoded, opacity).map_err(|what| format!("{key:?}: {what}"))?,
    ))
}

fn hex(text: &str) -> Option<[f64; 3]> {
    let digits = text
        .strip_prefix('#')
        .filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let channel = |at: usize| {
        u8::from_str_radix(&digits[at..at + 2], 16)
            .ok()
            .map(f64::from)
    };
    Some([channel(0)?, channel(2)?, channel(4)?])
}

/// A look from display colours of 0 to 255.
fn look(encoded: [f64; 3], opacity: f64) -> Result<LabelLook, String> {
    if !encoded
        .iter()
        .all(|channel| (0.0..=255.0).contains(channel))
        || !(0.0..=1.0).contains(&opacity)
    {
        return Err(format!(
            "colour {encoded:?} and opacity {opacity}: expected 0 to 255, and 0 to 1"
        ));
    }
    Ok(LabelLook {
        rgb: encoded.map(|channel| linear_from_srgb((channel / 255.0) as f32)),
        opacity,
    })
}

fn finite(word: &str) -> Option<f64> {
    word.parse::<f64>().ok().filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SNAP: &str = "################\n# ITK-SnAP Label Description File\n    0     0    0    0        0  0  0    \"Clear Label\"\n\
    1   255    0    0        1  1  1    \"Label 1\"\n    2     0  255    0      0.5  1  1    \"half\"\n   \
    7     0    0  255        1  0  1    \"not visible\"\n";

    #[test]
    fn the_three_kinds_of_file_say_the_same() {
        let snap = parse(SNAP).expect("a label file of ITK-SNAP");
        let csv = parse(
            "label,r,g,b,opacity,name\n0,0,0,0,0\n1, 255,0,0,1,red\n2,0,255,0,0.5\n7,0,0,255,0\n",
        );
        let json = parse(
            r##"{"0": {"colour": "#000000", "opacity": 0}, "1": "#ff0000", "2": {"color": "#00FF00", "opacity": 0.5},
        "7": {"colour": "#0000ff", "opacity": 0}}"##,
        );
        assert_eq!(Ok(&snap), csv.as_ref(), "CSV");
        assert_eq!(Ok(&snap), json.as_ref(), "JSON");
        assert_eq!(snap.look(1).rgb, [1.0, 0.0, 0.0], "red");
        assert!((snap.look(2).opacity - 0.5).abs() < 1e-15, "half opaque");
        assert_eq!(snap.look(7).opacity, 0.0, "not visible");
        assert_eq!(snap.look(3).opacity, 0.0, "not listed, so not drawn");
        for (table, label) in [snap, LabelTable::distinct()]
            .iter()
            .flat_map(|t| (0..9).map(move |label| (t, label)))
        {
            assert_eq!(
                table.shows(label),
                table.look(label).opacity > 0.0,
                "{table:?}, {label}"
            );
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        let bad = [
            ("", "no label"),
            ("1 255 0 0\n", "line 1"),
            ("1,255,0,0\n2,256,0,0\n", "line 2"),
            ("1,255,0,0\nx,1,0,0\n", "line 2"),
            ("1,255,0,0,1.5\n", "opacity 1.5"),
            (r#"{"1": "red"}"#, "\"1\""),
            (r#"{"a": "red"}"#, "\"a\""),
            (r##"{"1": "#123456""##, "no JSON"),
            ("1 1 1 nan 1 1\n", "line 1"),
            ("1e3 1 1 1 1 1\n", "line 1"),
        ];
        for (text, place) in bad {
            let error = parse(text).expect_err("not a table");
            assert!(error.contains(place), "{text:?}: {error}");
        }
    }
}
