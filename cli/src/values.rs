//! Values that are typed in one word: sizes, vectors, angles, axes, colours.
//!
//! Takes the word, gives the value or a sentence that names the expected form. These are the value parsers of
//! `args.rs`, so that clap can name the option in front of the sentence.

use std::path::PathBuf;

use clap::ValueEnum;
use glam::DVec3;
use resample_core::image::linear_from_srgb;
use volsplat::{ClipPlane, Subpixels};

mod bound;
mod bytes;

pub(crate) use bound::{Bound, BoundMetric, bound, metric_bound, time_ms};
pub(crate) use bytes::bytes;

/// Most views along a side of a grid: more than any light-field screen shows.
const MAX_GRID_SIDE: u32 = 64;

/// The word of a choice.
pub(crate) fn word(choice: impl ValueEnum) -> String {
    let value = choice.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// Columns and rows of a quilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Views beside each other.
    pub columns: u32,
    /// Views above each other.
    pub rows: u32,
}

/// A picture size, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
}

/// The place of the eye around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Orbit {
    /// Turn around the up axis, degrees; 0 is the front, positive moves the eye to the right.
    pub azimuth_deg: f64,
    /// Angle above the horizon, degrees, -90 to 90.
    pub elevation_deg: f64,
    /// Multiple of the distance that just fits the view, above 0.
    pub distance: f64,
}

/// A signed world axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    /// The unit vector.
    pub direction: DVec3,
}

/// A range of scalars by its middle and its extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    /// The scalar in the middle.
    pub level: f64,
    /// Distance of the ends, above 0.
    pub width: f64,
}

/// What lies behind the picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BackgroundWord {
    /// Nothing.
    Transparent,
    /// A colour, linear RGB.
    Colour([f32; 3]),
    /// A picture file.
    File(PathBuf),
}

/// `WxH`, each from 1 to the largest side of a camera.
pub(crate) fn size(text: &str) -> Result<Size, String> {
    let expected = || {
        format!(
            "expected WxH such as 800x600, each from 1 to {}",
            resample_core::camera::MAX_SIDE_PX
        )
    };
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
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
pub(crate) fn dims(text: &str) -> Result<[usize; 3], String> {
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
pub(crate) fn pair(text: &str) -> Result<[f64; 2], String> {
    match numbers(text).as_deref() {
        Some(&[a, b]) => Ok([a, b]),
        _ => Err("expected two numbers such as 1,-1024".into()),
    }
}

/// `X,Y,Z`, finite numbers.
pub(crate) fn vector(text: &str) -> Result<[f64; 3], String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok([x, y, z]),
        _ => Err("expected three numbers such as 1,1,1.4".into()),
    }
}

/// `X0,Y0,Z0,X1,Y1,Z1`: two corners of a box, the first below the second on every axis.
pub(crate) fn corners(text: &str) -> Result<[[f64; 3]; 2], String> {
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

/// `LOW,HIGH`, from 0 on, the first below the second.
pub(crate) fn ramp(text: &str) -> Result<[f64; 2], String> {
    match numbers(text).as_deref() {
        Some(&[low, high]) if low >= 0.0 && low < high => Ok([low, high]),
        _ => Err("expected two numbers from 0 on, the first below the second, such as 5,40".into()),
    }
}

/// `NX,NY,NZ,D`: a direction and a number.
pub(crate) fn plane(text: &str) -> Result<ClipPlane, String> {
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
pub(crate) fn number(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| "expected a finite number".into())
}

/// A finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    finite(text)
        .filter(|&value| value > 0.0)
        .ok_or_else(|| "expected a number above 0".into())
}

/// A finite number above 0, in single precision.
pub(crate) fn positive_f32(text: &str) -> Result<f32, String> {
    finite(text)
        .map(|value| value as f32)
        .filter(|&value| value > 0.0 && value.is_finite())
        .ok_or_else(|| "expected a number above 0".into())
}

/// `X,Y,Z`, not all 0: a direction of any length.
pub(crate) fn direction(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> = text.split(',').map_while(finite).collect();
    <[f64; 3]>::try_from(parts)
        .ok()
        .filter(|_| text.matches(',').count() == 2)
        .map(DVec3::from)
        .filter(|direction| direction.try_normalize().is_some())
        .ok_or_else(|| "expected X,Y,Z, three numbers that are not all 0".into())
}

/// `auto`, or a number of sub-pixels along a pixel's side.
pub(crate) fn subpixels(text: &str) -> Result<Subpixels, String> {
    match text.trim() {
        "auto" => Ok(Subpixels::Auto),
        word @ ("1" | "2" | "4" | "8" | "16") => word
            .parse()
            .map(Subpixels::Fixed)
            .map_err(|_| String::new()),
        _ => Err("expected auto, 1, 2, 4, 8 or 16".into()),
    }
}

/// A number from 0 up to, not including, 1, in single precision.
pub(crate) fn fraction(text: &str) -> Result<f32, String> {
    finite(text)
        .map(|value| value as f32)
        .filter(|value| (0.0..1.0).contains(value))
        .ok_or_else(|| "expected a number from 0 up to, not including, 1".into())
}

/// An angle in degrees, above 0 and below 180.
pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    finite(text)
        .filter(|&degrees| degrees > 0.0 && degrees < 180.0)
        .ok_or_else(|| "expected an angle above 0 and below 180 degrees".into())
}

/// `FX,FY,CX,CY` in pixels, focal lengths above 0.
pub(crate) fn intrinsics(text: &str) -> Result<[f64; 4], String> {
    match numbers(text).as_deref() {
        Some(&[fx, fy, cx, cy]) if fx > 0.0 && fy > 0.0 => Ok([fx, fy, cx, cy]),
        _ => Err(
            "expected FX,FY,CX,CY in pixels such as 525,525,319.5,239.5, focal lengths above 0"
                .into(),
        ),
    }
}

