//! Values that are typed in one word: sizes, vectors, angles, axes, colours.
//!
//! Takes the word, gives the value or a sentence that names the expected form. These are the value parsers of
//! `args.rs`, so that clap can name the option in front of the sentence.

pub mod input_file;
pub mod mesh_word;

use std::path::PathBuf;

use clap::ValueEnum;
use glam::DVec3;
use resample_core::image::linear_from_srgb;
use resample_core::narrow::single;
use volsplat::{Cells, ClipPlane, Subpixels};

mod bound;
mod part;

pub use crate::values::part::{IntrinsicsWord, Sway, bytes, intrinsics, sway};
pub use bound::{Bound, bound, metric_bound, time_ms};
pub use part::{FrameRange, LookOf, TileWord, frames, look_of, tile};
pub use resample_core::camera::orbit::{Orbit, Size};
pub use resample_core::metrics::estimate::BoundMetric;
pub use warp3d::multiview::Grid;

/// Most views along a side of a grid: more than any light-field screen shows.
const MAX_GRID_SIDE: u32 = 64;

/// The word of a choice.
pub fn word(choice: impl ValueEnum) -> String {
    let value = choice.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// A signed world axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// The unit vector.
    pub direction: DVec3,
}

/// A range of scalars by its middle and its extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The scalar in the middle.
    pub level: f64,
    /// Distance of the ends, above 0.
    pub width: f64,
}

/// The background of the picture.
#[derive(Clone, Debug, PartialEq)]
pub enum BackgroundWord {
    /// Nothing.
    Transparent,
    /// A colour, linear RGB.
    Colour([f32; 3]),
    /// A picture file.
    File(PathBuf),
}

/// `WxH`, or one number for both, each from 1 to the largest side of a camera.
pub fn size(text: &str) -> Result<Size, String> {
    let expected = || {
        format!(
            "expected WxH such as 800x600, or 800 for a square, each from 1 to {}",
            resample_core::camera::MAX_SIDE_PX
        )
    };
    let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
    let side = |word: &str| {
        let px: u32 = word.trim().parse().ok()?;
        (1..=resample_core::camera::MAX_SIDE_PX)
            .contains(&px)
            .then_some(px)
    };
    match (side(width), side(height)) {
        (Some(width), Some(height)) => Ok(Size { width, height }),
        _ => Err(expected()),
    }
}

/// `X,Y,Z`, whole numbers above 0.
pub fn dims(text: &str) -> Result<[usize; 3], String> {
    let parsed: Option<Vec<usize>> = text
        .split(',')
        .map(|word| word.trim().parse().ok())
        .collect();
    match parsed.as_deref() {
        Some(&[x, y, z]) if x > 0 && y > 0 && z > 0 => Ok([x, y, z]),
        _ => Err("expected three whole numbers above 0 such as 256,256,128".into()),
    }
}

/// `A,B`, finite numbers.
pub fn pair(text: &str) -> Result<[f64; 2], String> {
    match numbers(text).as_deref() {
        Some(&[a, b]) => Ok([a, b]),
        _ => Err("expected two numbers such as 1,-1024".into()),
    }
}

/// `A,B`, finite numbers, the first the smaller.
pub fn ascending(text: &str) -> Result<[f64; 2], String> {
    match numbers(text).as_deref() {
        Some(&[a, b]) if a < b => Ok([a, b]),
        _ => Err("expected two numbers, the first the smaller, such as 0,255".into()),
    }
}

/// `X,Y,Z`, finite numbers.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z]),
        _ => Err("expected three numbers such as 1,1,1.4".into()),
    }
}

/// `X0,Y0,Z0,X1,Y1,Z1`: two corners of a box, the first below the second on every axis.
pub fn corners(text: &str) -> Result<[[f64; 3]; 2], String> {
    match numbers(text).as_deref() {
        Some(&[x0, y0, z0, x1, y1, z1]) if x0 < x1 && y0 < y1 && z0 < z1 => {
            Ok([[x0, y0, z0], [x1, y1, z1]])
        }
        _ => Err(
            "expected six numbers, the first three below the other three, such as 0,0,0,100,100,50"
                .into(),
        ),
    }
}

/// `NX,NY,NZ,D`: a direction and a number.
pub fn plane(text: &str) -> Result<ClipPlane, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z, offset]) if DVec3::new(x, y, z).try_normalize().is_some() => {
            Ok(ClipPlane {
                normal: DVec3::new(x, y, z),
                offset,
            })
        }
        _ => Err("expected four numbers, the first three not all 0, such as 1,0,0,40".into()),
    }
}

