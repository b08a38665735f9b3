//! One picture: rendered, laid over its background, written.
//!
//! Takes any renderer as a closure, a camera and a file name, gives what the stats file says about the picture.

use std::path::PathBuf;

use anyhow::{Result, bail};
use resample_core::{Camera, Image};

use crate::background::Background;
use crate::output::{self, Format};
use crate::report::{Account, WrittenFrame};

/// How every picture of a run is finished.
#[derive(Clone, Debug)]
pub struct Finish {
    /// File format.
    pub format: Format,
    /// What lies behind.
    pub background: Background,
}

/// Most pixels of a picture: 16384 x 16384. The picture alone then takes 4 GiB; a camera file must not be able to
/// ask for all memory by its width and height.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Checks that a picture of this size can be held.
pub fn check_size(camera: &Camera) -> Result<()> {
    let (width, height) = (camera.width, camera.height);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        bail!(
            "a picture of {width}x{height} has more than {MAX_PIXELS} pixels: choose a smaller size"
        );
    }
    Ok(())
}

/// A renderer of a sequence: the picture that a camera sees, and its number, from 0 on.
pub type RenderNumbered<'a> = dyn FnMut(&Camera, usize) -> Result<Drawn> + 'a;

/// A picture in memory, and the counts and times of its drawing.
pub struct Drawn {
    /// The picture.
    pub image: Image,
    /// Counts and times.
    pub account: Account,
}

/// Renders from `camera` and lays the picture over its background.
pub fn render(
    render: &mut RenderNumbered,
    camera: &Camera,
    number: usize,
    background: &Background,
) -> Result<Drawn> {
    let Drawn { image, account } = render(camera, number)?;
    Ok(Drawn {
        image: background.behind(image),
        account,
    })
}

/// Renders from `camera` and writes `file`.
pub fn draw(
    renderer: &mut RenderNumbered,
    camera: &Camera,
    number: usize,
    file: PathBuf,
    finish: &Finish,
) -> Result<WrittenFrame> {
    let drawn = render(renderer, camera, number, &finish.background)?;
    write(drawn, file, finish.format, None)
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
    Ok(WrittenFrame {
        file,
        file_bytes,
        width: image.width,
        height: image.height,
        account,
    })
}