/// `CxR`, columns and rows of a grid of views.
pub(crate) fn grid(text: &str) -> Result<Grid, String> {
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
pub(crate) fn distance(text: &str) -> Result<f64, String> {
    if text.trim() == "inf" {
        Ok(f64::INFINITY)
    } else {
        positive(text).map_err(|e| format!("{e}, or inf"))
    }
}

/// An angle above 0 and up to 45 degrees.
pub(crate) fn sway(text: &str) -> Result<f64, String> {
    positive(text)
        .ok()
        .filter(|&angle_deg| angle_deg <= 45.0)
        .ok_or_else(|| "expected an angle above 0 and up to 45 degrees".into())
}

/// `AZ,EL` or `AZ,EL,DIST`.
pub(crate) fn orbit(text: &str) -> Result<Orbit, String> {
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
pub(crate) fn png_name(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_png = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    is_png
        .then_some(path)
        .ok_or_else(|| "expected a name that ends in .png".into())
}

/// `LEVEL,WIDTH`.
pub(crate) fn window(text: &str) -> Result<Window, String> {
    match numbers(text).as_deref() {
        Some(&[level, width]) if width > 0.0 => Ok(Window { level, width }),
        _ => Err("expected LEVEL,WIDTH such as 40,400, with a width above 0".into()),
    }
}

/// `x`, `y`, `z`, `-x`, `-y` or `-z`.
pub(crate) fn axis(text: &str) -> Result<Axis, String> {
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
pub(crate) fn bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("expected 8 or 16".into()),
    }
}

/// A colour given in sRGB (`white`, `black`, `#rrggbb` or `R,G,B` from 0 to 255), as linear RGB.
pub(crate) fn colour(text: &str) -> Result<[f32; 3], String> {
    let encoded = match text {
        "white" => Some([255.0; 3]),
        "black" => Some([0.0; 3]),
        _ => hex_colour(text).or_else(|| decimal_colour(text)),
    };
    let encoded = encoded.ok_or("expected white, black, #rrggbb, or R,G,B from 0 to 255")?;
    Ok(encoded.map(|channel| linear_from_srgb(channel / 255.0)))
}

/// `transparent`, a colour as [`colour`] takes it, or a file: a word that is not a colour must look like a file name.
pub(crate) fn background(text: &str) -> Result<BackgroundWord, String> {
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
mod tests {
    use super::*;

    #[test]
    fn sizes_need_two_sides_within_range() {
        assert_eq!(
            size("640x480"),
            Ok(Size {
                width: 640,
                height: 480
            }),
            "the usual spelling"
        );
        for bad in ["", "640", "0x1", "1x99999", "-1x5", "1x2x3", "axb"] {
            assert!(size(bad).is_err(), "{bad:?} is no size");
        }
    }

    #[test]
    fn vectors_are_three_finite_numbers() {
        assert_eq!(
            vector("1, -2,3e-1"),
            Ok([1.0, -2.0, 0.3]),
            "spaces and exponents are fine"
        );
        for bad in ["1,2", "1,2,3,4", "1,2,nan", "1,2,inf", "1,,2", ""] {
            assert!(vector(bad).is_err(), "{bad:?} is no vector");
        }
        assert!(dims("4,0,4").is_err(), "an empty grid has no voxels");
        assert_eq!(dims("4,5,6"), Ok([4, 5, 6]), "three sizes");
    }

    #[test]
    fn boxes_and_planes_have_an_inside() {
        assert_eq!(
            corners("-1,0,0,1,2,3.5"),
            Ok([[-1.0, 0.0, 0.0], [1.0, 2.0, 3.5]]),
            "two corners"
        );
        for bad in [
            "0,0,0,1,1",
            "0,0,0,1,1,0",
            "0,0,0,1,1,nan",
            "1,0,0,0,1,1",
            "",
        ] {
            assert!(corners(bad).is_err(), "{bad:?} is no box");
        }
        assert_eq!(
            plane("0,-2,0,5").map(|plane| plane.offset),
            Ok(5.0),
            "a direction of any length"
        );
        for bad in ["0,0,0,1", "1,0,0", "1,0,0,inf", "1,0,0,0,0"] {
            assert!(plane(bad).is_err(), "{bad:?} is no plane");
        }
    }

    #[test]
    fn colours_are_decoded_to_linear_light() {
        assert_eq!(colour("white"), Ok([1.0; 3]), "white");
        assert_eq!(colour("#000000"), Ok([0.0; 3]), "black");
        assert_eq!(
            colour("#ff8000"),
            colour("255,128,0"),
            "both spellings of orange"
        );
        for bad in ["#ff80", "#ff80zz", "256,0,0", "-1,0,0", "red", "#éé"] {
            assert!(colour(bad).is_err(), "{bad:?} is no colour");
        }
    }

    #[test]
    fn windows_have_a_level_and_a_width_above_0() {
        assert_eq!(
            window("-600, 1500"),
            Ok(Window {
                level: -600.0,
                width: 1500.0
            }),
            "a lung window"
        );
        for bad in ["40", "40,0", "40,-400", "1,2,3", "40,inf", ""] {
            assert!(window(bad).is_err(), "{bad:?} is no window");
        }
    }

    #[test]
    fn orbits_have_an_optional_distance() {
        let expected = Orbit {
            azimuth_deg: -30.0,
            elevation_deg: 90.0,
            distance: 1.0,
        };
        assert_eq!(orbit("-30,90"), Ok(expected), "the pole is allowed");
        for bad in ["30", "0,91", "0,0,0", "0,0,-1", "0,0,1,2"] {
            assert!(orbit(bad).is_err(), "{bad:?} is no orbit");
        }
    }
}
