//! The storage of a task: the pixels of a tile as they are composited, and lists that are reused from tile to tile.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, f32x16, mask32x8};
use resample_core::SurfaceTile;
use resample_core::composite::{DepthRule, TilePixels};
use resample_core::maps::TilePlane;
use resample_core::narrow::single;
use resample_core::tile::{TILE_AREA, TILE_PX};

use crate::field::settings::{FieldSettings, PlacedBrick, RayValues, at_start};
use crate::field::walk::lists::{PackedSamples, SegmentList};
use crate::slabs::settings::SheetSettings;
use crate::slabs::view::{HalfRow, LANES, PlaneView, TileView};
use crate::stats::SampleCounts;

/// How far f32 may move a sample, voxels: positions count from the middle of the volume, and 2048 voxels away f32
/// counts in steps of 1.2e-4.
pub(crate) const POSITION_ERROR: f32 = 2e-4;

/// Planes whose views are remembered in a tile; neighbouring bricks share planes. A power of two; a brick of unit
/// cells spans at most 2 * 8 * sqrt(3) planes half a voxel apart.
pub(crate) const REMEMBERED_PLANES: usize = 64;

/// The pixels of a tile, composited front to back.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Pixels {
    /// Colour so far, premultiplied; interleaved, as one sample at a time is added.
    pub(crate) rgb: [[[f32; 4]; TILE_PX]; TILE_PX],
    pub(crate) transmittance: TilePlane,
    /// Sum of camera z by weight.
    pub(crate) depth: TilePlane,
}

impl Default for Pixels {
    fn default() -> Self {
        Self {
            rgb: [[[0.0; 4]; TILE_PX]; TILE_PX],
            transmittance: [[1.0; TILE_PX]; TILE_PX],
            depth: [[0.0; TILE_PX]; TILE_PX],
        }
    }
}

/// Half a row of samples, by their weights.
pub(crate) struct WeightedRow<S: Simd> {
    pub(crate) weight: f32x8<S>,
    /// Camera z, finite; only where depth is wanted.
    pub(crate) camera_z: Option<f32x8<S>>,
    /// Factors of the colour, and white to add, of each sample.
    pub(crate) body: f32x8<S>,
    pub(crate) highlight: f32x8<S>,
    pub(crate) rgb: [f32; 3],
}