/// A finite number.
pub fn number(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| "expected a finite number".into())
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text)
        .filter(|&value| value > 0.0)
        .ok_or_else(|| "expected a number above 0".into())
}

/// A finite number above 0, in single precision.
pub fn positive_f32(text: &str) -> Result<f32, String> {
    finite(text)
        .map(|value| value as f32)
        .filter(|&value| value > 0.0 && value.is_finite())
        .ok_or_else(|| "expected a number above 0".into())
}

/// `X,Y,Z`, not all 0: a direction of any length.
pub fn direction(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> = text.split(',').map_while(finite).collect();
    <[f64; 3]>::try_from(parts)
        .ok()
        .filter(|_| text.matches(',').count() == 2)
        .map(DVec3::from)
        .filter(|direction| direction.try_normalize().is_some())
        .ok_or_else(|| "expected X,Y,Z, three numbers that are not all 0".into())
}

/// `auto`, or a number of sub-pixels along a pixel's side.
pub fn subpixels(text: &str) -> Result<Subpixels, String> {
    match text.trim() {
        "auto" => Ok(Subpixels::Auto),
        word @ ("1" | "2" | "4" | "8" | "16") => word
            .parse()
            .map(Subpixels::Fixed)
            .map_err(|_| String::new()),
        _ => Err("expected auto, 1, 2, 4, 8 or 16".into()),
    }
}

/// `auto`, `off`, `mean`, `split`, or `split:E` with the error of its parts.
pub fn cells(text: &str) -> Result<Cells, String> {
    match text.trim() {
        "auto" => Ok(Cells::Auto),
        "off" => Ok(Cells::Off),
        "mean" => Ok(Cells::Mean),
        "split" => Ok(Cells::SPLIT),
        word => {
            let error = word.strip_prefix("split:").map(fraction);
            let error = error.unwrap_or_else(|| {
                Err("expected auto, off, mean, split, or split:E such as split:0.25".into())
            });
            error.map(|error| Cells::Split { error })
        }
    }
}

/// Cells as they are typed.
pub fn cells_word(cells: Cells) -> String {
    match cells {
        Cells::Auto => "auto".into(),
        Cells::Off => "off".into(),
        Cells::Mean => "mean".into(),
        Cells::SPLIT => "split".into(),
        Cells::Split { error } => format!("split:{error}"),
    }
}

/// A number from 0 up to, not including, 1, in single precision.
pub fn fraction(text: &str) -> Result<f32, String> {
    finite(text)
        .map(|value| value as f32)
        .filter(|value| (0.0..1.0).contains(value))
        .ok_or_else(|| "expected a number from 0 up to, not including, 1".into())
}

/// A number above 0, at most 1.
pub fn share(text: &str) -> Result<f32, String> {
    finite(text)
        .map(single)
        .filter(|&value| value > 0.0 && value <= 1.0)
        .ok_or_else(|| "expected a number above 0, at most 1".into())
}

/// An angle in degrees, above 0 and below 180.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    finite(text)
        .filter(|&degrees| degrees > 0.0 && degrees < 180.0)
        .ok_or_else(|| "expected an angle above 0 and below 180 degrees".into())
}

/// `CxR`, columns and rows of a grid of views.
pub fn grid(text: &str) -> Result<Grid, String> {
    let side = |word: &str| {
        word.parse()
            .ok()
            .filter(|side| (1..=MAX_GRID_SIDE).contains(side))
    };
    let parsed = text
        .split_once(['x', 'X'])
        .and_then(|(columns, rows)| Some((side(columns)?, side(rows)?)));
    let grid = parsed
        .filter(|&(columns, rows)| columns * rows > 1)
        .map(|(columns, rows)| Grid { columns, rows });
    grid.ok_or_else(|| {
        format!("expected CxR such as 8x6, each from 1 to {MAX_GRID_SIDE}, two views or more")
    })
}

/// A distance above 0, or `inf`.
pub fn distance(text: &str) -> Result<f64, String> {
    if text.trim() == "inf" {
        Ok(f64::INFINITY)
    } else {
        positive(text).map_err(|e| format!("{e}, or inf"))
    }
}

/// `AZ,EL` or `AZ,EL,DIST`.
pub fn orbit(text: &str) -> Result<Orbit, String> {
    let (azimuth_deg, elevation_deg, distance) = match numbers(text).as_deref() {
        Some(&[azimuth, elevation]) => (azimuth, elevation, 1.0),
        Some(&[azimuth, elevation, distance]) => (azimuth, elevation, distance),
        _ => return Err("expected AZ,EL or AZ,EL,DIST such as 30,20 or 30,20,1.5".into()),
    };
    if !(-90.0..=90.0).contains(&elevation_deg) {
        return Err("expected an elevation from -90 to 90 degrees".into());
    }
    if distance <= 0.0 {
        return Err("expected a distance above 0".into());
    }
    Ok(Orbit {
        azimuth_deg,
        elevation_deg,
        distance,
    })
}

