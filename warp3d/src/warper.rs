//! The driver: references prepared once, then one picture per camera.

use rayon::prelude::*;
use resample_core::clock::StageClock;
use resample_core::{Camera, Image, Plane, Reuse};

use crate::fill::blend::blend;
use crate::fill::extrapolate::View;
use crate::fill::holes::fill;
use crate::fill::lay_under;
use crate::hybrid::{How, Hybrid};
use crate::options::{ExtraPlanes, Fill, Method, WarpOptions};
use crate::paper::nearest::Nearest;
use crate::paper::splat;
use crate::paper::splat::Shape;
use crate::project::prepared::Prepared;
use crate::stats::FrameStats;
use crate::surfaces::sharpen_edges::Edges;
use crate::surfaces::surface::MAX_CELLS;
use crate::view::layer::{Layer, Purpose};
use crate::view::reference::{counted_in, length_of, scaled};
use crate::{Error, Reference, resolve, rows};

/// The plane that says how well each pixel is seen.
const CONFIDENCE: &str = "confidence";

/// Pixels of one task of a pass over the whole picture.
const PASS: usize = 1 << 14;

/// Warps prepared references, frame after frame.
#[derive(Clone, Debug)]
pub struct Warper {
    /// The cameras of the references.
    cameras: Vec<Camera>,
    /// The length in which references are drawn, world units.
    length: f64,
    options: WarpOptions,
    pipeline: Pipeline,
    last: Last,
}

/// The last reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Last {
    /// A view as all others.
    View,
    /// It shows what the others hide: it lies under their picture.
    Hidden,
}