impl Pixels {
    /// Composites a sample behind those before it: `colour` is its colour by its weight. Returns false where the pixel is opaque,
    /// so that it takes no more samples: one by one, so that the picture does not depend on which other bricks the tile saw before.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        simd: S,
        pixel: usize,
        (opacity, least_transmittance): (f32, f32),
        camera_z: Option<f32>,
        colour: impl FnOnce(f32) -> f32x4<S>,
    ) -> bool {
        let pixel = pixel % TILE_AREA;
        let transmittance = &mut self.transmittance.as_flattened_mut()[pixel];
        let before = *transmittance;
        if !(before >= least_transmittance) {
            return false;
        }
        let weight = before * opacity;
        *transmittance = before - weight;
        let sum = &mut self.rgb.as_flattened_mut()[pixel];
        (f32x4::from_slice(simd, sum) + colour(weight)).store_slice(sum);
        if let Some(z) = camera_z {
            let depth = &mut self.depth.as_flattened_mut()[pixel];
            let four = |v: f32| f32x4::splat(simd, v);
            *depth = four(weight).mul_add(four(z), four(*depth)).to_array()[0];
        }
        true
    }

    /// Composites half a row of samples behind those before them.
    #[inline(always)]
    pub(crate) fn add_row<S: Simd>(&mut self, simd: S, at: HalfRow, samples: &WeightedRow<S>) {
        let range = at.first..at.first + LANES;
        let transmittance = &mut self.transmittance[at.row][range.clone()];
        (f32x8::from_slice(simd, transmittance) - samples.weight).store_slice(transmittance);
        if let Some(z) = samples.camera_z {
            let depth = &mut self.depth[at.row][range.clone()];
            let before = f32x8::from_slice(simd, depth);
            samples.weight.mul_add(z, before).store_slice(depth);
        }
        let bodies = samples.body.to_array();
        let highlights = samples.highlight.to_array();
        for (lane, sum) in self.rgb[at.row][range].iter_mut().enumerate() {
            for (sum, value) in sum.iter_mut().zip(samples.rgb) {
                *sum += bodies[lane] * value + highlights[lane];
            }
        }
    }

    /// Composites a surface behind the samples so far; its depths are camera z minus the anchor's.
    pub(crate) fn add_layer(&mut self, settings: &SheetSettings, layer: &SurfaceTile) {
        let with_depth = settings.depth == DepthRule::Expected;
        let anchor_z = single(settings.anchor.camera_z);
        for y in 0..TILE_PX {
            for x in 0..TILE_PX {
                let rgba = layer.rgba[y][x];
                let alpha = rgba[3];
                if alpha <= 0.0 {
                    continue;
                }
                let before = self.transmittance[y][x];
                self.transmittance[y][x] = before * (1.0 - alpha).max(0.0);
                for (sum, value) in self.rgb[y][x].iter_mut().zip(rgba).take(3) {
                    *sum += before * value;
                }
                if with_depth {
                    self.depth[y][x] += before * alpha * (layer.depth[y][x] + anchor_z);
                }
            }
        }
    }

    /// Returns true if all pixels have less than this transmittance left.
    #[inline(always)]
    pub(crate) fn is_opaque<S: Simd>(&self, simd: S, least_transmittance: f32) -> bool {
        let least = f32x16::splat(simd, least_transmittance);
        let is_open =
            |row: &[f32; TILE_PX]| f32x16::from_slice(simd, row).simd_ge(least).any_true();
        !self.transmittance.iter().any(is_open)
    }

    fn of_planes(planes: &TilePixels) -> Self {
        let mut pixels = Self {
            transmittance: planes.transmittance,
            depth: planes.depth,
            ..Self::default()
        };
        for (y, row) in pixels.rgb.iter_mut().enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                for (value, plane) in pixel.iter_mut().zip(&planes.rgb) {
                    *value = plane[y][x];
                }
            }
        }
        pixels
    }

    /// The pixels as planes.
    pub(crate) fn planes(&self) -> TilePixels {
        let mut planes = TilePixels {
            transmittance: self.transmittance,
            depth: self.depth,
            ..TilePixels::default()
        };
        for (y, row) in self.rgb.iter().enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                for (plane, value) in planes.rgb.iter_mut().zip(pixel) {
                    plane[y][x] = *value;
                }
            }
        }
        planes
    }
}

/// Storage of one task, reused from tile to tile.
#[derive(Clone, Debug)]
pub(crate) struct FieldScratch {
    pub(crate) planes: RememberedPlanes,
    pub(crate) pixels: Pixels,
    /// Values of rays so far, by channel; only where a statistic is shown.
    pub(crate) rays: Vec<RayValues>,
    /// Camera z, relative to the anchor's, of the last surface that was hit.
    pub(crate) last_hit: TilePlane,
    /// The planes of the brick in work that may be met.
    pub(crate) runs: Vec<Range<u32>>,
    pub(crate) samples: PackedSamples,
    pub(crate) segments: SegmentList,
    /// Counts since the tile was begun or resumed.
    pub(crate) work: SampleCounts,
}

/// Per-tile state, carried from brick to brick.
#[derive(Clone, Debug)]
pub(crate) struct Unfinished {
    pixels: TilePixels,
    rays: Vec<RayValues>,
    last_hit: Option<Box<TilePlane>>,
}

impl Unfinished {
    /// Bytes that one takes.
    pub(crate) fn bytes(settings: &FieldSettings) -> usize {
        let rays = settings
            .statistic
            .map_or(0, |_| settings.channels.len() * size_of::<RayValues>());
        size_of::<Self>() + rays + settings.iso.map_or(0, |_| size_of::<TilePlane>())
    }
}

/// The views of some planes of a tile, by their numbers; made where they are asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct RememberedPlanes {
    planes: Vec<(u32, PlaneView)>,
}

