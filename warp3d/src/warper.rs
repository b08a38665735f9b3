//! The driver: references prepared once, then one picture per camera.

use resample_core::{Camera, Image, Plane};

use crate::blend::blend;
use crate::fill::fill;
use crate::hybrid::{Hybrid, Prepared};
use crate::layer::Layer;
use crate::mesh::Mesh;
use crate::nearest::Nearest;
use crate::options::{ExtraPlanes, Fill, Method, SurfaceTolerance, WarpOptions};
use crate::patch::MAX_CELLS;
use crate::stats::{FrameStats, StageClock};
use crate::{Error, Reference, splat};

/// Warps prepared references, frame after frame.
#[derive(Clone, Debug)]
pub struct Warper {
    references: Vec<Reference>,
    options: WarpOptions,
    pipeline: Pipeline,
}

/// What each method keeps: per reference, and from frame to frame.
#[derive(Clone, Debug)]
enum Pipeline {
    Nearest(Nearest),
    Hybrid(Vec<Prepared>, Box<Hybrid>),
    Splats(Vec<Prepared>),
    Mesh(Vec<(Prepared, Mesh)>),
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
        let tolerances = vec![options.tolerance; references.len()];
        Self::with_tolerances(references, &tolerances, options)
    }

    /// As [`Warper::new`], with a tolerance of surfaces for each reference.
    pub(crate) fn with_tolerances(
        references: Vec<Reference>,
        tolerances: &[SurfaceTolerance],
        options: &WarpOptions,
    ) -> Result<Self, Error> {
        options.validate()?;
        if references.is_empty() {
            return Err(Error::Option(
                "there is no reference view: give one picture with depth at least".into(),
            ));
        }
        references
            .iter()
            .enumerate()
            .try_for_each(|(index, reference)| check(index, reference))?;
        let pipeline = Pipeline::new(&references, tolerances, options)?;
        Ok(Self {
            references,
            options: options.clone(),
            pipeline,
        })
    }

    /// Warps with `options` from now on, if what was prepared serves them too: true. False, and nothing changes, where
    /// they ask for another preparation, that is, for another warper.
    ///
    /// # Errors
    /// An option that is outside its range.
    pub fn adopt(&mut self, options: &WarpOptions) -> Result<bool, Error> {
        options.validate()?;
        // Only what is read anew for each frame may differ.
        let own = self.options.clone();
        let alike = WarpOptions {
            visibility: own.visibility,
            fill: own.fill,
            footprint: own.footprint,
            subpixels: own.subpixels,
            blend: own.blend,
            planes: own.planes,
            ..options.clone()
        };
        if alike != own {
            return Ok(false);
        }
        self.options = options.clone();
        Ok(true)
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
        let camera = camera
            .validated()
            .map_err(|e| Error::Option(e.to_string()))?;
        let mut stats = FrameStats::default();
        let whole = StageClock::start();
        let layer = self.layer(&camera, &mut stats);
        let image = finished(layer, &camera, &self.options, &mut stats);
        let whole = whole.stop();
        (stats.wall_ms, stats.cpu_ms) = (whole.wall_ms, whole.cpu_ms);
        Ok(Frame { image, stats })
    }

    /// What `camera`, a valid one, sees before holes are filled.
    pub(crate) fn layer(&mut self, camera: &Camera, stats: &mut FrameStats) -> Layer {
        let layers = (0..self.references.len()).map(|i| {
            self.pipeline
                .layer(i, &self.references[i], camera, &self.options, stats)
        });
        let layers: Vec<Layer> = layers.collect();
        let clock = StageClock::start();
        let pixels = camera.width as usize * camera.height as usize;
        let layer = blend(layers, &self.references, camera, self.options.blend);
        stats.stages.blend.add(clock.stop());
        layer.unwrap_or_else(|| Layer::empty(pixels))
    }
}

/// The picture of a whole layer, its holes filled.
pub(crate) fn finished(
    mut layer: Layer,
    camera: &Camera,
    options: &WarpOptions,
    stats: &mut FrameStats,
) -> Image {
    stats.seen = layer.rgba.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
    let clock = StageClock::start();
    let confidence = layer
        .resolution
        .iter()
        .zip(&layer.rgba)
        .map(|(r, p)| r * p[3])
        .collect();
    let filled = fill(&mut layer, camera.width as usize, options.fill);
    if options.fill != Fill::None {
        stats.filled = filled.iter().filter(|&&f| f > 0.5).count() as u64;
    }
    stats.stages.fill = clock.stop();
    let mut image = Image::transparent(camera.width as usize, camera.height as usize);
    if options.planes == ExtraPlanes::FilledAndConfidence {
        let filled = Plane {
            name: "filled".into(),
            values: filled,
        };
        image.planes = vec![
            filled,
            Plane {
                name: "confidence".into(),
                values: confidence,
            },
        ];
    }
    image.rgba = layer.rgba;
    image.depth = Some(layer.depth);
    image
}

impl Pipeline {
    fn new(
        references: &[Reference],
        tolerances: &[SurfaceTolerance],
        options: &WarpOptions,
    ) -> Result<Self, Error> {
        let prepared = || {
            references
                .iter()
                .zip(tolerances)
                .map(|(reference, &tolerance)| {
                    Prepared::new(
                        reference,
                        &WarpOptions {
                            tolerance,
                            ..options.clone()
                        },
                    )
                })
        };
        Ok(match options.method {
            Method::Nearest => Self::Nearest(Nearest::default()),
            Method::Hybrid => Self::Hybrid(prepared().collect(), Box::default()),
            Method::Points | Method::Splats | Method::Ewa => Self::Splats(prepared().collect()),
            Method::Mesh => {
                let meshes = prepared().map(|p| Mesh::new(&p.surfaces).map(|mesh| (p, mesh)));
                Self::Mesh(meshes.collect::<Result<_, _>>()?)
            }
        })
    }

    fn layer(
        &mut self,
        index: usize,
        reference: &Reference,
        camera: &Camera,
        options: &WarpOptions,
        stats: &mut FrameStats,
    ) -> Layer {
        match self {
            Self::Nearest(nearest) => nearest.render(reference, camera, options.visibility, stats),
            Self::Hybrid(prepared, hybrid) => {
                hybrid.render((reference, &prepared[index]), camera, options, stats)
            }
            Self::Splats(prepared) => {
                splat::render((reference, &prepared[index]), camera, options, stats)
            }
            Self::Mesh(meshes) => {
                let (prepared, mesh) = &meshes[index];
                mesh.render((reference, prepared), camera, stats)
            }
        }
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
