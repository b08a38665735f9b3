//! Pictures of a film, one after another: depth made steady, and the background that other pictures show.
//!
//! [`Film::add`] takes the references of a film in order. It makes the depth of each steady, and gives a second reference: the background that the first
//! hides. In the order in which data flow: `around` joins the numbers around pixels, `flow` is the motion from picture to picture, `cuts` finds the beginnings of shots,
//! `align` finds by how much a depth is scaled and shifted against those before, `smooth` takes noise out of a single picture, `steady` averages over time, `ego` is the
//! motion of things at rest, and `plate` keeps the background. What is kept begins anew with every shot.
//! Limits: pictures of one size; everything follows the order of the film, so that no picture can be drawn without those of its shot before it.

mod around;
mod flow;
mod cuts;
mod align;
mod smooth;
mod steady;
mod ego;
mod plate;
mod survey;

use rayon::prelude::*;

use crate::{Error, Reference};
pub use align::Freedom;
pub use cuts::{Cuts, Thumb};
use flow::{Flow, Grey};
use plate::Plate;
use steady::Steady;
pub use survey::{Shot, Survey};

/// Widest copy of a picture in which motion is looked for, px: flow of a tenth of a pixel there is half a pixel of 1920.
const FLOW_WIDTH: usize = 480;

/// The options of a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmOptions {
    /// The change that depths may have from picture to picture.
    pub freedom: Freedom,
    /// Pictures over which the depth of things at rest is averaged; 0 leaves all depth as it is.
    pub steady: u32,
    /// The use of what other pictures show.
    pub hidden: Hidden,
}

/// The use of what other pictures of a shot show where this one hides it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hidden {
    /// It is left out.
    LeftOut,
    /// It is a reference of its own.
    Kept,
}

impl Default for FilmOptions {
    fn default() -> Self {
        Self {
            freedom: Freedom::ScaleAndOffset,
            // A second of film: noise is a fifth of itself or a sixth.
            steady: 32,
            hidden: Hidden::Kept,
        }
    }
}

/// Pictures one after another.
#[derive(Clone, Debug, Default)]
pub struct Film {
    options: FilmOptions,
    cuts: Cuts,
    /// The picture before, small.
    before: Grey,
    steady: Steady,
    plate: Plate,
}

/// A picture's place in its film.
#[derive(Clone, Debug)]
pub struct Added {
    /// True if it begins a shot.
    pub begins_shot: bool,
    /// The background that it hides and other pictures of its shot show, seen by the same camera; depth is unknown where there is nothing.
    pub hidden: Option<Reference>,
}

impl Film {
    /// A film without pictures.
    pub fn new(options: FilmOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }

    /// Adds the next picture and makes its depth steady. Without `begins_shot` the film finds cuts itself, from the pictures so far.
    ///
    /// # Errors
    /// A plane that does not have one entry per pixel of its camera.
    pub fn add(
        &mut self,
        picture: &mut Reference,
        begins_shot: Option<bool>,
    ) -> Result<Added, Error> {
        let (width, height) = (
            picture.camera.width as usize,
            picture.camera.height as usize,
        );
        if picture.colour.len() != width * height || picture.depth.len() != width * height {
            return Err(Error::Input(format!(
                "a picture of a film: {} colours and {} depths, expected {} (one per pixel of its camera)",
                picture.colour.len(),
                picture.depth.len(),
                width * height
            )));
        }
        // Of an infinite depth it is 0.
        let nearness = |&z: &f32| if z > 0.0 { 1.0 / z } else { f32::NAN };
        let mut nearness: Vec<f32> = picture.depth.par_iter().map(nearness).collect();
        let begins_shot = begins_shot.unwrap_or_else(|| {
            self.cuts
                .add(Thumb::new(&picture.colour, width, &nearness, width))
        });
        let encoded: Vec<f32> = picture.colour.par_iter().map(encoded_grey).collect();
        let step = width.div_ceil(FLOW_WIDTH).max(1);
        let small = Grey::reduced(&encoded, width, step);
        let is_other = small.width != self.before.width || small.height != self.before.height;
        if begins_shot || is_other {
            self.steady.clear();
            self.plate.clear();
            self.before = small.clone();
        }
        let flow = Flow::between(&small, &self.before);
        if self.options.steady > 0 {
            smooth::denoise(&mut nearness, width);
            let mut present = steady::Present {
                width,
                nearness: &mut nearness,
                grey: &encoded,
                flow: &flow,
                step,
            };
            self.steady.add(
                &mut present,
                self.options.freedom,
                self.options.steady as f32,
            );
            let z = |(z, &q): (&mut f32, &f32)| *z = 1.0 / q;
            picture.depth.par_iter_mut().zip(&nearness).for_each(z);
        }
        let hidden = match self.options.hidden {
            Hidden::LeftOut => None,
            Hidden::Kept => self.hidden(picture, &nearness, (&flow, step)),
        };
        self.before = small;
        Ok(Added {
            begins_shot,
            hidden,
        })
    }

    /// The reference of what a picture hides, if anything is known of it.
    fn hidden(
        &mut self,
        picture: &Reference,
        nearness: &[f32],
        (flow, step): (&Flow, usize),
    ) -> Option<Reference> {
        let shown = plate::Shown {
            width: picture.camera.width as usize,
            colour: &picture.colour,
            nearness,
            flow,
            step,
        };
        let background = self.plate.add(&shown)?;
        Some(Reference {
            camera: picture.camera,
            colour: background.colour,
            depth: background.depth,
        })
    }
}

/// Luminance under a square root, which is near enough to how the eye takes it.
fn encoded_grey([r, g, b]: &[f32; 3]) -> f32 {
    (0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0).sqrt()
}
