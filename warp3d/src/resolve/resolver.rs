//! The input for resolving a picture: the visible pieces, the reference and the map to the screen.

use glam::DVec3;
use resample_core::simd::Vectors;
use resample_core::{Camera, Projection};

use super::home::Home;
use super::window::WindowWeights;
use crate::hybrid::{How, Hybrid};
use crate::prepared::Prepared;
use crate::resolve::colour::Lookup;
use crate::surfaces::patch::Patch;
use crate::view::layer::Purpose;
use crate::view::warp::Warp;

/// A row of the picture.
pub(super) struct Row<'a> {
    pub(super) rgba: &'a mut [[f32; 4]],
    pub(super) depth: &'a mut [f32],
    pub(super) resolution: &'a mut [f32],
    /// Empty where nobody asks for it.
    pub(super) purity: &'a mut [f32],
}

impl Row<'_> {
    /// Nothing is seen.
    pub(super) fn clear(&mut self) {
        self.rgba.fill([0.0; 4]);
        self.depth.fill(f32::INFINITY);
        self.resolution.fill(0.0);
        self.purity.fill(1.0);
    }

    /// Returns true if purity is asked for.
    #[inline(always)]
    pub(super) fn asks_for_purity(&self) -> bool {
        !self.purity.is_empty()
    }

    /// Weights resolution by coverage.
    #[inline(always)]
    pub(super) fn weigh(&mut self) {
        for (resolution, pixel) in self.resolution.iter_mut().zip(self.rgba.iter()) {
            *resolution *= pixel[3];
        }
    }

    /// Number of pixels in which something is seen.
    #[inline(always)]
    pub(super) fn seen(&self) -> u64 {
        let mut count = 0;
        for pixel in self.rgba.iter() {
            count += u64::from(pixel[3] > 0.0);
        }
        count
    }
}

/// Resolves one picture.
pub(crate) struct Resolver<'a> {
    pub(super) hybrid: &'a Hybrid,
    pub(super) prepared: &'a Prepared,
    pub(super) warp: &'a Warp,
    /// The terms of x, y, 1 and disparity in the homogeneous screen position.
    pub(super) columns: [DVec3; 4],
    pub(super) size: [usize; 2],
    pub(super) level: Vectors,
    pub(super) weights: WindowWeights,
    /// True if surfaces end before infinity.
    pub(super) has_front: bool,
    /// The purpose of the picture.
    pub(super) purpose: Purpose,
    /// Where the reference's own pixels are, if the target is its camera.
    pub(super) home: Option<Home>,
}

impl<'a> Resolver<'a> {
    /// Everything that the pixels need.
    pub(crate) fn new(
        hybrid: &'a Hybrid,
        prepared: &'a Prepared,
        warp: &'a Warp,
        target: &Camera,
        how: How,
    ) -> Self {
        let [x, y, one] = warp.pixel_columns();
        Self {
            hybrid,
            prepared,
            warp,
            columns: [x, y, one, warp.disparity_column()],
            size: [target.width as usize, target.height as usize],
            level: how.level,
            weights: WindowWeights::new(how.subpixels),
            has_front: target.projection == Projection::Perspective,
            purpose: how.purpose,
            home: Home::new(&prepared.camera, prepared.surfaces.largest, warp),
        }
    }

    /// A lookup on the plane of `patch`.
    #[inline(always)]
    pub(super) fn lookup(&self, patch: &Patch) -> Lookup<'_> {
        Lookup {
            colours: &self.prepared.colours,
            surfaces: &self.prepared.surfaces,
            patch: *patch,
        }
    }
}