/// The name of a PNG file.
pub fn png_name(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_png = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    is_png
        .then_some(path)
        .ok_or_else(|| "expected a name that ends in .png".into())
}

/// `LEVEL,WIDTH` or `LOW..HIGH`.
pub fn window(text: &str) -> Result<Window, String> {
    let (numbers, is_range) = match text.split_once("..") {
        Some((low, high)) => (numbers(&format!("{low},{high}")), true),
        None => (numbers(text), false),
    };
    match numbers.as_deref() {
        Some(&[low, high]) if is_range && low < high => Ok(Window {
            level: 0.5 * (low + high),
            width: high - low,
        }),
        Some(&[level, width]) if !is_range && width > 0.0 => Ok(Window { level, width }),
        _ => Err("expected LEVEL,WIDTH such as 40,400, with a width above 0, or LOW..HIGH such as -160..240".into()),
    }
}

/// `x`, `y`, `z`, `-x`, `-y` or `-z`.
pub fn axis(text: &str) -> Result<Axis, String> {
    let direction = match text {
        "x" | "+x" => DVec3::X,
        "y" | "+y" => DVec3::Y,
        "z" | "+z" => DVec3::Z,
        "-x" => DVec3::NEG_X,
        "-y" => DVec3::NEG_Y,
        "-z" => DVec3::NEG_Z,
        _ => return Err("expected x, y, z, -x, -y or -z".into()),
    };
    Ok(Axis { direction })
}

/// 8 or 16.
pub fn bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("expected 8 or 16".into()),
    }
}

/// Display colours by name, beside those that are written in numbers.
pub(crate) const COLOURS: [(&str, [f32; 3]); 9] = [
    ("white", [255.0; 3]),
    ("black", [0.0; 3]),
    ("red", [255.0, 0.0, 0.0]),
    ("green", [0.0, 255.0, 0.0]),
    ("blue", [0.0, 0.0, 255.0]),
    ("cyan", [0.0, 255.0, 255.0]),
    ("magenta", [255.0, 0.0, 255.0]),
    ("yellow", [255.0, 255.0, 0.0]),
    ("orange", [255.0, 128.0, 0.0]),
];

/// A colour given in sRGB (a name such as `white`, `#rrggbb` or `R,G,B` from 0 to 255), as linear RGB.
pub fn colour(text: &str) -> Result<[f32; 3], String> {
    let named = COLOURS.iter().find(|(name, _)| *name == text);
    let encoded = named
        .map(|(_, encoded)| *encoded)
        .or_else(|| hex_colour(text))
        .or_else(|| decimal_colour(text));
    let encoded = encoded.ok_or_else(|| {
        let names = COLOURS.map(|(name, _)| name).join(", ");
        format!("expected #rrggbb, R,G,B from 0 to 255, or one of {names}")
    })?;
    Ok(encoded.map(|channel| linear_from_srgb(channel / 255.0)))
}

/// `transparent`, a colour as [`colour`] takes it, or a file: a word that is not a colour must look like a file name.
pub fn background(text: &str) -> Result<BackgroundWord, String> {
    if text == "transparent" {
        return Ok(BackgroundWord::Transparent);
    }
    let path = PathBuf::from(text);
    match colour(text) {
        Ok(colour) => Ok(BackgroundWord::Colour(colour)),
        Err(_) if path.extension().is_some() => Ok(BackgroundWord::File(path)),
        Err(expected) => Err(format!(
            "{expected}, transparent, or the name of a picture file"
        )),
    }
}

fn hex_colour(text: &str) -> Option<[f32; 3]> {
    let digits = text
        .strip_prefix('#')
        .filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let channel = |at: usize| {
        u8::from_str_radix(&digits[at..at + 2], 16)
            .ok()
            .map(f32::from)
    };
    Some([channel(0)?, channel(2)?, channel(4)?])
}

fn decimal_colour(text: &str) -> Option<[f32; 3]> {
    match numbers(text)?.as_slice() {
        rgb @ &[r, g, b] if rgb.iter().all(|c| (0.0..=255.0).contains(c)) => {
            Some([r as f32, g as f32, b as f32])
        }
        _ => None,
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(finite).collect()
}

fn finite(text: &str) -> Option<f64> {
    text.trim()
        .parse::<f64>()
        .ok()
        .filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests;
