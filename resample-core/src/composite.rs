//! Compositing of one screen tile: points and splats over one another, front to back.
//!
//! A splat adds optical depth tau F(d) to each pixel; the pixel's opacity for it is 1 - exp(-tau F), so the product
//! of the transmittances of overlapping splats is exp(-integral of the reconstructed extinction), exactly; only the
//! order of colours inside an overlap is approximated. Points do not cover a pixel, so those within a depth range (a
//! sheet) are summed first and composited once, with the extinction-weighted mean colour.
//!
//! In slices ([`composite_slices`]) everything of one slice is summed before it is composited, splats as well.
//!
//! The hot loop works on whole rows of a tile, structure of arrays, generic over the vector width.
//! Source: Yuan et al. 2003, section 4.1 (order, sheets of points); Westover 1990 for the linear opacity.

mod points;
mod slices;

use crate::dispatch;
use crate::simd::Vectors;
use fearless_simd::prelude::*;
use fearless_simd_macros::simd;

use crate::maps::{TileMaps, TilePlane};
use crate::point::PixelFilter;
use crate::simd::opacity_from_optical_depth;
use crate::sort::entry_index;
use crate::table::FootprintProfile;
use crate::tile::{POINT_ROWS, Primitive, TILE_PX};

pub use points::Sheet;
use points::{close_sheet, gather_point};
pub use slices::{SliceSums, composite_slices};

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

/// Whether expected depth is gathered beside colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRule {
    /// Colour only.
    Skip,
    /// Depth weighted by what each sample adds to the pixel's opacity.
    Expected,
}

/// What the pixels of a tile have gathered so far; linear, premultiplied.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub struct TilePixels {
    /// What is left to be seen behind, 1 at the start.
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
    /// Whether depth is gathered.
    pub depth: DepthRule,
    /// Depth range of a sheet of points, world units.
    pub sheet_thickness: f32,
    /// A tile stops when every pixel's transmittance is below this.
    pub min_transmittance: f32,
}

/// What happened in a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileCounts {
    /// Entries that were composited before the tile was opaque.
    pub composited: usize,
    /// Pixel updates, counted in whole vectors.
    pub pixels_touched: usize,
}

/// The transmittances of a tile are looked at after this many entries: often enough that little is composited in
/// vain, seldom enough that looking costs nothing. A guess; the optimum is flat between 16 and 64.
const ENTRIES_PER_CHECK: usize = 32;

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

