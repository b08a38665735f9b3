//! A reference made ready to be drawn: its surfaces, its colours and its cells.

use rayon::prelude::*;

use crate::Reference;
use crate::colour::Colours;
use crate::options::{MixedPixels, SurfaceOptions};
use crate::ramps::{Edges, sharpened};
use crate::raster::{Quarters, Segments};
use crate::rims::Rims;
use crate::spline::solve;
use crate::surface::Surfaces;

/// A reference made ready for the hybrid.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    /// Its surfaces.
    pub(crate) surfaces: Surfaces,
    /// Its colours.
    pub(crate) colours: Colours,
    /// Its cells, as they are drawn.
    pub(crate) segments: Segments,
    /// Number of samples with a depth.
    pub(crate) known: u64,
}

impl Prepared {
    /// Finds surfaces and edges of `reference`, whose depth is made sharp where it is soft.
    pub(crate) fn new(reference: &Reference, options: &SurfaceOptions) -> Self {
        let Reference { camera, depth, .. } = reference;
        let width = camera.width as usize;
        match Edges::of(camera.projection, depth, width) {
            Edges::Sharp => Self::of_sharp(reference, depth, options),
            edges => {
                let depth = sharpened(camera.projection, depth, width, edges);
                Self::of_sharp(reference, &depth, options)
            }
        }
    }

    /// As [`Prepared::new`], with the depth that is given.
    pub(crate) fn of_sharp(reference: &Reference, depth: &[f32], options: &SurfaceOptions) -> Self {
        let mut surfaces = Surfaces::new(&reference.camera, depth, options.tolerance);
        let mut samples: Vec<_> = reference
            .colour
            .par_iter()
            .map(|&rgb| {
                // What is no number would spread, even with no weight.
                rgb.map(|v| if v.is_finite() { v } else { 0.0 })
            })
            .collect();
        let cuts = match options.mixed {
            MixedPixels::Keep => Rims::half_way(&surfaces),
            MixedPixels::Unmix => Rims::unmixed(&surfaces, &mut samples),
        };
        let reach = |s: &Surfaces, index, axis, towards| cuts.to_edge(s, index, axis, towards);
        surfaces.keep_slopes(reach);
        let segments = Segments::new(&surfaces, Quarters::new(&surfaces, &cuts));
        let mut colours = Colours::new(samples, &reference.colour, &mut surfaces);
        solve(colours.coefficients.samples_mut(), &surfaces);
        // The segments hold what frames ask of the cells.
        surfaces.cells = Vec::new();
        let known = surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
        Self {
            surfaces,
            colours,
            segments,
            known,
        }
    }
}
