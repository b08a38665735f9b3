//! One tile against the same sums in f64, entry by entry.

use super::*;
use crate::kernels::point::PixelFilter;
use crate::kernels::table::FootprintProfile;
use crate::simd::SimdLevel;
use crate::sort::{depth_key, entry};
use crate::tile::TILE_PX;
use crate::{Kernel, KernelShape};

/// First pixel of the tile.
const CORNER_PX: [usize; 2] = [32, 48];

/// Depth range of a sheet of points: four of the points below, which are half a unit apart.
const SHEET: f32 = 2.0;

/// A pixel in f64: transmittance, red, green, blue, depth.
#[derive(Clone, Copy)]
struct Pixel([f64; 5]);

/// The sums of the open sheet at a pixel: colour times strength, strength.
type Sums = [[f64; 4]; TILE_PX * TILE_PX];

fn settings(level: SimdLevel, opacity: OpacityMode, index: IndexRule) -> TileSettings {
    TileSettings {
        level: level.resolve(),
        profile: FootprintProfile::new(&Kernel::new(KernelShape::Gaussian)),
        filter: PixelFilter::new(),
        opacity,
        index,
        depth: DepthRule::Expected,
        sheet_thickness: SHEET,
        min_transmittance: 0.0,
    }
}

/// Points and splats in turn, five of each, around and beside the tile; `strength` is that of a splat.
fn list(count: usize, strength: f32) -> Vec<Primitive> {
    let place = |i: usize, step: f32| (i as f32 * step) % 20.0 - 2.0;
    let primitive = |i: usize| {
        let (x, y) = (place(i, 3.7) + 32.0, place(i, 7.3) + 48.0);
        let is_point = (i / 5).is_multiple_of(2);
        let radius = 2.0 + (i % 3) as f32;
        Primitive {
            x,
            y,
            form: [
                radius.powi(-2),
                0.3 * radius.powi(-2),
                1.2 * radius.powi(-2),
            ],
            sin2_cone: 0.2,
            strength: if is_point { 3.0 * strength } else { strength },
            rgb: [0.2, 0.5, 0.9].map(|c| c + 0.1 * (i % 2) as f32),
            rows: if is_point {
                POINT_ROWS
            } else {
                [(y - radius) as u16, (y + radius) as u16 + 1]
            },
            depth: 0.5 * i as f32,
        }
    };
    (0..count).map(primitive).collect()
}

fn opacity_of(mode: OpacityMode, added: f64) -> f64 {
    match mode {
        OpacityMode::Extinction => -(-added).exp_m1(),
        OpacityMode::Linear => added.min(1.0),
    }
}

fn lay(pixel: &mut Pixel, opacity: f64, rgb: [f64; 3], depth: f64) {
    let weight = pixel.0[0] * opacity;
    pixel.0[0] -= weight;
    for (sum, value) in pixel.0[1..].iter_mut().zip([rgb[0], rgb[1], rgb[2], depth]) {
        *sum += weight * value;
    }
}

/// Composites an open sheet, whose mean depth is this, and empties it.
fn close(settings: &TileSettings, sums: &mut Sums, strength_depth: [f64; 2], pixels: &mut [Pixel]) {
    for (pixel, sums) in pixels.iter_mut().zip(sums.iter_mut()) {
        if sums[3] > 0.0 {
            let rgb = [0, 1, 2].map(|k| sums[k] / sums[3]);
            let depth = strength_depth[1] / strength_depth[0];
            lay(pixel, opacity_of(settings.opacity, sums[3]), rgb, depth);
        }
        *sums = [0.0; 4];
    }
}

fn reference(settings: &TileSettings, list: &[Primitive]) -> Vec<Pixel> {
    let mut pixels = vec![Pixel([1.0, 0.0, 0.0, 0.0, 0.0]); TILE_PX * TILE_PX];
    let mut sums: Sums = [[0.0; 4]; TILE_PX * TILE_PX];
    let mut sheet = (0u32, [0.0f64; 2]);
    for primitive in list {
        let rgb = primitive.rgb.map(f64::from);
        let number = (primitive.depth / SHEET) as u32;
        let is_point = primitive.rows == POINT_ROWS;
        if !is_point || number != sheet.0 {
            close(settings, &mut sums, sheet.1, &mut pixels);
            sheet = (number, [0.0; 2]);
        }
        for (at, pixel) in pixels.iter_mut().enumerate() {
            let (column, row) = (at % TILE_PX, at / TILE_PX);
            let [x, y] = [(column, CORNER_PX[0]), (row, CORNER_PX[1])]
                .map(|(at, corner)| (at + corner) as f64 + 0.5);
            let (dx, dy) = (x - f64::from(primitive.x), y - f64::from(primitive.y));
            if is_point {
                let along = |centre: f32, corner: usize, at: usize| {
                    let taps = settings.filter.along_axis(centre - corner as f32);
                    let tap = at as i32 - taps.first;
                    let tap = usize::try_from(tap)
                        .ok()
                        .and_then(|tap| taps.weights.get(tap));
                    tap.map_or(0.0, |&weight| f64::from(weight))
                };
                let weight = along(primitive.x, CORNER_PX[0], column)
                    * along(primitive.y, CORNER_PX[1], row)
                    * f64::from(primitive.strength);
                for (sum, value) in sums[at].iter_mut().zip([rgb[0], rgb[1], rgb[2], 1.0]) {
                    *sum += weight * value;
                }
                continue;
            }
            let rows = primitive.rows.map(usize::from);
            if !(rows[0]..rows[1]).contains(&(row + CORNER_PX[1])) {
                continue;
            }
            let [xx, xy2, yy] = primitive.form.map(f64::from);
            let form = xx * dx * dx + xy2 * dx * dy + yy * dy * dy;
            let sin2 = f64::from(primitive.sin2_cone);
            let q = match settings.index {
                IndexRule::Direct => form,
                IndexRule::ConeCorrected => form / (1.0 - sin2 + form * sin2),
            };
            let integral = f64::from(settings.profile.line_integral(q as f32));
            let added = integral * f64::from(primitive.strength);
            lay(
                pixel,
                opacity_of(settings.opacity, added),
                rgb,
                primitive.depth.into(),
            );
        }
        if is_point {
            let strength = f64::from(primitive.strength);
            sheet.1[0] += strength;
            sheet.1[1] += strength * f64::from(primitive.depth);
        }
    }
    close(settings, &mut sums, sheet.1, &mut pixels);
    pixels
}

