//! A reference made ready to be drawn: its surfaces, its colours and its cells.

use rayon::prelude::*;
use resample_core::Camera;

use crate::Reference;
use crate::options::SurfaceTolerance;
use crate::project::{Quarters, Segments};
use crate::surfaces::colours::{Colours, solve};
use crate::surfaces::input_copy::{TakenColours, TakenDepths};
use crate::surfaces::rims::{Rims, clean};
use crate::surfaces::sharpen_edges::{Edges, sharpened_in_bands};
use crate::surfaces::surface::Surfaces;

/// A reference made ready for the hybrid. The colours and depths that were given follow from it, bit by bit.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    /// Its camera.
    pub(crate) camera: Camera,
    /// Its surfaces.
    pub(crate) surfaces: Surfaces,
    /// Its colours.
    pub(crate) colours: Colours,
    depths: TakenDepths,
    /// Its cells, as they are drawn.
    pub(crate) segments: Segments,
    /// Number of samples with a depth.
    pub(crate) known: u64,
}

impl Prepared {
    /// Finds surfaces and edges of `reference`, whose depth is made sharp as its `edges` ask for it. Each buffer of a number a sample is let
    /// go as soon as it can be.
    pub(crate) fn new(reference: Reference, tolerance: SurfaceTolerance, edges: Edges) -> Self {
        let Reference {
            camera,
            colour,
            depth,
        } = reference;
        let width = camera.width as usize;
        let sharp = match edges {
            Edges::Sharp => depth.clone(),
            edges => sharpened_in_bands(camera.projection, (&depth, &colour), width, edges),
        };
        let mut surfaces = Surfaces::new(&camera, sharp, tolerance);
        let depths = TakenDepths::new(camera.projection, &depth, &mut surfaces);
        drop(depth);
        let (taken, mut samples) = TakenColours::new(colour);
        samples.par_iter_mut().for_each(|rgb| {
            // A NaN or an infinity times a weight of 0 is NaN, which would spread.
            *rgb = rgb.map(|v| if v.is_finite() { v } else { 0.0 });
        });
        let cuts = Rims::unmixed(&surfaces, &mut samples);
        if edges != Edges::Sharp {
            clean(&surfaces, &mut samples);
        }
        let reach = |s: &Surfaces, index, axis, towards| cuts.to_edge(s, index, axis, towards);
        surfaces.keep_slopes(reach);
        let segments = Segments::new(&surfaces, Quarters::new(&surfaces, &cuts));
        drop(cuts);
        // The segments hold what frames ask of the cells.
        surfaces.cells = Vec::new();
        let mut colours = Colours::new(samples, taken, &mut surfaces);
        solve(colours.coefficients.samples_mut(), &surfaces);
        let known = surfaces.disparity.iter().filter(|d| !d.is_nan()).count() as u64;
        Self {
            camera,
            surfaces,
            colours,
            depths,
            segments,
            known,
        }
    }

    /// Camera z of a sample, as it was given.
    #[inline(always)]
    pub(crate) fn depth(&self, sample: usize) -> f32 {
        self.depths.get(&self.surfaces, sample)
    }

    /// The reference, as it was given.
    pub(crate) fn reference(&self) -> Reference {
        let samples = 0..self.surfaces.disparity.len();
        let colour = |sample| self.colours.taken.get(sample);
        Reference {
            camera: self.camera,
            colour: samples.clone().into_par_iter().map(colour).collect(),
            depth: samples
                .into_par_iter()
                .map(|sample| self.depth(sample))
                .collect(),
        }
    }
}
