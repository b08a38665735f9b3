//! Describes a picture or a depth image: its size and channels. For a depth image it adds the range and the number of unknown pixels.

use anyhow::{Result, anyhow};
use resample_io::{Part, Plane, Stored, colour, depth, exr, files};
use serde_json::{Value, json};

use super::words::{Line, line, listed, short};
use crate::args::InfoArgs;
use crate::args::words::content;

/// Bytes of a pixel while it is looked at.
const PIXEL_BYTES: u64 = 4 + 4;

/// Reads the picture and describes it.
pub(super) fn facts(args: &InfoArgs) -> Result<(Vec<Line>, Value)> {
    let path = &args.input.path;
    let part = Part {
        path: path.clone(),
        name: args.input.part.clone(),
    };
    let size = colour::size(&part).ok();
    if let Some([width, height]) = size {
        let bytes = u64::from(width) * u64::from(height) * PIXEL_BYTES;
        let asked = args.volume.reading.gate().ask(bytes, "the pixels");
        asked.map_err(|what| anyhow!("{}: {what}", path.display()))?;
    }
    let channels = channels(&part)?;
    let is_colour = channels.len() >= 3;
    let plane = match depth::read(&part) {
        Ok(plane) => Some(plane),
        // Its first error is the best where it is no picture either.
        Err(error) if size.is_none() => return Err(error.into()),
        Err(_) => None,
    };
    let [width, height] = match (size, &plane) {
        (Some([width, height]), _) => [width as usize, height as usize],
        (None, Some(plane)) => [plane.width, plane.height],
        (None, None) => [0; 2],
    };
    let format = format_name(&files::first_bytes(path, 64)?);
    let numbers = plane.as_ref().map(Numbers::of);
    let mut lines = vec![
        line("format", format),
        line("size", format!("{width} x {height} pixels")),
        line("channels", listed(&channels)),
    ];
    lines.extend(numbers.iter().flat_map(Numbers::lines));
    let facts = json!({
        "kind": "picture",
        "format": format,
        "size": [width, height],
        "channels": channels,
        "colour": is_colour,
        "depth": numbers.map(|numbers| numbers.json()),
    });
    Ok((lines, facts))
}

/// The usual name of a format that begins with these bytes.
fn format_name(head: &[u8]) -> &'static str {
    match head {
        [b'P', b'F' | b'f', ..] => "PFM",
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => "NumPy array",
        [0x76, 0x2f, 0x31, 0x01, ..] => "OpenEXR",
        _ => match image::guess_format(head) {
            Ok(image::ImageFormat::Png) => "PNG",
            Ok(image::ImageFormat::Jpeg) => "JPEG",
            Ok(image::ImageFormat::Tiff) => "TIFF",
            Ok(image::ImageFormat::Hdr) => "Radiance HDR",
            Ok(image::ImageFormat::WebP) => "WebP",
            _ => "picture",
        },
    }
}

/// The channels and the types of their numbers.
fn channels(part: &Part) -> Result<Vec<String>> {
    let head = files::first_bytes(&part.path, 2)?;
    if let Ok(found) = exr::channels_of(&part.path) {
        let named = |(name, kind): &(String, &str)| format!("{name} ({kind})");
        return Ok(found.all.iter().map(named).collect());
    }
    let (names, kind): (&[&str], _) = match content::colours(&part.path) {
        Some(colour) => {
            let names: &[&str] = match (colour.has_color(), colour.has_alpha()) {
                (false, false) => &["grey"],
                (false, true) => &["grey", "alpha"],
                (true, false) => &["red", "green", "blue"],
                (true, true) => &["red", "green", "blue", "alpha"],
            };
            let bits = 8 * u16::from(colour.bytes_per_pixel() / colour.channel_count());
            (names, format!("{bits} bits"))
        }
        None if head == b"PF" => (&["red", "green", "blue"], "32 bits".to_owned()),
        None => (&["numbers"], "one a pixel".to_owned()),
    };
    Ok(names
        .iter()
        .map(|name| format!("{name} ({kind})"))
        .collect())
}

/// The numbers of a depth.
struct Numbers {
    stored: Stored,
    pixels: usize,
    /// Least, median and greatest of those that are finite and above 0.
    range: Option<[f32; 3]>,
    zero: usize,
    negative: usize,
    nan: usize,
    infinite: usize,
}

impl Numbers {
    fn of(plane: &Plane) -> Self {
        let count = |is: &dyn Fn(f32) -> bool| plane.values.iter().filter(|&&v| is(v)).count();
        let mut known: Vec<f32> = plane
            .values
            .iter()
            .copied()
            .filter(|v| v.is_finite() && *v > 0.0)
            .collect();
        known.sort_unstable_by(f32::total_cmp);
        let range =
            (!known.is_empty()).then(|| [known[0], known[known.len() / 2], known[known.len() - 1]]);
        Self {
            stored: plane.stored,
            pixels: plane.values.len(),
            range,
            zero: count(&|v| v == 0.0),
            negative: count(&|v| v.is_finite() && v < 0.0),
            nan: count(&f32::is_nan),
            infinite: count(&f32::is_infinite),
        }
    }

    fn unknown(&self) -> usize {
        self.zero + self.negative + self.nan + self.infinite
    }

    fn lines(&self) -> Vec<Line> {
        let whole = match self.stored {
            Stored::Float => String::new(),
            Stored::Code(most) => {
                format!(", whole numbers up to {most} (say --depth-scale or --depth-kind)")
            }
        };
        let range = match self.range {
            Some([low, median, high]) => format!(
                "{} to {}, median {}{whole}",
                short(f64::from(low)),
                short(f64::from(high)),
                short(f64::from(median))
            ),
            None => "nothing above 0".to_owned(),
        };
        let share = 100.0 * self.unknown() as f64 / self.pixels.max(1) as f64;
        let unknown = format!(
            "{} of {} pixels, {share:.1} %: {} are 0, {} negative, {} NaN, {} infinite",
            self.unknown(),
            self.pixels,
            self.zero,
            self.negative,
            self.nan,
            self.infinite
        );
        vec![line("depth", range), line("unknown", unknown)]
    }

    fn json(&self) -> Value {
        json!({
            "low": self.range.map(|range| range[0]),
            "median": self.range.map(|range| range[1]),
            "high": self.range.map(|range| range[2]),
            "largest_code": match self.stored { Stored::Float => None, Stored::Code(most) => Some(most) },
            "unknown": { "zero": self.zero, "negative": self.negative, "nan": self.nan, "infinite": self.infinite },
        })
    }
}