/// The tile and its counts; the list lies in two chunks.
fn composited(settings: &TileSettings, list: &[Primitive]) -> (TileWork, TileCounts) {
    let mut tile = TileWork::default();
    let half = list.len() / 2;
    let entries: Vec<u64> = list
        .iter()
        .enumerate()
        .map(|(i, primitive)| {
            let index = if i < half { i } else { (1 << 16) + i - half };
            entry(depth_key(primitive.depth), index as u32)
        })
        .collect();
    let chunks = [&list[..half], &list[half..]];
    let counts = composite_tile(settings, &mut tile, CORNER_PX, &entries, &chunks);
    (tile, counts)
}

/// The largest difference, of depth in parts of the farthest.
fn difference(tile: &TileWork, wanted: &[Pixel], farthest: f64) -> f64 {
    let mut most = 0.0f64;
    for (at, wanted) in wanted.iter().enumerate() {
        let (x, y) = (at % TILE_PX, at / TILE_PX);
        let [red, green, blue] = &tile.pixels.rgb;
        let planes = [
            &tile.pixels.transmittance,
            red,
            green,
            blue,
            &tile.pixels.depth,
        ];
        for (k, plane) in planes.into_iter().enumerate() {
            let unit = if k == 4 { farthest } else { 1.0 };
            most = most.max((f64::from(plane[y][x]) - wanted.0[k]).abs() / unit);
        }
    }
    most
}

#[test]
fn a_tile_is_the_sum_of_its_entries_in_order() {
    let list = list(200, 0.4);
    for level in SimdLevel::ALL {
        for opacity in [OpacityMode::Extinction, OpacityMode::Linear] {
            for index in [IndexRule::Direct, IndexRule::ConeCorrected] {
                let settings = settings(level, opacity, index);
                let wanted = reference(&settings, &list);
                assert!(
                    wanted.iter().any(|pixel| pixel.0[0] < 0.5),
                    "next to nothing is seen, so nothing is tested"
                );
                let (tile, counts) = composited(&settings, &list);
                let most = difference(&tile, &wanted, 100.0);
                assert!(most < 2e-5, "{level:?}, {opacity:?}, {index:?}: {most:.1e}");
                assert_eq!(counts.composited, list.len());
            }
        }
    }
}

#[test]
fn a_long_list_keeps_what_rounding_takes() {
    // Each entry changes a pixel by about a step of f32: without what rounding took, the sums below are off by 1e-3.
    let list = list(MANY + 4000, 2e-7);
    let settings = settings(SimdLevel::Auto, OpacityMode::Extinction, IndexRule::Direct);
    let wanted = reference(&settings, &list);
    let (tile, counts) = composited(&settings, &list);
    let most = difference(&tile, &wanted, f64::from(list[list.len() - 1].depth));
    assert!(most < 1e-6, "{most:.1e}");
    assert_eq!(counts.composited, list.len());
}

#[test]
fn an_opaque_tile_ends_its_list_and_counts_what_it_touched() {
    let settings = TileSettings {
        min_transmittance: 0.01,
        ..settings(SimdLevel::Auto, OpacityMode::Extinction, IndexRule::Direct)
    };
    let wall = Primitive {
        x: 40.0,
        y: 56.0,
        form: [1e-4, 0.0, 1e-4],
        strength: 10.0,
        rows: [0, 100],
        ..Primitive::default()
    };
    let (_, counts) = composited(&settings, &vec![wall; 100]);
    assert_eq!(
        counts.composited, 32,
        "one block of entries is looked at as a whole"
    );
    assert_eq!(counts.pixels_touched, 32 * TILE_PX * TILE_PX);
    let point = Primitive {
        rows: POINT_ROWS,
        ..wall
    };
    let (_, counts) = composited(&settings, &[point]);
    // Four by four pixels take a part of it, and the four rows of the sheet are composited.
    assert_eq!(counts.pixels_touched, 16 + 4 * TILE_PX);
}
