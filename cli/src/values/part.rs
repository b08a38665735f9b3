//! Words for a part of the work (some pictures of a sequence, one tile of a picture), a lens, a sway, and a number of bytes.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::values::{Grid, finite, positive};

/// The step of a volume over time that decides its look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LookOf {
    /// All of them.
    #[default]
    All,
    /// The step of this number, counted from 0.
    Step(usize),
}

/// `--look-of`.
pub fn look_of(text: &str) -> Result<LookOf, String> {
    match (text, text.parse()) {
        ("all", _) => Ok(LookOf::All),
        (_, Ok(step)) => Ok(LookOf::Step(step)),
        _ => Err("expected all, or the number of a step, counted from 0".to_owned()),
    }
}

/// Pictures of a sequence by their numbers, the end not included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// The first one's number.
    pub first: usize,
    /// The number behind the last one's; `None` for all that follow.
    pub end: Option<usize>,
}

impl FrameRange {
    /// The numbers, of `count` pictures; `None` where there is none of them.
    pub fn of(self, count: usize) -> Option<Range<usize>> {
        let end = self.end.unwrap_or(count).min(count);
        (self.first < end).then_some(self.first..end)
    }
}

/// One tile of a picture that is divided evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileWord {
    /// Tiles on its left.
    pub column: u32,
    /// Tiles above it.
    pub row: u32,
    /// Tiles beside and above each other.
    pub grid: Grid,
}

/// Most tiles along a side of a picture: one for each 16 pixels of the largest.
const MAX_TILES: u32 = 1 << 10;

/// `A..B` or `A..`.
pub fn frames(text: &str) -> Result<FrameRange, String> {
    let parsed = text.split_once("..").and_then(|(first, end)| {
        let first = first.trim().parse().ok()?;
        let end = match end.trim() {
            "" => None,
            end => Some(end.parse().ok()?),
        };
        Some(FrameRange { first, end })
    });
    parsed
        .filter(|range| range.end.is_none_or(|end| range.first < end))
        .ok_or_else(|| {
            "expected A..B, the first picture and the one behind the last, such as 0..10".into()
        })
}

/// `COL,ROW/COLSxROWS`.
pub fn tile(text: &str) -> Result<TileWord, String> {
    let numbers = |text: &str, joint: &[char]| -> Option<[u32; 2]> {
        let (a, b) = text.split_once(joint)?;
        Some([a.trim().parse().ok()?, b.trim().parse().ok()?])
    };
    let parsed = text.split_once('/').and_then(|(place, grid)| {
        let ([column, row], [columns, rows]) =
            (numbers(place, &[','])?, numbers(grid, &['x', 'X'])?);
        let word = TileWord {
            column,
            row,
            grid: Grid { columns, rows },
        };
        let is_inside = column < columns && row < rows && columns.max(rows) <= MAX_TILES;
        is_inside.then_some(word)
    });
    parsed.ok_or_else(|| {
        "expected COL,ROW/COLSxROWS, counted from 0, such as 3,0/4x2 for the tile at the top right".into()
    })
}

/// A lens as it was typed.
#[derive(Clone, Debug, PartialEq)]
pub enum IntrinsicsWord {
    /// Focal lengths along x and y and the centre, px.
    Numbers([f64; 4]),
    /// A file that holds them.
    File(PathBuf),
}

/// `FX,FY,CX,CY` in pixels, focal lengths above 0, or the name of a file.
pub fn intrinsics(text: &str) -> Result<IntrinsicsWord, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|word| {
            word.trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
        })
        .collect();
    match numbers.as_deref() {
        Some(&[fx, fy, cx, cy]) if fx > 0.0 && fy > 0.0 => {
            Ok(IntrinsicsWord::Numbers([fx, fy, cx, cy]))
        }
        None if Path::new(text).is_file() => Ok(IntrinsicsWord::File(text.into())),
        _ => Err(
            "expected FX,FY,CX,CY in pixels such as 525,525,319.5,239.5, focal lengths above 0, or a file that exists"
                .into(),
        ),
    }
}

/// A sway of the camera around the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sway {
    /// Largest angle from the camera, degrees.
    pub angle_deg: f64,
    /// Pictures once around.
    pub pictures: u32,
}

/// Pictures of a sway: two seconds.
const DEFAULT_PICTURES: u32 = 48;

/// Most pictures: more is a slip of the finger.
const MAX_PICTURES: u32 = 100_000;

/// An angle above 0 and up to 45 degrees, and perhaps a number of pictures.
pub fn sway(text: &str) -> Result<Sway, String> {
    let (angle, pictures) = match text.split_once(',') {
        Some((angle, pictures)) => (angle, pictures.trim().parse().ok()),
        None => (text, Some(DEFAULT_PICTURES)),
    };
    let angle = positive(angle).ok().filter(|&angle_deg| angle_deg <= 45.0);
    let pictures = pictures.filter(|pictures| (1..=MAX_PICTURES).contains(pictures));
    match (angle, pictures) {
        (Some(angle_deg), Some(pictures)) => Ok(Sway { angle_deg, pictures }),
        _ => Err("expected an angle above 0 and up to 45 degrees, and perhaps a number of pictures: 3 or 3,48".into()),
    }
}

/// A number of bytes such as 4G: K, M, G and T stand for powers of 1024.
pub fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let (digits, unit) = text.split_at(
        text.trim_end_matches(|c: char| c.is_ascii_alphabetic())
            .len(),
    );
    let power = match unit.to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 1,
        "M" | "MB" | "MIB" => 2,
        "G" | "GB" | "GIB" => 3,
        "T" | "TB" | "TIB" => 4,
        _ => return Err("expected a number of bytes such as 4G or 512M".into()),
    };
    let count = finite(digits)
        .filter(|&count| count > 0.0)
        .map(|count| count * 1024f64.powi(power));
    // Beyond 2^60 bytes there is no machine.
    match count {
        Some(count) if (1.0..1.2e18).contains(&count) => Ok(count as u64),
        _ => Err("expected a number of bytes such as 4G or 512M".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_tiles_are_read() {
        let range = |text: &str| frames(text).expect("a range");
        assert_eq!(range("2..5").of(10), Some(2..5));
        assert_eq!(
            range("8..12").of(10),
            Some(8..10),
            "the last job may ask for more"
        );
        assert_eq!(range("8..").of(10), Some(8..10));
        assert_eq!(range("10..12").of(10), None);
        for wrong in ["3", "3..3", "..3", "a..b"] {
            assert!(frames(wrong).is_err(), "{wrong}");
        }
        let word = tile("2,0/4x3").expect("a tile");
        assert_eq!((word.column, word.row), (2, 0));
        for wrong in ["4,0/4x3", "0,0", "0,0/0x1", "0/4x3", "1,1/2000x2"] {
            assert!(tile(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn bytes_have_units_of_1024() {
        for (text, expected) in [
            ("1000", 1000),
            ("4G", 4 << 30),
            ("1.5k", 1536),
            ("512MiB", 512 << 20),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for bad in ["", "G", "-1G", "0", "4X", "1e30", "nan"] {
            assert!(bytes(bad).is_err(), "{bad:?} is no number of bytes");
        }
    }
}
