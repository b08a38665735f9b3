//! Tiles of a picture, each drawn by a process of its own.
//!
//! Tiles begin at edges of the renderers' own tiles, so that their sizes are alike and all are exact; the file of a tile says which one it is.

use std::ops::Range;

use anyhow::{Result, bail};
use resample_core::camera::bands::{TILE_SIDE, Window};
use serde::{Deserialize, Serialize};

use crate::output::Format;
use crate::values::TileWord;

/// The record inside the file of a tile.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PartMark {
    /// The version of the program.
    pub(crate) version: String,
    /// The vector instructions that drew it.
    pub(crate) vector_level: String,
    /// The mark of the whole picture.
    pub(crate) fingerprint: String,
    /// The number of the picture, where it is one of several.
    pub(crate) number: Option<usize>,
    /// Width and height of the whole picture, px.
    pub(crate) whole: [u32; 2],
    /// Column and row of the tile.
    pub(crate) place: [u32; 2],
    /// Columns and rows of all tiles.
    pub(crate) grid: [u32; 2],
    /// The format of the whole picture's file.
    pub(crate) format: Format,
}

/// The pixels of a tile.
pub(crate) fn window(word: &TileWord, [width, height]: [u32; 2]) -> Result<Window> {
    let span = |number: u32, count: u32, side: u32| -> Option<Range<u32>> {
        let blocks = u64::from(side.div_ceil(TILE_SIDE));
        let edge = |number: u32| {
            // At most `blocks`, which is a u32.
            let block = (u64::from(number) * blocks / u64::from(count)) as u32;
            (block * TILE_SIDE).min(side)
        };
        let span = edge(number)..edge(number + 1);
        (u64::from(count) <= blocks).then_some(span)
    };
    let spans = (
        span(word.column, word.grid.columns, width),
        span(word.row, word.grid.rows, height),
    );
    match spans {
        (Some(columns), Some(rows)) => Ok(Window { columns, rows }),
        _ => bail!(
            "--tile: a picture of {width}x{height} pixels has at most {}x{} tiles",
            width.div_ceil(TILE_SIDE),
            height.div_ceil(TILE_SIDE)
        ),
    }
}

#[cfg(test)]
mod tests {
    use crate::values;

    use super::*;

    #[test]
    fn tiles_cover_the_picture_once() {
        for (size, grid) in [([100, 80], "3x2"), ([800, 600], "7x5"), ([16, 16], "1x1")] {
            let (columns, rows) = grid.split_once('x').expect("a grid");
            let (columns, rows): (u32, u32) = (
                columns.parse().expect("a number"),
                rows.parse().expect("a number"),
            );
            let mut covered = vec![0; (size[0] * size[1]) as usize];
            for place in 0..columns * rows {
                let text = format!("{},{}/{grid}", place % columns, place / columns);
                let tile = values::tile(&text).expect("a tile");
                let window = window(&tile, size).expect("fits");
                for y in window.rows.clone() {
                    for x in window.columns.clone() {
                        covered[(y * size[0] + x) as usize] += 1;
                    }
                }
            }
            assert!(covered.iter().all(|&times| times == 1), "{grid}");
        }
        let small = values::tile("0,0/3x1").expect("a tile");
        assert!(window(&small, [32, 16]).is_err(), "only two of 16 pixels");
    }
}
