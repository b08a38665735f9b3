//! Words for a part of the work: some pictures of a sequence, one tile of a picture.

use std::ops::Range;

use super::Grid;

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
}