/// The methods' memory: per reference, counted in the warper's length, and from frame to frame. The parts of other methods
/// stay empty.
#[derive(Clone, Debug, Default)]
struct Pipeline {
    references: Vec<Reference>,
    prepared: Vec<Prepared>,
    rows: Vec<rows::Prepared>,
    nearest: Nearest,
    hybrid: Box<Hybrid>,
    /// Buffers of an earlier picture.
    spare: Layer,
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
        Self::prepared(references, Last::View, options)
    }

    /// As [`Warper::new`], with one more reference that shows what the others hide, such as [`crate::film::Film`] gives it: it is seen where
    /// they leave the picture open, whatever its depth.
    ///
    /// # Errors
    /// Those of [`Warper::new`].
    pub fn with_hidden(
        mut references: Vec<Reference>,
        hidden: Option<Reference>,
        options: &WarpOptions,
    ) -> Result<Self, Error> {
        let last = match &hidden {
            Some(_) => Last::Hidden,
            None => Last::View,
        };
        references.extend(hidden);
        Self::prepared(references, last, options)
    }

    fn prepared(
        references: Vec<Reference>,
        last: Last,
        options: &WarpOptions,
    ) -> Result<Self, Error> {
        options.validate()?;
        if references.is_empty() {
            return Err(Error::Option(
                "at least one reference image with depth is required".into(),
            ));
        }
        let mut numbered = references.iter().enumerate();
        numbered.try_for_each(|(index, reference)| check(index, reference))?;
        let cameras = references.iter().map(|r| r.camera).collect();
        let length = length_of(&references);
        let counted = |reference| match length {
            1.0 => reference,
            length => counted_in(reference, length),
        };
        let drawn = references.into_iter().map(counted).collect();
        Ok(Self {
            cameras,
            length,
            pipeline: Pipeline::new(drawn, last, options),
            options: options.clone(),
            last,
        })
    }

    /// Warps with `options` from now on, if the preparation serves them; else nothing changes, and a new warper is needed.
    ///
    /// # Errors
    /// An option that is outside its range.
    pub fn update(&mut self, options: &WarpOptions) -> Result<Reuse, Error> {
        options.validate()?;
        // The preparation depends on the method and on its surfaces; every other option is read anew for each frame.
        let own = &self.options;
        if !own.method.prepares_as(&options.method) || own.simd != options.simd {
            return Ok(Reuse::NeedsRenderer);
        }
        self.options = options.clone();
        Ok(Reuse::Kept)
    }

    /// The references as they were given. The warper keeps them in another form, so that each call makes them anew.
    pub fn references(&self) -> Vec<Reference> {
        let references = self.pipeline.references.iter().cloned();
        let prepared = self.pipeline.prepared.iter().map(Prepared::reference);
        let rows = self.pipeline.rows.iter().map(|row| row.reference.clone());
        let mut references: Vec<Reference> = references.chain(prepared).chain(rows).collect();
        for (reference, camera) in references.iter_mut().zip(&self.cameras) {
            reference.camera = *camera;
            if self.length != 1.0 {
                scaled(&mut reference.depth, self.length);
            }
        }
        references
    }

    /// The picture from `camera`.
    ///
    /// # Errors
    /// The camera is invalid.
    pub fn render(&mut self, camera: &Camera) -> Result<Frame, Error> {
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let alone = self.cameras.len() == 1 && self.options.fill == Fill::None;
        let purpose = if alone {
            Purpose::Picture
        } else {
            Purpose::Part
        };
        let mut layer = self.layer(&camera, purpose, &mut stats)?;
        let view = View {
            camera: &camera,
            references: self.cameras.clone(),
            level: self.options.simd.resolve(),
        };
        let image = finished(&mut layer, &view, &self.options, &mut stats);
        self.pipeline.spare = layer;
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    /// The view of `camera`, a valid one, before holes are filled.
    fn layer(
        &mut self,
        camera: &Camera,
        purpose: Purpose,
        stats: &mut FrameStats,
    ) -> Result<Layer, Error> {
        let in_unit = |camera: &Camera| match self.length {
            1.0 => *camera,
            length => camera.in_unit(length),
        };
        let camera = in_unit(camera);
        let references: Vec<Camera> = self.cameras.iter().map(in_unit).collect();
        let how = (&self.options, purpose);
        let layers = (0..references.len()).map(|i| self.pipeline.layer(i, &camera, how, stats));
        let mut layers = layers.collect::<Result<Vec<Layer>, Error>>()?;
        let clock = StageClock::start();
        let pixels = camera.width as usize * camera.height as usize;
        let hidden = match self.last {
            Last::Hidden => layers.pop(),
            Last::View => None,
        };
        let layer = blend(layers, &references, &camera);
        let mut layer = layer.unwrap_or_else(|| Layer::empty(pixels));
        if let Some(hidden) = &hidden {
            lay_under(&mut layer, hidden);
        }
        if self.length != 1.0 {
            scaled(&mut layer.depth, self.length);
        }
        stats.stages.blend += clock.stop();
        Ok(layer)
    }
}

/// The picture of a whole layer, its holes filled.
fn finished(
    layer: &mut Layer,
    view: &View<'_>,
    options: &WarpOptions,
    stats: &mut FrameStats,
) -> Image {
    let camera = view.camera;
    let planes = options.planes == ExtraPlanes::FilledAndConfidence;
    stats.seen = match layer.seen {
        Some(seen) => seen,
        None => seen(layer, planes),
    };
    let clock = StageClock::start();
    let filled = fill(layer, view, options.fill);
    if options.fill != Fill::None {
        stats.filled = filled.iter().filter(|&&f| f > 0.5).count() as u64;
    }
    stats.stages.fill = clock.stop();
    let mut image = Image::transparent(0, 0);
    (image.width, image.height) = (camera.width as usize, camera.height as usize);
    if planes {
        let plane = |name: &str, values| Plane {
            name: name.into(),
            values,
        };
        let confidence = std::mem::take(&mut layer.resolution);
        image.planes = vec![plane("filled", filled), plane(CONFIDENCE, confidence)];
    }
    image.rgba = std::mem::take(&mut layer.rgba);
    image.depth = Some(std::mem::take(&mut layer.depth));
    image
}