/// Composites the sorted `entries` of the tile whose first pixel is `corner_px` onto `pixels`.
pub fn composite_tile(
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [usize; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let corner_px = corner_px.map(|c| c as f32);
    dispatch!(settings.level, simd => composite_entries(simd, settings, tile, corner_px, entries, chunks))
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
}

#[simd]
fn composite_entries<S: Simd>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    entries: &[u64],
    chunks: &[&[Primitive]],
) -> TileCounts {
    let mut counts = TileCounts::default();
    let sheets_per_unit = 1.0 / settings.sheet_thickness;
    let mut gathered = [Primitive::default(); ENTRIES_PER_CHECK];
    for block in entries.chunks(ENTRIES_PER_CHECK) {
        // Depth order is random order in memory: fetched together, the misses of a block overlap.
        for (slot, &entry) in gathered.iter_mut().zip(block) {
            let index = entry_index(entry) as usize;
            *slot = chunks[index >> 16][index & 0xffff];
        }
        for primitive in &gathered[..block.len()] {
            if primitive.rows == POINT_ROWS {
                let number = (primitive.depth * sheets_per_unit) as u32;
                if number != tile.sheet.number {
                    close_sheet(simd, settings, tile, &mut counts);
                    tile.sheet.number = number;
                }
                counts.pixels_touched +=
                    gather_point(settings, &mut tile.sheet, corner_px, primitive);
            } else {
                close_sheet(simd, settings, tile, &mut counts);
                counts.pixels_touched +=
                    composite_splat::<_, false>(simd, settings, tile, corner_px, primitive);
            }
        }
        counts.composited += block.len();
        if tile.pixels.is_opaque(simd, settings.min_transmittance) {
            break;
        }
    }
    close_sheet(simd, settings, tile, &mut counts);
    counts
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

    /// Whether every pixel's transmittance is below the bound.
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

/// Lays one splat over the tile, or adds it to the open slice, row by row. Returns the pixels looked at.
#[inline(always)]
fn composite_splat<S: Simd, const SLICED: bool>(
    simd: S,
    settings: &TileSettings,
    tile: &mut TileWork,
    corner_px: [f32; 2],
    splat: &Primitive,
) -> usize {
    // A tile's rows and a splat's rows are whole numbers below 2^16: exact in f32 and in usize.
    let corner_row = corner_px[1] as usize;
    let first = usize::from(splat.rows[0]).saturating_sub(corner_row);
    let end = usize::from(splat.rows[1])
        .saturating_sub(corner_row)
        .min(TILE_PX);
    let (x, y) = (splat.x - corner_px[0], splat.y - corner_px[1]);
    let [xx, xy2, yy] = splat.form;
    for lane in (0..TILE_PX).step_by(S::f32s::LEN) {
        let dx = S::f32s::from_fn(simd, |i| (lane + i) as f32 + 0.5) - S::f32s::splat(simd, x);
        let xx_dx2 = dx * dx * S::f32s::splat(simd, xx);
        for row in first..end {
            let dy = row as f32 + 0.5 - y;
            let (linear, constant) = (
                S::f32s::splat(simd, xy2 * dy),
                S::f32s::splat(simd, yy * dy * dy),
            );
            let form = dx.mul_add(linear, xx_dx2) + constant;
            let at = RowLanes { row, lane };
            let Some(added) = added_lanes(simd, settings, &tile.maps, at, (form, splat)) else {
                continue;
            };
            if SLICED {
                slices::add_lanes(simd, &mut tile.slice, at, (added, splat));
            } else {
                composite_lanes(simd, settings, &mut tile.pixels, at, (added, splat));
            }
        }
    }
    end.saturating_sub(first) * TILE_PX
}

/// A vector's place in a tile.
#[derive(Clone, Copy)]
struct RowLanes {
    row: usize,
    lane: usize,
}

/// What a splat adds to the optical depth of a vector of pixels, given the value of its form; `None` if it misses them.
#[inline(always)]
fn added_lanes<S: Simd>(
    simd: S,
    settings: &TileSettings,
    maps: &TileMaps,
    at: RowLanes,
    (form, splat): (S::f32s, &Primitive),
) -> Option<S::f32s> {
    let range = at.lane..at.lane + S::f32s::LEN;
    let constant = |x: f32| S::f32s::splat(simd, x);
    let mut q = form * S::f32s::from_slice(simd, &maps.form_scale[at.row][range.clone()]);
    if settings.index == IndexRule::ConeCorrected {
        q = q / (constant(1.0 - splat.sin2_cone) + q * constant(splat.sin2_cone));
    }
    let u = constant(1.0) - q;
    let inside = u.simd_gt(constant(0.0));
    if inside.all_false() {
        return None;
    }
    let u = u.max(constant(0.0));
    let coefficients = &settings.profile.coefficients;
    let mut poly = constant(coefficients[coefficients.len() - 1]);
    for &c in coefficients[..coefficients.len() - 1].iter().rev() {
        poly = poly.mul_add(u, constant(c));
    }
    // A fitted profile may undershoot 0 near its edge, and a negative sum has no mean colour.
    let poly = poly.max(constant(0.0));
    let unit_per_grid = S::f32s::from_slice(simd, &maps.unit_per_grid[at.row][range]);
    Some((u * u.sqrt()) * (poly * constant(splat.strength)) * unit_per_grid)
}

/// Lays one vector of a splat, which adds this to the optical depth, over the pixels.
#[inline(always)]
fn composite_lanes<S: Simd>(
    simd: S,
    settings: &TileSettings,
    pixels: &mut TilePixels,
    at: RowLanes,
    (added, splat): (S::f32s, &Primitive),
) {
    let range = at.lane..at.lane + S::f32s::LEN;
    let constant = |x: f32| S::f32s::splat(simd, x);
    let opacity = opacity(simd, settings.opacity, added);
    let transmittance = &mut pixels.transmittance[at.row][range.clone()];
    let before = S::f32s::from_slice(simd, transmittance);
    let weight = before * opacity;
    (before - weight).store_slice(transmittance);
    for (plane, value) in pixels.rgb.iter_mut().zip(splat.rgb) {
        let lanes = &mut plane[at.row][range.clone()];
        weight
            .mul_add(constant(value), S::f32s::from_slice(simd, lanes))
            .store_slice(lanes);
    }
    if settings.depth == DepthRule::Expected {
        let lanes = &mut pixels.depth[at.row][range];
        weight
            .mul_add(constant(splat.depth), S::f32s::from_slice(simd, lanes))
            .store_slice(lanes);
    }
}

/// A pixel's opacity from what a splat or a sheet adds to it.
#[inline(always)]
pub fn opacity<S, F>(simd: S, mode: OpacityMode, added: F) -> F
where
    S: Simd,
    F: SimdFloat<S, Element = f32>,
    F::Bits: SimdInt<S, Element = u32>,
{
    match mode {
        OpacityMode::Extinction => opacity_from_optical_depth(simd, added),
        OpacityMode::Linear => added.min(F::splat(simd, 1.0)),
    }
}
