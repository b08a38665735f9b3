//! One picture: rendered, laid over its background, written.
//!
//! Takes a renderer, a camera and a file name, gives what the stats file says about the picture.

use std::path::PathBuf;

use anyhow::{Result, bail};
use resample_core::{Camera, Image};
use volsplat::{FrameStats, Renderer};

use crate::output::{self, Format};
use crate::report::WrittenFrame;

/// How every picture of a run is finished.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Finish {
    /// File format.
    pub format: Format,
    /// Opaque background, linear RGB; none keeps the picture's transparency.
    pub background: Option<[f32; 3]>,
}

/// Most pixels of a picture: 16384 x 16384. The picture alone then takes 4 GiB; a camera file must not be able to
/// ask for all memory by its width and height.
pub(crate) const MAX_PIXELS: u64 = 1 << 28;

/// Checks that a picture of this size can be held.
pub(crate) fn check_size(camera: &Camera) -> Result<()> {
    let (width, height) = (camera.width, camera.height);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        bail!("a picture of {width}x{height} has more than {MAX_PIXELS} pixels: choose a smaller size");
    }
    Ok(())
}

/// A picture in memory, and the counts and times of its drawing.
pub(crate) struct Drawn {
    /// The picture, over its background if there is one.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

/// Renders from `camera`.
pub(crate) fn render(
    renderer: &mut Renderer,
    camera: &Camera,
    background: Option<[f32; 3]>,
) -> Result<Drawn> {
    let frame = renderer.render(camera)?;
    let image = match background {
        Some(background) => frame.image.over_background(background),
        None => frame.image,
    };
    Ok(Drawn { image, stats: frame.stats })
}

/// Renders from `camera` and writes `file`.
pub(crate) fn draw(
    renderer: &mut Renderer,
    camera: &Camera,
    file: PathBuf,
    finish: &Finish,
) -> Result<WrittenFrame> {
    let Drawn { image, stats } = render(renderer, camera, finish.background)?;
    let file_bytes = output::write_picture(&file, finish.format, &image)?;
    Ok(WrittenFrame { file, file_bytes, width: image.width, height: image.height, stats })
}