/// Number of pixels in which something is seen; with `confidence`, how well each is resolved becomes how well it is seen.
fn seen(layer: &mut Layer, confidence: bool) -> u64 {
    let rows = layer.resolution.par_chunks_mut(PASS);
    let seen = rows
        .zip(layer.rgba.par_chunks(PASS))
        .map(|(resolution, rgba)| {
            let mut count = 0;
            for (resolution, pixel) in resolution.iter_mut().zip(rgba) {
                count += u32::from(pixel[3] > 0.0);
                if confidence {
                    *resolution *= pixel[3];
                }
            }
            u64::from(count)
        });
    seen.sum()
}

impl Pipeline {
    /// Prepares `references`, the last one for its use.
    fn new(references: Vec<Reference>, last: Last, options: &WarpOptions) -> Self {
        let Some(tolerance) = options.method.tolerance() else {
            return Self {
                references,
                ..Self::default()
            };
        };
        let count = references.len();
        let (mut prepared, mut rows) = (Vec::new(), Vec::new());
        for (index, reference) in references.into_iter().enumerate() {
            let camera = &reference.camera;
            let edges = match last {
                // The background of a film has no samples beside edges.
                Last::Hidden if index + 1 == count => Edges::Sharp,
                _ => Edges::of(camera.projection, &reference.depth, camera.width as usize),
            };
            match options.method {
                Method::Rows { .. } => rows.push(rows::Prepared::new(reference, tolerance, edges)),
                _ => prepared.push(Prepared::new(reference, tolerance, edges)),
            }
        }
        Self {
            prepared,
            rows,
            ..Self::default()
        }
    }

    fn layer(
        &mut self,
        index: usize,
        camera: &Camera,
        (options, purpose): (&WarpOptions, Purpose),
        stats: &mut FrameStats,
    ) -> Result<Layer, Error> {
        Ok(match options.method {
            Method::Nearest { visibility } => {
                let to = std::mem::take(&mut self.spare);
                let how = (visibility, options.simd.resolve());
                let reference = &self.references[index];
                self.nearest.render(reference, camera, how, to, stats)
            }
            Method::Rows { .. } => {
                let to = std::mem::take(&mut self.spare);
                self.rows[index].render(camera, to, stats)?
            }
            Method::Hybrid { subpixels, .. } => {
                let how = How {
                    subpixels: subpixels as usize,
                    level: options.simd.resolve(),
                    purpose,
                };
                let prepared = &self.prepared[index];
                let to = std::mem::take(&mut self.spare);
                resolve::render(&mut self.hybrid, prepared, camera, how, to, stats)
            }
            Method::Points { .. } => {
                splat::render(&self.prepared[index], camera, Shape::Point, stats)
            }
            Method::Splats { .. } => {
                splat::render(&self.prepared[index], camera, Shape::Disc, stats)
            }
        })
    }
}

fn check(index: usize, reference: &Reference) -> Result<(), Error> {
    reference
        .camera
        .validated()
        .map_err(|e| Error::Option(format!("reference {index}: {e}")))?;
    let pixels = reference.camera.width as usize * reference.camera.height as usize;
    for (plane, found) in [
        ("colour", reference.colour.len()),
        ("depth", reference.depth.len()),
    ] {
        if found != pixels {
            return Err(Error::Input(format!(
                "reference {index}: {found} entries of {plane}, expected {pixels} (one per pixel of its camera)"
            )));
        }
    }
    let cells = (reference.camera.width as usize + 1) * (reference.camera.height as usize + 1);
    if cells > MAX_CELLS {
        return Err(Error::Input(format!(
            "reference {index}: {pixels} pixels have {cells} cells between them, more than the {MAX_CELLS} that pieces \
             of surfaces can be numbered for; use a smaller picture"
        )));
    }
    Ok(())
}
