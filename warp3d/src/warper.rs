//! The driver: references prepared once, then one picture per camera.

use resample_core::{Camera, Image, Plane};

use crate::layer::Layer;
use crate::nearest::Nearest;
use crate::options::{ExtraPlanes, WarpOptions};
use crate::stats::{FrameStats, StageClock};
use crate::{Error, Reference};

/// Warps prepared references, frame after frame.
#[derive(Clone, Debug)]
pub struct Warper {
    references: Vec<Reference>,
    options: WarpOptions,
    nearest: Nearest,
}

/// A picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The picture: linear premultiplied colour, depth (camera z), and the planes that the options ask for.
    pub image: Image,
    /// Counts and times.
    pub stats: FrameStats,
}

impl Warper {
    /// Prepares `references` for warping with `options`.
    ///
    /// # Errors
    /// No reference, a plane that does not have one entry per pixel of its camera, or an option out of range.
    pub fn new(references: Vec<Reference>, options: &WarpOptions) -> Result<Self, Error> {
        options.validate()?;
        if references.is_empty() {
            return Err(Error::Option(
                "there is no reference view: give one picture with depth at least".into(),
            ));
        }
        references.iter().enumerate().try_for_each(|(index, reference)| check(index, reference))?;
        Ok(Self { references, options: options.clone(), nearest: Nearest::default() })
    }

    /// The references, as they were given.
    pub fn references(&self) -> &[Reference] {
        &self.references
    }

    /// The picture from `camera`.
    ///
    /// # Errors
    /// A camera that is none.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera.validated().map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let reference = &self.references[0];
        let layer = self.nearest.render(reference, &camera, self.options.visibility, &mut stats);
        let image = self.picture(layer, &camera, &mut stats);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    fn picture(&self, layer: Layer, camera: &Camera, stats: &mut FrameStats) -> Image {
        stats.seen = layer.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        let mut image = Image::transparent(camera.width as usize, camera.height as usize);
        if self.options.planes == ExtraPlanes::FilledAndConfidence {
            let filled = Plane { name: "filled".into(), values: vec![0.0; layer.rgba.len()] };
            image.planes = vec![filled, Plane { name: "confidence".into(), values: layer.resolution }];
        }
        image.rgba = layer.rgba;
        image.depth = Some(layer.depth);
        image
    }
}

fn check(index: usize, reference: &Reference) -> Result<(), Error> {
    reference.camera.validated().map_err(|e| Error::Option(format!("reference {index}: {e}")))?;
    let pixels = reference.camera.width as usize * reference.camera.height as usize;
    for (plane, found) in [("colour", reference.colour.len()), ("depth", reference.depth.len())] {
        if found != pixels {
            return Err(Error::Input(format!(
                "reference {index}: {found} entries of {plane}, expected {pixels} (one per pixel of its camera)"
            )));
        }
    }
    Ok(())
}
