//! The part of a sequence that one process draws: some of its pictures, or a tile of each.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Result, bail};
use resample_core::Camera;
use resample_core::simd::SimdLevel;

use crate::output;
use crate::picture::bands::Window;
use crate::picture::tiles::{Kind, PartMark};
use crate::picture::{Drawn, Shot, tiles};
use crate::plan::Request;
use crate::process::report::WrittenFrame;
use crate::values::TileWord;

/// The part of the work of one process.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// The numbers of the pictures.
    pub(crate) numbers: Range<usize>,
    tile: Option<TileWord>,
    vector_level: SimdLevel,
}

impl Part {
    /// The part that was asked for, of so many pictures.
    pub(crate) fn of(request: &Request, count: usize) -> Result<Self> {
        let asked = request.sequence.part;
        let numbers = match asked.frames {
            None => 0..count,
            Some(range) => match range.of(count) {
                Some(numbers) => numbers,
                None => bail!(
                    "--frames: starts at {}, and there are {count} pictures, counted from 0",
                    range.first
                ),
            },
        };
        Ok(Self {
            numbers,
            tile: asked.tile,
            vector_level: request.vector_level,
        })
    }

    /// Returns true if a tile of each picture is drawn.
    pub(crate) fn has_tile(&self) -> bool {
        self.tile.is_some()
    }

    /// The pixels that are drawn of a picture.
    pub(crate) fn window(&self, camera: &Camera) -> Result<Window> {
        let size = [camera.width, camera.height];
        match self.tile {
            Some(tile) => tiles::window(&tile, size),
            None => Ok(Window::whole(camera)),
        }
    }

    /// The mark in the file of a tile; `None` where pictures are drawn whole.
    pub(crate) fn mark(
        &self,
        (number, fingerprint): (Option<usize>, String),
        camera: &Camera,
        kind: Kind,
    ) -> Option<PartMark> {
        let TileWord { column, row, grid } = self.tile?;
        Some(PartMark {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            vector_level: self.vector_level.resolve().name().to_owned(),
            fingerprint,
            number,
            whole: [camera.width, camera.height],
            place: [column, row],
            grid: [grid.columns, grid.rows],
            kind,
        })
    }
}

/// Writes the file of a tile.
pub(crate) fn write(
    drawn: Drawn,
    file: PathBuf,
    shot: &Shot,
    mark: Option<&str>,
) -> Result<WrittenFrame> {
    let Drawn { image, account } = drawn;
    let whole = [shot.camera.width as usize, shot.camera.height as usize];
    let place = (shot.window.first(), whole);
    let file_bytes = output::write_tile(&file, &image, place, mark.unwrap_or_default())?;
    Ok(WrittenFrame::of(file, file_bytes, &image, account))
}
