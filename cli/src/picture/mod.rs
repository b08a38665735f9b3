//! One picture: rendered, laid over its background, written.
//!
//! Takes any renderer as a closure, a camera and a file name, gives what the stats file says about the picture.

pub mod tiles;

use std::path::PathBuf;

use anyhow::{Context, Result};
use resample_core::camera::bands;
use resample_core::{Camera, Image};
pub use resample_io::camera_file::{MAX_PIXELS, check_size};
use resample_io::figure::Figure;

use crate::output;
use crate::output::Format;
use crate::process::report::{Account, WrittenFrame};
use resample_core::camera::bands::Window;
use texmap::background::Background;

/// How every picture of a run is finished.
#[derive(Clone, Debug)]
pub struct Finish {
    /// File format.
    pub format: Format,
    /// The background.
    pub background: Background,
    /// The figure that is drawn over it.
    pub figure: Option<Figure>,
}

/// One drawing of a sequence: the picture of a camera, or a window of it.
#[derive(Clone, Debug)]
pub struct Shot<'a> {
    /// The camera of the whole picture.
    pub camera: &'a Camera,
    /// The picture's number, from 0 on.
    pub number: usize,
    /// The pixels that are drawn.
    pub window: Window,
}

/// A renderer of a sequence.
pub type RenderShot<'a> = dyn FnMut(&Shot) -> Result<Drawn> + 'a;

/// A picture in memory, and the counts and times of its drawing.
pub struct Drawn {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub account: Account,
}

/// Draws a window of a picture by a camera that is moved to it.
pub(crate) fn in_window(
    camera: &Camera,
    window: &Window,
    draw: &mut dyn FnMut(&Camera) -> Result<Drawn>,
) -> Result<Drawn> {
    let mut account = None;
    let image = bands::moved::<anyhow::Error>(camera, window, &mut |moved| {
        let drawn = draw(moved)?;
        account = Some(drawn.account);
        Ok(drawn.image)
    })?;
    let account = account.context("nothing was drawn")?;
    Ok(Drawn { image, account })
}

/// Renders, lays the picture over its background, and draws the figure over both.
pub fn render(render: &mut RenderShot, shot: &Shot, finish: &Finish) -> Result<Drawn> {
    let Drawn { image, account } = render(shot)?;
    let figure = finish.figure.as_ref();
    Ok(Drawn {
        image: finished(
            image,
            (shot.camera, shot.window.first()),
            &finish.background,
            figure,
        ),
        account,
    })
}

/// A picture, or a part of one that begins at a column and row, over its background and under its figure.
pub(crate) fn finished(
    image: Image,
    (camera, first): (&Camera, [usize; 2]),
    background: &Background,
    figure: Option<&Figure>,
) -> Image {
    let whole = [camera.width as usize, camera.height as usize];
    let mut image = background.behind_window(image, first, whole);
    if let Some(figure) = figure {
        figure.draw(&mut image, camera, first);
    }
    image
}

/// Writes `file`, with a mark inside if there is one.
pub fn write(
    drawn: Drawn,
    file: PathBuf,
    format: Format,
    mark: Option<&str>,
) -> Result<WrittenFrame> {
    let Drawn { image, account } = drawn;
    let file_bytes = output::write_marked_picture(&file, format, &image, mark)?;
    Ok(WrittenFrame::of(file, file_bytes, &image, account))
}
