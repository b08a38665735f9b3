//! The parts of a figure beside its picture: a scale bar, a colour bar, axes, a caption. Drawn into the picture at its own size, so that a large
//! picture has no coarser letters than a small one.
//!
//! Takes a [`Figure`], a picture in linear light, its camera and which part of the whole picture it is, and draws. `parts` describes them; `ticks` finds round numbers,
//! `text` makes letters, `canvas` covers pixels, `place` finds places on the screen; `bars` and `axes` lay them out. A part of a picture gets the same pixels as the whole has there.
//! Lines of the box of axes are hidden by what stands before them, as the picture's depth tells; all else lies over the picture.
//! Limits: letters run from left to right, without ligatures.

mod axes;
mod bars;
mod canvas;
mod mask;
mod parts;
mod place;
mod sheet;
mod text;
mod ticks;

use glam::DVec2;
use resample_core::{Camera, Image};

pub use parts::{Axes, ColourBar, Ground, ScaleBar};
pub use sheet::sheet;
pub use ticks::{number, round_length};

use crate::figure::canvas::Canvas;
use crate::figure::text::Anchor;

/// The parts of a figure beside its picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// A bar of a round length.
    pub scale_bar: Option<ScaleBar>,
    /// Colours and their values.
    pub colour_bar: Option<ColourBar>,
    /// Directions or a box with numbers.
    pub axes: Option<Axes>,
    /// A line of text at the top.
    pub caption: Option<String>,
    /// The ground of letters and lines.
    pub ground: Ground,
}

impl Figure {
    /// Draws over a part of a picture that begins at column and row `first` of the whole, which the camera shows.
    pub fn draw(&self, image: &mut Image, camera: &Camera, first: [usize; 2]) {
        let size = [camera.width, camera.height].map(f64::from);
        let mut canvas = Canvas::new(image, first, size, self.ground);
        if let Some(axes) = &self.axes {
            match axes.bounds {
                Some(bounds) => axes::boxed(&mut canvas, camera, axes, bounds),
                None => axes::directions(&mut canvas, camera, axes),
            }
        }
        if let Some(bar) = &self.scale_bar {
            bars::scale(&mut canvas, camera, bar);
        }
        if let Some(bar) = &self.colour_bar {
            bars::colours(&mut canvas, bar);
        }
        if let Some(caption) = &self.caption {
            let em = canvas.em;
            let at = DVec2::new(0.5 * size[0], 1.2 * em);
            canvas.text(caption, 1.2 * em, at, Anchor::MIDDLE);
        }
    }
}

#[cfg(test)]
mod tests;
