//! The references of a warp in memory, or in a file where they do not fit, and their warper: the same for whoever draws.

use anyhow::{Result, bail};
use resample_core::Camera;
use warp3d::{Frame, LargeReference, LargeWarper, Reference, WarpOptions, Warper};

use crate::cameras::multiview;

/// Where references are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keeping {
    /// In memory.
    Memory,
    /// In a temporary file; so many bytes of memory to work in.
    File(u64),
}

/// References that were read.
pub(crate) enum References {
    /// In memory.
    Held(Vec<Reference>),
    /// In a temporary file, with the memory to work in, bytes.
    Filed(Vec<LargeReference>, u64),
}

/// What warps them.
pub(crate) enum AnyWarper {
    /// In memory.
    Held(Box<Warper>),
    /// In a temporary file.
    Filed(Box<LargeWarper>),
}

impl References {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Held(references) => references.len(),
            Self::Filed(references, _) => references.len(),
        }
    }

    /// Samples with a depth.
    pub(crate) fn known(&self) -> u64 {
        let known = |r: &Reference| r.depth.iter().filter(|z| !z.is_nan()).count() as u64;
        match self {
            Self::Held(references) => references.iter().map(known).sum(),
            Self::Filed(references, _) => references.iter().map(LargeReference::known).sum(),
        }
    }

    /// Camera z of the sample that is nearest to the camera that saw it, world units.
    pub(crate) fn nearest(&self) -> f64 {
        let nearest = match self {
            Self::Held(references) => references
                .iter()
                .map(Reference::nearest)
                .fold(f32::INFINITY, f32::min),
            Self::Filed(references, _) => references
                .iter()
                .map(LargeReference::nearest)
                .fold(f32::INFINITY, f32::min),
        };
        f64::from(nearest)
    }

    /// The cameras.
    pub(crate) fn cameras_mut(&mut self) -> Vec<&mut Camera> {
        match self {
            Self::Held(references) => references.iter_mut().map(|r| &mut r.camera).collect(),
            Self::Filed(references, _) => references.iter_mut().map(|r| &mut r.camera).collect(),
        }
    }

    /// The median depth, camera z, at which `camera` sees the samples of the first.
    pub(crate) fn median_depth(&self, camera: &Camera) -> Result<Option<f64>> {
        match self {
            Self::Held(references) => {
                let Some(first) = references.first() else {
                    return Ok(None);
                };
                let step = multiview::median_step(&first.camera);
                let samples = first.depth.iter().copied().enumerate().step_by(step);
                Ok(multiview::median_depth(&first.camera, samples, camera))
            }
            Self::Filed(references, _) => {
                let Some(first) = references.first() else {
                    return Ok(None);
                };
                let samples = first.depths(multiview::median_step(&first.camera))?;
                Ok(multiview::median_depth(
                    &first.camera,
                    samples.into_iter(),
                    camera,
                ))
            }
        }
    }
}

impl AnyWarper {
    /// Makes references ready.
    pub(crate) fn new(references: References, options: &WarpOptions) -> Result<Self> {
        Ok(match references {
            References::Held(references) => Self::Held(Box::new(Warper::new(references, options)?)),
            References::Filed(references, max_memory) => {
                Self::Filed(Box::new(LargeWarper::new(references, options, max_memory)?))
            }
        })
    }

    /// The picture from `camera`.
    pub(crate) fn render(&mut self, camera: &Camera) -> Result<Frame> {
        Ok(match self {
            Self::Held(warper) => warper.render(camera)?,
            Self::Filed(warper) => warper.render(camera)?,
        })
    }

    /// Warps with these options from now on. References in a file are warped with those that they came with.
    pub(crate) fn change(&mut self, options: &WarpOptions) -> Result<()> {
        match self {
            Self::Held(warper) => {
                if !warper.adopt(options)? {
                    **warper = Warper::new(warper.references(), options)?;
                }
            }
            Self::Filed(warper) if warper.options() == options => {}
            Self::Filed(_) => {
                bail!("references in a file are warped with one setting: allow more --max-memory")
            }
        }
        Ok(())
    }
}
