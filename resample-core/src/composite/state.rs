//! The pixels and sums that a tile's entries are composited into, and the settings that all tiles of a frame share.

use fearless_simd::prelude::*;

use crate::composite::maps::{TileMaps, TilePlane};
use crate::kernels::point::PixelFilter;
use crate::kernels::table::FootprintProfile;
use crate::simd::Vectors;
use crate::tile::TILE_PX;

/// How the opacity of a sample becomes the opacity of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum OpacityMode {
    /// Opacity is turned into extinction; a pixel's opacity is 1 - exp(-optical depth). Transmittance is then exact
    /// however many footprints overlap.
    Extinction,
    /// A pixel's opacity is the sample's opacity times the footprint (Westover 1990), for comparison.
    Linear,
}

/// How a splat's form and map give the squared index q.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexRule {
    /// Their product is q.
    Direct,
    /// Their product is i^2 in the outline's ellipse; the cone angle corrects it.
    ConeCorrected,
}

/// Choice of the expected depth beside colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRule {
    /// Colour only.
    Skip,
    /// Depth weighted by what each sample adds to the pixel's opacity.
    Expected,
}

/// The accumulated pixels of a tile; linear, premultiplied.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct TilePixels {
    /// Transmittance so far, 1 at the start.
    pub transmittance: TilePlane,
    /// Red, green, blue.
    pub rgb: [TilePlane; 3],
    /// Depth times the opacity that it was seen with.
    pub depth: TilePlane,
}

/// The settings of a frame that every tile shares.
#[derive(Clone, Debug)]
pub struct TileSettings {
    /// Vector instructions to use.
    pub level: Vectors,
    /// The kernel's line integral.
    pub profile: FootprintProfile,
    /// The pixel's Gaussian.
    pub filter: PixelFilter,
    /// Opacity of a pixel from optical depth.
    pub opacity: OpacityMode,
    /// Index of a splat.
    pub index: IndexRule,
    /// Choice of the depth plane.
    pub depth: DepthRule,
    /// Depth range of a sheet of points, world units.
    pub sheet_thickness: f32,
    /// A tile stops when every pixel's transmittance is below this.
    pub min_transmittance: f32,
}

/// Counts of a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileCounts {
    /// Entries that were composited before the tile was opaque.
    pub composited: usize,
    /// Pixel updates, counted in whole vectors.
    pub pixels_touched: usize,
}

/// The transmittances of a tile are looked at after this many entries: often enough that little is composited in
/// vain, seldom enough that looking costs nothing. A guess; the optimum is flat between 16 and 64.
pub(super) const ENTRIES_PER_CHECK: usize = 32;

impl Default for TilePixels {
    fn default() -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        Self {
            transmittance: [[1.0; TILE_PX]; TILE_PX],
            rgb: [zero; 3],
            depth: zero,
        }
    }
}

/// The state that a tile's entries are composited into.
#[derive(Clone, Debug, Default)]
pub struct TileWork {
    /// The tile's pixels.
    pub pixels: TilePixels,
    /// The tile's maps.
    pub maps: TileMaps,
    /// The open sheet of points; empty between tiles.
    pub sheet: Sheet,
    /// The open slice; empty between tiles.
    pub slice: SliceSums,
    /// Where a list is long: what rounding took.
    pub(super) lost: Lost,
}

/// The rounding errors of the transmittance and the colours of a tile's pixels, added with the next contribution (Kahan
/// 1965).
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Lost {
    pub(super) transmittance: TilePlane,
    pub(super) rgb: [TilePlane; 3],
}

impl Default for Lost {
    fn default() -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        Self {
            transmittance: zero,
            rgb: [zero; 3],
        }
    }
}

/// Adds to a vector of a sum; where `KEPT`, with what rounding took before.
#[inline(always)]
pub(super) fn add<S: Simd, const KEPT: bool>(
    simd: S,
    sum: &mut [f32],
    lost: &mut [f32],
    added: S::f32s,
) {
    let before = S::f32s::from_slice(simd, sum);
    if !KEPT {
        (before + added).store_slice(sum);
        return;
    }
    let added = added + S::f32s::from_slice(simd, lost);
    let after = before + added;
    after.store_slice(sum);
    (added - (after - before)).store_slice(lost);
}

/// Points of the sheet that is being gathered. Interleaved: colour times strength, and strength.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct Sheet {
    pub(super) sums: [[[f32; 4]; TILE_PX]; TILE_PX],
    /// Rows first..end that hold anything.
    pub(super) rows: [usize; 2],
    pub(super) number: u32,
    pub(super) strength: f32,
    pub(super) strength_depth: f32,
}

impl Default for Sheet {
    fn default() -> Self {
        let sums = [[[0.0; 4]; TILE_PX]; TILE_PX];
        Self {
            sums,
            rows: [TILE_PX, 0],
            number: 0,
            strength: 0.0,
            strength_depth: 0.0,
        }
    }
}

/// Sums of the open slice.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct SliceSums {
    pub(super) strength: TilePlane,
    /// Strength times red, green, blue and depth.
    pub(super) weighted: [TilePlane; 4],
    /// Rows first..end that hold anything.
    pub(super) rows: [usize; 2],
}

impl Default for SliceSums {
    fn default() -> Self {
        let zero = [[0.0; TILE_PX]; TILE_PX];
        Self {
            strength: zero,
            weighted: [zero; 4],
            rows: [TILE_PX, 0],
        }
    }
}

impl TilePixels {
    /// The means over squares of `side` pixels, in the first `TILE_PX / side` rows and columns; `side` divides
    /// [`TILE_PX`].
    pub fn averaged(&self, side: usize) -> Self {
        if side <= 1 {
            return self.clone();
        }
        let share = 1.0 / (side * side) as f32;
        let mean = |plane: &TilePlane| -> TilePlane {
            let mut means = [[0.0; TILE_PX]; TILE_PX];
            for (y, row) in plane.iter().enumerate() {
                for (x, value) in row.iter().enumerate() {
                    means[y / side][x / side] += share * value;
                }
            }
            means
        };
        Self {
            transmittance: mean(&self.transmittance),
            rgb: [mean(&self.rgb[0]), mean(&self.rgb[1]), mean(&self.rgb[2])],
            depth: mean(&self.depth),
        }
    }

    /// Returns true if every pixel's transmittance is below the bound.
    #[inline(always)]
    pub fn is_opaque<S: Simd>(&self, simd: S, min_transmittance: f32) -> bool {
        let mut most = S::f32s::splat(simd, 0.0);
        for row in &self.transmittance {
            for lanes in row.chunks_exact(S::f32s::LEN) {
                most = most.max(S::f32s::from_slice(simd, lanes));
            }
        }
        most.simd_lt(S::f32s::splat(simd, min_transmittance))
            .all_true()
    }
}
