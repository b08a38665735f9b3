//! Options of a process that draws a part of the work.

use clap::Args;

use crate::values;
use crate::values::{FrameRange, TileWord};

/// The part of the pictures that is drawn; all else is decided by the whole.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[command(next_help_heading = "Several pictures")]
pub struct PartArgs {
    /// Draw only pictures A to B-1, counted from 0; `A..` means to the end
    ///
    /// Names, views and settings stay those of the whole, so that many processes can each draw their pictures.
    #[arg(long, value_name = "A..B", value_parser = values::frames)]
    pub frames: Option<FrameRange>,
    /// Draw only one tile of a picture that is divided in COLSxROWS, into a file of its own beside it
    ///
    /// Tiles are counted from 0. `resample join` makes the picture of all tiles: the bytes of one run.
    #[arg(long, value_name = "COL,ROW/COLSxROWS", value_parser = values::tile)]
    pub tile: Option<TileWord>,
}