impl RememberedPlanes {
    /// The view of a plane.
    #[inline(always)]
    pub(crate) fn at(&mut self, view: &TileView, number: u32) -> &PlaneView {
        self.make(view, number..number + 1);
        self.made(number)
    }

    /// Makes the views of planes, no more than are remembered.
    #[inline(always)]
    pub(crate) fn make(&mut self, view: &TileView, numbers: Range<u32>) {
        for number in numbers {
            let (remembered, plane) = &mut self.planes[number as usize % REMEMBERED_PLANES];
            if *remembered != number {
                *remembered = number;
                view.put_plane(number, plane);
            }
        }
    }

    /// The view of a plane that was made.
    #[inline(always)]
    pub(crate) fn made(&self, number: u32) -> &PlaneView {
        &self.planes[number as usize % REMEMBERED_PLANES].1
    }

    /// Makes ready for another tile.
    fn forget(&mut self) {
        if self.planes.is_empty() {
            self.planes = vec![(u32::MAX, PlaneView::default()); REMEMBERED_PLANES];
        }
        self.planes.iter_mut().for_each(|plane| plane.0 = u32::MAX);
    }
}

impl Default for FieldScratch {
    fn default() -> Self {
        Self {
            planes: RememberedPlanes::default(),
            pixels: Pixels::default(),
            rays: Vec::new(),
            last_hit: [[f32::NEG_INFINITY; TILE_PX]; TILE_PX],
            runs: Vec::new(),
            samples: PackedSamples::default(),
            segments: SegmentList::default(),
            work: SampleCounts::default(),
        }
    }
}

impl FieldScratch {
    /// The view of a plane, remembered.
    #[inline(always)]
    pub(crate) fn plane(&mut self, view: &TileView, number: u32) -> &PlaneView {
        self.planes.at(view, number)
    }

    /// Makes ready for an empty tile.
    pub(crate) fn begin(&mut self, settings: &FieldSettings) {
        self.planes.forget();
        self.pixels = Pixels::default();
        self.rays = at_start(settings.statistic, &settings.channels);
        self.last_hit = [[f32::NEG_INFINITY; TILE_PX]; TILE_PX];
        self.work = SampleCounts::default();
    }

    /// Makes ready for a tile that was begun before.
    pub(crate) fn resume(&mut self, settings: &FieldSettings, begun: &Unfinished) {
        self.begin(settings);
        self.pixels = Pixels::of_planes(&begun.pixels);
        self.rays.clone_from(&begun.rays);
        if let Some(last_hit) = &begun.last_hit {
            self.last_hit = **last_hit;
        }
    }

    /// Returns the state from which [`FieldScratch::resume`] goes on.
    pub(crate) fn suspend(&mut self, settings: &FieldSettings) -> Unfinished {
        let last_hit = settings.iso.map(|_| Box::new(self.last_hit));
        Unfinished {
            pixels: self.pixels.planes(),
            rays: self.rays.clone(),
            last_hit,
        }
    }
}

/// How many lanes a mask holds.
#[inline(always)]
pub(crate) fn set_lanes<S: Simd>(lanes: mask32x8<S>) -> usize {
    lanes.to_bitmask().count_ones() as usize
}

/// The pixels of a tile that a brick covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    pub(crate) columns: [usize; 2],
    pub(crate) rows: [usize; 2],
}

impl Window {
    /// Its columns and rows.
    pub(crate) fn ranges(&self) -> (Range<usize>, Range<usize>) {
        let [columns, rows] = [self.columns, self.rows].map(|[first, end]| first..end);
        (columns, rows)
    }

    pub(crate) fn new(placed: &PlacedBrick, view: &TileView) -> Self {
        let corner_px = view.first_px();
        let inside = |pixel: u16, axis: usize| {
            usize::from(pixel)
                .saturating_sub(corner_px[axis])
                .min(TILE_PX)
        };
        Self {
            columns: placed.columns.map(|c| inside(c, 0)),
            rows: placed.rows.map(|r| inside(r, 1)),
        }
    }
}
